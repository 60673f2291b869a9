"""The work of the weight, on wheels that rise and fall over their rollers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from omniroll.effects.effect import Effect
from omniroll.effects.slope import Slope
from omniroll.errors import InvalidValueError
from omniroll.vehicles.loads import loads_of_standing
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import STANDARD_GRAVITY, WEIGHT, documented


@documented(*WEIGHT)
@dataclass(frozen=True)
class Weight(Effect):
    """Gravity on a vehicle whose wheels rise and fall, to first order in H', the slope of their height by their angle.

    Each wheel carries its load N at rest on level ground up and down: its axle takes the moment -N H'. Left out are the
    platform's tilt, what that moves aside, and the inertia of the rise and fall.

    {entries}

    Raises InvalidValueError for numbers out of their bounds; simulate raises it for wheels that stay round, for a
    Slope beside it, and for loads that do not follow from the vehicle: of fewer than three wheels, or one that tips.
    """

    potentials: ClassVar[Mapping[str, str]] = {"weight_work": "lift_energy"}

    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        self._keep_checked(WEIGHT)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        if not vehicle.has_profile:
            bound = "has no work on wheels that stay round: give meridian_radius or roller_profile, or leave it out"
            raise InvalidValueError("gravity", self.gravity, bound)
        if any(isinstance(other, Slope) for other in others):
            raise InvalidValueError("gravity", self.gravity, "has loads of level ground: leave the slope out")
        loads_of_standing(vehicle, self.gravity)

    def kernel_effects(self) -> tuple[str, ...]:
        return ("weight",)

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        return {"wheel_loads": tuple(loads_of_standing(vehicle, self.gravity).tolist())}
