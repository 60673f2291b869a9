"""The ground as it is: wheels that may slip on it.

The mechanics is in maxima/effects/contact.mac: the wheels' rates and the axial speeds of the rollers in contact are
states of their own, and the ground acts by forces that a law gives. A switch then changes no speed: the roller that
comes into contact has the axial speed that it has, and the ground spins it up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.friction import Grip
from omniroll.effects.numbers import PerWheel, per_wheel, spread
from omniroll.effects.slope import Slope
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import JOINTS, Kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.vehicles.loads import loads_carried, loads_of_standing
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import CONTACT, STANDARD_GRAVITY, documented

# Numbers of each law.
NEEDED = {"viscous": ("coefficient",), "coulomb": ("friction",), "regularised": ("friction", "speed")}
OPTIONAL = {"coulomb": ("static_friction", "load", "normal_gravity"), "regularised": ("load", "normal_gravity")}
COEFFICIENTS = ("coefficient", "friction", "static_friction")
# Effects beside which no wheel stands on its joint.
UNSHARED = {"axle_sticking", "roller_sticking", "roller_viscous", "roller_coulomb", "contact_springs"}
LEAST_CARRYING = 3  # contacts, whose loads follow from their sum and moments
OF_LOADS = {"mass", "platform_radius", "wheel_angles", "wheel_places", "center_of_mass"}  # at rest, of the vehicle


def _along_and_across(name: str, value: ArrayLike) -> PerWheel:
    """One number, or two: along the axle and along the rolling direction. Raises InvalidValueError."""
    numbers = per_wheel(name, value)
    if np.ndim(numbers) and len(numbers) != 2:
        raise InvalidValueError(name, value, "must be one number, or two: along the axle and the rolling direction")
    if np.min(numbers) < 0 or (name != "coefficient" and np.min(numbers) == 0):
        bound = "must not be negative" if name == "coefficient" else "must be positive"
        raise InvalidValueError(name, value, bound)
    return numbers


def _of_wheels(numbers: PerWheel, vehicle: Vehicle) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, np.broadcast_to(numbers, (vehicle.wheels, 2)).tolist()))


@documented(*CONTACT)
@dataclass(frozen=True)
class Contact(Effect):
    """Wheels that may slip on the ground, under a law of friction.

    {entries}

    Locked rollers are refused. The law of a switch has no part in such a run.

    Raises InvalidValueError for numbers out of their bounds, and for those that the law needs or does not have;
    simulate for a number of loads, rates or spins that is not N, and for loads that do not follow from the vehicle.
    """

    is_friction: ClassVar[bool] = True
    signals: ClassVar[tuple[str, ...]] = ("wheel_rates", "contact_spins")

    coefficient: ArrayLike | None = None
    law: str = "viscous"
    friction: ArrayLike | None = None
    static_friction: ArrayLike | None = None
    speed: float | None = None
    loads: str = "static"
    load: ArrayLike | None = None
    normal_gravity: float | None = None
    joints: bool = False
    wheel_rates: ArrayLike | None = None
    contact_spins: ArrayLike | None = None

    def __post_init__(self) -> None:
        plain = ("law", "speed", "normal_gravity", "loads", "joints")
        self._keep_checked(entry for entry in CONTACT if entry.name in plain)
        if self.loads == "dynamic":
            bound = "is refused: rigid loads may be several or none; take Springs, or see them after a run by reactions"
            raise InvalidValueError("loads", self.loads, bound)
        for name in NEEDED[self.law]:
            if getattr(self, name) is None:
                raise InvalidValueError(name, None, f"must be given with the law {self.law}")
        for name in (*COEFFICIENTS, "speed", "load", "normal_gravity"):
            if getattr(self, name) is not None and name not in (*NEEDED[self.law], *OPTIONAL.get(self.law, ())):
                raise InvalidValueError(name, getattr(self, name), f"has no part in the law {self.law}")
        for name in COEFFICIENTS:
            if getattr(self, name) is not None:
                self._put(**{name: _along_and_across(name, getattr(self, name))})
        if self.static_friction is not None and (np.subtract(self.static_friction, self.friction) < 0).any():
            bound = f"must be at least friction, {self.friction}"
            raise InvalidValueError("static_friction", self.static_friction, bound)
        for name in ("load", "wheel_rates", "contact_spins"):
            if getattr(self, name) is not None:
                self._put(**{name: per_wheel(name, getattr(self, name))})
                validation.magnitude(name, np.atleast_1d(getattr(self, name)), axes=1)
        if self.load is not None and np.min(self.load) < 0:
            raise InvalidValueError("load", self.load, "must not be negative")

    @property
    def numbers(self) -> Mapping[str, str]:  # type: ignore[override]
        """Fields that are arguments of `prepare`, or of the friction of contacts that may stick."""
        own = {"coefficient": "ground_damping", "friction": "ground_friction", "speed": "ground_fade_speed"}
        own |= {"load": "contact_load", "static_friction": "ground_static_friction"}
        return {name: argument for name, argument in own.items() if getattr(self, name) is not None}

    def number_shape(self, name: str, shape: tuple[int, ...]) -> tuple[int, ...]:
        return (2,) if name in COEFFICIENTS else shape

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        for name in ("wheel_rates", "contact_spins"):
            self._given(name, vehicle.wheels)
        if sum(isinstance(effect, Contact) for effect in others) > 1:
            raise InvalidValueError("effects", self, "there is one ground")
        slope = next((effect for effect in others if isinstance(effect, Slope)), None)
        if self.law != "viscous" and slope is not None and self.load is None and self.normal_gravity is None:
            bound = f"must be given on a slope; across this plane it is {slope.normal_gravity!r}"
            raise InvalidValueError("normal_gravity", None, bound)
        self.constants(vehicle)

    def check_model_beside(self, roller_model: str, others: Sequence[Effect]) -> None:
        present = {name for effect in others for name in effect.kernel_effects()}
        if self.joints and UNSHARED & present:
            bound = "has no part beside friction of rollers, bearings that stick and springs; leave it out"
            raise InvalidValueError("joints", True, bound)
        if roller_model == "massless" and {"contact_coulomb", "roller_sticking", "roller_viscous"} <= present:
            bound = "does not go with massless rollers that stick on coulomb ground; leave it out, or take free ones"
            damping = next(own for effect in others if (own := getattr(effect, "roller_viscous", None)) is not None)
            raise InvalidValueError("roller_viscous", damping, bound)

    def check_model(self, roller_model: str) -> None:
        if roller_model == "locked":
            bound = "cannot be locked where wheels may slip: no ground stops a roller at once; choose free or massless"
            raise InvalidValueError("roller_model", roller_model, bound)
        if roller_model == "massless" and self.contact_spins is not None:
            raise InvalidValueError("contact_spins", self.contact_spins, "massless rollers turn as they roll")

    def _given(self, name: str, wheels: int) -> np.ndarray | None:
        value: PerWheel | None = getattr(self, name)
        return None if value is None else spread(name, value, wheels)

    def kernel_effects(self) -> tuple[str, ...]:
        return ("contact", f"contact_{self.law}", *((JOINTS,) if self.joints else ()))

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple]:
        if self.law == "viscous":
            return {"ground_damping": _of_wheels(self.coefficient, vehicle)}
        loads = tuple(self.loads_at_rest(vehicle).tolist())
        if self.law == "coulomb":
            return {}
        friction = _of_wheels(self.friction, vehicle)
        return {"contact_load": loads, "ground_friction": friction, "ground_fade_speed": self.speed}

    def constants_along(self, vehicle: Vehicle, moved: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The slopes of the loads at rest, where the law has them and they are not given.

        moved  slopes of the vehicle's numbers, by name

        Raises InvalidValueError for a vehicle that stands on two contacts alone.
        """
        if self.law == "viscous" or self.load is not None or not OF_LOADS & moved.keys():
            return {}

        def carrying(name: str) -> np.ndarray:
            value = getattr(vehicle, name)
            return with_tangent(value, moved.get(name, np.zeros(np.shape(value))))

        counts = vehicle.wheels, vehicle.rollers_per_wheel
        rays = carrying("platform_radius"), carrying("wheel_angles")
        given = vehicle.wheel_places is not None
        places = carrying("wheel_places") if given else np.array(parts.places_on_rays(*counts, *rays))
        center = carrying("center_of_mass")
        sums = np.array(parts.standing_loads(*counts, carrying("mass"), self._gravity, center))
        carries = self.loads_at_rest(vehicle) > 0
        if carries.sum() < LEAST_CARRYING:
            raise InvalidValueError("sensitivities", "loads at rest", "have no derivative on two contacts: give `load`")
        return {"contact_load": tangent_of(loads_carried(places, sums, carries))}

    def loads_at_rest(self, vehicle: Vehicle) -> np.ndarray:
        """(N,) in N, the loads of the contacts: those that are given, or those of the vehicle at rest on level ground.

        vehicle  Vehicle, of three wheels or more where no loads are given

        Raises InvalidValueError where they do not follow from the vehicle, or where it tips.
        """
        if self.load is not None:
            return self._given("load", vehicle.wheels)
        return loads_of_standing(vehicle, self._gravity)

    @property
    def _gravity(self) -> float:
        return STANDARD_GRAVITY if self.normal_gravity is None else self.normal_gravity

    def grip(self, vehicle: Vehicle) -> Grip | None:
        """What its contacts can hold at most: the cones of the law `coulomb`; None for the other laws.

        vehicle  Vehicle with the inertia of all effects
        """
        if self.law != "coulomb":
            return None
        static = self.friction if self.static_friction is None else self.static_friction
        both = (np.array(_of_wheels(numbers, vehicle)) for numbers in (self.friction, static))
        return Grip(self.loads_at_rest(vehicle), *both)

    def recorded(self) -> tuple[str, ...]:
        return ("sticks", "slip_heading") if self.law == "coulomb" else ()

    def events(self) -> tuple[str, ...]:
        return ("contacts that come to rest, stick and let go",) if self.law == "coulomb" else ()

    def begin(self, kernel: Kernel, state: State) -> State:
        rates, spins = (self._given(name, kernel.wheels) for name in ("wheel_rates", "contact_spins"))
        kernel = kernel_in_phase(kernel, Carry(state.contact, np.zeros_like(state.contact)))
        rolling, rolling_spins = kernel.wheel_rates(state.nu, state.chi)
        state = replace(state, rates=rolling if rates is None else np.broadcast_to(rates, rolling.shape))
        if not kernel.has_spins:
            return state
        excess = 0.0 if spins is None else spins - rolling_spins
        carried = kernel.carried_beyond_rolling(state.nu, state.chi, state.rates)
        state = replace(state, axial=state.axial + carried[..., None])
        return state.with_contact_axial(kernel.contact_axial(state.nu, state.chi) + carried + excess)

    def initial(self, kernel: Kernel, state: State) -> dict[str, np.ndarray]:
        states = {"rates": state.rates}
        return states | {"contact_omega": state.contact_axial()} if kernel.has_spins else states
