"""What an evaluation of the equations of motion costs: operations, as counted, and time, as measured here."""

import time
from dataclasses import dataclass
from typing import Any

from omniroll import specialised
from omniroll.compiled_engine import can_run
from omniroll.runs import Task
from omniroll.scene.loading import Scene, run
from omniroll.vehicle import Vehicle

ALWAYS = ("reduced", "wheel_speeds", "pose_rates")
KINDS = ("add", "mul", "div", "sqrt", "sincos")
PROBES = {"compiled": 8.0, "Python": 0.5}  # s of motion that are timed, by engine
REPEATS = 5
ENOUGH = 1.0  # s spent on that


@dataclass(frozen=True)
class Cost:
    """Operations of one function: constant, per wheel, per free roller, and in all."""

    function: str
    constant: int
    per_wheel: int
    per_roller: int
    total: int


def operations(task: Task) -> list[Cost]:
    """What the functions that make the right-hand side cost; an operation is +, *, /, a root, a sine or cosine."""
    bound = task.kernel
    counted = {entry["name"]: entry["operations"] for entry in specialised.functions(bound.base, bound.effects)}
    names = dict.fromkeys(ALWAYS + task.effects.functions(bound.roller_model))
    return [_cost(name, counted[name], bound.vehicle) for name in names]


def _cost(name: str, counted: dict[str, dict[str, int]], vehicle: Vehicle) -> Cost:
    wheels, places = vehicle.wheels, vehicle.rollers_per_wheel - 1
    once, wheel, roller, slot = (
        sum(counted[part][kind] for kind in KINDS) for part in ("once", "wheel", "roller", "slot")
    )
    total = once + wheels * wheel + wheels * places * roller + places * slot
    return Cost(name, once, wheel, roller, total)


def nanoseconds(scene: Scene, task: Task) -> dict[str, Any]:
    """Time per evaluation on this machine, ns: that of a run over the number of its evaluations, the least of a few.

    Steps, switches and what the engine does between them are in it.
    """
    engine = "compiled" if task.engine == "compiled" and can_run(task) else "Python"
    duration = min(PROBES[engine], task.duration)
    least, began = float("inf"), time.perf_counter()
    for _ in range(REPEATS):
        start = time.perf_counter()
        trajectory = run(scene, duration=duration, control=False)
        took, evaluations = time.perf_counter() - start, trajectory.stats["evaluations"]
        least = min(least, 1e9 * took / max(evaluations, 1))
        if time.perf_counter() - began > ENOUGH:
            break
    return {"nanoseconds": least, "evaluations": evaluations, "engine": engine}
