"""Sensitivities of runs in which free rollers come to rest on their disks, stick there and break away."""

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, InvalidValueError, NoDerivativeError, Torque, TorqueTable
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import Case, derivative
from tests.sensitivities.test_runs import check
from tests.sensitivities.test_sticking import AT_REST, RAMP

RUBBING = Bearings(roller_coulomb=2e-5)
HELD_LONGER = Bearings(roller_coulomb=2e-5, roller_break_away=4e-5)
AXLES, ROLLERS = {"wheel_coulomb": 1e-3}, {"roller_coulomb": 2e-3, "roller_break_away": 4e-3}
NUMBERS = {"nu[0]": 1e-4, "chi[1]": 1e-4, "spins[1][2]": 1e-3, "mass": 1e-3, "roller_coulomb": 1e-8}
OF_VEHICLE = {"roller_inertia": 1e-9, "roller_axis_radius": 1e-6, "wheel_angles[1]": 1e-5, "yaw_scale": 1e-4}
STILL = AT_REST | {"spins": 0.0}
BACK_AND_FORTH = TorqueTable((0, 0.5, 1), ((0, 0, 0), (0.3, 0.2, 0.3), (-0.1, 0.05, -0.2)))
PUSHED = {"mass": 1e-3, "torque[1][0]": 5e-6, "times[1]": 1e-5, "roller_coulomb": 4e-8, "roller_break_away": 4e-8}


def free_rollers(run):
    """(T, N, n-1) their modes."""
    bearings = Motion(run).bearings
    return bearings.split(bearings.modes)[1][..., 1:]


def turns(run):
    """How many times free rollers go from one mode to another (before, after), where no wheel switches."""
    motion = Motion(run)
    of_steps, first = free_rollers(run)[run.step_rows], run.step_rows
    together = np.array([not motion.directions[a + 1 : b + 1].any() for a, b in zip(first, first[1:], strict=False)])
    before, after = of_steps[:-1][together], of_steps[1:][together]
    return {(a, b): int(((before == a) & (after == b)).sum()) for a in (-1, 0, 1) for b in (-1, 0, 1) if a != b}


@pytest.mark.long
@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_rollers_come_to_rest_on_their_disks(law):
    """Under `impact` each switch sets all that stuck spinning again; one that sticks comes into contact and spins."""
    case = Case("free", law, effects=(RUBBING,), duration=3.0)
    check(case, NUMBERS | OF_VEHICLE, switches=9)
    found, run = turns(case.run()), case.run(sensitivities=("nu[0]",))
    assert found[-1, 0] + found[1, 0] >= (60 if law == "impact" else 8)
    stuck = free_rollers(run)[-1] == 0
    assert stuck.any() and not run.sensitivity("nu[0]").spins[-1][stuck].any()


@pytest.mark.long
@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_rollers_break_away_from_their_disks_and_pass_rest(law):
    """The disk turns faster and faster; above the sliding torque the rates jump where a roller breaks away."""
    case = Case("free", law, effects=(BACK_AND_FORTH, HELD_LONGER), start=STILL, duration=0.6)
    check(case, PUSHED, switches=10)
    found = turns(case.run())
    assert found[0, 1] + found[0, -1] >= 8 and found[1, -1] + found[-1, 1] >= 2


@pytest.mark.long
def test_axles_rollers_in_contact_and_free_ones_stick_together():
    case = Case("free", effects=(RAMP, Bearings(**AXLES, **ROLLERS)), start=STILL, duration=2.5)
    changes = {"mass": 1e-3, "torque[1][0]": 5e-6, "wheel_coulomb[2]": 1e-7, "roller_coulomb": 2e-7,
               "roller_break_away": 2e-7, "wheel_radius": 1e-6, "roller_axis_radius": 1e-6}  # fmt: skip
    check(case, changes)
    sets = Motion(case.run()).held.sets
    found = turns(case.run())
    assert {3, 6} <= set(sets.sum(axis=1)) and min(found[1, 0], found[-1, 0]) >= 20


@pytest.mark.long
def test_at_the_end_everything_rests():
    case = Case("free", effects=(Bearings(roller_coulomb=2e-5, wheel_coulomb=2e-3),), duration=12.0)
    check(case, {"nu[0]": 1e-4, "mass": 1e-3, "wheel_coulomb": 1e-7, "roller_axis_radius": 1e-6}, switches=10)
    end = case.run(sensitivities=("nu[0]",)).sensitivity("nu[0]")
    assert not end.spins[-1].any() and np.abs(end.nu[-1]).max() < 1e-12 and np.abs(end.pose[-1]).max() > 1
    reason = r"what sticks together would leave other directions; by wheel_angles\[1\]"
    with pytest.raises(NoDerivativeError, match=reason):  # two axles hold the third wheel's roller: in this shape alone
        case.run(sensitivities=("wheel_angles[1]",))


@pytest.mark.long
def test_between_rows_and_backwards_they_are_the_same():
    case, names = Case("free", effects=(Torque((0.02, 0.01, -0.01)), RUBBING)), tuple(NUMBERS)
    check(case, {"nu[0]": 1e-4, "mass": 1e-3, "roller_coulomb": 1e-8}, t=0.637)
    run, weights, times = case.run(sensitivities=names), np.array([[1.0, 2, 3], [0.5, -1, 2]]), np.array([0.33, 0.9])
    found = omniroll.gradient(run, names, times, pose=weights)
    for name in names:
        forwards = (weights * run.sensitivity(name, times).pose).sum()
        assert found[name] == pytest.approx(forwards, rel=1e-11)


@pytest.mark.long
def test_a_spin_that_friction_takes_at_once_does_nothing():
    """At rest on its disk a little spin is gone before anything has moved by more than its square."""
    case = Case(
        "free", effects=(Torque((0.0, 0.0, 0.0)), Bearings(roller_coulomb=2e-5, wheel_coulomb=0.01)), start=STILL
    )
    run = case.run(sensitivities=("spins[1][2]", "nu[0]"))
    assert not derivative(run, "spins[1][2]").any() and not derivative(run, "nu[0]").any()


def test_linear_models_of_them_are_still_refused():
    with pytest.raises(InvalidValueError, match="stick"):
        omniroll.linearise(omniroll.Vehicle.paper(), nu=(1, 0, 0), roller_model="free", effects=[RUBBING])
