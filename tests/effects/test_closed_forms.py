"""Motions with effects that are known in closed form, and events at times that are known."""

import warnings

import numpy as np
import pytest

from omniroll import (
    Bearings,
    Controller,
    Motor,
    Slope,
    Torque,
    TorqueTable,
    UnstableControllerWarning,
    Vehicle,
    simulate,
)

PAPER = Vehicle.paper()
EPS = np.finfo(float).eps
RATIO = PAPER.platform_radius / PAPER.wheel_radius  # chi' = - RATIO theta' where the vehicle turns on the spot
TURNING = PAPER.yaw_inertia + PAPER.wheels * PAPER.wheel_inertia * RATIO**2  # inertia of that turning, massless rollers
ROLLING = PAPER.mass + PAPER.wheels * PAPER.wheel_inertia / PAPER.wheel_radius**2 / 2  # and of going straight
EXACT = {"roller_model": "massless", "accuracy": 1e-12, "control": False}


def turning(nu_3, **more):
    return {"nu": (0, 0, nu_3), **EXACT, **more}


def theta_rate(run):
    return run.nu[:, 2] / PAPER.yaw_scale


def test_equal_torques_spin_the_vehicle_up_linearly():
    run = simulate(PAPER, **turning(0.0), duration=3, effects=[Torque(-0.01)])
    rate = PAPER.wheels * 0.01 * RATIO / TURNING
    np.testing.assert_allclose(theta_rate(run), rate * run.t, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.pose[:, 2], rate * run.t**2 / 2, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.quantity("drive_work"), TURNING * theta_rate(run) ** 2 / 2, rtol=1e-11, atol=1e-13)
    assert len(run.switches) > 10 and np.abs(run.nu[:, :2]).max() < 1e-13


