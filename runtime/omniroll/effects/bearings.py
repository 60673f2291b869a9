"""Friction in the bearings: in the axles of the wheels, and between the rollers and their disks.

Viscous friction is the torque - c chi' at an axle and - c phi' at a roller, with phi' relative to its disk. Coulomb
friction has two laws. The set-valued one: - T sign(w) where a bearing turns at the rate w; where it is at rest, what
holds it, up to the break-away torque. The regularised one:
- T w / sqrt(w^2 + w_0^2) with a speed w_0 that the user names; the torque is smooth, so that nothing sticks: at rates
well below w_0 it is small, and what should stick creeps.

Free rollers spin down, so that their momenta are no longer constant. With viscous friction alone they still collapse
into a few numbers a wheel, which are states then: two momenta and the energy of the axial spins, whatever n is; the
speeds of the single rollers follow from them (axial_after). With Coulomb friction the spin of each is a state, relative
to its disk, where the friction acts: next to rest an axial speed would round it away. Where wheels may slip, it is the
axial speed.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects import registry
from omniroll.effects.effect import Effect
from omniroll.effects.friction import Bearing
from omniroll.effects.numbers import spread
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import BEARINGS, STANDARD_GRAVITY, documented

# Times the weight of the vehicle times the radius of its wheels: what is refused, and what locked bearings take.
BEYOND_USE, LOCKS = 1e10, 1e3
# Field of the effect, argument of the kernel's prepare, effect of the registry. Where axles stick, wheel_coulomb is no
# argument: the kernel has the torques of the bearings as an input.
COEFFICIENTS = (
    ("wheel_viscous", "axle_damping", "axle_viscous"),
    ("wheel_coulomb", "axle_torque", "axle_coulomb"),
    ("roller_viscous", "roller_damping", "roller_viscous"),
    ("roller_coulomb", "roller_torque", "roller_coulomb"),
)
SPEEDS = (("wheel_speed", "axle_fade_speed"), ("roller_speed", "roller_fade_speed"))  # field, argument of prepare
BODIES = (("axle", "wheel"), ("roller", "roller"))  # kinds of bearings, and how the names of their fields begin


@documented(*BEARINGS)
@dataclass(frozen=True)
class Bearings(Effect):
    """Friction in the bearings of wheels and rollers. What is None is not there.

    {entries}

    wheel_coulomb without wheel_speed is the set-valued law: axles stick, and break away together where the torques that
    they take do not hold them. With wheel_speed it is the regularised law. The same holds of rollers. A small
    wheel_speed or roller_speed makes the equations stiff: near rest steps shrink like speed * inertia / torque.
    wheel_locked is the set-valued law with a bound that nothing reaches.

    Raises InvalidValueError for numbers out of their bounds, for wheel_speed or wheel_break_away without wheel_coulomb
    or both together, for wheel_locked with wheel_speed, for the same of rollers, and where no coefficient is given;
    simulate raises it for a number of coefficients that is not N, and for break_away below coulomb.
    """

    is_friction: ClassVar[bool] = True
    numbers: ClassVar[Mapping[str, str]] = {row[0]: row[1] for row in (*COEFFICIENTS, *SPEEDS)}

    signals: ClassVar[tuple[str, ...]] = ("wheel_coulomb", "wheel_break_away", "roller_coulomb", "roller_break_away")

    wheel_viscous: ArrayLike | None = None
    wheel_coulomb: ArrayLike | None = None
    wheel_speed: float | None = None
    wheel_break_away: ArrayLike | None = None
    wheel_locked: bool | Sequence[bool] | None = None
    roller_viscous: ArrayLike | None = None
    roller_coulomb: ArrayLike | None = None
    roller_speed: float | None = None
    roller_break_away: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._keep_checked(BEARINGS)
        for body in ("wheel", "roller"):
            coulomb, speed, break_away = (f"{body}_{what}" for what in ("coulomb", "speed", "break_away"))
            for name in (speed, break_away):
                if getattr(self, name) is not None and getattr(self, coulomb) is None:
                    raise InvalidValueError(name, getattr(self, name), f"must not be given without {coulomb}")
            if getattr(self, speed) is not None and getattr(self, break_away) is not None:
                bound = f"must not be given with {speed}: under the regularised law nothing rests"
                raise InvalidValueError(break_away, getattr(self, break_away), bound)
        if self.wheel_locked is not None and self.wheel_speed is not None:
            bound = "must not be given with wheel_speed: under the regularised law nothing rests"
            raise InvalidValueError("wheel_locked", self.wheel_locked, bound)
        if not self.kernel_effects():
            raise InvalidValueError("wheel_viscous", None, "Bearings needs at least one coefficient")

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        self.constants(vehicle)
        for _, body in self._stick():
            self._refuse_beyond_use(body, vehicle)

    def _refuse_beyond_use(self, body: str, vehicle: Vehicle) -> None:
        """What holds a bearing is a sum that torques far above all others leave no digits of."""
        usual = _usual_torque(vehicle)
        for name, torques in zip(("coulomb", "break_away"), self._torques(body, vehicle), strict=True):
            if torques.max() > BEYOND_USE * usual:
                locks = "wheel_locked" if body == "wheel" else f"a torque of {LOCKS * usual:.3g}"
                bound = f"must be at most {BEYOND_USE * usual:.3g}; {locks} locks it"
                raise InvalidValueError(f"{body}_{name}", getattr(self, f"{body}_{name}"), bound)

    @property
    def sticks(self) -> bool:
        """Whether the axles' Coulomb friction is the set-valued law."""
        return (self.wheel_coulomb is not None or self._locks) and self.wheel_speed is None

    @property
    def _locks(self) -> bool:
        """Whether an axle is locked."""
        return bool(np.any(self.wheel_locked))

    def _stick(self) -> tuple[tuple[str, str], ...]:
        """Those of BODIES whose Coulomb friction is the set-valued law."""
        return tuple(compress(BODIES, (self.sticks, self.roller_coulomb is not None and self.roller_speed is None)))

    def _torques(self, body: str, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
        """(N,) torques of the wheels' axles, or of their rollers, that turn; and the largest at rest."""
        coulomb, break_away = f"{body}_coulomb", f"{body}_break_away"
        given = getattr(self, coulomb)
        sliding = spread(coulomb, 0.0 if given is None else given, vehicle.wheels)  # none: some axle is locked
        holding = sliding.copy()
        if getattr(self, break_away) is not None:
            holding = spread(break_away, getattr(self, break_away), vehicle.wheels)
        if (holding < sliding).any():
            bound = f"must be at least {coulomb}, {given}"
            raise InvalidValueError(break_away, getattr(self, break_away), bound)
        if body == "wheel" and self._locks:
            locked = spread("wheel_locked", self.wheel_locked, vehicle.wheels) > 0
            for torques in (sliding, holding):
                torques[locked] = LOCKS * _usual_torque(vehicle)
        return sliding, holding

    def bearings(self, kernel: Kernel) -> dict[str, Bearing]:
        return {name: Bearing(*self._torques(body, kernel.vehicle)) for name, body in self._stick()}

    def events(self) -> tuple[str, ...]:
        return tuple(f"{name}s that stop, stick and break away" for name, _ in self._stick())

    def terms(self) -> "Iterator[tuple[str, Bearings | None]]":
        given = [name for name, _, _ in COEFFICIENTS if getattr(self, name) is not None]
        given += ["wheel_locked"] if self._locks else []
        for name in given:
            body = name.split("_")[0]
            beside = [f"{body}_speed", f"{body}_break_away"]
            own = [name, *(beside if name.endswith("coulomb") else ())]
            shown = [f"{field} = {getattr(self, field)}" for field in own if getattr(self, field) is not None]
            rest = replace(self, **dict.fromkeys(own)) if len(given) > 1 else None
            yield f"{type(self).__name__} ({', '.join(shown)})", rest

    def _coefficients(self) -> tuple[tuple[str, str, str], ...]:
        """Those of COEFFICIENTS whose constants the kernel has."""
        sticks = [f"{body}_coulomb" for _, body in self._stick()]
        return tuple(row for row in COEFFICIENTS if getattr(self, row[0]) is not None and row[0] not in sticks)

    def kernel_effects(self) -> tuple[str, ...]:
        sticking = (f"{name}_sticking" for name, _ in self._stick())
        return (*(effect for _, _, effect in self._coefficients()), *sticking)

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        coefficients = {
            argument: tuple(spread(name, getattr(self, name), vehicle.wheels).tolist())
            for name, argument, _ in self._coefficients()
        }
        speeds = {argument: getattr(self, name) for name, argument in SPEEDS}
        return coefficients | {argument: speed for argument, speed in speeds.items() if speed is not None}

    def initial(self, kernel: Kernel, state: State) -> dict[str, np.ndarray]:
        names, axial = self._names(kernel), state.free_axial()
        if "momenta" in names:
            return {"momenta": kernel.momenta(axial), "roller_energy": kernel.call("roller_energy", axial)}
        if "spins" in names:
            return {"spins": kernel.spins_from_axial(state.nu, state.chi, axial)}
        return {"axial": axial} if "axial" in names else {}

    def axial_later(
        self, kernel: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray | None:
        names = self._names(kernel)
        if "momenta" in names:
            return kernel.call("axial_after", axial, before["momenta"], after["momenta"], elapsed)
        if "spins" in names:
            return kernel.axial_speeds(after["nu"], after["chi"], after["spins"])
        return after["axial"] if "axial" in names else None

    def _names(self, kernel: Kernel) -> set[str]:
        """What is integrated for all effects of a kernel: of rollers, the ground says what where wheels may slip."""
        return {quantity.name for quantity in registry.quantities(kernel.effects, kernel.roller_model)}


def _usual_torque(vehicle: Vehicle) -> float:
    """In N m: the weight of the vehicle at the radius of its wheels."""
    return vehicle.mass * STANDARD_GRAVITY * vehicle.wheel_radius
