"""A program's way to number the wheels of a vehicle and to count their speeds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.vehicles.vehicle import Vehicle

NEAR = 1e-3  # rad, and share of the wheels' distance, by which a wheel may be off the place that a program knows


def away(angles: ArrayLike) -> np.ndarray:
    """Angles in rad without whole turns, between -pi and pi."""
    return (np.asarray(angles) + np.pi) % (2 * np.pi) - np.pi


@dataclass(frozen=True)
class DriveConvention:
    """How a program counts the speeds of a vehicle's wheels.

    vehicle  Vehicle with N wheels as the program knows it: exactly even angles where those of a scene are rounded
    order    (N,) numbers of the vehicle's wheels, from 0, in the program's order
    factors  (N,) the program's speed of a wheel per rad/s of its axle, in the program's order. A factor is negative
             where the program's positive speed lowers chi
    """

    vehicle: Vehicle
    order: tuple[int, ...]
    factors: tuple[float, ...]

    @cached_property
    def matrix(self) -> np.ndarray:
        """(N, 3) the program's wheel speeds per twist (vx, vy, wz), from (2.2) with contacts in the wheels' middles."""
        return np.array(self.factors)[:, None] * self.vehicle.middle_rows()[list(self.order)]

    def speeds(self, twist: ArrayLike) -> np.ndarray:
        """The program's wheel speeds (..., N) that a twist asks for.

        twist  (..., 3) vx, vy in m/s, wz in rad/s

        Raises InvalidValueError for what is not such an array.
        """
        return validation.trailing("twist", twist, (3,)) @ self.matrix.T

    def twist(self, speeds: ArrayLike) -> np.ndarray:
        """The twist (..., 3) that fits the program's wheel speeds best, by least squares over all wheels.

        speeds  (..., N) in the program's order, signs and units

        Raises InvalidValueError for what is not such an array.
        """
        return validation.trailing("speeds", speeds, (self.vehicle.wheels,)) @ np.linalg.pinv(self.matrix).T

    def rates(self, speeds: ArrayLike) -> np.ndarray:
        """The rates (..., N) of the vehicle's wheels in rad/s, in its own order and signs.

        speeds  (..., N) in the program's order, signs and units

        Raises InvalidValueError for what is not such an array.
        """
        numbers = validation.trailing("speeds", speeds, (self.vehicle.wheels,)) / np.array(self.factors)
        return numbers[..., np.argsort(self.order)]

    def speeds_of_rates(self, rates: ArrayLike) -> np.ndarray:
        """The program's wheel speeds (..., N): the inverse of `rates`.

        rates  (..., N) in rad/s, of the vehicle's wheels

        Raises InvalidValueError for what is not such an array.
        """
        numbers = validation.trailing("rates", rates, (self.vehicle.wheels,))
        return numbers[..., list(self.order)] * np.array(self.factors)
