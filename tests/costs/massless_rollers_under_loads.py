"""What massless rollers cost whose bearings stick under loads that follow the motion, beside those that turn freely
there, with every drive. `python -m costs.massless_rollers_under_loads` from tests/ prints the table."""

from omniroll import Bearings, Contact

from . import massless_rollers
from .counting import Count, counted
from .massless_rollers import DRIVES

LOADS = {"loads": "dynamic", "height": 0.03}
GROUNDS = {
    "viscous, 30 N s/m": Contact(30.0, **LOADS),
    "viscous, 1e4 N s/m": Contact(1e4, **LOADS),
    "regularised, 1e-2 m/s": Contact(law="regularised", friction=0.5, speed=1e-2, **LOADS),
    "regularised, 1e-4 m/s": Contact(law="regularised", friction=0.5, speed=1e-4, **LOADS),
}
BEARINGS = {"": 0.0, "stick": 0.5, "turn": 1e-3}  # N m: none, more than is asked for, and less


def task(name: str) -> dict:
    """The arguments of a run, from its drive, its ground, and what bearings do, or nothing."""
    drive, ground, own = name.split("|")
    bearings = [Bearings(roller_coulomb=BEARINGS[own])] if own else []
    return massless_rollers.task(f"{drive}||") | {
        "nu": (2.0, 1.0, 3.0),
        "effects": (GROUNDS[ground], *bearings, DRIVES[drive]),
    }


def measured(drives: tuple[str, ...] = tuple(DRIVES)) -> dict[str, dict[str, list[Count]]]:
    """{drive: {ground: of rollers that turn freely, of bearings that stick, of such as turn}}."""
    names = {drive: {ground: [f"{drive}|{ground}|{own}" for own in BEARINGS] for ground in GROUNDS} for drive in drives}
    every = [name for grounds in names.values() for three in grounds.values() for name in three]
    found = counted("costs.massless_rollers_under_loads", every)
    return {drive: {ground: [found[n] for n in three] for ground, three in own.items()} for drive, own in names.items()}


def main() -> None:
    print("| drive, ground, bearings | evaluations | times free ones | instructions, times those |")
    print("| --- | --- | --- | --- |")
    for drive, grounds in measured().items():
        for ground, (free, *bearings) in grounds.items():
            for name, own in zip(("stick", "turn"), bearings, strict=True):
                times = own.evaluations / free.evaluations, own.instructions / free.instructions
                print(f"| {drive}, {ground}, {name} | {own.evaluations} |", " | ".join(f"{t:.2f}" for t in times), "|")


if __name__ == "__main__":
    main()
