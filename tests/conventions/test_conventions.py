"""The conventions of ROS 2 and WPILib, beside their own formulas, which are written here once more."""

import math

import numpy as np
import pytest

import omniroll
from omniroll.conventions import ros, wpilib
from omniroll.conventions.odometry import Odometry
from omniroll.conventions.twists import nu_of_twist, twist_of_nu

EXACT = 1e-15  # of the largest entry


def vehicle_of(angles, **changes):
    paper = omniroll.Vehicle.paper(len(angles)).replace(wheel_angles=angles, platform_radius=0.17, yaw_scale=1.7)
    return paper.replace(**changes)


def ros_matrix(wheels, offset, robot_radius, wheel_radius):
    """compute commands of omni_wheel_drive_controller.cpp"""
    rows = []
    for i in range(wheels):
        theta = 2 * math.pi * i / wheels + offset
        rows.append([math.sin(theta) / wheel_radius, -math.cos(theta) / wheel_radius, -robot_radius / wheel_radius])
    return np.array(rows)


def wpilib_matrix(places):
    """MecanumDriveKinematics, whose signs are written out for FL, FR, RL, RR."""
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = places
    return np.array([[1, -1, -(x0 + y0)], [1, 1, x1 - y1], [1, 1, x2 - y2], [1, -1, -(x3 + y3)]])


def assert_same(matrix, wanted):
    assert np.abs(matrix - wanted).max() <= EXACT * np.abs(wanted).max()


@pytest.mark.parametrize("wheels, offset", [(3, 0.0), (3, -math.pi / 6), (4, math.pi / 4), (5, 2.0)])
def test_the_matrix_is_that_of_ros2_controllers(wheels, offset):
    vehicle = vehicle_of([2 * math.pi * i / wheels + offset for i in range(wheels)])
    drive = ros.RosOmniDrive.of(vehicle)
    assert drive.order == tuple(range(wheels))
    assert_same(drive.matrix, ros_matrix(wheels, offset, vehicle.platform_radius, vehicle.wheel_radius))


def test_wheels_in_another_order_find_their_places():
    """The controller's wheels go counterclockwise from the first."""
    vehicle = vehicle_of([math.pi / 4 + k * math.pi / 2 for k in (0, 2, 3, 1)])
    drive = ros.RosOmniDrive.of(vehicle)
    assert drive.order == (0, 3, 1, 2)
    assert_same(drive.matrix, ros_matrix(4, math.pi / 4, vehicle.platform_radius, vehicle.wheel_radius))
    rates = np.array([1.0, 2.0, 3.0, 4.0])
    assert drive.speeds_of_rates(rates).tolist() == [1.0, 4.0, 2.0, 3.0]
    assert drive.rates(drive.speeds_of_rates(rates)).tolist() == rates.tolist()


def test_parameters_go_out_and_come_back():
    vehicle = vehicle_of([math.radians(angle) for angle in (30, 270, 150)])
    parameters = ros.RosOmniDrive.of(vehicle).parameters(["a", "b", "c"])
    assert parameters["wheel_names"] == ["a", "c", "b"]
    back = vehicle.replace(**ros.RosOmniDrive.fields(parameters))
    assert_same(ros.RosOmniDrive.of(back).matrix, ros.RosOmniDrive.of(vehicle).matrix)


CORNERS = [math.radians(angle) for angle in (135, 45, 315, 225)]


def test_the_matrix_is_that_of_wpilib_for_an_x_drive():
    """Wheels are listed here as RL, FL, FR, RR, and WPILib's as FL, FR, RL, RR."""
    drive = wpilib.WpilibDrive.of(vehicle_of(CORNERS))
    assert drive.order == (1, 2, 0, 3)
    assert_same(drive.matrix, wpilib_matrix(drive.places()))


RECTANGLE = [(-0.2, 0.1), (0.2, 0.1), (0.2, -0.1), (-0.2, -0.1)]  # axles at 45 degrees that miss the centre


