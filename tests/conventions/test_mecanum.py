"""Mecanum wheels in ROS 2 and WPILib, beside their own formulas, which are written here once more."""

import math

import numpy as np
import pytest

import omniroll
from omniroll.conventions import mecanum, wpilib

EXACT = 1e-15  # of the largest entry
X, Y, RADIUS = 0.235, 0.15, 0.05
OUTWARD = {(1, 1): 90, (1, -1): -90, (-1, 1): 90, (-1, -1): -90}  # degrees, FL, FR, RL, RR
HANDS = (1, -1, -1, 1)


def vehicle_of(order=(0, 1, 2, 3), turned=(), hands=HANDS, shift=(0.0, 0.0), half=(X, Y)):
    """A youBot's base with its wheels numbered in any order, and axles turned inward where `turned` names them."""
    corners = list(OUTWARD)
    places = [(shift[0] + x * half[0], shift[1] + y * half[1]) for x, y in corners]
    axles = [math.radians(-OUTWARD[corner] if k in turned else OUTWARD[corner]) for k, corner in enumerate(corners)]
    paper = omniroll.Vehicle.paper(4, 12).replace(wheel_radius=RADIUS, roller_axis_radius=0.036, platform_radius=0.3)
    return paper.replace(
        wheel_places=[places[k] for k in order],
        wheel_angles=[axles[k] for k in order],
        roller_angle=[hands[k] * math.pi / 4 for k in order],
        center_of_mass=(0.016, -0.026),
    )


def ros_rates(twist, lengths, radius):
    """mecanum_drive_controller.cpp: FL, FR, RR, RL."""
    vx, vy, wz = twist
    turning = lengths * wz
    return np.array([vx - vy - turning, vx + vy + turning, vx - vy + turning, vx + vy - turning]) / radius


def ros_twist(rates, lengths, radius):
    """odometry.cpp."""
    fl, fr, rr, rl = rates
    forward, left = radius / 4 * (fl + rl + rr + fr), radius / 4 * (-fl + rl - rr + fr)
    return np.array([forward, left, radius / (4 * lengths) * (-fl - rl + rr + fr)])


@pytest.mark.parametrize("order, turned", [((0, 1, 2, 3), ()), ((2, 0, 1, 3), (1,)), ((3, 2, 1, 0), (0, 1, 2, 3))])
def test_ros_both_ways(order, turned):
    drive = mecanum.RosMecanumDrive.of(vehicle_of(order, turned))
    wanted = np.column_stack([ros_rates(row, X + Y, RADIUS) for row in np.eye(3)])
    assert np.abs(drive.matrix - wanted).max() <= EXACT * np.abs(wanted).max()
    assert [order[k] for k in drive.order] == [0, 1, 3, 2]
    rates = np.array([3.0, -1.0, 2.0, 0.5])
    assert drive.twist(rates) == pytest.approx(ros_twist(rates, X + Y, RADIUS), rel=1e-14)
    forward = drive.rates(np.ones(4))
    assert forward[order.index(0)] == (-1 if 0 in turned else 1)  # a positive rate about an axle to the left


def test_an_offset_of_the_rectangle_is_a_parameter():
    drive = mecanum.RosMecanumDrive.of(vehicle_of(shift=(0.03, -0.01)))
    parameters = drive.parameters(["a", "b", "c", "d"])
    assert parameters["kinematics.base_frame_offset.x"] == pytest.approx(-0.03, rel=1e-14)
    assert parameters["front_left_wheel_command_joint_name"] == "a"
    assert parameters["rear_left_wheel_command_joint_name"] == "c"
    offset = [parameters[f"kinematics.base_frame_offset.{axis}"] for axis in "xy"]
    for vx, vy, wz in np.eye(3):  # v_center = v_base + (y wz, -x wz), as the controller has it
        center = vx + offset[1] * wz, vy - offset[0] * wz, wz
        assert drive.speeds([vx, vy, wz]) == pytest.approx(ros_rates(center, X + Y, RADIUS), rel=1e-13, abs=1e-15)
    fields = mecanum.RosMecanumDrive.fields(parameters)
    back = mecanum.RosMecanumDrive.of(omniroll.Vehicle.paper(4, 12).replace(**fields, roller_axis_radius=0.036))
    assert back.matrix == pytest.approx(drive.matrix, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("order, turned", [((0, 1, 2, 3), ()), ((1, 3, 0, 2), (2, 3))])
def test_wpilib_both_ways(order, turned):
    drive = wpilib.WpilibDrive.of(vehicle_of(order, turned, shift=(0.02, 0.005)))
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = drive.places()
    wanted = np.array([[1, -1, -(x0 + y0)], [1, 1, x1 - y1], [1, 1, x2 - y2], [1, -1, -(x3 + y3)]])
    assert np.abs(drive.matrix - wanted).max() <= EXACT * np.abs(wanted).max()
    fields = wpilib.fields(drive.places(), RADIUS)
    back = wpilib.WpilibDrive.of(omniroll.Vehicle.paper(4, 12).replace(**fields, roller_axis_radius=0.036))
    assert np.abs(back.matrix - drive.matrix).max() <= EXACT and back.order == (0, 1, 2, 3)


@pytest.mark.parametrize("vehicle, words", [
    (vehicle_of(hands=(-1, 1, 1, -1)), "roller_angle.* an O of the rollers .* exchange the left wheels"),
    (vehicle_of(hands=(1, 1, -1, 1)), "roller_angle.* must be 45 degrees, positive at front left"),
    (omniroll.Vehicle.paper(4), "wheel_places|wheel_angles"),
    (omniroll.Vehicle.paper(), "wheels = 3"),
])  # fmt: skip
def test_what_ros_does_not_know(vehicle, words):
    with pytest.raises(omniroll.InvalidValueError, match=words):
        mecanum.RosMecanumDrive.of(vehicle)


def test_the_odometry_turns_first():
    """odometry.cpp: the heading is integrated, then the position along the new one."""
    x, y, heading = mecanum.moved([1.0, 2.0, 0.3], [0.5, -0.2, 0.8], 0.1)
    assert heading == pytest.approx(0.38, rel=1e-15)
    assert x == pytest.approx(1.0 + 0.05 * math.cos(0.38) + 0.02 * math.sin(0.38), rel=1e-15)
    assert y == pytest.approx(2.0 + 0.05 * math.sin(0.38) - 0.02 * math.cos(0.38), rel=1e-15)
    assert mecanum.moved([1.0, 2.0, 0.3], [0.5, -0.2, 0.8], 9e-5).tolist() == [1.0, 2.0, 0.3]
