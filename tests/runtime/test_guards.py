"""Guards: phases end where a linear function of time and state passes zero, to a few roundings."""

import numpy as np
import pytest

from omniroll.effects.guards import Guard, Guards
from omniroll.engine.integrate import PhaseIntegrator
from omniroll.engine.switching import tau

EPS = np.finfo(float).eps
SIZE = 9  # three wheels: nu, chi, pose


def run(flow, guards, nu=(0.0, 0.0, 0.0), chi=(0.0, 0.0, 0.0), limit=10.0, first_step=None):
    integrator = PhaseIntegrator(3, np.pi / 5, np.ones(SIZE), 1e-12)
    integrator.next_step = first_step
    y = np.concatenate([nu, chi, np.zeros(3)]).astype(float)
    return integrator.run(flow, y, limit, lambda h: tau(h, h), Guards(guards, SIZE))


def only_nu(rates):
    """The flow nu' = rates(t, nu); nothing else moves."""
    return lambda t, y: np.concatenate([rates(t, y[:3]), np.zeros(6)])


def nu_1(constant, slope=0.0, sign=1.0):
    return Guard(constant, slope, np.array([sign, 0.0, 0.0]))


@pytest.mark.parametrize("rate", [1e-6, 0.3, 1e5])
def test_a_guard_is_landed_on(rate):
    """nu_1 = 1 - exp(-rate t) reaches 1/2 at log(2)/rate."""
    phase = run(only_nu(lambda t, nu: rate * (1 - nu)), [nu_1(-0.5)], limit=10 / rate)
    assert phase.passed.tolist() == [True]
    assert phase.y[0] == pytest.approx(0.5, rel=4 * EPS)
    assert phase.duration == pytest.approx(np.log(2) / rate, rel=1e-11)
    assert not phase.directions.any()


def test_a_flow_that_knows_the_time():
    """nu_1' = cos t from nu_1 = 0: sin t reaches 1/2 at pi/6, late in a phase of several steps."""
    phase = run(only_nu(lambda t, nu: np.array([np.cos(t), 0, 0])), [nu_1(-0.5)], first_step=0.01)
    assert phase.duration == pytest.approx(np.pi / 6, rel=1e-11)
    assert len(phase.times) > 2


def test_a_guard_that_moves_with_time():
    """nu_1 = t^2 against 0.3 + 2 t."""
    phase = run(only_nu(lambda t, nu: np.array([2 * t, 0, 0])), [nu_1(-0.3, -2.0)])
    assert phase.duration == pytest.approx(1 + np.sqrt(1.3), rel=4 * EPS)


@pytest.mark.parametrize("excess", [1e-1, 1e-5, 1e-9])
def test_over_and_back_within_one_step(excess):
    """nu_1 = v t - t^2/2 peaks `excess` above 1; one step would pass both crossings."""
    speed = np.sqrt(2 * (1 + excess))
    phase = run(only_nu(lambda t, nu: np.array([speed - t, 0, 0])), [nu_1(-1.0)], limit=2 * speed, first_step=2 * speed)
    assert phase.passed.any()
    assert phase.duration == pytest.approx(speed - np.sqrt(2 * excess), abs=8 * EPS / np.sqrt(excess) + 4 * EPS)


def test_the_first_of_two_guards():
    phase = run(only_nu(lambda t, nu: np.array([1.0, 0, 0])), [nu_1(-2.0), nu_1(-1.5), nu_1(-1.5)])
    assert phase.passed.tolist() == [False, True, True]
    assert phase.duration == pytest.approx(1.5, rel=4 * EPS)


def test_a_joint_before_the_guard_and_after_it():
    def flow(t, y):
        return np.concatenate([[1.0, 0, 0], [1.0, 0, 0], np.zeros(3)])

    joint = np.pi / 5
    before = run(flow, [nu_1(-0.7)])
    assert before.directions.tolist() == [1, 0, 0] and not before.passed.any()
    after = run(flow, [nu_1(-0.5)])
    assert not after.directions.any() and after.passed.all()
    together = run(flow, [nu_1(-joint)])
    assert together.passed.all() or together.directions.any()
    assert together.duration == pytest.approx(joint, rel=4 * EPS)


def test_the_way_back_is_quiet_after_a_landing():
    """What has just been landed on from below does not count as passed downwards, but for a real return."""
    there = run(only_nu(lambda t, nu: np.array([np.cos(t), 0, 0])), [nu_1(-0.5)])
    back = run(
        only_nu(lambda t, nu: np.array([np.cos(t + there.duration), 0, 0])), [nu_1(0.5, sign=-1.0)], nu=there.y[:3]
    )
    assert there.duration + back.duration == pytest.approx(np.pi * 5 / 6, rel=1e-11)


def test_resting_on_a_guard_is_no_passage():
    phase = run(only_nu(lambda t, nu: np.zeros(3)), [nu_1(-1.0), nu_1(1.0, sign=-1.0)], nu=(1.0, 0, 0))
    assert not phase.passed.any() and phase.duration == 10


def test_a_guard_that_is_passed_at_the_start_ends_the_phase_at_once():
    phase = run(only_nu(lambda t, nu: np.ones(3)), [nu_1(-0.5)], nu=(0.6, 0, 0))
    assert phase.passed.all() and phase.duration == 0


def test_a_joint_under_a_flow_that_knows_the_time():
    """chi_1'' = cos t from rest: 1 - cos t reaches the joint, late in a phase of several steps."""
    joint = np.pi / 5

    def flow(t, y):
        return np.concatenate([[np.cos(t), 0, 0], y[:3], np.zeros(3)])

    phase = run(flow, [], first_step=0.01)
    assert phase.directions.tolist() == [1, 0, 0] and len(phase.times) > 2
    assert phase.duration == pytest.approx(np.arccos(1 - joint), rel=1e-11)


def graze(bound, tolerance, others=()):
    """The phase of nu_1 = sin t up to t = 3 with a guard at `bound`."""
    integrator = PhaseIntegrator(3, np.pi / 5, np.ones(SIZE), tolerance)
    guards = Guards([nu_1(-bound), *others], SIZE)
    flow = only_nu(lambda t, nu: np.array([np.cos(t), 0, 0]))
    return integrator.run(flow, np.zeros(SIZE), 3.0, lambda h: tau(h, h), guards), guards


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_a_guard_that_a_polynomial_alone_passes_does_not_end_the_phase(tolerance):
    """A step's polynomial may lead beyond a guard that the motion only comes near: the phase ended far behind it."""
    ends = []
    for near in np.linspace(-20, 3, 231):
        phase, guards = graze(1 + near * tolerance, tolerance)
        ends.append(phase.passed.any())
        if phase.passed.any():
            assert abs(guards.values(phase.duration, phase.y)[0]) <= 1e-8
        else:
            assert phase.duration == 3.0
    assert any(ends) and not all(ends)


def test_another_guard_of_a_step_ends_the_phase_where_the_first_is_passed_by_its_polynomial_alone():
    """The other is a time, which the motion has no part in."""
    passed = set()
    for near in np.linspace(-20, 3, 231):
        phase, guards = graze(1 + near * 1e-6, 1e-6, [Guard(-2.2, 1.0, np.zeros(3))])
        passed.add(tuple(phase.passed.tolist()))
        assert np.abs(guards.values(phase.duration, phase.y)[phase.passed]).max() <= 1e-8
    assert passed == {(True, False), (False, True)}
