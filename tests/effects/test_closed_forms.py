"""Motions with effects that are known in closed form, and events at times that are known."""

import numpy as np
import pytest

from omniroll import Controller, Motor, Slope, Torque, TorqueTable, Vehicle, simulate

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


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_a_controller_at_its_limit_keeps_its_integral(engine):
    """Far from the target the torque is the limit; without the wait the integral would overshoot by far."""
    controller = Controller((0, 0, 3.0), 0.05, 0.01, integral=0.2, limit=0.01)
    accuracy = {"accuracy": 1e-12 if engine == "compiled" else 1e-9}
    run = simulate(PAPER, **turning(0.0) | accuracy, duration=4.0, effects=[controller], engine=engine)
    rate = PAPER.wheels * 0.01 * RATIO / TURNING
    early = run.t < 0.5
    np.testing.assert_allclose(theta_rate(run)[early], rate * run.t[early], rtol=1e-11, atol=1e-13)
    assert run.nu[-1, 2] == pytest.approx(3.0, rel=1e-2) and run.nu[:, 2].max() < 3.6
