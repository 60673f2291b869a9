"""Mecanum wheels that stand on their joint: where the rollers on both sides push them back to it."""

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import kernel
from tests.mecanum.corners import CORNERS, JOINT, TURNING, trio, two_stand, usual, vanishing_rate
from tests.rows import reversals

MODELS, LAWS = reversals.MODELS, ("impact", "smooth")


def simulated(vehicle, model, law="impact", duration=2.0, **task):
    given = {"control": False, "accuracy": 1e-9} | task
    return omniroll.simulate(vehicle, roller_model=model, switching=law, duration=duration, **given)


def assert_lawful(run, law="impact"):
    assert reversals.most_at_once(run) <= 4
    assert law == "smooth" or reversals.rises(run) <= 1e-13
    assert abs(run.ledger.residual) < 1e-7 * run.energy.max()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", LAWS)
def test_wheels_stand_while_both_rollers_push_them_back(model, law):
    """Two together, until one of its rollers takes a wheel from there, by their rows; energy stays."""
    run = simulated(trio(), model, law, 0.5, accuracy=1e-13, **two_stand())
    stands = run.pivots > 0
    assert stands[run.step_rows[0]].tolist() == [True, True, False]
    assert (run.times_on_joints()[:2] > 0.02).all()
    assert (np.abs(run.chi[stands]) == JOINT).all()
    plain = kernel(trio(), model)
    inward = np.sign(run.chi) * plain.wheel_speeds(run.nu, run.chi)
    back = np.sign(run.chi) * plain.wheel_speeds(run.nu, -run.chi)
    for row in (run.step_rows, run.step_rows + 1):
        assert (inward[row][stands[run.step_rows]] > -1e-8).all()
        assert (back[row][stands[run.step_rows]] < 1e-8).all()
    assert run.stats["phase_energy_drift"] < 1e-12
    assert_lawful(run, law)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("corner", CORNERS)
def test_corners(model, corner):
    for law in LAWS[: 1 if corner == "89 degrees" else 2]:  # smooth switches gain energy without bound there
        assert_lawful(simulated(CORNERS[corner], model, law, 1.0, **TURNING), law)


@pytest.mark.parametrize("model", MODELS)
def test_a_wheel_whose_rate_vanishes_at_its_joint(model):
    for yaw in (0.0, 0.4, -0.4):
        assert_lawful(simulated(usual(), model, duration=0.5, **vanishing_rate(yaw)))


@pytest.mark.parametrize("model", MODELS)
def test_random_vehicles_reverse(model):
    """What tests/hard/pivots.py asks of a thousand."""
    stood = 0.0
    for seed in range(8):
        random = np.random.default_rng([seed, reversals.MODELS.index(model)])
        task = reversals.task(random, seed % 2 == 1, is_mecanum=True)
        run = simulated(task.pop("vehicle"), model, **task)
        assert_lawful(run)
        stood += reversals.stood(run)
    assert stood > 0
