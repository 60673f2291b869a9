"""Fits to motions of the independent oracle with noise say what they do not know."""

import numpy as np
import pytest

from identification.coverage import FREE, fit_of, study
from identification.oracle_motion import FRICTION, ROWS, motion, recorded

START = 101  # rows of each motion that are made again, 1 s
SEVERAL = 30  # logs
LEAST, MOST = 25, 119  # fewer of 30 intervals, or more of 120, hold the truth once in 300 and in 470 such studies


@pytest.mark.parametrize("name", ROWS)
def test_the_motions_in_the_files_are_those_of_the_oracle(name):
    assert len(recorded(name)) == ROWS[name]
    assert motion(name, START) == pytest.approx(recorded(name)[:START], abs=1e-6)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
@pytest.mark.parametrize("name, words", [
    ("straight", {"mass and wheel_inertia only as mass +", "yaw_inertia: not determined"}),
    ("on the spot", {"yaw_inertia and wheel_inertia only as yaw_inertia +", "mass: not determined"}),
])  # fmt: skip
def test_what_a_motion_does_not_show_is_said(name, words, seed):
    fit = fit_of(name, seed)
    assert {next((w for w in words if said.startswith(w)), said) for said in fit.undetermined} == words
    low, high = fit.interval("wheel_viscous", 0.999)  # one of 95 % misses once in 20 logs
    assert low < FRICTION < high and high - low < 0.1 * FRICTION


def test_turning_while_driving_shows_all():
    fit = fit_of("turning while driving", 1)
    assert fit.undetermined == fit.doubts == fit.differenced == ()
    assert (fit.deviations < 0.04 * fit.values).all()


@pytest.mark.long
def test_intervals_hold_the_truth_as_often_as_they_say():
    """Of 400 logs docs/fitting.md has the numbers; here are the first 30."""
    held, errors = study(range(SEVERAL))
    assert (held.sum(axis=0) >= LEAST).all() and held.sum() <= MOST, dict(zip(FREE, held.sum(axis=0), strict=True))
    assert (np.abs(errors.mean(axis=0)) < 3.3 * SEVERAL**-0.5).all()
