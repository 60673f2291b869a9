"""The task: what an agent sees, does and gets. It knows arrays of vehicles, whose first axis may be missing."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects import Effect, Motor
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle

SPEED_COST, EFFORT_COST = 1.0, 0.01


@dataclass(frozen=True)
class TwistTask:
    """Motors are to bring a vehicle from rest to a twist that is drawn for each episode, and to hold it.

    vehicle        Vehicle with N wheels of n rollers
    motor          Motor without a voltage of its own
    largest_volts  in V: that of an action of 1
    largest_nu     (3,) in 1/s: targets are drawn between minus this and this
    step           in s, the time of a step
    steps          of an episode
    roller_model   "free", "locked" or "massless"
    effects        further effects, a sequence
    accuracy       to which a step is made

    Action: (N,) in [-1, 1], voltages over largest_volts. Observation: (6 + N,), nu and the target over largest_nu, and
    chi over pi/n. Reward: minus |nu - target|^2/|largest_nu|^2, minus 0.01 |action|^2/N, at the end of the step. An
    episode is truncated after `steps`; it is terminated only where the motion cannot go on.

    Raises InvalidValueError for numbers that make no sense.
    """

    vehicle: Vehicle = field(default_factory=Vehicle.paper)
    motor: Motor = Motor(0.0, torque_constant=0.012, resistance=2.5, gear_ratio=20)
    largest_volts: float = 6.0
    largest_nu: tuple[float, float, float] = (2.0, 2.0, 1.0)
    step: float = 0.01
    steps: int = 500
    roller_model: str = "free"
    effects: Sequence[Effect] = ()
    accuracy: float = 1e-6

    def __post_init__(self) -> None:
        for name in ("largest_volts", "step"):
            validation.positive(name, getattr(self, name))
        validation.integer("steps", self.steps, 1)
        scale = validation.real_array("largest_nu", self.largest_nu, (3,))
        if (scale <= 0).any():
            raise InvalidValueError("largest_nu", self.largest_nu, "must be positive")
        object.__setattr__(self, "largest_nu", tuple(scale.tolist()))
        object.__setattr__(self, "motor", replace(self.motor, voltage=(0.0,) * self.vehicle.wheels))

    @property
    def options(self) -> dict:
        """The arguments of a session."""
        acting = [self.motor, *self.effects]
        return {"effects": acting, "roller_model": self.roller_model, "accuracy": self.accuracy}

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(6 + N,) of observations: nu has none."""
        largest = np.concatenate([np.full(3, np.inf), np.ones(3 + self.vehicle.wheels)])
        return -largest, largest

    def starts(self, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Targets (count, 3) and wheel angles (count, N), drawn evenly."""
        joint = np.pi / self.vehicle.rollers_per_wheel
        targets = rng.uniform(-1, 1, (count, 3)) * self.largest_nu
        return targets, rng.uniform(-joint, joint, (count, self.vehicle.wheels))

    def actions(self, given: ArrayLike, *lead: int) -> np.ndarray:
        """Actions (*lead, N), cut off at 1. Raises InvalidValueError for others, and where one is not finite."""
        return np.clip(validation.real_array("action", given, (*lead, self.vehicle.wheels)), -1, 1)

    def targets(self, given: ArrayLike, *lead: int) -> np.ndarray:
        """Targets (*lead, 3) in 1/s that are given. Raises InvalidValueError for others."""
        return validation.real_array("target", given, (*lead, 3))

    def volts(self, action: np.ndarray) -> np.ndarray:
        """Voltages of actions (..., N)."""
        return action * self.largest_volts

    def observation(self, nu: np.ndarray, target: np.ndarray, chi: np.ndarray) -> np.ndarray:
        """(..., 6 + N)."""
        scaled = nu / self.largest_nu, target / self.largest_nu, chi * (self.vehicle.rollers_per_wheel / np.pi)
        parts = scaled[0], np.clip(scaled[1], -1, 1), np.clip(scaled[2], -1, 1)  # of what rounding adds
        return np.concatenate(parts, axis=-1)

    def reward(self, nu: np.ndarray, target: np.ndarray, action: np.ndarray) -> np.ndarray:
        """(...)."""
        missed = ((nu - target) ** 2).sum(axis=-1) / np.square(self.largest_nu).sum()
        effort = (action**2).mean(axis=-1)
        return -SPEED_COST * missed - EFFORT_COST * effort
