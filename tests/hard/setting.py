"""What the cases share: engines, roller models and laws, vehicles, random starts, and runs without control."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import omniroll
from hard.case import Measurement
from omniroll import Trajectory, Vehicle
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task
from omniroll.kernels.kernel import Kernel

EPS = 2.0**-52
ENGINES = ("compiled", "python")
MODELS = ("massless", "locked", "free")
LAWS = ("smooth", "impact")
PAPER = Vehicle.paper()
JOINT = 3.141592653589793 / 5  # of the paper's vehicle
DOUBLE = "double"


@dataclass(frozen=True)
class Setting:
    """A roller model, a law and an engine."""

    model: str
    law: str
    engine: str

    @property
    def name(self) -> str:
        return f"{self.model}, {self.law}"

    def options(self, **task: Any) -> dict[str, Any]:
        if self.model != "free":
            task.pop("spins", None)
        return task | {"roller_model": self.model, "switching": self.law, "engine": self.engine}

    def run(self, vehicle: Vehicle = PAPER, *, accuracy: float = 1e-12, **task: Any) -> Trajectory:
        return omniroll.simulate(vehicle, **self.options(**task), accuracy=accuracy, control=False)

    def task(self, vehicle: Vehicle = PAPER, **task: Any) -> Task:
        return checked_task(vehicle, **self.options(**task))

    def measurement(self, what: str, measured: float, bound: float, naive: float | None = None) -> Measurement:
        return Measurement(what, self.engine, DOUBLE, self.name, measured, bound, naive)


def random_start(random: np.random.Generator, reach: float = 0.5, **others: Any) -> dict[str, Any]:
    """A start of the paper's vehicle whose wheels are at random within `reach` of the middle of their rollers."""
    nu, chi, spins = random.normal(size=3), random.uniform(-reach, reach, 3), random.normal(size=(3, 4))
    return {"nu": nu, "chi": chi, "spins": spins} | others


def end_of(run: Trajectory) -> np.ndarray:
    """(6 + N,) nu, chi and the pose at the end."""
    return np.concatenate([run.nu[-1], run.chi[-1], run.pose[-1]])


def speeds_of_wheels(kernel: Kernel) -> np.ndarray:
    """(3, N): chi' = nu @ this."""
    return kernel.wheel_speeds(np.eye(3))


def accelerations_of_wheels(task: Task) -> np.ndarray:
    """(N,) chi'' at the start of a task."""
    state, free = task.state, task.state.free_axial()
    momenta = () if free is None else (task.kernel.momenta(free),)
    return task.kernel.wheel_speeds(task.kernel.forward_dynamics(state.nu, state.chi, *momenta))


def settings(models=MODELS, laws=LAWS, engines=ENGINES) -> Iterator[Setting]:
    for engine in engines:
        for model in models:
            for law in laws:
                yield Setting(model, law, engine)
