"""One phase with motions that are known: wheels under constant acceleration, chi_i' = nu_i, nu_i' = a_i."""

import numpy as np
import pytest

from omniroll.engine.integrate import PhaseIntegrator, StepFailedError
from omniroll.engine.switching import tau

JOINT = np.pi / 5
EPS = np.finfo(float).eps


def constant(a):
    """The flow of y = (nu, chi, pose) with nu' = a; the pose stays."""
    return lambda t, y: np.concatenate([a, y[:3], np.zeros(3)])


def run(chi, nu, a=(0, 0, 0), limit=10.0, flow=None, first_step=None, tolerance=1e-12):
    integrator = PhaseIntegrator(3, JOINT, np.ones(9), tolerance)
    integrator.next_step = first_step
    y = np.concatenate([nu, chi, np.zeros(3)]).astype(float)
    return integrator.run(flow or constant(np.array(a, float)), y, limit, lambda h: tau(h, h))


@pytest.mark.parametrize("rate", [1.0, -1.0, 1e-6, -1e6])
def test_a_wheel_lands_exactly_on_its_joint(rate):
    phase = run([0.1, 0.0, 0.0], [rate, 0, 0], limit=1e9)
    assert phase.directions.tolist() == [np.sign(rate), 0, 0]
    assert phase.y[3] == np.sign(rate) * JOINT
    expected = (JOINT - np.sign(rate) * 0.1) / abs(rate)
    assert phase.duration == pytest.approx(expected, rel=4 * EPS)
    assert (phase.ends[-1] == phase.y).all() and (phase.dense[-1][-1] == phase.y).all()


@pytest.mark.parametrize("excess", [1e-1, 1e-4, 1e-8])
def test_out_and_in_again_within_one_step(excess):
    """chi = 0.5 + v t - t^2/2 peaks `excess` beyond the joint; one step would pass both crossings."""
    speed = np.sqrt(2 * (JOINT + excess - 0.5))
    phase = run([0.5, 0, 0], [speed, 0, 0], [-1, 0, 0], limit=2 * speed, first_step=2 * speed)
    expected = speed - np.sqrt(2 * excess)
    assert phase.directions.tolist() == [1, 0, 0]
    assert phase.duration == pytest.approx(expected, abs=4 * EPS / np.sqrt(excess) + 4 * EPS)


def test_turning_back_at_the_joint_is_no_switch():
    for short in (0.0, 1e-15, 1e-9, 1e-3):
        speed = np.sqrt(2 * (JOINT - short - 0.5))
        phase = run([0.5, 0, 0], [speed, 0, 0], [-1, 0, 0], limit=1.5 * speed)
        if phase.directions.any():  # the peak is on the joint up to rounding: a switch there is no error
            assert short < 1e-14 and phase.duration == pytest.approx(speed, rel=1e-6)
        else:
            assert phase.duration == 1.5 * speed
            assert np.abs(np.array(phase.dense)[:, :, 3]).max() <= JOINT * (1 + 1e-2)


def test_the_first_of_two_wheels_is_found():
    phase = run([0.0, 0.01, 0.0], [1.0, 1.0, -1.0])
    assert phase.directions.tolist() == [0, 1, 0]
    assert phase.duration == pytest.approx(JOINT - 0.01, rel=4 * EPS)


@pytest.mark.parametrize("gap_over_tau, together", [(0.0, True), (0.1, True), (10.0, False), (1000.0, False)])
def test_wheels_within_tau_switch_together(gap_over_tau, together):
    gap = gap_over_tau * tau(JOINT, JOINT)
    phase = run([0.0, -gap, 0.0], [1.0, 1.0, 0.0])
    assert phase.directions.tolist() == [1, 1 if together else 0, 0]
    assert phase.y[4] == JOINT if together else phase.y[4] < JOINT


def test_starting_on_a_joint():
    inwards = run([-JOINT, 0, 0], [1.0, 0, 0])
    assert inwards.directions.tolist() == [1, 0, 0] and inwards.duration == pytest.approx(2 * JOINT, rel=4 * EPS)
    driven_out = run([JOINT, 0, 0], [0.0, 0, 0], [1, 0, 0])
    assert driven_out.directions.tolist() == [1, 0, 0] and driven_out.duration == 0
    driven_in = run([JOINT, 0, 0], [0.0, 0, 0], [-1, 0, 0])
    assert driven_in.directions.tolist() == [-1, 0, 0]
    assert driven_in.duration == pytest.approx(2 * np.sqrt(JOINT), rel=4 * EPS)
    resting = run([JOINT, 0, 0], [0.0, 0, 0])
    assert not resting.directions.any() and resting.duration == 10


def test_a_switch_at_the_end_counts_and_beyond_it_does_not():
    assert run([0, 0, 0], [1.0, 0, 0], limit=JOINT).directions.tolist() == [1, 0, 0]
    assert not run([0, 0, 0], [1.0, 0, 0], limit=JOINT * (1 - 1e-12)).directions.any()


def test_steps_tile_the_phase():
    def flow(t, y):
        return np.concatenate([-y[3:6], y[:3], y[:3]])

    phase = run([0.5, -0.3, 0.2], [0.2, 0.3, 0.1], limit=20.0, flow=flow)
    assert not phase.directions.any() and phase.duration == 20
    ends = np.array(phase.ends)
    dense = np.array(phase.dense)
    assert (dense[1:, 0] == ends[:-1]).all() and (dense[:, -1] == ends).all()
    np.testing.assert_allclose(
        phase.y[3:6],
        np.array([0.5, -0.3, 0.2]) * np.cos(20) + np.array([0.2, 0.3, 0.1]) * np.sin(20),
        rtol=1e-10,
    )


def test_a_flow_that_leaves_the_numbers_stops_with_what_was_done():
    def flow(t, y):
        return np.concatenate([y[:3] ** 2, 0 * y[:3], np.zeros(3)])

    with np.errstate(all="ignore"), pytest.raises(StepFailedError) as raised:
        run([0, 0, 0], [1.0, 0, 0], flow=flow)
    assert raised.value.phase.duration == pytest.approx(1, rel=1e-9)
