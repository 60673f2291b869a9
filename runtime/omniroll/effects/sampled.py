"""What controllers share that take samples: an output that is held from one sample to the next."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from omniroll.effects.effect import Called, Effect, Form, Influence, Process, Signal
from omniroll.effects.torque import Drive, with_torque
from omniroll.errors import InvalidValueError, UnstableControllerWarning
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.vehicle import Vehicle

NEUTRAL = 1e-6  # growth that rounding may give to what neither grows nor fades


class SampledDrive(Drive):
    """A controller that gives torques or voltages, its `output`, at each `sample_time`."""

    sample_time: float
    output: str

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        if self.output != "torque" and not any(self.output in effect.needs for effect in others):
            raise InvalidValueError("output", self.output, "needs a Motor among the effects")


class Sampled(Process):
    """The controller in one run: how many samples it has taken, and the output (N,) that it holds."""

    remembers: ClassVar[tuple[str, ...] | None] = ("samples", "sum", "output")

    def __init__(self, controller: SampledDrive, kernel: Kernel):
        self.controller, self.kernel, self.samples = controller, kernel, 0
        self.output = np.zeros(kernel.wheels)

    def compiled(self) -> tuple[Form, ...]:
        return (Called(self.controller.output, self.controller.sample_time),)

    def next_time(self) -> float:
        return self.samples * self.controller.sample_time

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        return Influence({self.controller.output: Signal.constant(self.output)})


def doubts_of_growth(growth: float, errors: str, test: str, smaller: str) -> tuple[UserWarning, ...]:
    """The warning of a controller whose errors grow by a factor from sample to sample, up to 1 none; in these words."""
    if growth <= 1 + NEUTRAL:
        return ()
    text = f"{errors} grow from sample to sample, {growth:.3g} times in {test}; make {smaller} smaller"
    return (UnstableControllerWarning(text),)


def without_controllers(effects: Sequence[Effect]) -> Sequence[Effect]:
    """The effects without controllers, whose outputs are inputs of the plant: of a linear model, of an FMU, of a
    solver's function. With torques where nothing drives."""
    if not isinstance(effects, Sequence):
        return effects  # refused where effects are checked
    rest = [effect for effect in effects if not isinstance(effect, SampledDrive)]
    return rest if any(isinstance(effect, Drive) for effect in rest) else with_torque(rest)
