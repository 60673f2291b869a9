"""Sensitivities of runs in which contacts, axles and rollers come to rest, stick and let go, of every kind of friction,
against differences of runs: of this engine's, or in 40 digits by models that find each event by themselves (hard)."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact
from tests.sensitivities import test_axles_on_the_ground as axles
from tests.sensitivities import test_bearings_beside_contacts as bearings
from tests.sensitivities import test_massless_rollers as massless
from tests.sensitivities import test_massless_rollers_beside_contacts as series
from tests.sensitivities import test_rollers_on_the_ground as rollers
from tests.sensitivities import test_standing_wheels as standing
from tests.sensitivities.differences import assert_the_same_backwards_and_in_sessions, derivative, differenced
from tests.sensitivities.test_true_events import true

ALL_STICK = replace(massless.BREAKING_AWAY, effects=(
    Contact(**massless.REGULARISED), Bearings(roller_coulomb=0.001, roller_break_away=0.002, wheel_coulomb=0.02,
                                              wheel_break_away=0.03), massless.RAMP))  # fmt: skip
BY_DIFFERENCES = {
    **{f"massless, {name}": found for name, found in massless.CASES.items()},
    **{f"massless beside contacts, {name}": found for name, found in series.CASES.items()},
    **{f"free rollers, {name}": found for name, found in rollers.CASES.items()},
    "massless beside axles, regularised": (ALL_STICK, ("wheel_break_away", "speed")),
}
IN_40_DIGITS = {
    **{f"axles, {name}": found for name, found in axles.CASES.items()},
    **{f"axles beside contacts, {name}": found for name, found in standing.CASES.items()},
    "rollers beside contacts, stop": bearings.CASES["stops"],
    "rollers beside contacts, break away": bearings.CASES["break-aways"],
}
BACKWARDS = {
    "massless": massless.BREAKING_AWAY, "massless beside contacts": series.SLIPPING, "free": rollers.BREAKING_AWAY,
    "rollers beside contacts": bearings.STOPPING,
}  # fmt: skip


def followed(case, names, accuracy):
    run = case.run(sensitivities=names, accuracy=accuracy)
    assert run.stats["phases"] > max(1, len(run.switches))  # else nothing has happened; modes may change at a switch
    return run


@pytest.mark.long
@pytest.mark.parametrize("case, names", BY_DIFFERENCES.values(), ids=BY_DIFFERENCES)
def test_they_are_differences_of_runs(case, names):
    run = followed(case, names[:2], 1e-13)
    for name in names[:2]:
        wanted = differenced(case, name, 3e-4 * size_of(case, name), accuracy=1e-13)
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-8 * np.abs(wanted).max(), name


def size_of(case, name):
    """The size of a number, so that its change makes no other events."""
    number = name.split("[")[0]
    holders = [case.start, *(vars(one) for one in (*case.effects, case.vehicle) if hasattr(one, "__dict__"))]
    value = next((holder[number] for holder in holders if holder.get(number) is not None), 1.0)
    return min(1.0, np.abs(value).max())


@pytest.mark.long
@pytest.mark.parametrize("case, names", IN_40_DIGITS.values(), ids=IN_40_DIGITS)
def test_they_are_differences_of_runs_in_40_digits(case, names):
    run = followed(case, names[:1], 1e-13)
    wanted, log = true(case, names[0])
    assert log and np.abs(derivative(run, names[0]) - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.long
@pytest.mark.parametrize("case", BACKWARDS.values(), ids=BACKWARDS)
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same(case):
    assert_the_same_backwards_and_in_sessions(case)
