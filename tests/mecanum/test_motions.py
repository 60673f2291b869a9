"""Motions of mecanum vehicles."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import omniroll
from omniroll import Vehicle
from omniroll.kernels.kernel import kernel
from tests.mecanum.corners import usual

MODELS = ("massless", "locked", "free")


def run(vehicle: Vehicle, nu=(0.5, 0.8, 0.6), duration=1.0, **options):
    options = {"accuracy": 1e-12, "control": False} | options
    return omniroll.simulate(vehicle, nu=nu, duration=duration, **options)


@pytest.mark.parametrize("model", ["massless", "locked"])
def test_a_phase_is_that_of_a_general_integrator(model):
    vehicle, nu, chi = usual(), np.array([0.5, 0.8, 0.6]), np.array([0.1, -0.2, 0.05, 0.0])
    found = run(vehicle, nu, 0.012, chi=chi, roller_model=model)
    assert len(found.switches) == 0
    bound = kernel(vehicle, model, "python")

    def rates(_, y):
        return np.concatenate([bound.forward_dynamics(y[:3], y[3:7]), bound.wheel_speeds(y[:3], y[3:7]),
                               bound.pose_rates(y[:3], y[9])])  # fmt: skip

    exact = solve_ivp(rates, (0, 0.012), [*nu, *chi, 0, 0, 0], method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    np.testing.assert_allclose([*found.nu[-1], *found.chi[-1], *found.pose[-1]], exact, rtol=1e-12, atol=1e-12)


def heavy(psi: float, rollers: int) -> Vehicle:
    """So heavy that its speed is constant to rounding."""
    return usual(psi, rollers_per_wheel=rollers, roller_axis_radius=0.02 if rollers < 5 else 0.037, mass=1e16,
                 yaw_inertia=1e15)  # fmt: skip


@pytest.mark.parametrize("rollers", [3, 6, 9, 16])
@pytest.mark.parametrize("psi", [0.4, math.pi / 4, 1.2])
def test_strafing_turns_wheels_as_closed_forms_say(rollers, psi):
    vehicle, speed = heavy(psi, rollers), 0.3
    joint, radius = math.pi / rollers, vehicle.wheel_radius
    passing = 2 * radius * math.sin(joint) / (math.tan(psi) * speed)
    found = run(vehicle, (0, speed / vehicle.platform_radius, 0), 3.2 * passing, roller_model="massless")
    times = np.unique(found.switches.t)
    np.testing.assert_allclose(np.diff(times), passing, rtol=1e-11)
    classical = math.tan(psi) * speed / radius
    assert 2 * joint / passing / classical == pytest.approx(joint / math.sin(joint), rel=1e-15)
    rate = np.abs(kernel(vehicle, "massless").wheel_speeds(found.nu, found.chi))
    assert rate.max() == pytest.approx(classical / math.cos(joint), rel=1e-12)


def test_a_roller_spins_faster_at_the_joint():
    vehicle = usual()
    middle, joint = (kernel(vehicle, "free").wheel_rates((0, 1, 0), (angle,) * 4)[1][0] for angle in (0, math.pi / 9))
    radius, axis = vehicle.wheel_radius, vehicle.roller_axis_radius
    assert joint / middle == pytest.approx((radius - axis) / (radius * math.cos(math.pi / 9) - axis), rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_a_small_angle_changes_the_motion_in_proportion(model):
    options = {"nu": (0.5, 0.8, 0.6), "duration": 0.3, "roller_model": model, "chi": (0.02, -0.11, 0.2, -0.27)}
    plain = run(usual(0.0), **options).pose[-1]
    changes = [np.abs(run(usual(psi), **options).pose[-1] - plain).max() for psi in (1e-5, 1e-6)]
    assert changes[0] / changes[1] == pytest.approx(10, rel=0.02) and changes[1] > 0
