"""What massless rollers cost whose bearings stick where wheels may slip, beside those that turn freely there, with
every drive. `python -m costs.massless_rollers` from tests/ prints the table."""

import numpy as np

from omniroll import Bearings, Contact, Controller, Motor, TorqueTable, Vehicle

from .counting import Count, counted

KNOTS, PUSH = np.arange(21), np.array([0.03, -0.02, 0.01])  # N m
DRIVES = {
    "torque": TorqueTable(tuple(KNOTS / 20), (-1.0) ** KNOTS[:, None] * PUSH),
    "motor": Motor((0.3, -0.2, 0.1), torque_constant=0.02, resistance=0.5, gear_ratio=12),
    "speed": Controller((0.1, 0.05, 0.1), 0.05, 0.01),
}
GROUNDS = {
    "viscous, 30 N s/m": Contact(30.0),
    "viscous, 1e4 N s/m": Contact(1e4),
    "regularised, 1e-2 m/s": Contact(law="regularised", friction=5.0, speed=1e-2),
    "regularised, 1e-4 m/s": Contact(law="regularised", friction=5.0, speed=1e-4),
}
STUCK = Bearings(roller_coulomb=0.5)  # more than the ground ever asks for


def task(name: str) -> dict:
    """The arguments of a run, from its drive, its ground or nothing, and whether bearings stick."""
    drive, ground, stick = name.split("|")
    effects = (*([GROUNDS[ground]] if ground else []), *([STUCK] if stick else []), DRIVES[drive])
    common = {"vehicle": Vehicle.paper(), "nu": (0, 0, 0), "duration": 0.3, "accuracy": 1e-9}
    return common | {"roller_model": "massless", "effects": effects}


def measured(drives: tuple[str, ...] = tuple(DRIVES)) -> dict[str, dict[str, tuple[Count, Count]]]:
    """{drive: {ground: of rollers that turn, and of rollers that stick}}; the ground "" is rolling, twice."""
    names = [f"{drive}|{ground}|{stick}" for drive in drives for ground in GROUNDS for stick in ("", "stick")]
    found = counted("costs.massless_rollers", [*names, *(f"{drive}||" for drive in drives)])
    pairs = {
        drive: {ground: tuple(found[f"{drive}|{ground}|{stick}"] for stick in ("", "stick")) for ground in GROUNDS}
        for drive in drives
    }
    return {drive: own | {"": (found[f"{drive}||"],) * 2} for drive, own in pairs.items()}


def main() -> None:
    print("| drive, ground | evaluations | times rollers that turn | instructions, times those | times rolling |")
    print("| --- | --- | --- | --- | --- |")
    for drive, grounds in measured().items():
        rolling = grounds.pop("")[0]
        for ground, (turn, stick) in grounds.items():
            times = [stick.evaluations / turn.evaluations, stick.instructions / turn.instructions,
                     stick.instructions / rolling.instructions]  # fmt: skip
            print(f"| {drive}, {ground} | {stick.evaluations} |", " | ".join(f"{t:.2f}" for t in times), "|")


if __name__ == "__main__":
    main()
