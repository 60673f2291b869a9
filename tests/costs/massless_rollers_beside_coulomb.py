"""What massless rollers cost whose bearings stick beside contacts of the law coulomb, beside those that turn freely,
with every drive. `python -m costs.massless_rollers_beside_coulomb` from tests/ prints the table."""

from omniroll import Bearings, Contact, Vehicle

from .counting import Count, counted
from .massless_rollers import DRIVES

FRICTIONS = {"sticks": 5.0, "slips": 0.1}
STUCK = {"stick": Bearings(roller_coulomb=0.5), "turn": Bearings(roller_coulomb=1e-3)}  # more than is asked, and less


def task(name: str) -> dict:
    """The arguments of a run, from its drive, what contacts do, and what bearings do, or nothing."""
    drive, contact, bearings = name.split("|")
    own = [STUCK[bearings]] if bearings else []
    effects = (Contact(law="coulomb", friction=FRICTIONS[contact]), *own, DRIVES[drive])
    common = {"vehicle": Vehicle.paper(), "nu": (2.0, 1.0, 3.0), "duration": 0.3, "accuracy": 1e-9}
    return common | {"roller_model": "massless", "effects": effects}


def measured(drives: tuple[str, ...] = tuple(DRIVES)) -> dict[str, Count]:
    """{"drive|contacts|bearings": what a run takes}; no bearings: rollers turn freely."""
    names = [f"{drive}|{contact}|{own}" for drive in drives for contact in FRICTIONS for own in ("", *STUCK)]
    return counted("costs.massless_rollers_beside_coulomb", names)


def main() -> None:
    print("| drive, contacts, bearings | evaluations | times free ones | instructions, times those |")
    print("| --- | --- | --- | --- |")
    found = measured()
    for name, own in found.items():
        drive, contact, bearings = name.split("|")
        free = found[f"{drive}|{contact}|"]
        if bearings:
            times = own.evaluations / free.evaluations, own.instructions / free.instructions
            print(f"| {drive}, {contact}, {bearings} | {own.evaluations} |", " | ".join(f"{t:.2f}" for t in times), "|")


if __name__ == "__main__":
    main()
