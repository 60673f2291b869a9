"""ROS 2: omni_wheel_drive_controller of ros2_controllers, version 6.9.0, commit 94e74de3.

Its formulas are those of src/odometry.cpp and src/omni_wheel_drive_controller.cpp there, its parameters those of
src/omni_wheel_drive_controller_parameters.yaml. Wheel i = 0..N-1 stands at theta_i = 2 pi i/N + wheel_offset, and

    w_i = (sin(theta_i) vx - cos(theta_i) vy - robot_radius wz)/wheel_radius    in rad/s.

A positive rate turns the robot clockwise: that is this project's sign as well.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.conventions.drive_convention import NEAR, DriveConvention, away
from omniroll.errors import InvalidValueError
from omniroll.vehicles.checks import refuse_kinds
from omniroll.vehicles.vehicle import Vehicle

SHORTEST = 1e-6  # s and rad: the controller's own bounds below which it does not update, or drives straight on


class RosOmniDrive(DriveConvention):
    """A vehicle as omni_wheel_drive_controller drives it; speeds are rates in rad/s. `of` makes it."""

    @classmethod
    def of(cls, vehicle: Vehicle) -> "RosOmniDrive":
        """The vehicle's first wheel is the controller's first; the others follow counterclockwise.

        vehicle  Vehicle. Its centre of mass may be anywhere: wheel rates do not know of it

        Raises InvalidValueError for fewer than three wheels, and where they are not evenly spaced on rays from S at
        one distance: the controller knows no others. 1e-3 rad, and 1e-3 of the distance, count as rounding.
        """
        refuse_kinds(vehicle, "wheel_kinds", vehicle.wheel_kinds, "omni_wheel_drive_controller knows one radius")
        if vehicle.wheels < 3:
            raise InvalidValueError("wheels", vehicle.wheels, "must be at least 3 for omni_wheel_drive_controller")
        if any(vehicle.roller_angle):
            raise InvalidValueError("roller_angle", vehicle.roller_angle, "must be 0 for omni_wheel_drive_controller")
        places, angles = vehicle.places(), np.array(vehicle.wheel_angles)
        distances = np.linalg.norm(places, axis=1)
        radius = float(distances.mean())
        rays = radius * np.column_stack([np.cos(angles), np.sin(angles)])
        if np.abs(places - rays).max() > NEAR * radius:
            bound = f"must be on rays from S at one distance, {radius:.6g} m, for omni_wheel_drive_controller"
            raise InvalidValueError("wheel_places", vehicle.wheel_places, bound)
        count, first = vehicle.wheels, angles[0]
        numbers = np.round((angles - first) * count / (2 * math.pi)).astype(int) % count
        even = first + 2 * math.pi * numbers / count
        if len(set(numbers)) < count or np.abs(away(angles - even)).max() > NEAR:
            bound = "must be evenly spaced for omni_wheel_drive_controller"
            raise InvalidValueError("wheel_angles", vehicle.wheel_angles, bound)
        exact = {"wheel_angles": even.tolist(), "wheel_places": None, "platform_radius": radius}
        if vehicle.wheel_places is None:
            del exact["platform_radius"]
        known = vehicle.replace(**exact, center_of_mass=(0.0, 0.0))
        return cls(known, tuple(np.argsort(numbers).tolist()), (1.0,) * count)

    def parameters(self, wheel_names: Sequence[str]) -> dict[str, Any]:
        """The controller's parameters that say what the robot is.

        wheel_names  names of the joints, in the vehicle's own order

        Raises InvalidValueError where there is not one name for each wheel.
        """
        if len(wheel_names) != self.vehicle.wheels:
            raise InvalidValueError("wheel_names", wheel_names, f"must be {self.vehicle.wheels}, one for each wheel")
        return {
            "wheel_offset": self.vehicle.wheel_angles[0],
            "wheel_names": [wheel_names[wheel] for wheel in self.order],
            "robot_radius": self.vehicle.platform_radius,
            "wheel_radius": self.vehicle.wheel_radius,
        }

    @staticmethod
    def fields(parameters: dict[str, Any]) -> dict[str, Any]:
        """wheels, wheel_angles, platform_radius and wheel_radius of a Vehicle, whose wheel i is the controller's.

        parameters  of the controller by name: wheel_offset (0 where it is missing), wheel_names, robot_radius and
                    wheel_radius

        Raises InvalidValueError for parameters that are missing or not positive.
        """
        radii = {name: validation.positive(name, parameters.get(name)) for name in ("robot_radius", "wheel_radius")}
        names = parameters.get("wheel_names")
        if not isinstance(names, Sequence) or isinstance(names, str) or len(names) < 3:
            raise InvalidValueError("wheel_names", names, "must be the names of three wheels or more")
        offset = float(validation.real_array("wheel_offset", parameters.get("wheel_offset", 0.0), ()))
        wheels = len(names)
        return {
            "wheels": wheels,
            "wheel_angles": tuple(2 * math.pi * i / wheels + offset for i in range(wheels)),
            "platform_radius": radii["robot_radius"],
            "wheel_radius": radii["wheel_radius"],
        }


def moved(pose: ArrayLike, twist: ArrayLike, duration: float) -> np.ndarray:
    """The pose (3,) after a constant twist, as the controller's odometry reckons it: along an arc, and straight on
    where the heading changes by less than 1e-6 rad. Times below 1e-6 s leave the pose alone.

    pose      (3,) x, y in m and the heading in rad, which is not wrapped
    twist     (3,) vx, vy in m/s and wz in rad/s, in the robot's frame
    duration  in s

    Raises InvalidValueError for what is not such numbers.
    """
    x, y, heading = validation.real_array("pose", pose, (3,)).tolist()
    duration = float(validation.real_array("duration", duration, ()))
    if abs(duration) < SHORTEST:
        return np.array([x, y, heading])
    dx, dy, turn = (validation.real_array("twist", twist, (3,)) * duration).tolist()
    cosine, sine, end = math.cos(heading), math.sin(heading), heading + turn
    if abs(turn) < SHORTEST:
        return np.array([x + dx * cosine - dy * sine, y + dx * sine + dy * cosine, end])
    along, across = (math.sin(end) - sine) / turn, (math.cos(end) - cosine) / turn
    return np.array([x + dx * along + dy * across, y - dx * across + dy * along, end])
