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


def test_turned_the_other_way_no_roller_pushes_them_there():
    run = simulated(trio(), "free", duration=0.5, **two_stand(-1.0))
    assert not run.pivots[run.step_rows[0]].any()


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


def test_a_session_and_a_file_know_wheels_that_stand(tmp_path):
    run = simulated(trio(), "free", duration=0.06, **two_stand())
    session = omniroll.Session(trio(), roller_model="free", driven=False, accuracy=1e-9, **two_stand())
    for _ in range(15):
        session.step(0.004)
        sample = run.sample(session.time)
        assert session.energy == pytest.approx(float(sample.energy), rel=1e-6)
        np.testing.assert_allclose(session.spins, sample.spins, atol=1e-4)
        rates = run.measure([session.time], names=("wheel_rate",))["wheel_rate"][0]
        np.testing.assert_allclose(session.wheel_speeds, rates, atol=1e-5)
    for name in ("run.npz", "run.csv"):
        run.save(tmp_path / name)
        again = omniroll.Trajectory.load(tmp_path / name)
        assert (again.pivots == run.pivots).all()
        np.testing.assert_array_equal(again.sample([0.01, 0.05]).spins, run.sample([0.01, 0.05]).spins)


def test_many_runs_end_with_wheels_that_stand():
    task = two_stand() | {"duration": 0.01, "roller_model": "massless"}
    many, one = omniroll.simulate_many(trio(), **task), omniroll.simulate(trio(), **task)
    assert one.pivots[-1].any()
    np.testing.assert_array_equal(many.end.contact, one.contact[-1])
    assert many.end.energy == one.energy[-1]
