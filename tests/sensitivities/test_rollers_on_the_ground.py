"""Sensitivities of runs in which rollers come to rest on their disks, stick and break away beside wheels that may slip:
where there are none, and numbers that do nothing. test_friction.py holds CASES to differences of runs."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from tests.sensitivities.differences import (
    SPINS,
    VEHICLE,
    Case,
    derivative,
    differenced,
)

REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
FREE = {"nu": (0.0, 0.0, 0.0), "spins": np.zeros_like(SPINS).tolist()}
RAMP = TorqueTable((0.0, 0.3), ((0.0, 0.0, 0.0), (0.3, -0.1, 0.2)))
RUBBING, HARD = Bearings(roller_coulomb=2e-5), Bearings(roller_coulomb=0.003)
HELD_LONGER = Bearings(roller_coulomb=0.003, roller_break_away=0.004)
STOPPING = Case("free", effects=(Contact(5.0), RUBBING), duration=0.02)
BREAKING_AWAY = Case("free", effects=(Contact(20.0), HELD_LONGER, RAMP), start=FREE, duration=0.1)
BESIDE_AXLES = Bearings(roller_coulomb=0.001, wheel_coulomb=0.05)
AT_A_JOINT = {"chi": (0.61, -0.2, -0.61)}
CASES = {
    "stops": (STOPPING, ("nu[2]", "roller_coulomb[1]", "roller_inertia")),
    "a switch": (replace(STOPPING, start=AT_A_JOINT), ("mass",)),
    "a roller that enters sticking, and lets go": (
        Case("free", effects=(Contact(20.0), HELD_LONGER), start=AT_A_JOINT | {"spins": FREE["spins"]}, duration=0.015),
        ("mass",),
    ),
    "break-aways": (BREAKING_AWAY, ("roller_break_away",)),
    "break-aways without a jump": (replace(BREAKING_AWAY, effects=(Contact(20.0), HARD, RAMP)), ("roller_coulomb",)),
    "with axles": (
        Case("free", effects=(Contact(**REGULARISED), BESIDE_AXLES), duration=0.03),
        ("wheel_coulomb[0]", "roller_coulomb"),
    ),
}  # fmt: skip


def test_numbers_that_do_nothing_while_all_rollers_stick():
    """A spin of the start is taken away at once; the platform feels what it had."""
    names = ("roller_coulomb", "roller_break_away", "spins[1][2]", "nu[0]")
    effects = Contact(5.0, contact_spins=0.0), Bearings(roller_coulomb=1.0, roller_break_away=2.0)
    case = Case("free", effects=effects, start={"spins": np.zeros_like(SPINS).tolist()}, duration=0.1)
    run = case.run(sensitivities=names)
    assert not run.modes.any()
    assert not any(derivative(run, name).any() for name in names[:2])
    assert np.abs(run.sensitivity("spins[1][2]").spins).max() <= 1e-15
    assert run.sensitivity("spins[1][2]").nu[0, 2] != 0
    assert np.abs(run.sensitivity("nu[0]").spins).max() <= 1e-13


def sliding(holding, duration, **options):
    """A vehicle with blocked wheels that slides downhill, whose speed tends to a limit, with what rollers hold."""
    bearings = Bearings(roller_coulomb=holding / 2, roller_break_away=holding, wheel_coulomb=100.0)
    effects = Contact(20.0), bearings, omniroll.Slope(0.2, 0.3)
    return Case("free", effects=effects, start=FREE, duration=duration).run(**options)


@pytest.mark.long
def test_a_roller_that_is_asked_for_ever_so_slowly_more_than_it_takes_has_none():
    """What holds it rises as 1 - exp(-t/T), with T = M/(3 c)."""
    time = VEHICLE.mass / 60
    run = sliding(100.0, 40 * time)
    most = abs(run.drive[-1, run.effects.drives().index("contact_bearing")])
    earlier = sliding(most.max() * (1 - 1e-4), 40 * time, sensitivities=("mass",))
    assert np.isfinite(earlier.sensitivity("mass").nu).all()
    with pytest.raises(NoDerivativeError, match="only just") as error:
        sliding(most.max() * (1 - 1e-8), 40 * time, sensitivities=("mass",))
    assert error.value.wheels == (int(most.argmax()),)
    assert error.value.t == pytest.approx(-np.log(1e-8) * time, rel=1e-4)


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    """What holds the rollers of a vehicle that slides along one axle, at its start, is all that they can take."""
    ground = Contact(20.0, wheel_rates=0.0, contact_spins=0.0)
    case = Case("free", effects=(ground, Bearings(roller_coulomb=1.0)), start=FREE | {"nu": (1.0, 0.3, 0.0)})
    run = case.run()
    asked = abs(run.drive[0, run.effects.drives().index("contact_bearing")])
    at_bound = replace(case, effects=(ground, Bearings(roller_coulomb=asked.max())))
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        at_bound.run(sensitivities=("mass",))
    assert error.value.wheels == (int(asked.argmax()),) and error.value.t == 0


def test_a_roller_that_begins_to_turn_from_rest_has_one_by_all_but_its_own_spin():
    """The ground takes rollers along that rest at the start; an angle of a wheel moves what their disks have."""
    ground = Contact(20.0, contact_spins=0.0)
    case = Case("free", effects=(ground, HELD_LONGER), start={"spins": FREE["spins"]}, duration=0.004)
    run = case.run(sensitivities=("chi[0]",), accuracy=1e-13)
    assert run.modes[0, :: run.vehicle.rollers_per_wheel].all()
    wanted = differenced(case, "chi[0]", 1e-4, accuracy=1e-13)
    assert np.abs(derivative(run, "chi[0]") - wanted).max() <= 1e-9 * np.abs(wanted).max()
    with pytest.raises(NoDerivativeError, match="begins to turn from rest") as error:
        case.run(sensitivities=("contact_spins[1]",))
    assert error.value.wheels == (1,) and error.value.t == 0
