"""Which wheel is which, on which side, and which way it turns: of a vehicle, and in the programs that drive it."""

import math
from typing import Any

import numpy as np

from omniroll.conventions.lekiwi import NAMES, LeKiwiDrive
from omniroll.conventions.mecanum import RosMecanumDrive, drawing
from omniroll.conventions.ros import RosOmniDrive
from omniroll.conventions.wpilib import WpilibDrive
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle

SIDES = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")
PROGRAMS = {  # title, class, the program's names of its wheels (None: by number), unit of its speeds
    "ros": ("ROS 2, omni_wheel_drive_controller", RosOmniDrive, None, "rad/s"),
    "ros-mecanum": ("ROS 2, mecanum_drive_controller", RosMecanumDrive, ("FL", "FR", "RR", "RL"), "rad/s"),
    "wpilib": ("WPILib, MecanumDriveKinematics", WpilibDrive, ("FL", "FR", "RL", "RR"), "m/s"),
    "lekiwi": ("LeRobot, LeKiwi", LeKiwiDrive, NAMES, "deg/s"),
}
TINY = 1e-12  # of the largest number, below which one is shown as 0


def facts(vehicle: Vehicle) -> dict[str, Any]:
    """Of each wheel its place, side, and rate for a twist; of each program the same in its order, or why it has none.

    Wheels count from 1.
    """
    rates = vehicle.middle_rows()
    wheels = [
        {"wheel": k + 1, "x": x, "y": y, "axle": math.degrees(angle), "side": side(x, y)} | _moves(rates[k], rates)
        for k, ((x, y), angle) in enumerate(zip(vehicle.places().tolist(), vehicle.wheel_angles, strict=True))
    ]
    found = {"wheels": wheels, "programs": {name: _program(vehicle, name) for name in PROGRAMS}}
    return found | ({"drawing": drawing(vehicle)} if any(vehicle.roller_angle) else {})


def side(x: float, y: float) -> str:
    """Where a place is seen from the centre: "front left", within 22.5 degrees."""
    return SIDES[round(math.atan2(y, x) / (math.pi / 4)) % 8]


def _moves(row: np.ndarray, rows: np.ndarray) -> dict[str, float]:
    kept = np.where(np.abs(row) > TINY * np.abs(rows).max(), row, 0.0)
    return dict(zip(("for_x", "for_y", "for_yaw"), kept.tolist(), strict=True))


def _program(vehicle: Vehicle, name: str) -> dict[str, Any]:
    title, kind, names, unit = PROGRAMS[name]
    try:
        drive = kind.of(vehicle)
    except InvalidValueError as error:
        return {"title": title, "refused": f"{error.field} {error.bound}"}
    wheels = [
        {"name": names[k] if names else str(k), "wheel": wheel + 1} | _moves(drive.matrix[k], drive.matrix)
        for k, wheel in enumerate(drive.order)
    ]
    found: dict[str, Any] = {"title": title, "unit": unit, "wheels": wheels}
    if isinstance(drive, RosOmniDrive | RosMecanumDrive):
        found["parameters"] = drive.parameters([f"wheel{k + 1}" for k in range(vehicle.wheels)])
    return found
