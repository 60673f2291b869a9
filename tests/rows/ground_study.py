"""Random vehicles that turn while their wheels reverse, on a ground where these may slip: how many runs stop.

    python -m tests.rows.ground_study [vehicles] [roller model ...]

prints the table of docs/ground-contact.md.
"""

import sys
import warnings

import numpy as np

import omniroll
from tests.rows import reversals

MODELS = ("massless", "free")
LAWS = ("viscous", "regularised", "coulomb")


def ground(law: str, vehicle: omniroll.Vehicle) -> omniroll.Contact:
    """A ground of some law: of the viscous one a wheel's weight at 0.1 m/s, of the others a friction of 0.6."""
    if law == "viscous":
        return omniroll.Contact(coefficient=vehicle.mass * 9.81 / vehicle.wheels / 0.1)
    return omniroll.Contact(law=law, friction=0.6, speed=0.01 if law == "regularised" else None)


def line(is_mecanum: bool, model: str, law: str, vehicles: int) -> str:
    """A line of the table."""
    stopped, stood, unsure = 0, 0, 0
    for seed in range(vehicles):
        task = reversals.task(np.random.default_rng([seed, 7]), driven=seed % 2 == 1, is_mecanum=is_mecanum)
        task["effects"] += (ground(law, task["vehicle"]),)
        try:
            run = omniroll.simulate(**task, roller_model=model)
        except omniroll.SimulationStopped:
            stopped += 1
            continue
        stood += bool(run.times_on_joints().any())
        estimate = run.stats["error_estimate"]
        unsure += estimate is None or estimate > task["accuracy"]
    kind = "mecanum" if is_mecanum else "two rows"
    return f"| {kind} | {model} | {law} | {stopped} | {stood} | {unsure} |"


if __name__ == "__main__":
    warnings.simplefilter("ignore", omniroll.AccuracyWarning)
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    print("| wheels | rollers | law | runs that stop | with wheels that stand | above the accuracy asked |")
    print("| --- | --- | --- | --- | --- | --- |")
    for model in sys.argv[2:] or MODELS:
        for is_mecanum in (False, True):
            for law in LAWS:
                print(line(is_mecanum, model, law, count), flush=True)
