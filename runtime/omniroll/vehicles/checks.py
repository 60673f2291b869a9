"""Checks of states: speeds, wheel angles and spins that fit a vehicle and a roller model."""

import math

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle


def joint_angle(rollers_per_wheel: int) -> float:
    """pi/n in rad: the largest |chi| that a roller has in contact."""
    return math.pi / rollers_per_wheel


def wheel_angles_in_contact(chi: ArrayLike, vehicle: Vehicle) -> np.ndarray:
    """`chi` as an array (..., N) with |chi| <= pi/n; a scalar is one angle for all wheels.

    An angle that is outside by rounding only (4 ulp) becomes +-pi/n.
    """
    if np.ndim(chi) == 0:
        chi = np.full(vehicle.wheels, validation.real("chi", chi))
    array = validation.trailing("chi", chi, (vehicle.wheels,))
    joint = joint_angle(vehicle.rollers_per_wheel)
    if (np.abs(array) > joint * (1 + 4 * np.finfo(float).eps)).any():
        raise InvalidValueError(
            "chi", np.asarray(chi).tolist(), f"must lie within +-pi/n = {joint!r}, the roller in contact"
        )
    return np.clip(array, -joint, joint)


def speeds(nu: ArrayLike) -> np.ndarray:
    """`nu` as an array (..., 3) whose squares stay in the number range."""
    return validation.magnitude("nu", validation.trailing("nu", nu, (3,)), axes=1)


def free_spins(spins: ArrayLike | None, vehicle: Vehicle, roller_model: str) -> np.ndarray | None:
    """`spins` as an array (..., N, n-1) for free rollers, None for the others, which may only be at rest."""
    if spins is None:
        spins = 0.0
    if roller_model != "free":
        if validation.real_array("spins", spins).any():
            raise InvalidValueError(
                "spins",
                np.asarray(spins).tolist(),
                f'must be 0: roller_model "{roller_model}" has no spinning free rollers',
            )
        return None
    shape = (vehicle.wheels, vehicle.rollers_per_wheel - 1)
    if np.ndim(spins) == 0:
        spins = np.full(shape, validation.real("spins", spins))
    return validation.magnitude("spins", validation.trailing("spins", spins, shape), axes=2)


def refuse_unless_finite(what: str, nu: np.ndarray, *results: np.ndarray) -> None:
    """Raise InvalidValueError where speeds inside the bounds give results that leave the number range."""
    if not all(np.isfinite(result).all() for result in results):
        raise InvalidValueError("nu", nu.tolist(), f"too large for this vehicle: the {what} leave the number range")
