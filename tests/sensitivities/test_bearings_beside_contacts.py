"""Sensitivities of runs in which axles and rollers stick beside contacts that do, under Coulomb's friction on the
ground: where there are none, and numbers that do nothing. test_friction.py holds CASES to differences of runs."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, Torque, TorqueTable, Vehicle
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import (
    SPINS,
    Case,
    derivative,
)

STILL = np.zeros_like(SPINS).tolist()
SKID = Contact(law="coulomb", friction=0.1, wheel_rates=(3.0, -2.0, 1.0))
STANDING, HELD = Contact(law="coulomb", friction=0.1), Contact(law="coulomb", friction=0.1, static_friction=0.15)
RUBBING = Bearings(roller_coulomb=0.002)
HELD_LONGER = Bearings(roller_coulomb=0.002, roller_break_away=0.003)
SIDEWAYS = TorqueTable((0.0, 0.1), ((0, 0, 0), (0.0, 0.3, -0.3)))
PUSH = TorqueTable((0.0, 1.0), ((0, 0, 0), (0.9, -0.5, 0.4)))
ALONG_AN_AXLE = {"nu": (0, 1.0, 0), "spins": STILL, "chi": (0.1, 0.2, -0.2)}
STOPPING = Case("free", effects=(SKID, RUBBING), duration=0.002)
BREAKING_AWAY = Case("free", effects=(HELD, HELD_LONGER, SIDEWAYS), start=ALONG_AN_AXLE, duration=0.04)
COMING_TO_REST = Case(
    "free", effects=(SKID, RUBBING), start={"spins": STILL, "nu": (0.2, 0.1, 0.1)}, duration=0.05
)  # fmt: skip
CASES = {
    "stops": (STOPPING, ("roller_coulomb",)),
    "stops beside axles": (
        replace(STOPPING, effects=(SKID, replace(RUBBING, wheel_coulomb=0.05))), ("wheel_coulomb",)
    ),
    "a switch": (replace(STOPPING, start={"chi": (0.627, -0.2, -0.61)}, duration=0.0012), ("mass",)),
    "break-aways": (BREAKING_AWAY, ("wheel_radius",)),
    "contacts come to rest": (COMING_TO_REST, ("friction",)),
}  # fmt: skip
PUSHED = Case(
    "free", effects=(HELD, Bearings(roller_coulomb=0.004, roller_break_away=0.005), PUSH),
    start={"nu": (0, 0, 0), "spins": STILL}, duration=0.2,
)  # fmt: skip
FIRM = Bearings(roller_coulomb=0.05, roller_break_away=0.1, wheel_coulomb=0.01)
UNDETERMINED = {
    "rollers let go": (PUSHED, ("roller_break_away", "mass")),
    "axles and contacts let go": (replace(PUSHED, effects=(HELD, FIRM, PUSH), duration=0.4), ("mass",)),
    "four wheels hold three speeds": (
        Case("massless", vehicle=Vehicle.paper(4, 5), duration=0.9,
             start={"nu": (0, 0, 0), "chi": (0.1, -0.2, 0.15, 0.05)},
             effects=(STANDING, Bearings(wheel_coulomb=0.02, wheel_break_away=0.03),
                      TorqueTable((0.0, 1.0), ((0,) * 4, (0.2, -0.1, 0.05, 0.1))))),
        ("mass", "wheel_break_away"),
    ),
}  # fmt: skip


def kinds(run):
    """How many contacts stick in the rows, and how many rollers, axles."""
    of_axles, of_rollers = Motion(run).bearings.split(run.modes == 0)
    counts = [own for own in (run.sticks, of_rollers.reshape(len(run), -1), of_axles) if own.size]
    return {tuple(map(int, row)) for row in np.stack([own.sum(axis=1) for own in counts]).T}


@pytest.mark.long
@pytest.mark.parametrize("case, names", UNDETERMINED.values(), ids=UNDETERMINED)
def test_where_forces_that_hold_are_not_determined_there_are_none(case, names):
    """The compiled engine does not follow a let-go that the least use of many forces decides: it says so."""
    with pytest.raises(NoDerivativeError) as error:
        case.run(sensitivities=names, accuracy=1e-12)
    assert error.value.wheels and error.value.t > 0


def test_a_vehicle_that_stands_depends_on_nothing():
    """A speed of the start is taken away at once."""
    firm = Bearings(roller_coulomb=0.05, wheel_coulomb=0.02)
    start = {"nu": (0, 0, 0), "spins": STILL}
    case = Case("free", effects=(STANDING, firm, Torque((0.01, 0, 0))), start=start, duration=0.1)
    names = ("nu[0]", "mass", "wheel_coulomb", "roller_coulomb", "friction", "spins[1][2]", "wheel_angles[0]")
    run = case.run(sensitivities=names)
    assert kinds(run) == {(3, 15, 3)}
    for name in names:
        assert not derivative(run, name).any()


def test_numbers_that_do_nothing_while_all_that_may_stick_sticks():
    """The wheels turn freely, and carry the vehicle across one axle."""
    effects = STANDING, Bearings(roller_coulomb=1.0, roller_break_away=2.0)
    case = Case("free", effects=effects, start={"nu": (0, 0, 1.0), "spins": STILL, "chi": (0, 0, 0)}, duration=0.01)
    names = ("roller_break_away", "roller_coulomb", "friction", "nu[2]")
    run = case.run(sensitivities=names)
    assert kinds(run) == {(3, 15)}
    assert not any(derivative(run, name).any() for name in names[:3])
    assert run.sensitivity("nu[2]").nu[-1, 2] != 0


def test_a_roller_that_sticks_by_all_its_friction_has_none():
    """Two wheels push the vehicle sideways, whose third one's roller holds it."""

    def case(held, **options):
        effects = HELD, Bearings(roller_coulomb=(held, 0.002, 0.002)), Torque((0.0, 0.01, -0.01))
        return replace(BREAKING_AWAY, effects=effects, duration=1e-5).run(**options)

    run = case(1.0)
    assert kinds(run) == {(3, 13)}
    asked = abs(run.drive[0, run.effects.drives().index("contact_bearing")][0])
    assert np.isfinite(case(1.001 * asked, sensitivities=("mass",)).sensitivity("mass").nu).all()
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        case(asked * (1 + 1e-9), sensitivities=("mass",))
    assert error.value.wheels == (0,) and error.value.t == 0


@pytest.mark.long
def test_a_number_that_turns_one_of_two_parallel_axles_whose_wheels_stand_has_none():
    start = {"nu": (0, 1.0, 0), "spins": np.zeros((4, 4)).tolist(), "chi": (0.1, 0.2, -0.2, 0.1)}
    effects = STANDING, Bearings(roller_coulomb=1.0, roller_break_away=2.0)
    case = Case("free", effects=effects, start=start, duration=0.001, vehicle=Vehicle.paper(4, 5))
    with pytest.raises(NoDerivativeError):
        case.run(sensitivities=("wheel_angles[0]",))
