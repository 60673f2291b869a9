"""Sensitivities of runs in which massless rollers stick on their disks and break away, and wheels slip, against
differences of runs in 40 digits, which find those events by themselves (hard.true_massless)."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import Case, assert_the_same_backwards_and_in_sessions, derivative, differenced
from tests.sensitivities.test_true_events import true

REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
RUBBING = Bearings(roller_coulomb=0.01)
HELD_LONGER = Bearings(roller_coulomb=0.001, roller_break_away=0.002)
BESIDE_AXLES = replace(HELD_LONGER, wheel_coulomb=0.02, wheel_break_away=0.03)
RAMP = TorqueTable((0.0, 0.3), ((0, 0, 0), (0.3, -0.1, 0.2)))
STILL = {"nu": (0.0, 0.0, 0.0)}
STOPPING = Case("massless", effects=(Contact(5.0), RUBBING), duration=0.6)
BREAKING_AWAY = Case("massless", effects=(Contact(5.0), HELD_LONGER, RAMP), start=STILL, duration=0.3)
STOPPING_SOONER = replace(STOPPING, effects=(Contact(5.0), replace(RUBBING, roller_viscous=2e-4)))
BRAKED = replace(BREAKING_AWAY, effects=(Contact(5.0), replace(HELD_LONGER, roller_viscous=2e-5), RAMP))
ON_REGULARISED = replace(BREAKING_AWAY, effects=(Contact(**REGULARISED), HELD_LONGER, RAMP))
BRAKED_ON_REGULARISED = replace(BRAKED, effects=(Contact(**REGULARISED), *BRAKED.effects[1:]))
CASES = {
    "stops and a switch": (STOPPING, ("mass", "roller_coulomb", "nu[0]", "wheel_radius"), {(1, 0)}),
    "break-aways and switches": (
        BREAKING_AWAY, ("mass", "roller_break_away", "roller_coulomb"), {(0, 1), (1, 0)}
    ),
    "regularised": (ON_REGULARISED, ("roller_break_away",), {(0, 1)}),
    "braked": (STOPPING_SOONER, ("roller_viscous", "mass"), {(1, 0)}),
    "braked break-aways": (BRAKED, ("roller_viscous", "roller_break_away"), {(0, 1)}),
    "braked on regularised": (BRAKED_ON_REGULARISED, ("roller_viscous",), {(0, 1)}),
}  # fmt: skip


def changes(run):
    """How rollers in contact change their modes in the rows: (before, after)."""
    modes = Motion(run).massless.modes
    return {(abs(int(a)), abs(int(b))) for a, b in zip(modes[:-1].ravel(), modes[1:].ravel(), strict=True) if a != b}


@pytest.mark.parametrize("case, names, seen", CASES.values(), ids=CASES)
def test_they_are_the_differences_of_runs_in_40_digits(case, names, seen):
    run = case.run(sensitivities=names, accuracy=1e-13)
    assert seen <= changes(run) and len(run.switches)
    for name in names:
        wanted, log = true(case, name)
        assert log
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.long
@pytest.mark.parametrize("name", ["mass", "roller_break_away", "wheel_break_away", "speed"])
def test_beside_axles_that_stick_they_are_differences_of_runs(name):
    case = replace(BREAKING_AWAY, effects=(Contact(**REGULARISED), BESIDE_AXLES, RAMP))
    run = case.run(sensitivities=(name,), accuracy=1e-12)
    assert {(0, 1)} <= changes(run) and (np.diff(Motion(run).axles.modes, axis=0) != 0).any()
    wanted = differenced(case, name, 1e-5 if "break_away" in name else 1e-4, accuracy=1e-12)
    assert np.abs(derivative(run, name) - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.parametrize("name", ["friction[0]", "speed"])
def test_by_numbers_of_the_ground_they_are_differences_of_runs(name):
    run = BRAKED_ON_REGULARISED.run(sensitivities=(name,), accuracy=1e-12)
    assert {(0, 1)} <= changes(run)
    wanted = differenced(BRAKED_ON_REGULARISED, name, 1e-4, accuracy=1e-12)
    assert np.abs(derivative(run, name) - wanted).max() <= 1e-8 * np.abs(wanted).max()


@pytest.mark.long
@pytest.mark.parametrize("case", [STOPPING, BREAKING_AWAY, BRAKED, BRAKED_ON_REGULARISED],
                         ids=["stops", "break-aways", "viscous", "viscous on regularised"])  # fmt: skip
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same(case):
    assert_the_same_backwards_and_in_sessions(case)


def test_numbers_that_do_nothing_while_all_rollers_stick():
    case = Case("massless", effects=(Contact(5.0), Bearings(roller_coulomb=1.0, roller_break_away=2.0)), duration=0.1)
    run = case.run(sensitivities=("roller_coulomb", "roller_break_away", "mass"))
    assert not Motion(run).massless.modes.any()
    assert not any(derivative(run, name).any() for name in ("roller_coulomb", "roller_break_away"))
    assert derivative(run, "mass").any()


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    run = Case("massless", effects=(Contact(5.0), Bearings(roller_coulomb=1.0)), duration=0.01).run()
    asked = np.abs(run.drive[0, run.effects.drives().index("contact_bearing")])
    at_bound = Bearings(roller_coulomb=asked.min() / 2, roller_break_away=(asked + 1e-9 * asked).tolist())
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        Case("massless", effects=(Contact(5.0), at_bound), duration=0.01).run(sensitivities=("mass",))
    assert error.value.wheels == (0, 1, 2) and error.value.t == 0
