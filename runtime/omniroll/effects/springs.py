"""Loads from springs: the platform heaves and tilts on its wheels, and a contact may leave the ground.

The mechanics is in maxima/effects/contact_springs.mac. Here are the numbers of the springs, as people know them, and
the process that says which contacts press on the ground: a contact is off where its spring and its damper would pull.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects import registry
from omniroll.effects.bearings import Bearings
from omniroll.effects.contact import Contact
from omniroll.effects.effect import Effect, Influence, Process, Signal
from omniroll.effects.guards import Guard
from omniroll.effects.motor import spin_inertia_of
from omniroll.effects.registry import Quantity
from omniroll.effects.state_vector import StateVector
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles import parts
from omniroll.vehicles.loads import loads_of_standing
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import SPRINGS, STANDARD_GRAVITY, documented

OF_BEARINGS = {"axle_viscous", "axle_coulomb"}  # effects of the registry that go with springs


@documented(*SPRINGS)
@dataclass(frozen=True)
class Springs(Effect):
    """Springs and dampers at the contacts, on which the platform heaves and tilts; beside a Contact.

    {entries}

    Raises InvalidValueError for numbers out of their bounds; simulate raises it where there is no Contact with the law
    coulomb or regularised, and for rollers whose bearings have friction.
    """

    height: float
    deflection: float = 1e-4
    damping_ratio: float = 0.3
    tilt_inertia: ArrayLike | None = None
    products: ArrayLike = (0.0, 0.0)
    spin_inertia: ArrayLike | None = None
    normal_gravity: float = STANDARD_GRAVITY
    tilt: ArrayLike = (0.0, 0.0, 0.0)
    tilt_rate: ArrayLike = (0.0, 0.0, 0.0)
    most_tilt: float = 0.2

    def __post_init__(self) -> None:
        self._keep_checked(SPRINGS)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        contact = next((effect for effect in others if isinstance(effect, Contact)), None)
        if contact is None or contact.law == "viscous":
            bound = "need wheels that may slip under a law that knows loads: a Contact with coulomb or regularised"
            raise InvalidValueError("effects", "Springs", bound)
        if contact.load is not None:
            raise InvalidValueError("load", contact.load, "must not be given on springs, which have the loads at rest")
        if (contact.normal_gravity or STANDARD_GRAVITY) != self.normal_gravity:
            bound = f"must be that of the contacts, {contact.normal_gravity or STANDARD_GRAVITY!r}"
            raise InvalidValueError("normal_gravity", self.normal_gravity, bound)
        rotor = next((effect for effect in others if getattr(effect, "rotor_inertia", 0.0)), None)
        if self.spin_inertia is None and rotor is not None:
            turns = float(spin_inertia_of(rotor.equipped(vehicle), (rotor,))[0])
            bound = f"must be given beside a motor whose rotor has inertia; it is {turns!r}"
            raise InvalidValueError("spin_inertia", None, bound)
        for effect in others:
            if isinstance(effect, Bearings) and not OF_BEARINGS.issuperset(effect.kernel_effects()):
                bound = "on springs rollers have no friction: leave roller_... out; wheel_coulomb needs a wheel_speed"
                raise InvalidValueError("effects", "Bearings", bound)

    def kernel_effects(self) -> tuple[str, ...]:
        return ("contact_springs",)

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        """The arguments of `prepare`: springs and dampers, and the inertia of the tilt.

        Raises InvalidValueError for a vehicle with a contact that carries nothing at rest, and for an inertia that
        wheels and rollers alone exceed.
        """
        loads = loads_of_standing(vehicle, self.normal_gravity)
        if loads.min() <= 0:
            raise InvalidValueError("load", loads.tolist(), "must be positive at rest where contacts stand on springs")
        spin = spin_inertia_of(vehicle, (), self.spin_inertia)
        own = {"deflection": self.deflection, "damping_ratio": self.damping_ratio}
        own["gravity_strength"] = self.normal_gravity
        springs = [parts.of_vehicle("spring_of_load", vehicle, load_at_rest=load, **own) for load in loads.tolist()]
        return {
            "spring_load": tuple(loads.tolist()),
            "spring_stiffness": tuple(stiffness for stiffness, _ in springs),
            "spring_damping": tuple(damping for _, damping in springs),
            "tilt_height": self.height,
            "tilt_gravity": self.normal_gravity,
            "tilt_inertia": self._inertia(vehicle, spin),
            "tilt_products": tuple(self.products),
            "tilt_spin_inertia": tuple(spin.tolist()),
        }

    def _inertia(self, vehicle: Vehicle, spin: np.ndarray) -> tuple[float, ...]:
        """In kg m^2 about xi and eta through the centre of mass. Where it is not given, that of a cylinder with the
        vehicle's mass, over the wheels' circle and from the ground to twice the height of the centre of mass. Refuses
        one that wheels and rollers alone exceed, which turn about their axes by themselves."""
        given = self.tilt_inertia
        size = vehicle.mass, vehicle.platform_radius, 2 * self.height
        found = parts.cylinder(*size)[1] if given is None else given
        of_rollers = vehicle.wheels * vehicle.rollers_per_wheel * vehicle.roller_inertia / 2
        least = float((spin**2).sum() / vehicle.wheel_inertia + of_rollers)
        if np.min(found) <= least:
            bound = f"must exceed {least:.3g} kg m^2, what wheels and rollers have about their axes"
            raise InvalidValueError("tilt_inertia", given, bound)
        return tuple(np.broadcast_to(found, 2).tolist())

    def start(self) -> dict[str, np.ndarray]:
        return {"tilt": np.array(self.tilt), "tilt_rate": np.array(self.tilt_rate)}

    def recorded(self) -> tuple[str, ...]:
        return ("presses",)

    def events(self) -> tuple[str, ...]:
        return ("contacts that leave the ground, and press on it again", f"a tilt of {self.most_tilt:g} rad")

    def process(self, kernel: Kernel, start_time: float) -> "Supports":
        contact = tuple(name for name in kernel.effects if name.startswith("contact"))
        quantities = registry.quantities(contact, kernel.roller_model, kernel.effects)
        return Supports(kernel, self.most_tilt, quantities)


class Supports(Process):
    """Which contacts press on the ground in one run, and whether the vehicle has tipped.

    presses  (N,) 1 for those that do, else 0
    """

    remembers: ClassVar[tuple[str, ...] | None] = ("presses",)

    def __init__(self, kernel: Kernel, most_tilt: float, quantities: Sequence[Quantity]):
        vector = StateVector(kernel, quantities)
        self.presses = np.ones(kernel.wheels)
        self.constant, self.weights = _margins(kernel, vector)
        self.most_tilt, self.turns = most_tilt, np.eye(vector.size)[vector.slices["tilt"]][1:]

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        sign = np.where(self.presses > 0, -1.0, 1.0)
        guards = (
            Guard(s * constant, 0.0, s * weights, size=abs(constant))
            for s, constant, weights in zip(sign, self.constant, self.weights, strict=True)
        )
        tips = (Guard(-self.most_tilt, 0.0, side * turn) for turn in self.turns for side in (1, -1))
        return Influence({"presses": Signal.constant(self.presses.copy())}, (*guards, *tips))

    def pass_guards(self, passed: np.ndarray) -> None:
        of_contacts = passed[: len(self.presses)]
        self.presses = np.where(of_contacts, 1 - self.presses, self.presses)
        if passed[len(self.presses) :].any():
            self.ended = f"the vehicle tips: its platform has turned by {self.most_tilt:g} rad"


def _margins(kernel: Kernel, vector: StateVector) -> tuple[np.ndarray, np.ndarray]:
    """(N,) in N what springs and dampers have at rest, and its slopes (N, size) by the state: it is affine."""
    moved = np.concatenate([np.zeros((1, 6)), np.eye(6)])
    _, margins, _ = kernel.call("support_state", moved[:, :3], moved[:, 3:], np.ones((7, kernel.wheels)))
    weights = np.zeros((kernel.wheels, vector.size))
    for name, slopes in (("tilt", margins[1:4]), ("tilt_rate", margins[4:7])):
        weights[:, vector.slices[name]] = (slopes - margins[0]).T
    return margins[0], weights
