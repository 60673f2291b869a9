"""WPILib: MecanumDriveKinematics, for mecanum wheels and for four omni-wheels whose axles stand at 45 degrees, an
"X drive".

Formulas restated from allwpilib, commit caf0fb2d, wpimath, kinematics/MecanumDriveKinematics. WPILib has no class for
omni-wheels. A wheel's row there is (1, -+1, ...) where that of an omni-wheel at 45 degrees is the same divided by
sqrt(2): so the class serves, its places are the true ones, and the rim of an omni-wheel moves along its rolling
direction at the class's speed over sqrt(2); that of a mecanum wheel moves at the class's speed. Wheels are ordered FL,
FR, RL, RR; speeds are in m/s, positive ones drive the robot forward.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.conventions.drive_convention import NEAR, DriveConvention, away
from omniroll.conventions.mecanum import at_the_corners, fields_of_mecanum
from omniroll.errors import InvalidValueError
from omniroll.vehicles.checks import refuse_kinds
from omniroll.vehicles.vehicle import Vehicle

CORNERS = tuple(math.radians(angle) for angle in (45, -45, 135, -135))  # of FL, FR, RL, RR
FORWARD = (1, -1, 1, -1)  # the sign of a rate that drives forward: by (2.2) a positive one carries the centre along
# (sin(alpha), -cos(alpha)), which points forward on the left side and backward on the right one
SMALL = 1e-9  # rad: below it WPILib takes the first terms of the series in a pose's exponential


class WpilibDrive(DriveConvention):
    """A vehicle as MecanumDriveKinematics counts it; speeds are its wheel speeds in m/s. `of` makes it."""

    @classmethod
    def of(cls, vehicle: Vehicle) -> "WpilibDrive":
        """The vehicle's wheels in the order FL, FR, RL, RR.

        vehicle  Vehicle. Its wheels may stand anywhere, and its centre of mass too: the class takes places

        Raises InvalidValueError unless there are four omni-wheels whose axles point along 45, 135, 225 and 315 degrees,
        or four mecanum wheels as RosMecanumDrive has them, at any places. 1e-3 rad count as rounding.
        """
        refuse_kinds(vehicle, "wheel_kinds", vehicle.wheel_kinds, "MecanumDriveKinematics knows one radius")
        if vehicle.wheels != 4:
            raise InvalidValueError("wheels", vehicle.wheels, "must be 4 for MecanumDriveKinematics")
        if any(vehicle.roller_angle):
            known, order, signs = at_the_corners(vehicle, "MecanumDriveKinematics")
            return cls(known, order, tuple(sign * vehicle.wheel_radius for sign in signs))
        off = np.abs(away(np.array(CORNERS)[:, None] - np.array(vehicle.wheel_angles)))
        order = off.argmin(axis=1)
        if sorted(order) != [0, 1, 2, 3] or off.min(axis=1).max() > NEAR:
            bound = "must be 45, 135, 225 and 315 degrees in some order: MecanumDriveKinematics fits no others"
            raise InvalidValueError("wheel_angles", vehicle.wheel_angles, bound)
        angles = np.array(CORNERS)[np.argsort(order)]
        known = vehicle.replace(wheel_angles=angles.tolist(), center_of_mass=(0.0, 0.0))
        per_rate = math.sqrt(2) * vehicle.wheel_radius
        return cls(known, tuple(order.tolist()), tuple(sign * per_rate for sign in FORWARD))

    def places(self) -> np.ndarray:
        """(4, 2) in m, the arguments of MecanumDriveKinematics: FL, FR, RL, RR; x forward, y to the left."""
        return self.vehicle.places()[list(self.order)]


def fields(places: ArrayLike, wheel_radius: float) -> dict[str, Any]:
    """Fields of a Vehicle with mecanum wheels that MecanumDriveKinematics drives, its wheels FL, FR, RL, RR.

    places        (4, 2) in m, as the class takes them
    wheel_radius  in m

    Raises InvalidValueError for what is not such numbers.
    """
    radius = validation.positive("wheel_radius", wheel_radius)
    return fields_of_mecanum(validation.real_array("places", places, (4, 2)), radius)


def moved(pose: ArrayLike, moved_by: ArrayLike) -> np.ndarray:
    """The pose (3,) after a displacement at constant curvature: WPILib's pose + exp(twist).

    pose      (3,) x, y in m and the heading in rad
    moved_by  (3,) dx, dy in m in the robot's frame, and the change of the heading in rad. WPILib's odometry takes dx
              and dy from the wheels and the heading from the gyro

    Raises InvalidValueError for what is not such numbers.
    """
    x, y, heading = validation.real_array("pose", pose, (3,)).tolist()
    dx, dy, turn = validation.real_array("moved_by", moved_by, (3,)).tolist()
    small = abs(turn) < SMALL
    sine = 1 - turn * turn / 6 if small else math.sin(turn) / turn
    cosine = turn / 2 if small else (1 - math.cos(turn)) / turn
    ahead, left = dx * sine - dy * cosine, dx * cosine + dy * sine
    c, s = math.cos(heading), math.sin(heading)
    return np.array([x + ahead * c - left * s, y + ahead * s + left * c, heading + turn])
