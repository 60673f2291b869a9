"""What an evaluation of the equations of motion costs: operations, as counted, and time, as measured here."""

import time
from dataclasses import dataclass, replace
from typing import Any

from omniroll.engine.compiled_engine import can_run
from omniroll.engine.runs import Task
from omniroll.engine.simulate import one_run
from omniroll.errors import SimulationStopped
from omniroll.kernels import sets
from omniroll.vehicles.vehicle import Vehicle

ALWAYS = ("forward_dynamics", "wheel_speeds", "pose_rates")
KINDS = ("add", "mul", "div", "sqrt", "sincos")
MANY = {"compiled": 20_000, "Python": 1000}  # with so many evaluations the work that a run does once hardly shows
SHORTEST = 0.5**10  # the first run that is timed simulates this part of the motion
DOUBLINGS = 20  # then the simulated time is doubled, at most this often, until there are MANY evaluations
REPEATS = 5  # the longest run is timed again at most this often,
ENOUGH = 1.0  # and no longer than so many s in all


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
    counted = {entry["name"]: entry["operations"] for entry in sets.functions(bound.base, bound.effects)}
    names = dict.fromkeys(ALWAYS + task.effects.functions(bound.roller_model))
    return [_cost(name, counted[bound.form(name)], bound.vehicle) for name in names]


def _cost(name: str, counted: dict[str, dict[str, int]], vehicle: Vehicle) -> Cost:
    wheels, places = vehicle.wheels, vehicle.rollers_per_wheel - 1
    once, wheel, roller, slot = (
        sum(counted[part][kind] for kind in KINDS) for part in ("once", "wheel", "roller", "slot")
    )
    total = once + wheels * wheel + wheels * places * roller + places * slot
    return Cost(name, once, wheel, roller, total)


def nanoseconds(task: Task) -> dict[str, Any]:
    """Time per evaluation on this machine, ns: that of a run over the number of its evaluations, the least of a few.

    Steps, switches and what the engine does between them are in it. A long motion is timed at its beginning,
    and one with few evaluations runs on beyond its end.
    """
    engine = "compiled" if task.engine == "compiled" and can_run(task) else "Python"
    task = replace(task, progress=None, duration=SHORTEST * task.duration)
    took, evaluations = _timed(task)
    for _ in range(DOUBLINGS if task.duration > 0 else 0):
        longer = replace(task, duration=2 * task.duration)
        try:
            took, evaluations = _timed(longer)
        except SimulationStopped:
            break
        task = longer
        if evaluations >= MANY[engine]:
            break
    began = time.perf_counter()
    for _ in range(REPEATS):
        if time.perf_counter() - began + took > ENOUGH:
            break
        took = min(took, _timed(task)[0])
    return {"nanoseconds": 1e9 * took / max(evaluations, 1), "evaluations": evaluations, "engine": engine}


def _timed(task: Task) -> tuple[float, int]:
    """Seconds of a run, and its evaluations. Raises SimulationStopped."""
    start = time.perf_counter()
    trajectory = one_run(task, task.accuracy)
    return time.perf_counter() - start, trajectory.stats["evaluations"]
