"""Checks of states: speeds, wheel angles and spins that fit a vehicle and a roller model."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle

FLOAT = np.dtype(float)


def refuse_unmodelled(vehicle: Vehicle) -> None:
    """Raise InvalidValueError for wheels that the equations of motion do not have."""
    if any(vehicle.roller_angle) and vehicle.rows > 1:
        bound = "has no equations of motion with rows = 2: mecanum wheels have one row"
        raise InvalidValueError("roller_angle", vehicle.roller_angle, bound)


def refuse_two_rows(vehicle: Vehicle, name: str, value: object, instead: str) -> None:
    """Raise InvalidValueError for what wheels with two rows of rollers do not have."""
    if vehicle.rows > 1:
        raise InvalidValueError(name, value, f"does not go with two rows of rollers: {instead}")


def refuse_moving_rows(vehicle: Vehicle, name: str, value: object, instead: str) -> None:
    """Raise InvalidValueError for what mecanum wheels and those whose rollers have a profile do not have."""
    if vehicle.rows_move:
        wheels = "mecanum wheels" if any(vehicle.roller_angle) else "a roller_profile or meridian_radius"
        raise InvalidValueError(name, value, f"does not go with {wheels}: {instead}")


def refuse_kinds(vehicle: Vehicle, name: str, value: object, instead: str) -> None:
    """Raise InvalidValueError for what wheels of several kinds do not have."""
    if vehicle.has_kinds:
        raise InvalidValueError(name, value, f"does not go with wheels of several kinds: {instead}")


def joint_angles(vehicle: Vehicle) -> np.ndarray:
    """(N,) pi/n in rad of each wheel: the largest |chi| that a roller of it has in contact."""
    return math.pi / np.array(vehicle.rollers)


def joint_angle(rollers_per_wheel: int) -> float:
    """pi/n in rad: the largest |chi| that a roller has in contact."""
    return math.pi / rollers_per_wheel


def wheel_angles_in_contact(chi: ArrayLike, vehicle: Vehicle) -> np.ndarray:
    """`chi` as an array (..., N) with |chi| <= pi/n; a scalar is one angle for all wheels.

    An angle that is outside by rounding only (4 ulp) becomes +-pi/n.
    """
    array = validation.real_array("chi", chi)
    if array.ndim == 0:
        array = np.full(vehicle.wheels, array)
    array = validation.trailing("chi", array, (vehicle.wheels,))
    joint = joint_angles(vehicle)
    if (np.abs(array) > joint * (1 + 4 * np.finfo(float).eps)).any():
        limit = joint.tolist() if vehicle.has_kinds else float(joint[0])
        raise InvalidValueError("chi", array.tolist(), f"must lie within +-pi/n = {limit!r}, the roller in contact")
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
    array = validation.real_array("spins", spins)
    there = rollers_there(vehicle)
    if array.ndim == 0:
        array = np.where(there, array, 0.0)
    array = validation.trailing("spins", array, shape)
    if (array * ~there).any():
        raise InvalidValueError("spins", array.tolist(), "must be 0 beyond the rollers that a wheel has")
    return validation.magnitude("spins", array, axes=2)


def rollers_there(vehicle: Any) -> np.ndarray:
    """(N, n-1) whether a wheel has a free roller at a place; of a vehicle, or of what a file says of one."""
    return np.arange(1, vehicle.rollers_per_wheel) < np.array(vehicle.rollers)[:, None]


def plain_state(
    vehicle: Vehicle, roller_model: str, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike | None
) -> tuple[np.ndarray, ...] | None:
    """nu (3,), chi (N,) and for free rollers spins (N, n-1), checked; None where they need a closer look.

    The checks are those of the functions above, for one state. On so few numbers plain Python is faster than NumPy.
    """
    free = roller_model == "free"
    if vehicle.has_kinds or not (free or spins is None or (type(spins) in (int, float) and spins == 0)):
        return None
    states = [_plain(nu, (3,)), _one_or_all(chi, (vehicle.wheels,))]
    if free:
        states.append(_one_or_all(0.0 if spins is None else spins, (vehicle.wheels, vehicle.rollers_per_wheel - 1)))
    largest = validation.LARGEST, joint_angle(vehicle.rollers_per_wheel), validation.LARGEST
    smallest = validation.SMALLEST, 0.0, validation.SMALLEST
    for state, least, most in zip(states, smallest, largest, strict=False):
        if state is None:
            return None
        numbers = state.ravel().tolist()
        size = max(map(abs, numbers))
        if not (size == 0 or least <= size <= most) or not math.isfinite(sum(numbers)):
            return None
    return tuple(states)


def _plain(value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray | None:
    """Real numbers of this shape, or None."""
    try:
        array = np.asarray(value)
    except Exception:  # ragged rows, or an object whose own code fails
        return None
    if array.shape != shape or array.dtype.kind not in "iuf":
        return None
    return array if array.dtype is FLOAT else array.astype(float)


def _one_or_all(value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray | None:
    """Likewise; a number by itself stands for all."""
    if type(value) not in (int, float):
        return _plain(value, shape)
    try:
        return np.full(shape, float(value))
    except OverflowError:  # an integer of hundreds of digits
        return None


def seem_finite(*arrays: np.ndarray) -> bool:
    """Whether the sums of a few numbers are finite; if not, a closer look must say which of them are not."""
    return math.isfinite(sum(sum(array.ravel().tolist()) for array in arrays))


def refuse_unless_finite(what: str, nu: np.ndarray, *results: np.ndarray) -> None:
    """Raise InvalidValueError where speeds inside the bounds give results that leave the number range."""
    if not all(np.isfinite(result).all() for result in results):
        raise InvalidValueError("nu", nu.tolist(), f"too large for this vehicle: the {what} leave the number range")
