"""Four mecanum wheels as programs know them, and ROS 2: mecanum_drive_controller of ros2_controllers, version 6.9.0,
commit 94e74de3.

Its formulas are those of src/odometry.cpp and src/mecanum_drive_controller.cpp there, its parameters those of
src/mecanum_drive_controller.yaml. Wheels are ordered FL, FR, RR, RL, positive rates drive the robot forward, and with L
half of the track and half of the wheelbase together

    w_FL = (vx - vy - L wz)/r    w_FR = (vx + vy + L wz)/r    w_RR = (vx - vy + L wz)/r    w_RL = (vx + vy - L wz)/r

in rad/s: rollers at 45 degrees which, on top of the wheels and seen from above, make an X.
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

NAMES = ("front_left", "front_right", "rear_right", "rear_left")
CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))  # signs of x and y, FL, FR, RL, RR
X_HANDS = (1, -1, -1, 1)  # signs of roller_angle there
ROS_ORDER = (0, 1, 3, 2)
SHORTEST = 1e-4  # s below which the controller's odometry does not update
UP, ACROSS = 4, 12  # half of a drawing's lines and columns


def at_the_corners(vehicle: Vehicle, program: str) -> tuple[Vehicle, tuple[int, ...], tuple[int, ...]]:
    """A vehicle with exact angles, the numbers of its wheels FL, FR, RL, RR, and of each the sign of a rate that drives
    forward.

    Raises InvalidValueError unless there is one wheel at each corner, each with its axle across and its rollers at 45
    degrees as an X.
    """
    if vehicle.wheels != 4:
        raise InvalidValueError("wheels", vehicle.wheels, f"must be 4 for {program}")
    refuse_kinds(vehicle, "wheel_kinds", vehicle.wheel_kinds, f"{program} knows one radius")
    places = vehicle.places()
    corners = [tuple(sign) for sign in np.sign(places - places.mean(axis=0)).astype(int).tolist()]
    if sorted(corners) != sorted(CORNERS):
        bound = f"must be at four corners, front and rear, left and right, for {program}"
        raise InvalidValueError("wheel_places", places.tolist(), bound)
    order = tuple(corners.index(corner) for corner in CORNERS)
    signs = np.sign(np.sin(vehicle.wheel_angles))
    exact = signs * math.pi / 2
    if np.abs(away(np.array(vehicle.wheel_angles) - exact)).max() > NEAR:
        raise InvalidValueError("wheel_angles", vehicle.wheel_angles, f"must be 90 or -90 degrees for {program}")
    slants = np.empty(4)
    slants[list(order)] = np.array(X_HANDS) * math.pi / 4
    if np.abs(np.array(vehicle.roller_angle) + slants).max() < NEAR:
        bound = (
            f"makes an O of the rollers on top of the wheels, seen from above, where {program} has an X: exchange the "
            "left wheels with the right ones"
        )
        raise InvalidValueError("roller_angle", vehicle.roller_angle, bound)
    if np.abs(np.array(vehicle.roller_angle) - slants).max() > NEAR:
        bound = f"must be 45 degrees, positive at front left and rear right, negative at the others, for {program}"
        raise InvalidValueError("roller_angle", vehicle.roller_angle, bound)
    changes = {"wheel_places": places.tolist(), "wheel_angles": exact.tolist(), "roller_angle": slants.tolist()}
    known = vehicle.replace(**changes, center_of_mass=(0.0, 0.0))
    return known, order, tuple(signs[list(order)].astype(int).tolist())


def fields_of_mecanum(places: ArrayLike, wheel_radius: float) -> dict[str, Any]:
    """Fields of a Vehicle whose wheels are FL, FR, RL, RR at `places`, (4, 2) in m."""
    places = np.asarray(places, float)
    return {
        "wheels": 4,
        "wheel_angles": tuple(math.pi / 2 * y for _, y in CORNERS),
        "wheel_places": tuple(map(tuple, places.tolist())),
        "roller_angle": tuple(math.pi / 4 * hand for hand in X_HANDS),
        "platform_radius": float(np.linalg.norm(places - places.mean(axis=0), axis=1).mean()),
        "wheel_radius": wheel_radius,
    }


class RosMecanumDrive(DriveConvention):
    """A vehicle as mecanum_drive_controller drives it; speeds are rates in rad/s, FL, FR, RR, RL. `of` makes it."""

    @classmethod
    def of(cls, vehicle: Vehicle) -> "RosMecanumDrive":
        """The vehicle's wheels in the order FL, FR, RR, RL.

        vehicle  Vehicle. Its wheels stand at the corners of a rectangle, whose middle may be off S; its centre of mass
                 may be anywhere

        Raises InvalidValueError for other places, axles that are not across, and rollers that are not at 45 degrees as
        an X. 1e-3 rad, and 1e-3 of the distances, count as rounding.
        """
        program = "mecanum_drive_controller"
        known, order, signs = at_the_corners(vehicle, program)
        places = known.places()
        middle, half = places.mean(axis=0), np.abs(places - places.mean(axis=0)).mean(axis=0)
        rectangle = np.empty((4, 2))
        rectangle[list(order)] = middle + np.array(CORNERS) * half
        if np.abs(places - rectangle).max() > NEAR * half.sum():
            raise InvalidValueError(
                "wheel_places", places.tolist(), f"must be the corners of a rectangle for {program}"
            )
        known = known.replace(wheel_places=rectangle.tolist())
        numbers = [order[k] for k in ROS_ORDER]
        return cls(known, tuple(numbers), tuple(float(signs[k]) for k in ROS_ORDER))

    def parameters(self, wheel_names: Sequence[str]) -> dict[str, Any]:
        """The controller's parameters that say what the robot is.

        wheel_names  names of the joints, in the vehicle's own order

        Raises InvalidValueError where there is not one name for each wheel.
        """
        if len(wheel_names) != 4:
            raise InvalidValueError("wheel_names", wheel_names, "must be 4, one for each wheel")
        places = self.vehicle.places()
        middle = places.mean(axis=0)
        joints = {f"{name}_wheel_command_joint_name": wheel_names[k] for name, k in zip(NAMES, self.order, strict=True)}
        return joints | {
            "kinematics.wheels_radius": self.vehicle.wheel_radius,
            "kinematics.sum_of_robot_center_projection_on_X_Y_axis": float(np.abs(places - middle).mean(axis=0).sum()),
            "kinematics.base_frame_offset.x": -float(middle[0]) + 0.0,
            "kinematics.base_frame_offset.y": -float(middle[1]) + 0.0,
        }

    @staticmethod
    def fields(parameters: dict[str, Any]) -> dict[str, Any]:
        """Fields of a Vehicle that the controller drives, whose wheels are FL, FR, RL, RR.

        parameters  of the controller by name: kinematics.wheels_radius,
                    kinematics.sum_of_robot_center_projection_on_X_Y_axis, and kinematics.base_frame_offset.x and .y (0
                    where they are missing)

        They say half of the track and half of the wheelbase together; here both are the same. Raises InvalidValueError
        for parameters that are missing or not positive, and where base_frame_offset.theta is not 0.
        """
        total, radius = (
            validation.positive(name, parameters.get(name))
            for name in ("kinematics.sum_of_robot_center_projection_on_X_Y_axis", "kinematics.wheels_radius")
        )
        offset = [
            float(validation.real_array(name, parameters.get(name, 0.0), ()))
            for name in (f"kinematics.base_frame_offset.{axis}" for axis in ("x", "y", "theta"))
        ]
        if offset[2]:
            raise InvalidValueError(
                "kinematics.base_frame_offset.theta", offset[2], "must be 0: turn the robot's frame"
            )
        return fields_of_mecanum(np.array(CORNERS) * total / 2 - np.array(offset[:2]), radius)


def moved(pose: ArrayLike, twist: ArrayLike, duration: float) -> np.ndarray:
    """The pose (3,) after a twist, as mecanum_drive_controller's odometry reckons it: first the heading, then straight
    on along the new one. Times below 1e-4 s leave the pose alone.

    pose      (3,) x, y in m and the heading in rad, which is not wrapped
    twist     (3,) vx, vy in m/s and wz in rad/s, in the robot's frame
    duration  in s

    Raises InvalidValueError for what is not such numbers.
    """
    x, y, heading = validation.real_array("pose", pose, (3,)).tolist()
    duration = float(validation.real_array("duration", duration, ()))
    if duration < SHORTEST:
        return np.array([x, y, heading])
    dx, dy, turn = (validation.real_array("twist", twist, (3,)) * duration).tolist()
    heading += turn
    cosine, sine = math.cos(heading), math.sin(heading)
    return np.array([x + dx * cosine - dy * sine, y + dx * sine + dy * cosine, heading])


def drawing(vehicle: Vehicle) -> list[str]:
    """Lines of text that show the vehicle from above, x upward and y to the left: each wheel by its number, with the
    rollers on its top as they lie."""
    lines = [[" "] * (2 * ACROSS + 5) for _ in range(2 * UP + 1)]
    places = vehicle.places()
    largest = max(float(np.abs(places).max()), 1e-300)
    for wheel, ((x, y), axle, slant) in enumerate(
        zip(places.tolist(), vehicle.wheel_angles, vehicle.roller_angle, strict=True)
    ):
        line = axle + math.pi / 2 + slant  # of a roller on top; below it is turned the other way
        tilt = math.sin(2 * line)
        level = "|" if abs(math.cos(line)) > abs(math.sin(line)) else "-"
        slope = level if abs(tilt) < NEAR else "\\" if tilt > 0 else "/"
        row, column = UP - round(UP * x / largest), ACROSS + 2 - round(ACROSS * y / largest)
        lines[row][column - 1 : column + 2] = [slope] * 3
        lines[row][column - 2] = str((wheel + 1) % 10)
    return ["".join(line).rstrip() for line in lines]