def test_angles_of_four_digits_are_those_that_the_controllers_know():
    rounded, exact = vehicle_of([2.3562, 0.7854, 5.4978, 3.927]), vehicle_of(CORNERS)
    assert_same(wpilib.WpilibDrive.of(rounded).matrix, wpilib.WpilibDrive.of(exact).matrix)
    drive = ros.RosOmniDrive.of(rounded)
    assert_same(drive.matrix, ros_matrix(4, 2.3562, 0.17, rounded.wheel_radius))
    assert drive.parameters("abcd")["wheel_offset"] == 2.3562 and drive.order == (0, 3, 2, 1)


@pytest.mark.parametrize("make, vehicle, field", [
    (ros.RosOmniDrive.of, vehicle_of([0.0, 2.0, 4.0]), "wheel_angles"),
    (ros.RosOmniDrive.of, vehicle_of([0.0, math.pi]), "wheels"),
    (ros.RosOmniDrive.of, vehicle_of([0.0, 2.09, 4.19]), "wheel_angles"),
    (ros.RosOmniDrive.of, vehicle_of(CORNERS, wheel_places=RECTANGLE), "wheel_places"),
    (wpilib.WpilibDrive.of, omniroll.Vehicle.paper(), "wheels"),
    (wpilib.WpilibDrive.of, omniroll.Vehicle.paper(4), "wheel_angles"),
])  # fmt: skip
def test_what_the_others_do_not_know_is_refused(make, vehicle, field):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        make(vehicle)
    assert refused.value.field == field


def test_twists_are_the_rates_of_the_pose():
    vehicle = vehicle_of([0.0, 2.0, 4.0])
    nu = np.array([0.3, -0.7, 1.1])
    twist = twist_of_nu(vehicle, nu)
    run = omniroll.simulate(vehicle, nu=nu, duration=1e-6)
    assert run.pose[-1] == pytest.approx(twist * 1e-6, rel=1e-5)
    assert nu_of_twist(vehicle, twist) == pytest.approx(nu, rel=1e-15)


@pytest.mark.parametrize("turn", [0.0, 1e-7, 1e-3, 2.5])
def test_both_odometries_follow_an_arc(turn):
    """Against many short straight steps of a body that turns at a constant rate."""
    start, twist = np.array([0.4, -0.2, 0.9]), np.array([0.5, -0.3, turn])
    steps = 20_000
    headings = start[2] + turn * (np.arange(steps) + 0.5) / steps
    c, s = np.cos(headings), np.sin(headings)
    x, y = np.mean(0.5 * c + 0.3 * s), np.mean(0.5 * s - 0.3 * c)
    wanted = [start[0] + x, start[1] + y, start[2] + turn]
    assert ros.moved(start, twist, 1.0) == pytest.approx(wanted, abs=1e-7)
    assert wpilib.moved(start, twist) == pytest.approx(wanted, abs=1e-8)


def test_odometry_of_a_run_and_back(tmp_path):
    vehicle = omniroll.Vehicle.paper()
    run = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=20)
    times = np.linspace(0, 20, 400)
    seen, odometry = run.sample(times), Odometry.of(run, times)
    assert odometry.pose() == pytest.approx(seen.pose, abs=1e-12)
    assert odometry.pose()[-1, 2] > math.pi
    assert odometry.nu(vehicle) == pytest.approx(seen.nu, abs=1e-14)
    # The twist is the robot's own: turned into odom, it is the rate of the position.
    heading = seen.pose[:, 2]
    along = odometry.twist[:, 0] * np.cos(heading) - odometry.twist[:, 1] * np.sin(heading)
    inner = np.gradient(seen.pose[:, 0], times)[1:-1]
    assert np.abs(inner - along[1:-1]).max() < 0.02 * np.abs(along).max()
    odometry.save(tmp_path / "odometry.csv")
    table = np.genfromtxt(tmp_path / "odometry.csv", delimiter=",", names=True, deletechars="")
    assert table["twist.linear.x"].tolist() == odometry.twist[:, 0].tolist()
