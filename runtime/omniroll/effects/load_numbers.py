"""The numbers of the loads' balance that a vehicle does not have: for the reactions of a run, and for loads that follow
the motion."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts
from omniroll.vehicles.loads import refuse_collinear
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import REACTIONS, by_name

ENTRIES = by_name(REACTIONS)
CENTRED = 1e-12  # distance, per R, within which the wheels' centroid is the centre of mass


def part(vehicle: Vehicle, name: str, **values: float) -> float:
    """The first output of a function of the set "parts"."""
    return parts.evaluate(name, vehicle.wheels, vehicle.rollers_per_wheel, **values)[0]


def balance_numbers(
    vehicle: Vehicle, height: float, wheel_mass: float | None, platform_products: ArrayLike
) -> dict[str, Any]:
    """height, wheel_mass and platform_products as the functions of the balance take them.

    vehicle  Vehicle with three wheels or more

    Raises InvalidValueError for numbers that make no sense, for fewer than three wheels, for contacts on one line, and
    where wheel_mass is needed and None.
    """
    places = vehicle.places()
    refuse_collinear(places)
    if wheel_mass is None:
        _refuse_unless_centred(vehicle, places)
    return {
        "height": ENTRIES["height"].checked(height),
        "platform_products": np.array(ENTRIES["platform_products"].checked(platform_products)),
        "wheel_mass": 0.0 if wheel_mass is None else _wheel_mass(vehicle, wheel_mass),
    }


def spin_inertia_of(equipped: Vehicle, effects: Sequence[Any], given: ArrayLike | None = None) -> np.ndarray:
    """(N,) in kg m^2, angular momentum about the axles per rate of the wheels.

    equipped  Vehicle with the inertia that the effects bring
    effects   of the run; those with a gear_ratio and a rotor_inertia are motors
    given     one number or (N,) in its place

    Raises InvalidValueError.
    """
    wheels = equipped.wheels
    if given is not None:
        numbers = validation.real_array("spin_inertia", given)
        numbers = validation.real_array("spin_inertia", numbers, () if numbers.ndim == 0 else (wheels,))
        if (numbers <= 0).any():
            raise InvalidValueError("spin_inertia", given, "must be positive")
        return np.broadcast_to(numbers, (wheels,))
    inertia = equipped.wheel_inertia
    for motor in effects:
        if hasattr(motor, "rotor_inertia"):
            rotor = {"gear_ratio": motor.gear_ratio, "rotor_axial_inertia": motor.rotor_inertia}
            inertia = part(equipped, "spin_inertia", wheel_inertia=inertia, **rotor)
    return np.full(wheels, inertia)


def _wheel_mass(vehicle: Vehicle, wheel_mass: float) -> float:
    wheel_mass = ENTRIES["wheel_mass"].checked(wheel_mass)
    if vehicle.wheels * wheel_mass >= vehicle.mass:
        bound = f"wheels must be lighter than the whole vehicle, {vehicle.mass!r} kg"
        raise InvalidValueError("wheel_mass", wheel_mass, bound)
    return wheel_mass


def _refuse_unless_centred(vehicle: Vehicle, places: np.ndarray) -> None:
    beside = np.abs(places.mean(axis=0) - vehicle.center_of_mass).max()
    if beside > CENTRED * vehicle.platform_radius:
        bound = "must be given: the wheels' centroid is not below the centre of mass, so that their height matters"
        raise InvalidValueError("wheel_mass", None, bound)
