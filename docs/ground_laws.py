"""Prints the table of laws of docs/ground-contact.md: their distance from the set-valued one, and what they cost."""

import numpy as np

from omniroll import Contact, Trajectory, Vehicle, simulate
from omniroll.results.comparison import distance_at

START = {"nu": (2, -1, 3), "duration": 0.15, "control": False}
SPIN = {"wheel_rates": (3, -2, 5), "contact_spins": 4}
SPEEDS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
LAWS = {
    "`coulomb`": {"law": "coulomb", "friction": 0.4},
    **{f"`regularised`, {speed:.0e} m/s": {"law": "regularised", "friction": 0.4, "speed": speed} for speed in SPEEDS},
    "`viscous`, 30 N s/m": {"coefficient": 30.0},
    "`viscous`, 100 N s/m": {"coefficient": 100.0},
}


def run(law: dict, accuracy: float) -> Trajectory:
    return simulate(Vehicle.paper(), **START, accuracy=accuracy, effects=[Contact(**law, **SPIN)])


def main() -> None:
    truth = run(LAWS["`coulomb`"], 1e-11)
    times = np.linspace(0.01, START["duration"], 15)
    print("| law | distance | steps | evaluations |\n| --- | --- | --- | --- |")
    for name, law in LAWS.items():
        found = run(law, 1e-8)
        distance = distance_at(found, truth, times)
        print(f"| {name} | {distance:.1e} | {found.stats['steps']} | {found.stats['evaluations']} |")


if __name__ == "__main__":
    main()
