"""A controller that tracks a velocity: sampled, proportional and integral, one loop for each wheel.

At each sample the wheels' speeds that the wanted nu demands are compared with those that are; the output is held until
the next sample. A sample at which the output of a wheel is cut off at its limit leaves that wheel's integral as it was.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.contact import Contact
from omniroll.effects.effect import Effect, Sampler
from omniroll.effects.linear_loop import excess_alone, growth
from omniroll.effects.motor import Motor
from omniroll.effects.numbers import Curve, spread
from omniroll.effects.sampled import NEUTRAL, Sampled, SampledDrive, doubts_of_growth
from omniroll.errors import UnstableControllerWarning
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import CONTROLLER, documented


@documented(*CONTROLLER)
@dataclass(frozen=True)
class Controller(SampledDrive):
    """Tracks a wanted nu by torques or voltages of the wheels, proportional and integral, in samples.

    {entries}

    Gains that are too large for the sample time give an UnstableControllerWarning, beside a Contact also those that are
    too large for a wheel that slips, which does not carry the vehicle. Raises InvalidValueError for numbers out of
    their bounds; simulate raises it for a number of gains that is not N, and for an output of voltages without a Motor.
    """

    signals: ClassVar[tuple[str, ...]] = ("target", "proportional", "integral", "times")

    target: ArrayLike
    proportional: ArrayLike
    sample_time: float
    integral: ArrayLike = 0.0
    output: str = "torque"
    limit: float | None = None
    times: ArrayLike | None = None
    interpolation: str = "linear"

    def __post_init__(self) -> None:
        self._keep_checked(entry for entry in CONTROLLER if entry.name not in ("target", "times"))
        if self.times is None:
            self._put(target=tuple(validation.real_array("target", self.target, (3,)).tolist()))
        else:
            self._keep_table("target", width=3)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        for name in ("proportional", "integral"):
            spread(name, getattr(self, name), vehicle.wheels)
        super().check(vehicle, others)

    def doubts(self, vehicle: Vehicle, others: Sequence[Effect]) -> tuple[UserWarning, ...]:
        gains = [spread(name, getattr(self, name), vehicle.wheels) for name in ("proportional", "integral")]
        per_output, damping = self._torques(vehicle, others)
        times = growth(vehicle, per_output, damping, *gains, self.sample_time)
        words = "the controller's errors", "a linear test at rest", "sample_time, proportional or integral"
        doubts = doubts_of_growth(times, *words)
        if any(isinstance(other, Contact) and other.law != "viscous" for other in others):  # viscous ground damps slip
            excess = excess_alone(vehicle.wheel_inertia, per_output, damping, *gains, self.sample_time)
            doubts += _doubts_of_slip(vehicle, excess)
        return doubts

    def _torques(self, vehicle: Vehicle, others: Sequence[Effect]) -> tuple[np.ndarray, np.ndarray]:
        """(N,) the torque at an axle per output, and what friction and motors take from it per rate of the wheel."""
        per_output, damping = vehicle.driven.astype(float), np.zeros(vehicle.wheels)
        for other in others:
            damping = damping + other.constants(vehicle).get("axle_damping", 0.0)
            if isinstance(other, Motor):
                per_volt, lost = other.line(vehicle)
                damping = damping + lost
                per_output = per_volt if self.output == "voltage" else per_output
        return per_output, damping

    def events(self) -> tuple[str, ...]:
        return (f"samples of the controller, every {self.sample_time:g} s",)

    def process(self, kernel: Kernel, start_time: float) -> "Sampling":
        table = self.times is not None
        return Sampling(self, kernel, self._curve("target", start_time) if table else Curve.constant(self.target))


class Sampling(Sampled):
    """The controller in one run, with its integral."""

    def __init__(self, controller: Controller, kernel: Kernel, target: Curve):
        super().__init__(controller, kernel)
        self.target = target
        driven = kernel.vehicle.driven
        self.proportional = driven * spread("proportional", controller.proportional, kernel.wheels)
        self.integral = driven * spread("integral", controller.integral, kernel.wheels)
        self.limit = math.inf if controller.limit is None else controller.limit
        self.sum = np.zeros(kernel.wheels)  # of the errors, rad

    def compiled(self) -> tuple[Sampler]:
        output, sample_time = self.controller.output, self.controller.sample_time
        return (Sampler(output, sample_time, self.limit, self.target, self.proportional, self.integral),)

    def pass_time(self, state: State) -> None:
        wanted, _ = self.target.after(self.next_time())
        error = self.kernel.wheel_speeds(wanted - state.nu)
        if state.rates is not None:
            error = self.kernel.wheel_speeds(wanted) - state.rates
        numbers = (array.tolist() for array in (error, self.sum, self.proportional, self.integral))
        summed, output = parts.controller_sample(len(error), 0, *numbers, self.controller.sample_time)
        self.output = np.clip(output, -self.limit, self.limit)
        self.sum = np.where(self.output == output, summed, self.sum)
        self.samples += 1

    def held(self) -> Mapping[str, np.ndarray]:
        return {"target": self.target.values[0]} if self.target.is_constant else {}


def _doubts_of_slip(vehicle: Vehicle, excess: np.ndarray) -> tuple[UnstableControllerWarning, ...]:
    """The warning of gains that are too large for wheels that slip; excess (N,) is how many times."""
    if excess.max() <= 1 + NEUTRAL:
        return ()
    text = (
        f"where wheels slip, the controller's errors grow from sample to sample: wheel {excess.argmax() + 1} alone has "
        f"{vehicle.wheel_inertia:.3g} kg m^2 about its axle; the gains are {excess.max():.3g} times the largest with "
        "which it settles in a linear test; make proportional and integral so many times smaller, or sample_time, or "
        "give the motor's rotor_inertia, if the wheel's inertia does not hold it"
    )
    return (UnstableControllerWarning(text),)
