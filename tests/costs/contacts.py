"""What contacts cost that stick on the ground, beside rolling. `python -m costs.contacts` from tests/ prints the table.

Torques that rise and fall drive the vehicle to and fro on one roller of each wheel, so that nothing switches.
"""

import numpy as np

from omniroll import Contact, TorqueTable, Vehicle

from .counting import Count, counted

KNOTS, PUSH = np.arange(21), np.array([0.03, -0.02, 0.01])  # N m
DRIVE = TorqueTable(tuple(KNOTS / 20), (-1.0) ** KNOTS[:, None] * PUSH)
ROUGH = {"law": "coulomb", "friction": 5.0}
GROUNDS = {
    "rolling": (),
    "static loads": (Contact(**ROUGH),),
    "dynamic loads": (Contact(**ROUGH, loads="dynamic", height=0.03),),
}
MODELS = ("massless", "free")


def task(name: str) -> dict:
    """The arguments of a run, from its roller model and its ground."""
    model, _, ground = name.partition("|")
    return {
        "vehicle": Vehicle.paper(), "nu": (0, 0, 0), "duration": 1.0, "accuracy": 1e-9, "roller_model": model,
        "effects": (*GROUNDS[ground], DRIVE),
    }  # fmt: skip


def measured() -> dict[str, dict[str, Count]]:
    """{roller model: {ground: Count}}."""
    found = counted("costs.contacts", [f"{model}|{ground}" for model in MODELS for ground in GROUNDS])
    return {model: {ground: found[f"{model}|{ground}"] for ground in GROUNDS} for model in MODELS}


if __name__ == "__main__":
    for model, counts in measured().items():
        for ground, count in counts.items():
            times = count.instructions / counts["rolling"].instructions
            print(f"{model:9} {ground:14} {times:5.2f} of rolling's instructions, {count}")
