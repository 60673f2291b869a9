"""Gravity on an inclined plane."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from omniroll.effects.effect import Effect
from omniroll.vehicles import parts
from omniroll.vocabulary import SLOPE, STANDARD_GRAVITY, documented


@documented(*SLOPE)
@dataclass(frozen=True)
class Slope(Effect):
    """Gravity on a plane that is inclined.

    {entries}

    Raises InvalidValueError for numbers out of their bounds.
    """

    potentials: ClassVar[Mapping[str, str]] = {"slope_work": "potential"}
    numbers: ClassVar[Mapping[str, str]] = {
        "gravity": "gravity", "angle": "slope_angle", "direction": "slope_direction",
    }  # fmt: skip

    angle: float
    direction: float = 0.0
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        self._keep_checked(SLOPE)

    @property
    def normal_gravity(self) -> float:
        """Gravity across the plane in m/s^2."""
        (across,) = parts.evaluate("across_plane", 1, 3, gravity_strength=self.gravity, plane_angle=self.angle)
        return across

    def kernel_effects(self) -> tuple[str, ...]:
        return ("slope",)
