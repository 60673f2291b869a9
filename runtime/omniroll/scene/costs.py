"""What an evaluation of the equations of motion costs: operations, as counted, and time, as measured here."""

import time
from dataclasses import dataclass
from typing import Any

from omniroll import generated_data
from omniroll.kernels import Kernel
from omniroll.scene.loading import Scene, run
from omniroll.vehicle import Vehicle

RIGHT_HAND_SIDE = ("reduced", "wheel_speeds", "pose_rates", "momenta_rates", "roller_rates")
KINDS = ("add", "mul", "div", "sqrt", "sincos")
PROBE = 8.0  # s of motion that are timed
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


def operations(kernel: Kernel) -> list[Cost]:
    """What the functions that make the right-hand side cost; an operation is +, *, /, a root, a sine or cosine."""
    functions = {
        function["name"]: function["operations"]
        for function in generated_data.load("kernels")["functions"]
        if function["set"] == kernel.set_name
    }
    return [_cost(name, functions[name], kernel.vehicle) for name in RIGHT_HAND_SIDE if name in functions]


def _cost(name: str, counted: dict[str, dict[str, int]], vehicle: Vehicle) -> Cost:
    wheels, places = vehicle.wheels, vehicle.rollers_per_wheel - 1
    once, wheel, roller, slot = (
        sum(counted[part][kind] for kind in KINDS) for part in ("once", "wheel", "roller", "slot")
    )
    total = once + wheels * wheel + wheels * places * roller + places * slot
    return Cost(name, once, wheel, roller, total)


def nanoseconds(scene: Scene) -> dict[str, Any]:
    """Time per evaluation on this machine, ns: that of a run over the number of its evaluations, the least of a few.

    Steps, switches and what the engine does between them are in it.
    """
    least, began = float("inf"), time.perf_counter()
    for _ in range(REPEATS):
        start = time.perf_counter()
        trajectory = run(scene, duration=min(PROBE, scene.options["duration"]), control=False)
        took, evaluations = time.perf_counter() - start, trajectory.stats["evaluations"]
        least = min(least, 1e9 * took / max(evaluations, 1))
        if time.perf_counter() - began > ENOUGH:
            break
    return {"nanoseconds": least, "evaluations": evaluations, "engine": trajectory.engine}
