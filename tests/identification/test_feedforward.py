"""Constants of feedforwards against the regression of SysId on runs, and torques along a path against a run of them."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll.identification.feedforward import along_path, feedforward, strafe_factor

# Wheels of a robot that is not alike in its two directions
VEHICLE = omniroll.Vehicle.paper(4).replace(wheel_angles=(0.6, 2.5, 3.8, 5.6))
MOTOR = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=4)
BEARINGS = omniroll.Bearings(wheel_viscous=1e-3, wheel_coulomb=5e-3, wheel_speed=1e-3)
NUMBERS = {"roller_model": "massless"}


def regression(direction):
    """kS, kV, kA by least squares over a run whose voltages are in proportion to the wheels' rates, as SysId does."""
    place = ("forward", "sideways", "turning").index(direction)
    bound = omniroll.kernel(VEHICLE, "massless", "python")
    along = np.linalg.solve(bound.pose_rates(np.eye(3), 0.0).T, np.eye(3)[place])
    rates = bound.wheel_speeds(along)
    constants = feedforward(VEHICLE, effects=[MOTOR, BEARINGS])[direction]
    times = np.linspace(0, 4, 401)
    ramp = np.interp(times, [0, 2, 2.01, 4], [1, 4, 5, 5])
    # Each wheel gets what its own rate takes: in proportion, and the friction of its own sign
    friction = 5e-3 / MOTOR.line(VEHICLE)[0]
    beyond = ramp - constants.kS
    voltage = beyond[:, None] * rates / np.abs(rates).max() + friction * np.sign(rates)
    run = omniroll.simulate(
        VEHICLE,
        nu=1e-3 * along,
        duration=4,
        effects=[replace(MOTOR, times=times, voltage=voltage), BEARINGS],
        **NUMBERS,
    )
    at = times[20:-1:5] + 0.005
    speed = run.sample(at).nu @ along / (along @ along)
    ahead = run.sample(at + 1e-4).nu @ along / (along @ along)
    acceleration = (ahead - speed) / 1e-4
    largest = np.interp(at, times, np.abs(voltage).max(axis=1))
    found, *_ = np.linalg.lstsq(np.stack([np.ones_like(at), speed, acceleration], axis=1), largest)
    return found


@pytest.mark.parametrize("direction", ["turning"])
def test_constants_are_those_that_regression_finds(direction):
    constants = feedforward(VEHICLE, effects=[MOTOR, BEARINGS])[direction]
    assert [constants.kS, constants.kV, constants.kA] == pytest.approx(regression(direction), rel=1e-2)


def test_constants_of_one_motor_by_hand():
    """Three wheels on the spot: V = R/(g k) (I a/(3 R/l) ...) in the numbers of the paper's vehicle, typed here."""
    vehicle = omniroll.Vehicle.paper()
    found = feedforward(vehicle, effects=[MOTOR, omniroll.Bearings(wheel_viscous=1e-3)])["turning"]
    ratio = vehicle.platform_radius / vehicle.wheel_radius  # of the wheels' rates to the heading's
    inertia = (vehicle.yaw_inertia + 3 * vehicle.wheel_inertia * ratio**2) / (3 * ratio)
    per_volt = 4 * 0.02 / 1.5
    assert found.kA == pytest.approx(inertia / per_volt, rel=1e-9)
    assert found.kV == pytest.approx((1e-3 / per_volt + 4 * 0.02) * ratio, rel=1e-9)
    assert abs(found.kS) < 1e-12 and found.unit == "rad"


def test_the_strafe_factor():
    """One on even layouts; elsewhere what the rates of the fastest wheels say, where no friction is."""
    assert strafe_factor(feedforward(omniroll.Vehicle.paper(4), effects=[MOTOR])) == pytest.approx(1)
    bound = omniroll.kernel(VEHICLE, "massless", "python")
    ahead, aside, _ = np.abs(bound.wheel_rows.T).max(axis=1)
    assert strafe_factor(feedforward(VEHICLE, effects=[MOTOR])) == pytest.approx(ahead / aside)


def test_no_motor_no_feedforward():
    with pytest.raises(omniroll.InvalidValueError, match="must have a Motor"):
        feedforward(VEHICLE)


@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_torques_along_a_path_drive_along_it(model):
    """Under smooth, where a switch takes nothing. Rollers that are left out lead astray ten times as far."""
    vehicle = omniroll.Vehicle.paper().replace(roller_inertia=3e-5)
    times = np.linspace(0, 2, 401)
    s = times / 2
    part = s**3 * (10 - 15 * s + 6 * s**2)
    pose = np.stack([0.6 * part, 0.2 * np.sin(np.pi * part), 1.5 * part], axis=1)
    friction = omniroll.Bearings(wheel_viscous=1e-3)

    def missed(torque):
        table = omniroll.TorqueTable(times, torque)
        run = omniroll.simulate(
            vehicle, nu=(0, 0, 0), duration=2, roller_model=model, switching="smooth", effects=[table, friction]
        )
        return float(np.abs(run.pose[-1] - pose[-1]).max())

    own = missed(along_path(vehicle, times, pose, effects=[friction], roller_model=model).torque)
    assert own < 1e-3
    if model == "locked":
        without = missed(along_path(vehicle, times, pose, effects=[friction], roller_model="massless").torque)
        assert without > 10 * own


def test_voltages_along_a_path():
    times = np.linspace(0, 1, 51)
    pose = np.stack([0.1 * times**3, 0 * times, 0 * times], axis=1)
    found = along_path(VEHICLE, times, pose, effects=[MOTOR], roller_model="massless")
    per_volt, lost = MOTOR.line(VEHICLE)
    rates = omniroll.kernel(VEHICLE, "massless", "python").wheel_speeds(found.nu)
    assert np.allclose(per_volt * found.voltage - lost * rates, found.torque)
    assert along_path(VEHICLE, times, pose, roller_model="massless").voltage is None
