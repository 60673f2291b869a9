"""What drives a mecanum robot and what it reads: current limits, paths, odometry, many runs, linear models."""

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import kernel
from tests.mecanum.test_motions import MODELS, usual

MOTOR = {"torque_constant": 0.02, "resistance": 0.5, "gear_ratio": 20.0}
TURNED = (9.0, -7.0, 8.0, -6.0)  # voltages that drive ahead and turn


@pytest.mark.parametrize("model", MODELS)
def test_a_current_limit_holds(model):
    """Its guards read the wheels' rates, which go by the wheels' angles."""
    motor = omniroll.Motor(TURNED, current_limit=5.0, **MOTOR)
    run = omniroll.simulate(
        usual(), nu=(0, 0, 0), duration=1.5, roller_model=model, effects=(motor,), control=False, accuracy=1e-9
    )
    times = np.linspace(0.01, 1.49, 300)
    current = np.abs(run.measure(times, names=("motor_current",))["motor_current"])
    assert current.max() < 5.0 * (1 + 1e-6)
    assert (current > 5.0 * (1 - 1e-6)).any() and (current < 4.9).any()
    assert abs(run.ledger.residual) < 1e-8 * run.ledger.scale
    high = omniroll.simulate(usual(), nu=(0, 0, 0), duration=1.5, roller_model=model, control=False, accuracy=1e-9,
                             effects=(omniroll.Motor(TURNED, current_limit=1e3, **MOTOR),))  # fmt: skip
    plain = omniroll.simulate(usual(), nu=(0, 0, 0), duration=1.5, roller_model=model, control=False, accuracy=1e-9,
                              effects=(omniroll.Motor(TURNED, **MOTOR),))  # fmt: skip
    np.testing.assert_allclose(high.pose[-1], plain.pose[-1], atol=1e-7)


def test_a_path_is_followed():
    times = np.linspace(0, 4, 5)
    poses = np.array([[0, 0, 0], [0.3, 0.2, 0.3], [0.6, 0.0, 0.0], [0.8, -0.3, 0.5], [1.0, 0.0, 1.0]])
    follower = omniroll.PathFollower(times, poses, sample_time=0.01, bandwidth=8.0)
    run = omniroll.simulate(usual(), nu=(0, 0, 0), duration=5.0, effects=(follower,), control=False)
    np.testing.assert_allclose(run.pose[-1], poses[-1], atol=2e-3)


def test_odometry_reckons_with_rollers_in_their_middle():
    """As robots do: ahead it is right, aside it overrates the way, by one over the strafe factor."""
    vehicle = usual().replace(mass=1e9, yaw_inertia=1e9)
    instruments = omniroll.Instruments(counts_per_turn=10**6)
    way = {}
    for name, nu in (("ahead", (1.0, 0, 0)), ("aside", (0, 1.0, 0))):
        run = omniroll.simulate(vehicle, nu=nu, duration=4.0, roller_model="massless", control=False)
        read = run.measure(np.linspace(0, 4, 400), instruments, names=("odometry",))["odometry"][-1]
        way[name] = np.hypot(*read[:2]) / np.hypot(*run.pose[-1][:2])
    joint = np.pi / vehicle.rollers_per_wheel
    assert way["ahead"] == pytest.approx(1, abs=1e-4)
    assert way["aside"] == pytest.approx(joint / np.sin(joint), abs=2e-3)


def test_instruments_read_what_is_told_of_wheels_that_may_stand_on_their_joint():
    """Without names all but the acceleration, which depends on how two rollers share the force."""
    run = omniroll.simulate(usual(), nu=(0.5, 0.8, 0.6), duration=0.5, control=False)
    read = run.measure(np.linspace(0, 0.5, 6))
    assert {"wheel_angle", "gyro", "odometry"} <= read.keys() and "accelerometer" not in read
    assert all(np.isfinite(values).all() for values in read.values())
    session = omniroll.Session(usual(), nu=(0.5, 0.8, 0.6))
    assert session.measure()["wheel_rate"] == pytest.approx(read["wheel_rate"][0], abs=1e-14)
    with pytest.raises(omniroll.InvalidValueError, match="names = 'accelerometer': is told of omni-wheels in one row"):
        run.measure([0.1], names=("accelerometer",))


def test_least_torques_and_speeds_from_wheels():
    bound, chi = kernel(usual(), "locked"), np.array([0.1, -0.3, 0.2, 0.0])
    nu, force = np.array([0.4, -0.2, 0.9]), np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(bound.nu_from_wheels(bound.wheel_speeds(nu, chi), chi), nu, rtol=1e-12)
    torque = bound.wheel_torques(force, chi)
    np.testing.assert_allclose(bound.wheel_speeds(np.eye(3), np.tile(chi, (3, 1))) @ torque, force, rtol=1e-12)
