"""LeRobot: LeKiwi, a base with three omni-wheels, lerobot 0.4.4.

Its formulas are those of lerobot/robots/lekiwi/lekiwi.py, _body_to_wheel_raw. Wheels are left, back, right, and

    w_i = (cos(a_i) x.vel + sin(a_i) y.vel + base_radius theta.vel)/wheel_radius    with a = 150, -90, 30 degrees,

x.vel and y.vel in m/s, theta.vel and the wheels' speeds in deg/s. A wheel that drives along a_i stands at a_i - 90
degrees: left at 60, back at 180, right at -60. Positive speeds turn the robot counterclockwise: the sign of this
project is the other one.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.conventions.drive_convention import NEAR, DriveConvention, away
from omniroll.errors import InvalidValueError
from omniroll.vehicles.checks import refuse_kinds
from omniroll.vehicles.vehicle import Vehicle

NAMES = ("base_left_wheel", "base_back_wheel", "base_right_wheel")
PLACES = tuple(math.radians(angle) for angle in (60, 180, -60))
PER_RATE = -180 / math.pi  # deg/s the other way round
FIELDS = ("x.vel", "y.vel", "theta.vel")


class LeKiwiDrive(DriveConvention):
    """A vehicle as LeKiwi's driver counts it; speeds are in deg/s, in the order left, back, right. `of` makes it."""

    @classmethod
    def of(cls, vehicle: Vehicle) -> "LeKiwiDrive":
        """The vehicle's wheels in the order left, back, right.

        vehicle  Vehicle. Its centre of mass may be anywhere

        Raises InvalidValueError unless three wheels stand on rays from S at 60, 180 and -60 degrees. 1e-3 rad count as
        rounding.
        """
        refuse_kinds(vehicle, "wheel_kinds", vehicle.wheel_kinds, "LeKiwi knows one radius")
        if vehicle.wheels != 3 or vehicle.wheel_places is not None:
            raise InvalidValueError("wheels", vehicle.wheels, "must be 3 on rays at platform_radius for LeKiwi")
        if any(vehicle.roller_angle):
            raise InvalidValueError("roller_angle", vehicle.roller_angle, "must be 0 for LeKiwi")
        off = np.abs(away(np.array(PLACES)[:, None] - np.array(vehicle.wheel_angles)))
        order = off.argmin(axis=1)
        if sorted(order) != [0, 1, 2] or off.min(axis=1).max() > NEAR:
            bound = "must be 60, 180 and -60 degrees in some order: LeKiwi's left, back and right wheel"
            raise InvalidValueError("wheel_angles", vehicle.wheel_angles, bound)
        angles = np.array(PLACES)[np.argsort(order)]
        known = vehicle.replace(wheel_angles=angles.tolist(), center_of_mass=(0.0, 0.0))
        return cls(known, tuple(order.tolist()), (PER_RATE,) * 3)


def fields_of_twist(twist: ArrayLike) -> dict[str, float]:
    """x.vel, y.vel in m/s and theta.vel in deg/s, as LeKiwi's actions have them.

    twist  (3,) vx, vy in m/s, wz in rad/s

    Raises InvalidValueError for what is not such an array.
    """
    vx, vy, wz = validation.real_array("twist", twist, (3,)).tolist()
    return dict(zip(FIELDS, (vx, vy, math.degrees(wz)), strict=True))


def twist_of_fields(fields: dict[str, float]) -> np.ndarray:
    """(3,) the inverse of fields_of_twist. Raises InvalidValueError where one is missing."""
    for name in FIELDS:
        if name not in fields:
            raise InvalidValueError(name, None, "must be given")
    vx, vy, turns = (float(validation.real_array(name, fields[name], ())) for name in FIELDS)
    return np.array([vx, vy, math.radians(turns)])
