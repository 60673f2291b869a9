"""Sensitivities of runs in which massless rollers stick on their disks and break away, and wheels slip: where there are
none, and numbers that do nothing. test_friction.py holds CASES to differences of runs."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from tests.sensitivities.differences import Case, derivative

REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
RUBBING = Bearings(roller_coulomb=0.01)
HELD_LONGER = Bearings(roller_coulomb=0.001, roller_break_away=0.002)
RAMP = TorqueTable((0.0, 0.3), ((0, 0, 0), (0.3, -0.1, 0.2)))
STILL = {"nu": (0.0, 0.0, 0.0)}
STOPPING = Case("massless", effects=(Contact(5.0), RUBBING), duration=0.6)
BREAKING_AWAY = Case("massless", effects=(Contact(5.0), HELD_LONGER, RAMP), start=STILL, duration=0.3)
STOPPING_SOONER = replace(STOPPING, effects=(Contact(5.0), replace(RUBBING, roller_viscous=2e-4)))
BRAKED = replace(BREAKING_AWAY, effects=(Contact(5.0), replace(HELD_LONGER, roller_viscous=2e-5), RAMP))
ON_REGULARISED = replace(BREAKING_AWAY, effects=(Contact(**REGULARISED), HELD_LONGER, RAMP))
BRAKED_ON_REGULARISED = replace(BRAKED, effects=(Contact(**REGULARISED), *BRAKED.effects[1:]))
CASES = {
    "stops and a switch": (STOPPING, ("mass", "roller_coulomb", "nu[0]", "wheel_radius")),
    "break-aways and switches": (
        BREAKING_AWAY, ("mass", "roller_break_away", "roller_coulomb")
    ),
    "regularised": (ON_REGULARISED, ("roller_break_away",)),
    "braked": (STOPPING_SOONER, ("roller_viscous", "mass")),
    "braked break-aways": (BRAKED, ("roller_viscous", "roller_break_away")),
    "braked on regularised": (BRAKED_ON_REGULARISED, ("roller_viscous",)),
}  # fmt: skip


def test_numbers_that_do_nothing_while_all_rollers_stick():
    case = Case("massless", effects=(Contact(5.0), Bearings(roller_coulomb=1.0, roller_break_away=2.0)), duration=0.1)
    run = case.run(sensitivities=("roller_coulomb", "roller_break_away", "mass"))
    assert not run.modes.any()
    assert not any(derivative(run, name).any() for name in ("roller_coulomb", "roller_break_away"))
    assert derivative(run, "mass").any()


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    run = Case("massless", effects=(Contact(5.0), Bearings(roller_coulomb=1.0)), duration=0.01).run()
    asked = np.abs(run.drive[0, run.effects.drives().index("contact_bearing")])
    at_bound = Bearings(roller_coulomb=asked.min() / 2, roller_break_away=(asked + 1e-9 * asked).tolist())
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        Case("massless", effects=(Contact(5.0), at_bound), duration=0.01).run(sensitivities=("mass",))
    assert error.value.wheels == (0, 1, 2) and error.value.t == 0