@pytest.mark.long
def test_viscous_axles_slow_it_down_exponentially():
    """On a regular polygon sum g g^T is diagonal: |(nu_1, nu_2)| and nu_3 each decay at their own rate."""
    damping = 0.02
    run = simulate(PAPER, nu=(1, 0.4, 0.7), duration=2, **EXACT, effects=[Bearings(wheel_viscous=damping)])
    along = damping * PAPER.wheels / 2 / PAPER.wheel_radius**2 / ROLLING
    around = damping * PAPER.wheels * RATIO**2 / TURNING
    np.testing.assert_allclose(np.hypot(*run.nu[:, :2].T), np.hypot(1, 0.4) * np.exp(-along * run.t), rtol=1e-11)
    np.testing.assert_allclose(run.nu[:, 2], 0.7 * np.exp(-around * run.t), rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(run.quantity("axle_loss"), run.energy[0] - run.energy, rtol=1e-10, atol=1e-14)


def time_from_fade(speed, fade, rate):
    """When w' = - rate w/sqrt(w^2 + fade^2) has come down to `speed`, but for a constant."""
    whole = np.hypot(speed, fade)
    return -(whole - fade * np.arctanh(fade / whole)) / rate


@pytest.mark.long
def test_coulomb_friction_of_the_axles():
    torque, fade = 0.01, 2.0
    run = simulate(PAPER, **turning(1.0), duration=2, effects=[Bearings(wheel_coulomb=torque, wheel_speed=fade)])
    speed = RATIO * theta_rate(run)  # of a wheel
    rate = torque * PAPER.wheels * RATIO**2 / TURNING
    found = time_from_fade(speed, fade, rate) - time_from_fade(speed[0], fade, rate)
    np.testing.assert_allclose(found, run.t, atol=1e-10)
    assert speed[-1] < 0.7 * speed[0]


@pytest.mark.long
@pytest.mark.parametrize("effect", [Bearings(roller_viscous=4e-6), Bearings(roller_coulomb=5e-6, roller_speed=0.5)])
def test_free_rollers_spin_down(effect):
    """chi = 0 and equal spins: the rollers' couples about the vertical cancel, and the vehicle stays at rest."""
    run = simulate(PAPER, nu=(0, 0, 0), spins=3.0, duration=1.5, accuracy=1e-11, control=False, effects=[effect])
    assert np.abs(run.nu).max() < 1e-12
    rate = (effect.roller_viscous or effect.roller_coulomb) / PAPER.roller_inertia
    spins = run.spins.reshape(len(run), -1)
    if effect.roller_viscous is not None:
        np.testing.assert_allclose(spins, np.repeat(3 * np.exp(-rate * run.t)[:, None], 12, axis=1), rtol=1e-10)
    else:
        elapsed = time_from_fade(spins, 0.5, rate) - time_from_fade(3.0, 0.5, rate)
        np.testing.assert_allclose(elapsed, np.repeat(run.t[:, None], 12, axis=1), atol=1e-9)
    assert 0.1 < spins[-1].min() and spins[-1].max() < 1.5
    np.testing.assert_allclose(run.quantity("roller_loss"), run.energy[0] - run.energy, rtol=1e-9, atol=1e-15)


@pytest.mark.long
@pytest.mark.parametrize("direction", [0.0, 1.3])
@pytest.mark.parametrize("heading", [0.0, -0.6])
def test_down_a_slope_from_rest(direction, heading):
    run = simulate(
        PAPER, nu=(0, 0, 0), pose=(0.2, -0.1, heading), duration=1.5, **EXACT, effects=[Slope(0.1, direction, 9.8)]
    )
    way = PAPER.mass * 9.8 * np.sin(0.1) / ROLLING * run.t**2 / 2
    np.testing.assert_allclose(run.pose[:, 0], 0.2 + way * np.cos(direction), atol=1e-11)
    np.testing.assert_allclose(run.pose[:, 1], -0.1 + way * np.sin(direction), atol=1e-11)
    np.testing.assert_allclose(run.pose[:, 2], heading, atol=1e-12)
    assert run.ledger.contributions["slope_work"] == pytest.approx(PAPER.mass * 9.8 * np.sin(0.1) * way[-1], rel=1e-11)


# Events


def rows_at(run, time):
    return np.flatnonzero(np.abs(run.t - time) < 1e-13)


def test_knots_are_rows_and_the_motion_between_them_is_exact():
    """theta'' follows a broken line: theta' is a parabola on each piece. The clock starts at 2."""
    times, torques = np.array([2.3, 2.9, 3.1]), np.array([0.0, 0.02, -0.01])
    table = TorqueTable(times, -np.repeat(torques[:, None], 3, axis=1))
    run = simulate(PAPER, **turning(0.3, start_time=2.0), duration=2, effects=[table])
    per_torque = PAPER.wheels * RATIO / TURNING
    for time in times:
        (row,) = rows_at(run, time)
        assert run.elapsed[row] == time - 2.0
    gained = np.concatenate([[0.0], np.cumsum(np.diff(times) * (torques[1:] + torques[:-1]) / 2)])
    rates = [theta_rate(run)[rows_at(run, time)[0]] for time in times]
    np.testing.assert_allclose(rates, 0.3 / PAPER.yaw_scale + per_torque * gained, rtol=1e-12)
    last = rates[-1] + per_torque * torques[-1] * (4.0 - times[-1])
    assert theta_rate(run)[-1] == pytest.approx(last, rel=1e-12)


MOTOR = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 4.0, "back_emf": 0.03}


