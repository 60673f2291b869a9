"""Slip of a log fits friction of the ground: logs of a model that is not this simulator's."""

import numpy as np
import pytest

import omniroll
from identification.coverage_of_slip import NUMBER, VEHICLE, acting, fit_of, names, truth
from identification.ground_motion import STEP, TRUTHS, motion

ROWS = 201  # 2 s


@pytest.mark.parametrize("law", NUMBER)
def test_two_models_of_slip_move_alike(law):
    """Lagrange's function by hand beside the derived equations."""
    rates, pose = motion(law, ROWS)
    own = TRUTHS[law]
    options = {"duration": (ROWS - 1) * STEP, "effects": acting(law, own.wheel_viscous, own.ground)}
    run = omniroll.simulate(VEHICLE, nu=(0, 0, 0), accuracy=1e-10, **options)
    times = np.minimum(STEP * np.arange(ROWS), run.t[-1])
    assert np.abs(run.measure(times, names=["wheel_rate"])["wheel_rate"] - rates).max() < 1e-8 * np.abs(rates).max()
    assert np.abs(run.sample(times).pose - pose).max() < 1e-8
    assert len(run.switches) > 50 and np.abs(run.slip).max() > 1.0


@pytest.mark.parametrize("law", ["coulomb", pytest.param("viscous", marks=pytest.mark.long)])
def test_the_ground_is_found_from_poses_beside_encoders(law):
    fit = fit_of(law, 1, ROWS)
    assert fit.differenced == fit.undetermined == fit.doubts == ()
    assert (np.abs(fit.values - truth(law)) < 4 * fit.deviations).all(), dict(zip(names(law), fit.values, strict=True))
    assert (fit.deviations < 0.05 * fit.values).all()
