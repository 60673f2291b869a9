"""What `accuracy` means: the error stays below ten times the request, down to eps times the measured sensitivity."""

import warnings

import numpy as np
import pytest
from oracle import references
from oracle.bridge import error, simulated

import omniroll

EPS = np.finfo(float).eps
PAPER = omniroll.Vehicle.paper()


def floats(values):
    return np.array(values, float)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9, 1e-12, 1e-14])
def test_the_error_is_below_ten_times_the_request_or_the_floor(accuracy):
    for case in references.load():
        options = case["start"] | {"duration": case["duration"], "accuracy": accuracy}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", omniroll.AccuracyWarning)
            run = simulated(case["vehicle"], model=case["model"], law=case["law"], **options)
        wanted = floats(case["end"]["pose"]), floats(case["end"]["nu"])
        found = error(case["vehicle"], case["start"]["nu"], run.pose[-1], run.nu[-1], *wanted)
        assert found <= 10 * max(accuracy, EPS * run.stats["sensitivity"])
        assert run.stats["error_estimate"] >= EPS * run.stats["sensitivity"]


def sensitivity(nu, duration, **options):
    return omniroll.simulate(PAPER, nu=nu, duration=duration, **options).stats["sensitivity"]


@pytest.mark.long
@pytest.mark.parametrize("engine", ["compiled", "python"])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-9])
def test_the_sensitivity_belongs_to_the_motion(engine, accuracy):
    options = {"roller_model": "locked", "switching": "smooth", "duration": 10, "nu": (1, 0, 1)}
    fine = sensitivity(**options, accuracy=1e-12)
    assert sensitivity(**options, engine=engine, accuracy=accuracy) == pytest.approx(fine, rel=0.02)


def test_an_unstable_run_says_so():
    """Straight ahead, wheels 2 and 3 switch together; any disturbance takes that apart, and the vehicle turns."""
    stable = sensitivity((1, 0, 1), 20, roller_model="locked")
    unstable = sensitivity((1, 0, 0), 20, roller_model="locked")
    assert stable < 100 < 1e4 < unstable


def test_without_control_nothing_is_claimed():
    run = omniroll.simulate(PAPER, nu=(1, 0, 1), duration=1, control=False)
    assert run.stats["sensitivity"] is None and run.stats["error_estimate"] is None
