"""Twists (vx, vy, wz) of a body in its own frame, as ROS (REP 103) and WPILib have them, and nu."""

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import kernel
from omniroll.vehicles.vehicle import Vehicle


def _per_nu(vehicle: Vehicle) -> np.ndarray:
    """(3,) m/s, m/s and rad/s of a twist per nu: the rates of the pose at heading 0."""
    rates = kernel(vehicle, "massless", "python").pose_rates(np.eye(3), np.zeros(3))
    return np.diagonal(rates).copy()


def nu_of_twist(vehicle: Vehicle, twist: ArrayLike) -> np.ndarray:
    """nu (..., 3) in 1/s of twists.

    vehicle  Vehicle
    twist    (..., 3) vx forward and vy to the left in m/s, of the point S; wz counterclockwise in rad/s

    Raises InvalidValueError for what is not such an array.
    """
    return validation.trailing("twist", twist, (3,)) / _per_nu(vehicle)


def twist_of_nu(vehicle: Vehicle, nu: ArrayLike) -> np.ndarray:
    """Twists (..., 3) in m/s, m/s and rad/s: forward, to the left, counterclockwise; of the point S.

    vehicle  Vehicle
    nu       (..., 3) in 1/s

    Raises InvalidValueError for what is not such an array.
    """
    return validation.trailing("nu", nu, (3,)) * _per_nu(vehicle)


def nu_of_wheel_rates(vehicle: Vehicle, rates: ArrayLike) -> np.ndarray:
    """nu (..., 3) in 1/s that fits wheel rates best, by least squares over all wheels; exactly for three.

    vehicle  Vehicle of three wheels or more
    rates    (..., N) in rad/s, those of chi

    Raises InvalidValueError for what is not such an array, and for wheels whose rates do not say how it moves.
    """
    rates, rows = validation.trailing("rates", rates, (vehicle.wheels,)), wheel_rows(vehicle)
    if np.linalg.matrix_rank(rows) < 3:
        bound = "must say by their rates how the vehicle moves: three or more"
        raise InvalidValueError("wheels", vehicle.wheels, bound)
    return rates @ np.linalg.pinv(rows).T


def wheel_rows(vehicle: Vehicle) -> np.ndarray:
    """(N, 3) the wheels' rates in rad/s per nu, (2.2)."""
    return kernel(vehicle, "massless", "python").wheel_rows
