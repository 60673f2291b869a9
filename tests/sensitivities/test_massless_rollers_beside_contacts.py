"""Sensitivities of runs in which massless rollers stick on their disks beside contacts that stick on the ground, and
axles: where there are none, and numbers that do nothing. test_friction.py holds CASES to differences of runs."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from omniroll.engine import compiled_variations
from tests.sensitivities.differences import (
    Case,
    derivative,
    differenced,
    motion,
)

FLAT = Contact(law="coulomb", friction=(0.3, 0.25))
HELD = replace(FLAT, static_friction=(0.4, 0.35))
SKID, SKID_HELD = (replace(ground, wheel_rates=(3.0, -2.0, 1.0)) for ground in (FLAT, HELD))
RUBBING = Bearings(roller_coulomb=0.02)
HELD_LONGER = Bearings(roller_coulomb=0.02, roller_break_away=0.03)
ONE_TURNS = Bearings(roller_coulomb=(0.02, 0.025, 0.002), roller_break_away=(0.03, 0.035, 0.002))
RIGID = Bearings(roller_coulomb=(0.2, 0.25, 0.002))
BESIDE_AXLES = replace(HELD_LONGER, wheel_coulomb=0.05, wheel_break_away=0.07)
PULL = TorqueTable((0.0, 0.05), ((0, 0, 0), (0.2, 0.9, -0.6)))
PUSH = TorqueTable((0.0, 0.05), ((0, 0, 0), (0.0, -0.9, 0.9)))
RAMP = TorqueTable((0.0, 0.3), ((0, 0, 0), (0.9, -0.5, 0.4)))
SLOW, STILL = {"nu": (0.2, 0.1, 0.2)}, {"nu": (0.0, 0.0, 0.0)}
NEAR_JOINTS = {"chi": (0.627, -0.2, -0.61)}
SLIPPING = Case("massless", effects=(SKID, RUBBING), duration=0.035)
BREAKING_AWAY = Case("massless", effects=(SKID_HELD, HELD_LONGER), start={"nu": (0.3, 0.1, 0.2)}, duration=0.04)
PUSHED = Case("massless", effects=(HELD, ONE_TURNS, RAMP), start=STILL, duration=0.1)
CASES = {
    "rollers let go and contacts come to rest": (SLIPPING, ("mass", "roller_coulomb[1]")),
    "break-aways with a jump, and a wheel that stands": (
        BREAKING_AWAY, ("mass", "roller_break_away", "friction[1]")
    ),
    "rigid wheels come to rest": (
        Case("massless", effects=(SKID, RIGID), start=SLOW, duration=0.026), ("nu[1]",)
    ),
    "a contact that stands lets go": (
        Case("massless", effects=(HELD, ONE_TURNS, PULL), start=SLOW, duration=0.018),
        ("mass", "static_friction[1]"),
    ),
    "a roller that stands lets go, then its contact": (
        Case("massless", effects=(HELD, ONE_TURNS, PUSH), start=SLOW, duration=0.023),
        ("roller_break_away[1]",),
    ),
    "switches": (
        replace(SLIPPING, effects=(SKID, HELD_LONGER), start=NEAR_JOINTS, duration=0.03), ("mass",)
    ),
    "a roller that turns gives way to one that stands": (
        replace(BREAKING_AWAY, start={"nu": (6.0, 2.0, 5.0), "chi": (0.1, 0.33, 0.1)}, effects=(HELD, HELD_LONGER),
                duration=0.032), ("mass", "chi[1]"),
    ),
    "axles stop and stick": (
        replace(BREAKING_AWAY, effects=(SKID, BESIDE_AXLES), duration=0.0265), ("wheel_coulomb[0]",)
    ),
}  # fmt: skip


def ways(run):
    """How contacts and their rollers change their modes in the rows."""
    of_rollers = run.modes[:, -run.vehicle.wheels :]
    modes = np.where(run.sticks, "s", "m").astype(object) + np.where(of_rollers == 0, "s", "m")
    return {f"{a} {b}" for a, b in zip(modes[:-1].ravel(), modes[1:].ravel(), strict=True) if a != b}


@pytest.mark.long
@pytest.mark.parametrize("name", ["mass", "roller_break_away[0]", "static_friction[1]"])
def test_where_forces_that_hold_are_not_determined_there_are_none(name):
    """The compiled engine does not follow a let-go that the least use of many forces decides: it says so."""
    with pytest.raises(NoDerivativeError) as error:
        PUSHED.run(sensitivities=(name,), accuracy=1e-12)
    assert error.value.wheels and error.value.t > 0


def test_numbers_that_do_nothing():
    """No roller turns, and no contact sticks."""
    firm = Bearings(roller_coulomb=1.0, roller_break_away=2.0)
    case = Case("massless", effects=(SKID_HELD, firm), duration=0.004)
    nothing = ("roller_coulomb", "roller_break_away", "static_friction")
    run = case.run(sensitivities=(*nothing, "mass"), accuracy=1e-10)
    assert not run.modes.any() and not run.sticks.any()
    assert not any(derivative(run, name).any() for name in nothing)
    assert derivative(run, "mass").any()


def test_a_roller_turns_whose_bearing_takes_nothing_while_it_does():
    """Its torque does not tell its mode; the speed along its axle does."""
    loose = Bearings(roller_coulomb=(0.02, 0.0, 0.02), roller_break_away=(0.02, 0.01, 0.02))
    case = Case("massless", effects=(SKID, loose), duration=0.01)
    run = case.run(sensitivities=("mass", "roller_coulomb[1]"), accuracy=1e-12)
    assert "ms mm" in ways(run) and run.contact_spin[-1, 1]
    assert derivative(run, "mass") == pytest.approx(differenced(case, "mass", 1e-4, accuracy=1e-12), rel=1e-7, abs=1e-9)
    by, change = derivative(run, "roller_coulomb[1]"), 1e-6  # it has none below
    more = motion(case.changed("roller_coulomb[1]", change).run(accuracy=1e-12))
    assert np.abs((more - motion(run)) / change - by).max() <= 1e-3 * np.abs(by).max()


def test_a_roller_that_stops_where_its_contact_slips_leaves_its_bound():
    """With one torque it begins to stick by all its friction, and is asked for less from then on."""
    effects = (HELD, replace(ONE_TURNS, roller_break_away=None), PUSH)
    case = Case("massless", effects=effects, start=SLOW, duration=0.0112)
    run = case.run(sensitivities=("mass",), accuracy=1e-12)
    assert {"sm ss", "ss sm", "mm ms"} <= ways(run)
    wanted = differenced(case, "mass", 1e-4, accuracy=1e-12)
    assert np.abs(derivative(run, "mass") - wanted).max() <= 1e-7 * np.abs(wanted).max()


def test_a_roller_that_only_just_stops_has_none(monkeypatch):
    """Every spin is said to fall slowly: C does not pass it."""
    case = Case("massless", effects=(HELD, ONE_TURNS, PUSH), start=SLOW, duration=0.0112)
    run = case.run(sensitivities=("mass",), accuracy=1e-9)
    assert "mm ms" in ways(run) and derivative(run, "mass").any()
    monkeypatch.setattr(compiled_variations, "GRAZES", 1e9)
    with pytest.raises(NoDerivativeError, match="only just") as error:
        case.run(sensitivities=("mass",), accuracy=1e-9)
    assert error.value.wheels == (1,) and 0 < error.value.t < 0.0112


def test_a_contact_that_begins_to_slip_from_rest_has_none_by_a_speed():
    pushed = replace(PUSHED, effects=(FLAT, RIGID, omniroll.Torque((3.0, 0.0, 0.0))), duration=0.001)
    run = pushed.run(sensitivities=("mass",), accuracy=1e-9)
    assert not run.sticks[0].all() and derivative(run, "mass").any()
    with pytest.raises(NoDerivativeError, match="begins to slip from rest") as error:
        pushed.run(sensitivities=("nu[0]",), accuracy=1e-9)
    assert error.value.t == 0


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    run = Case("massless", effects=(SKID, Bearings(roller_coulomb=1.0)), duration=0.001).run(accuracy=1e-9)
    asked = np.abs(run.drive[0, run.effects.drives().index("contact_bearing")])
    at_bound = Bearings(roller_coulomb=asked.min() / 2, roller_break_away=(asked + 1e-9 * asked).tolist())
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        Case("massless", effects=(SKID, at_bound), duration=0.001).run(sensitivities=("mass",), accuracy=1e-9)
    assert error.value.wheels == (0, 1, 2) and error.value.t == 0