@pytest.mark.long
def test_a_motor_runs_up_to_its_speed():
    run = simulate(PAPER, **turning(0.0), duration=2, effects=[Motor(-3.0, **MOTOR)])
    per_volt = MOTOR["gear_ratio"] * MOTOR["torque_constant"] / MOTOR["resistance"]
    damping = per_volt * MOTOR["gear_ratio"] * MOTOR["back_emf"]
    rate = PAPER.wheels * damping * RATIO**2 / TURNING
    final = per_volt * 3.0 / damping / RATIO
    np.testing.assert_allclose(theta_rate(run), final * -np.expm1(-rate * run.t), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_current_leaves_its_limit_where_it_should(sign):
    """At the limit theta' grows linearly, up to where u - k_e g chi' = R i; from there exponentially."""
    limit, rotor = 1.0, 1e-5
    motor = Motor(-3.0 * sign, **MOTOR, current_limit=limit, rotor_inertia=rotor)
    run = simulate(PAPER, **turning(0.0), duration=2, effects=[motor])
    g, k_t, k_e, resistance = (MOTOR[n] for n in ("gear_ratio", "torque_constant", "back_emf", "resistance"))
    inertia = TURNING + PAPER.wheels * g**2 * rotor * RATIO**2
    rate = PAPER.wheels * g * k_t * limit * RATIO / inertia
    speed = (3.0 - resistance * limit) / (k_e * g) / RATIO  # theta' where the limit ends
    row = rows_at(run, speed / rate)[-1]  # three wheels, whose limits end at the same time but for rounding
    assert theta_rate(run)[row] == pytest.approx(sign * speed, rel=8 * EPS)
    decay = PAPER.wheels * g**2 * k_t * k_e / resistance * RATIO**2 / inertia
    final = 3.0 / (k_e * g) / RATIO
    late = run.t > run.t[row]
    expected = np.where(late, final - (final - speed) * np.exp(-decay * (run.t - run.t[row])), rate * run.t)
    np.testing.assert_allclose(sign * theta_rate(run), expected, rtol=1e-10, atol=1e-12)


def test_a_current_that_stands_exactly_on_its_limit():
    """Torques hold the motors at rest with u/R = the limit: neither mode is left for the other again and again."""
    motor = Motor(3.0, 0.02, 1.5, gear_ratio=4.0, current_limit=2.0)
    run = simulate(PAPER, **turning(0.0), duration=5, effects=[motor, Torque(-4.0 * 0.02 * 2.0)])
    assert run.stats["phases"] < 10 and np.abs(run.nu).max() < 1e-12


def test_a_sampled_controller():
    """theta' - target shrinks by one factor at each sample: the plant between samples is an integrator."""
    gain, sample = 0.05, 0.04
    controller = Controller((0, 0, 1.0), gain, sample)
    run = simulate(PAPER, **turning(0.0), duration=1.0, effects=[controller])
    factor = 1 - PAPER.wheels * gain * RATIO**2 / TURNING * sample
    for k in range(25):
        row = rows_at(run, k * sample)[-1]
        assert run.elapsed[row] == k * sample
        assert run.nu[row, 2] == pytest.approx(1 - factor**k, rel=1e-11, abs=1e-13)


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_gain_that_is_too_large_for_the_sample_time_is_told(part):
    """Turning on the spot, an error of theta' is multiplied by 1 - gain * sample * inertia^-1 at each sample.

    Of the three kinds of motion turning is the lightest, so that its bound is the one that counts.
    """
    sample = 0.04
    gain = part * 2 * TURNING / (PAPER.wheels * RATIO**2 * sample)
    assert RATIO**2 * PAPER.wheels / TURNING > PAPER.wheels / 2 / PAPER.wheel_radius**2 / ROLLING
    controller = Controller((0, 0, 1.0), gain, sample)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = simulate(PAPER, **turning(0.0), duration=1.0, effects=[controller])
    assert [w.category for w in told] == [UnstableControllerWarning] * (part > 1)
    errors = np.abs(run.nu[[rows_at(run, k * sample)[-1] for k in range(25)], 2] - 1)
    assert (errors[-1] > errors[0]) == (part > 1)


def test_a_controller_at_its_limit_keeps_its_integral():
    """Far from the target the torque is the limit; without the wait the integral would overshoot by far."""
    controller = Controller((0, 0, 3.0), 0.05, 0.01, integral=0.2, limit=0.01)
    run = simulate(PAPER, **turning(0.0), duration=4.0, effects=[controller])
    rate = PAPER.wheels * 0.01 * RATIO / TURNING
    early = run.t < 0.5
    np.testing.assert_allclose(theta_rate(run)[early], rate * run.t[early], rtol=1e-11, atol=1e-13)
    assert run.nu[-1, 2] == pytest.approx(3.0, rel=1e-2) and run.nu[:, 2].max() < 3.6


def test_a_controller_through_motors():
    """Voltage and motors are one linear plant: at each sample the state is the exact solution from the last one."""
    motor, gain, sample = Motor(0.0, **MOTOR), 0.5, 0.02
    run = simulate(
        PAPER, **turning(0.0), duration=0.2, effects=[motor, Controller((0, 0, 1.0), gain, sample, output="voltage")]
    )
    per_volt = MOTOR["gear_ratio"] * MOTOR["torque_constant"] / MOTOR["resistance"]
    damping = per_volt * MOTOR["gear_ratio"] * MOTOR["back_emf"]
    decay = np.exp(-PAPER.wheels * damping * RATIO**2 / TURNING * sample)
    expected = 0.0
    for k in range(11):
        assert theta_rate(run)[rows_at(run, k * sample)[-1]] == pytest.approx(expected, rel=1e-11, abs=1e-13)
        volts = gain * RATIO * (1 / PAPER.yaw_scale - expected)
        final = per_volt * volts / damping / RATIO
        expected = final + (expected - final) * decay
