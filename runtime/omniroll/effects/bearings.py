"""Friction in the bearings: in the axles of the wheels, and between the rollers and their disks.

Viscous friction is the torque - c chi' at an axle and - c phi' at a roller, with phi' relative to its disk. Coulomb
friction is - T w / sqrt(w^2 + w_0^2), w the rate and w_0 a speed that the user names: the torque is smooth, so that
nothing sticks; at rates well below w_0 it is small, and what should stick creeps.

Free rollers spin down, so that their momenta are no longer constant. With viscous friction alone they still collapse
into a few numbers a wheel, which are states then: two momenta and the energy of the axial spins, whatever n is; the
speeds of the single rollers follow from them (axial_after). With Coulomb friction each axial speed is a state.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect
from omniroll.effects.numbers import spread
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import BEARINGS, documented

# Field of the effect, argument of the kernel's prepare, effect of the registry.
COEFFICIENTS = (
    ("wheel_viscous", "axle_damping", "axle_viscous"),
    ("wheel_coulomb", "axle_torque", "axle_coulomb"),
    ("roller_viscous", "roller_damping", "roller_viscous"),
    ("roller_coulomb", "roller_torque", "roller_coulomb"),
)
# Field, argument of prepare, the coefficient that needs it.
SPEEDS = (("wheel_speed", "axle_fade_speed", "wheel_coulomb"), ("roller_speed", "roller_fade_speed", "roller_coulomb"))


@documented(*BEARINGS)
@dataclass(frozen=True)
class Bearings(Effect):
    """Friction in the bearings of wheels and rollers. What is None is not there.

    {entries}

    A small wheel_speed or roller_speed makes the equations stiff: near rest the steps shrink like speed * inertia /
    torque. Raises InvalidValueError for numbers out of their bounds, where a Coulomb torque and its speed do not come
    together, and where no coefficient is given; simulate raises it for a number of coefficients that is not N.
    """

    wheel_viscous: ArrayLike | None = None
    wheel_coulomb: ArrayLike | None = None
    wheel_speed: float | None = None
    roller_viscous: ArrayLike | None = None
    roller_coulomb: ArrayLike | None = None
    roller_speed: float | None = None

    def __post_init__(self) -> None:
        self._keep_checked(BEARINGS)
        for name, _, coefficient in SPEEDS:
            speed = getattr(self, name)
            if (speed is None) != (getattr(self, coefficient) is None):
                raise InvalidValueError(name, speed, f"must be given together with {coefficient}, and only then")
        if not self.kernel_effects():
            raise InvalidValueError("wheel_viscous", None, "Bearings needs at least one coefficient")

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        self.constants(vehicle)

    def kernel_effects(self) -> tuple[str, ...]:
        return tuple(effect for name, _, effect in COEFFICIENTS if getattr(self, name) is not None)

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        coefficients = {
            argument: tuple(spread(name, getattr(self, name), vehicle.wheels).tolist())
            for name, argument, _ in COEFFICIENTS
            if getattr(self, name) is not None
        }
        speeds = {argument: getattr(self, name) for name, argument, _ in SPEEDS}
        return coefficients | {argument: speed for argument, speed in speeds.items() if speed is not None}

    def initial(self, kernel: Kernel, axial: np.ndarray | None) -> dict[str, np.ndarray]:
        names = self._names(kernel)
        if "momenta" in names:
            return {"momenta": kernel.momenta(axial), "roller_energy": kernel.call("roller_energy", axial)}
        return {"axial": axial} if "axial" in names else {}

    def axial_later(
        self, kernel: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray | None:
        names = self._names(kernel)
        if "momenta" in names:
            return kernel.call("axial_after", axial, before["momenta"], after["momenta"], elapsed)
        return after["axial"] if "axial" in names else None

    def _names(self, kernel: Kernel) -> set[str]:
        return {quantity.name for quantity in self.quantities(kernel.roller_model)}
