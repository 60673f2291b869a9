"""The ground as it is: wheels that may slip on it.

The mechanics is in maxima/effects/contact.mac: the wheels' rates and the axial speeds of the rollers in contact are
states of their own, and the ground acts by forces that a law gives. A switch then changes no speed: the roller that
comes into contact has the axial speed that it has, and the ground spins it up.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect
from omniroll.effects.numbers import PerWheel, per_wheel, spread
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import CONTACT, documented

STATES = ("rates", "contact_omega")  # what is integrated for it beside the account


@documented(*CONTACT)
@dataclass(frozen=True)
class Contact(Effect):
    """Wheels that may slip on the ground, under a law of friction.

    {entries}

    Locked rollers are refused: to stop a roller on its disk at a switch takes an impulse that no friction of the ground
    gives. So is Coulomb's friction in the wheels' axles without a wheel_speed. The law of a switch has no part in such
    a run, which is made by the Python engine.

    Raises InvalidValueError for numbers out of their bounds; simulate raises it for a number of rates or spins that is
    not N, and for contact_spins of massless rollers, which turn as they roll.
    """

    coefficient: ArrayLike
    law: str = "viscous"
    wheel_rates: ArrayLike | None = None
    contact_spins: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._keep_checked(entry for entry in CONTACT if entry.name == "law")
        coefficient = per_wheel("coefficient", self.coefficient)
        if np.ndim(coefficient) and len(coefficient) != 2:
            bound = "must be one number, or two: along the axle and along the rolling direction"
            raise InvalidValueError("coefficient", self.coefficient, bound)
        if np.min(coefficient) < 0:
            raise InvalidValueError("coefficient", self.coefficient, "must not be negative")
        object.__setattr__(self, "coefficient", coefficient)
        for name in ("wheel_rates", "contact_spins"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, per_wheel(name, getattr(self, name)))

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        for name in ("wheel_rates", "contact_spins"):
            self._given(name, vehicle.wheels)
        if any("axle_sticking" in effect.kernel_effects() for effect in others):
            bound = "must be given where wheels may slip: axles that stick are not solved together with the ground"
            raise InvalidValueError("wheel_speed", None, bound)
        if sum(isinstance(effect, Contact) for effect in others) > 1:
            raise InvalidValueError("effects", self, "there is one ground")

    def check_model(self, roller_model: str) -> None:
        if roller_model == "locked":
            bound = (
                "cannot be locked where wheels may slip: a roller that leaves the ground would have to stop on its "
                "disk at once, which no friction of the ground does; choose free or massless"
            )
            raise InvalidValueError("roller_model", roller_model, bound)
        if roller_model == "massless" and self.contact_spins is not None:
            raise InvalidValueError("contact_spins", self.contact_spins, "massless rollers turn as they roll")

    def _given(self, name: str, wheels: int) -> np.ndarray | None:
        value: PerWheel | None = getattr(self, name)
        return None if value is None else spread(name, value, wheels)

    def kernel_effects(self) -> tuple[str, ...]:
        return ("contact", f"contact_{self.law}")

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple]:
        coefficient = np.broadcast_to(self.coefficient, (vehicle.wheels, 2))
        return {"ground_damping": tuple(map(tuple, coefficient.tolist()))}

    def begin(self, kernel: Kernel, state: State) -> State:
        rates, spins = (self._given(name, kernel.wheels) for name in ("wheel_rates", "contact_spins"))
        rolling, rolling_spins = kernel.wheel_rates(state.nu, state.chi)
        state = replace(state, rates=rolling if rates is None else rates)
        if not kernel.has_spins:
            return state
        excess = 0.0 if spins is None else spins - rolling_spins
        return state.with_contact_axial(kernel.contact_axial(state.nu, state.chi) + excess)

    def initial(self, kernel: Kernel, state: State) -> dict[str, np.ndarray]:
        states = {"rates": state.rates}
        return states | {"contact_omega": state.contact_axial()} if kernel.has_spins else states
