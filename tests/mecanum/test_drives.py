"""What drives a mecanum robot and what it reads: current limits, paths, odometry, many runs, linear models."""

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
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


@pytest.mark.parametrize("model", MODELS)
def test_many_runs_are_those_of_each(model):
    starts = [(0.5, 0.8, 0.6), (1.75, 0.0, 1.5), (-0.5, 0.3, -1.0)]
    many = omniroll.simulate_many(usual(), nu=np.array(starts), duration=1.0, roller_model=model)
    for k, nu in enumerate(starts):
        one = omniroll.simulate(usual(), nu=nu, duration=1.0, roller_model=model)
        np.testing.assert_array_equal(many.end.pose[k], one.pose[-1])


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rows", [1, 2])
def test_a_linear_model_is_that_of_differences(model, rows):
    """Of mecanum wheels, and of two rows the outer one; with the momenta of free rollers as they are."""
    vehicle = usual() if rows == 1 else usual(0.0, rollers_per_wheel=8, rows=2, row_offset=0.012)
    nu, chi = np.array([0.5, 0.8, 0.6]), np.array([0.1, -0.2, 0.05, 0.3])
    found = omniroll.linearise(vehicle, roller_model=model, nu=nu, chi=chi, outputs=("wheel_rate",))
    first = np.zeros(4, int)
    bound = kernel_in_phase(kernel(vehicle, model, effects=("drive",)), Carry(first, first))
    momenta = ()
    if model == "free":
        momenta = (bound.momenta(bound.axial_speeds(nu, chi, np.zeros((4, vehicle.rollers_per_wheel - 1)))),)

    def rates(x):
        turning = bound.wheel_speeds(x[:3], x[3:7])
        return np.concatenate([bound.forward_dynamics(x[:3], x[3:7], *momenta, x[7:]), turning])

    x = np.concatenate([nu, chi, np.zeros(4)])
    np.testing.assert_allclose(found.rates[:7], rates(x), rtol=1e-12)
    slopes = np.array([(rates(x + step) - rates(x - step)) / 2e-6 for step in 1e-6 * np.eye(11)]).T
    np.testing.assert_allclose(np.hstack([found.A[:7, :7], found.B[:7]]), slopes, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.C[:4, :7], found.A[3:7, :7], rtol=1e-12)


def test_least_torques_and_speeds_from_wheels():
    bound, chi = kernel(usual(), "locked"), np.array([0.1, -0.3, 0.2, 0.0])
    nu, force = np.array([0.4, -0.2, 0.9]), np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(bound.nu_from_wheels(bound.wheel_speeds(nu, chi), chi), nu, rtol=1e-12)
    torque = bound.wheel_torques(force, chi)
    np.testing.assert_allclose(bound.wheel_speeds(np.eye(3), np.tile(chi, (3, 1))) @ torque, force, rtol=1e-12)
