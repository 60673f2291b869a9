"""Sensitivities of runs in which massless rollers stick on their disks and break away, and loads follow the motion,
against differences of runs in 40 digits, which find these events and the loads by themselves
(hard.true_loaded_massless)."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import Case, assert_the_same_backwards_and_in_sessions, derivative, differenced
from tests.sensitivities.test_loads_that_follow import STARTING, TALL
from tests.sensitivities.test_massless_rollers import BESIDE_AXLES, HELD_LONGER, RAMP, REGULARISED, STILL, changes
from tests.sensitivities.test_true_events import true

LOW = {"loads": "dynamic", "height": 0.05}
SMOOTH = {"viscous": {"coefficient": 5.0}, "regularised": REGULARISED}
LIFT = TorqueTable((0.0, 0.2, 0.4), ((0, 0, 0, 0), (0, 0.5, 0, -0.5), (0, 0, 0, 0)))
SOFT = Bearings(roller_coulomb=0.005, roller_break_away=0.006)
# When the last roller lets go, the first one is asked for 0.00837 N m in place of 0.00822.
TAKEN_ALONG = Case(
    "massless", start=STILL, duration=0.12,
    effects=(
        Contact(**REGULARISED, loads="dynamic", height=0.14),
        Bearings(roller_coulomb=0.001, roller_break_away=(0.0083, 1.0, 0.01)), RAMP,
    ),
)  # fmt: skip


def breaking_away(law, bearings=HELD_LONGER):
    return Case("massless", effects=(Contact(**SMOOTH[law], **LOW), bearings, RAMP), start=STILL, duration=0.3)


def lifted(law):
    """Four wheels that are pushed until one is off the ground, and comes back."""
    own = {"coefficient": 5.0, "height": 0.2} if law == "viscous" else REGULARISED | {"friction": 0.5, "height": 0.25}
    effects = (Contact(**own, loads="dynamic"), SOFT, LIFT)
    return Case("massless", vehicle=TALL, effects=effects, start=STARTING, duration=0.5)


def assert_as_in_40_digits(case, names):
    run = case.run(sensitivities=names, accuracy=1e-13)
    for name in names:
        wanted, log = true(case, name)
        assert log
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-9 * np.abs(wanted).max()
    return run


@pytest.mark.parametrize("law, names", [
    ("viscous", ("roller_break_away",)),
    ("regularised", ("height",)),
    pytest.param("viscous", ("mass", "roller_coulomb"), marks=pytest.mark.long),
    pytest.param("regularised", ("mass", "roller_break_away", "roller_coulomb"), marks=pytest.mark.long),
])  # fmt: skip
def test_they_are_the_differences_of_runs_in_40_digits(law, names):
    run = assert_as_in_40_digits(breaking_away(law), names)
    assert (0, 1) in changes(run) and len(run.switches)


def test_beside_viscous_friction_they_are():
    case = breaking_away("viscous", replace(HELD_LONGER, roller_viscous=2e-5))
    run = assert_as_in_40_digits(case, ("roller_viscous",))
    assert (0, 1) in changes(run) and len(run.switches)


@pytest.mark.long
def test_beside_viscous_friction_that_goes_with_loads_they_are():
    case = replace(breaking_away("regularised", replace(HELD_LONGER, roller_viscous=2e-4)), duration=0.05)
    assert (0, 1) in changes(assert_as_in_40_digits(case, ("roller_viscous",)))


@pytest.mark.long
@pytest.mark.parametrize("law", SMOOTH)
def test_where_loads_vanish_and_come_back_they_are(law):
    run = assert_as_in_40_digits(lifted(law), ("mass", "height", "roller_coulomb"))
    assert (0, 1) in changes(run) and (1, 0) in changes(run)
    assert (run.ground_load.min(axis=0) < 1e-9).any()


@pytest.mark.long
@pytest.mark.parametrize("name", ["mass", "height", "roller_break_away", "wheel_break_away", "torque[1][0]"])
def test_beside_axles_that_stick_they_are_differences_of_runs(name):
    case = breaking_away("regularised", BESIDE_AXLES)
    run = case.run(sensitivities=(name,), accuracy=1e-12)
    assert {(0, 1)} <= changes(run) and (np.diff(Motion(run).axles.modes, axis=0) != 0).any()
    wanted = differenced(case, name, 1e-5 if "break_away" in name else 1e-4, accuracy=1e-12)
    assert np.abs(derivative(run, name) - wanted).max() <= 1e-9 * np.abs(wanted).max()


def test_a_drive_that_jumps_takes_rollers_along_through_loads():
    """The torques move the loads at once, and with these what the ground asks of rollers: one lets go then. When they
    come moves that."""
    push = TorqueTable((0.0, 0.1), ((0.1, -0.05, 0.02), (-0.3, 0.4, 0.2)), interpolation="hold")
    held = Bearings(roller_coulomb=0.012, roller_break_away=(1.0, 1.0, 0.0246))  # asked for 0.0197 and 0.0295 N m
    ground, names = Contact(**REGULARISED, loads="dynamic", height=0.1), ("times[1]", "mass")
    case = Case("massless", effects=(ground, held, push), start=STILL, duration=0.12)
    run = case.run(sensitivities=names, accuracy=1e-11)
    row = np.flatnonzero((np.diff(Motion(run).massless.modes, axis=0) != 0).any(axis=1))[0]
    assert run.t[row] == run.t[row + 1] == 0.1
    for name in names:
        wanted = differenced(case, name, 1e-4, accuracy=1e-11)
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-6 * np.abs(wanted).max()


def test_a_roller_that_lets_go_takes_another_along_through_loads():
    """They go at the time of the one that has come to its bound by itself: a little more does not keep the other."""
    names = ("mass", "roller_break_away[0]", "roller_break_away[2]", "height")
    run = TAKEN_ALONG.run(sensitivities=names, accuracy=1e-11)
    modes = Motion(run).massless.modes
    row = np.flatnonzero((modes[:-1] != modes[1:]).any(axis=1))[0]
    assert (modes[row] == 0).all() and (modes[row + 1] != 0).tolist() == [True, False, True]
    for name in names[:1] + names[2:]:
        wanted = differenced(TAKEN_ALONG, name, 1e-6 if "break_away" in name else 1e-4, accuracy=1e-11)
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-6 * np.abs(wanted).max()
    assert not derivative(run, names[1]).any()


@pytest.mark.parametrize("law", SMOOTH)
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same(law):
    assert_the_same_backwards_and_in_sessions(breaking_away(law))


def test_numbers_that_do_nothing_have_none():
    """While all rollers stick none of their torques moves anything; under `viscous` no load moves a force."""
    held = Bearings(roller_coulomb=1.0, roller_break_away=2.0)
    names = ("roller_coulomb", "roller_break_away", "mass")
    run = replace(breaking_away("regularised", held), duration=0.1).run(sensitivities=names, accuracy=1e-11)
    assert not Motion(run).massless.modes.any()
    assert [derivative(run, name).any() for name in names] == [False, False, True]
    run = breaking_away("viscous").run(sensitivities=("height", "mass"), accuracy=1e-11)
    assert not derivative(run, "height").any() and derivative(run, "mass").any()


def test_without_height_they_are_those_of_loads_at_rest():
    """Where the centre of mass is on the ground and nothing turns about the axles, no force moves a load."""
    names = ("mass", "roller_break_away", "friction", "speed")
    flat = {"loads": "dynamic", "height": 1e-100, "spin_inertia": 1e-100}
    grounds = (Contact(**REGULARISED, **loads) for loads in ({}, flat))
    still, flat = (
        Case("massless", effects=(own, HELD_LONGER, RAMP), start=STILL, duration=0.3).run(
            sensitivities=names, accuracy=1e-12
        )
        for own in grounds
    )
    for name in names:
        expected = derivative(still, name)
        assert np.abs(derivative(flat, name) - expected).max() <= 1e-9 * np.abs(expected).max()


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    ground = Contact(**REGULARISED, loads="dynamic", height=0.1)
    at_bound = {"start": {"nu": (1.0, 0.3, 0.8)}, "duration": 0.01}
    run = Case("massless", effects=(ground, Bearings(roller_coulomb=1.0)), **at_bound).run(accuracy=1e-11)
    asked = np.abs(run.drive[0, run.effects.drives().index("contact_bearing")])
    held = Bearings(roller_coulomb=asked.min() / 2, roller_break_away=(asked + 1e-9 * asked).tolist())
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        Case("massless", effects=(ground, held), **at_bound).run(sensitivities=("mass",), accuracy=1e-11)
    assert error.value.wheels == (0, 1, 2) and error.value.t == 0


def test_rollers_that_let_go_together_have_none_by_what_parts_them():
    """Along the axle of the first wheel the other two are alike. The mass keeps them so, and a speed of turning does
    not."""
    push = TorqueTable((0.0, 0.3), ((0.0, 0.0, 0.0), (0.0, 0.5, -0.5)))
    held = Bearings(roller_coulomb=0.001, roller_break_away=(1.0, 0.002, 0.002))
    start = {"nu": (0.0, 0.0, 0.0), "chi": (0.0,) * 3, "pose": (0.0, 0.0, 0.0)}
    case = Case("massless", effects=(Contact(**REGULARISED, **LOW), held, push), start=start, duration=0.05)
    run = case.run(sensitivities=("mass",), accuracy=1e-11)
    modes = Motion(run).massless.modes
    row = np.flatnonzero((modes[:-1] != modes[1:]).any(axis=1))[0]
    assert (modes[row] != modes[row + 1]).sum() == 2
    wanted = differenced(case, "mass", 1e-3, accuracy=1e-11)
    assert np.abs(derivative(run, "mass") - wanted).max() <= 1e-6 * np.abs(wanted).max()
    with pytest.raises(NoDerivativeError, match="together, and apart") as error:
        case.run(sensitivities=("nu[2]",), accuracy=1e-11)
    assert error.value.t == run.t[row] and set(error.value.wheels) == set(np.flatnonzero(modes[row + 1]))
