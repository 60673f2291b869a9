"""Sensitivities of runs in which axles come to rest, stick and break away beside wheels that may slip, where there are
some and where there are none; test_friction.py holds CASES to differences of runs."""

import pytest

import omniroll
from omniroll import Bearings, Contact, NoDerivativeError, TorqueTable
from tests.sensitivities.differences import Case, derivative

REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
RUBBING = Bearings(wheel_coulomb=0.02)
HELD_LONGER = Bearings(wheel_coulomb=0.02, wheel_break_away=0.03)
RAMP = TorqueTable((0.0, 1.0), ((0, 0, 0), (0.1, -0.06, 0.04)))
AT_REST = {"nu": (0.0, 0.0, 0.0)}
STOPPING = Case("massless", effects=(Contact(20.0), RUBBING), duration=0.9)
BREAKING_AWAY = Case("massless", effects=(Contact(5.0), HELD_LONGER, RAMP), start=AT_REST, duration=0.9)
CASES = {
    "stops": (STOPPING, ("nu[0]", "wheel_coulomb[1]")),
    "break-aways": (BREAKING_AWAY, ("wheel_break_away", "mass")),
    "regularised": (
        Case("massless", effects=(Contact(**REGULARISED), HELD_LONGER, RAMP), start=AT_REST, duration=0.7),
        ("friction[1]", "wheel_coulomb"),
    ),
    "free": (
        Case("free", effects=(Contact(5.0), RUBBING), duration=0.3), ("mass", "wheel_coulomb")
    ),
}  # fmt: skip


def modes(run):
    """Of the axles, 0 where one sticks, in all rows."""
    return {"".join("01"[int(mode != 0)] for mode in row) for row in run.modes}


def test_a_speed_of_a_start_at_which_axles_stick_does_nothing():
    ground = Contact(20.0, wheel_rates=0.0)
    run = Case("massless", effects=(ground, Bearings(wheel_coulomb=10.0)), duration=0.1).run(
        sensitivities=("wheel_rates[0]", "nu[0]")
    )
    assert modes(run) == {"000"}
    assert not derivative(run, "wheel_rates[0]").any() and derivative(run, "nu[0]").any()


def pushed(first):
    """Wheels that turn on the spot, slowed down by all the less the later it is, from a torque `first`."""
    push = TorqueTable((0.0, 1.0), ((first,) * 3, (0.04,) * 3))
    start = {"nu": (0.0, 0.0, -1.0), "chi": (0.0, 0.0, 0.0)}
    return Case("massless", effects=(Contact(1.0), RUBBING, push), start=start, duration=1.0)


def test_axles_that_only_just_come_to_rest_have_none():
    """Between a torque by which the wheels stop and one by which they do not, to the last double."""
    low, high = -0.02, 0.02
    assert "000" in modes(pushed(low).run()) and "000" not in modes(pushed(high).run())
    while low < (half := (low + high) / 2) < high:
        low, high = (half, high) if "000" in modes(pushed(half).run()) else (low, half)
    with pytest.raises(NoDerivativeError, match="only just") as error:
        pushed(low).run(sensitivities=("mass",))
    assert error.value.wheels == (0, 1, 2) and 0 < error.value.t < 1


def test_an_axle_that_is_asked_for_ever_so_slowly_more_than_it_takes_has_none():
    most = HELD_LONGER.wheel_break_away
    push = TorqueTable((0.0, 1.0, 2.0), ((0,) * 3, (0, most * (1 - 1e-8), 0), (0, most * (1 + 1e-8), 0)))
    case = Case("massless", effects=(Contact(20.0), HELD_LONGER, push), start=AT_REST, duration=2.0)
    with pytest.raises(NoDerivativeError, match="only just") as error:
        case.run(sensitivities=("mass",))
    assert error.value.wheels == (1,) and error.value.t == pytest.approx(1.5, abs=0.1)


def test_an_axle_that_sticks_by_all_its_friction_has_none():
    case = Case("massless", effects=(Contact(20.0), RUBBING, omniroll.Torque((0, 0.02, 0))), start=AT_REST)
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        case.run(sensitivities=("mass",))
    assert error.value.wheels == (1,) and error.value.t == 0
