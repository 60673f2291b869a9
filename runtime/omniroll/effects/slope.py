"""Gravity on an inclined plane."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle

STANDARD_GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class Slope(Effect):
    """A plane that is inclined.

    angle      in rad, at least 0 and below pi/2
    direction  in rad: the way of steepest descent in the x, y plane
    gravity    in m/s^2, at least 0
    """

    potentials: ClassVar[Mapping[str, str]] = {"slope_work": "potential"}

    angle: float
    direction: float = 0.0
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for name in ("angle", "direction", "gravity"):
            object.__setattr__(self, name, validation.real(name, getattr(self, name)))
        if not 0 <= self.angle < math.pi / 2:
            raise InvalidValueError("angle", self.angle, "must lie between 0 and pi/2")
        if self.gravity < 0:
            raise InvalidValueError("gravity", self.gravity, "must not be negative")

    def kernel_effects(self) -> tuple[str, ...]:
        return ("slope",)

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        return {"gravity": self.gravity, "slope_angle": self.angle, "slope_direction": self.direction}
