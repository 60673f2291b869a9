"""Numbers that do nothing, and runs that have no derivative: where what happens is only just so, where elements that
change together part, where forces that hold are not determined. The error says when, and at which wheels."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Contact, NoDerivativeError, Torque, TorqueTable, Vehicle
from omniroll.engine import compiled_variations
from omniroll.engine.motion import Motion
from omniroll.vocabulary import STANDARD_GRAVITY
from tests.sensitivities.differences import START, TIED, VEHICLE, Case, derivative, differenced
from tests.sensitivities.test_differences import (
    AXLES,
    AXLES_HELD,
    AXLES_HELD_LONGER,
    DISKS,
    FLAT,
    FREE_HELD,
    GRIPS,
    GROUND,
    HELD_AXLES,
    LETS_GO,
    LEVEL,
    ONE_TURNS,
    PUSH,
    PUSHED,
    REST,
    RIGID,
    SERIES_GRIPS,
    SERIES_SKID,
    SERIES_SKID_GRIPS,
    SLOW,
    STILL,
    STRONG,
    UP_AND_DOWN,
    assert_is_differenced,
    ramp,
)


def refused(case, match, *names, **options):
    with pytest.raises(NoDerivativeError, match=match) as error:
        case.run(sensitivities=names or ("mass",), **options)
    assert error.value.wheels
    return error.value


def modes(run):
    """What the sets of bearings that stick together are, as text."""
    return {"".join(map(str, own.astype(int))) for own in Motion(run).held.sets}


def only_just(makes, low, high):
    """The last value, from `low` on, for which `makes` is true; it is not for `high`."""
    assert makes(low) and not makes(high)
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if makes(middle) else (low, middle)
    return low


# ---- numbers that do nothing -----------------------------------------------------------------------------------------

FIRM = Bearings(roller_coulomb=1.0, roller_break_away=2.0)
DO_NOTHING = {
    "axles stick, and a rate is taken away at once": (
        Case("massless", effects=(Contact(20.0, wheel_rates=0.0), Bearings(wheel_coulomb=10.0)), duration=0.1),
        ("wheel_rates[0]",), ("nu[0]",)),
    "a vehicle stands by its axles": (
        Case("massless", effects=(GROUND, HELD_AXLES, Torque((0.01, 0, 0))), start=REST, duration=0.1),
        ("nu[0]", "mass", "wheel_coulomb"), ()),
    "a vehicle stands by all that may stick": (
        Case("free", effects=(GROUND, Bearings(roller_coulomb=0.05, wheel_coulomb=0.02), Torque((0.01, 0, 0))),
             start=STILL, duration=0.1),
        ("nu[0]", "mass", "wheel_coulomb", "roller_coulomb", "friction", "spins[1][2]", "wheel_angles[0]"), ()),
    "wheels turn freely and carry the vehicle across one axle": (
        Case("free", effects=(GROUND, FIRM), start={"nu": (0, 0, 1.0), "spins": DISKS, "chi": (0, 0, 0)},
             duration=0.01), ("roller_break_away", "roller_coulomb", "friction"), ("nu[2]",)),
    "massless rollers stick": (
        Case("massless", effects=(Contact(5.0), FIRM), duration=0.1), ("roller_coulomb", "roller_break_away"),
        ("mass",)),
    "no roller turns, and no contact sticks": (
        Case("massless", effects=(SERIES_SKID_GRIPS, FIRM), duration=0.004),
        ("roller_coulomb", "roller_break_away", "static_friction"), ("mass",)),
    "free rollers stick": (
        Case("free", effects=(Contact(5.0, contact_spins=0.0), FIRM), start={"spins": DISKS}, duration=0.1),
        ("roller_coulomb", "roller_break_away"), ("nu[0]", "spins[1][2]")),
}  # fmt: skip


@pytest.mark.parametrize("case, nothing, something", DO_NOTHING.values(), ids=DO_NOTHING)
def test_numbers_that_do_nothing_while_all_that_may_stick_sticks(case, nothing, something):
    run = case.run(sensitivities=nothing + something)
    assert not run.modes.any()
    assert not any(derivative(run, name).any() for name in nothing)
    assert all(derivative(run, name).any() for name in something)
    if "spins[1][2]" in something:  # it is taken away at once, and the platform feels what it had
        assert np.abs(run.sensitivity("spins[1][2]").spins).max() <= 1e-15


@pytest.mark.parametrize("model, effects, names", [
    ("locked", (AXLES,), ("nu[0]",)),
    ("free", (Torque((0.0, 0.0, 0.0)), Bearings(roller_coulomb=2e-5, wheel_coulomb=0.01)), ("spins[1][2]", "nu[0]")),
])  # fmt: skip
def test_a_speed_that_friction_takes_at_once_does_nothing(model, effects, names):
    """At rest a little speed is gone before anything has moved by more than its square."""
    run = Case(model, effects=effects, start=STILL if model == "free" else REST).run(sensitivities=names)
    assert not any(derivative(run, name).any() for name in names)


# ---- where there are none --------------------------------------------------------------------------------------------


UNDETERMINED = {
    "in series": (PUSHED, ("mass",)),
    "rollers let go": (Case("free", effects=(GRIPS, Bearings(roller_coulomb=0.004, roller_break_away=0.005), STRONG),
                            start=STILL, duration=0.2), ("roller_break_away", "mass")),
    "axles and contacts let go": (
        Case("free", effects=(GRIPS, Bearings(roller_coulomb=0.05, roller_break_away=0.1, wheel_coulomb=0.01), STRONG),
             start=STILL, duration=0.4), ("mass",)),
    "four wheels hold three speeds": (
        Case("massless", vehicle=Vehicle.paper(4, 5), start=REST | {"chi": (0.1, -0.2, 0.15, 0.05)}, duration=0.9,
             effects=(GROUND, AXLES_HELD, ramp(0.2, -0.1, 0.05, 0.1))), ("mass", "wheel_break_away")),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("case, names", UNDETERMINED.values(), ids=UNDETERMINED)
def test_where_forces_that_hold_are_not_determined_there_are_none(case, names):
    """The compiled engine does not follow a let-go that the least use of many forces decides: it says so."""
    assert refused(case, None, *names, accuracy=1e-12).t > 0


@pytest.mark.parametrize("ground", [Contact(20.0), GROUND], ids=["viscous", "coulomb"])
def test_an_axle_that_sticks_by_all_its_friction_has_none(ground):
    case = Case("massless", effects=(ground, HELD_AXLES, Torque((0.02, 0, 0))), start=REST, duration=0.1)
    error = refused(case, "all its friction")
    assert error.wheels == (0,) and error.t == 0


SLIDING = Contact(20.0, wheel_rates=0.0, contact_spins=0.0)
STUCK = {
    "massless": Case("massless", effects=(Contact(5.0), Bearings(roller_coulomb=1.0)), duration=0.001),
    "in series": Case("massless", effects=(SERIES_SKID, Bearings(roller_coulomb=1.0)), duration=0.001),
    "free": Case("free", effects=(SLIDING, Bearings(roller_coulomb=1.0)), start=STILL | {"nu": (1.0, 0.3, 0.0)},
                 duration=0.001),
}  # fmt: skip


def asked_of_rollers(run, row=0):
    return np.abs(run.drive[row, run.effects.drives().index("contact_bearing")])


@pytest.mark.parametrize("case", STUCK.values(), ids=STUCK)
def test_rollers_that_stick_by_all_their_friction_have_none(case):
    asked = asked_of_rollers(case.run(accuracy=1e-9))
    at_bound = Bearings(roller_coulomb=asked.min() / 2, roller_break_away=(asked * (1 + 1e-9)).tolist())
    error = refused(replace(case, effects=(case.effects[0], at_bound)), "all its friction", accuracy=1e-9)
    assert error.wheels == (0, 1, 2) and error.t == 0


def test_axles_that_only_just_come_to_rest_have_none():
    """Between a torque by which wheels that turn on the spot stop and one by which they do not, to the last double."""

    def pushed(first):
        push = TorqueTable((0.0, 1.0), ((first,) * 3, (0.04,) * 3))
        return Case("massless", effects=(Contact(1.0), HELD_AXLES, push), start={"nu": (0, 0, -1.0), "chi": (0, 0, 0)})

    def stops(first):
        return not pushed(first).run().modes.any(axis=1).all()

    error = refused(pushed(only_just(stops, -0.02, 0.02)), "only just")
    assert error.wheels == (0, 1, 2) and 0 < error.t < 1


def test_a_roller_that_only_just_stops_has_none(monkeypatch):
    """It stops where its contact slips, and is asked for less from then on; then every spin is said to fall slowly: C
    does not pass it."""
    case = Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, PUSH), start=SLOW, duration=0.0112)
    run = case.run(sensitivities=("mass",), accuracy=1e-9)
    of_rollers = Motion(run).bearings.split(run.modes)[1].reshape(len(run), -1)
    assert ((of_rollers[:-1] != 0) & (of_rollers[1:] == 0)).any() and derivative(run, "mass").any()
    monkeypatch.setattr(compiled_variations, "GRAZES", 1e9)
    error = refused(case, "only just", accuracy=1e-9)
    assert error.wheels == (1,) and 0 < error.t < case.duration


def test_what_begins_to_move_from_rest_has_none_by_its_own_speed():
    """A contact that a torque drags; rollers that the ground takes along, which have one by all else."""
    dragged = replace(PUSHED, effects=(FLAT, RIGID, Torque((3.0, 0.0, 0.0))), duration=0.001)
    run = dragged.run(sensitivities=("mass",), accuracy=1e-9)
    assert not run.sticks[0].all() and derivative(run, "mass").any()
    assert refused(dragged, "begins to slip from rest", "nu[0]", accuracy=1e-9).t == 0
    taken = Case("free", effects=(Contact(20.0, contact_spins=0.0), FREE_HELD), start=START | {"spins": DISKS},
                 duration=0.004)  # fmt: skip
    run = taken.run(sensitivities=("chi[0]",), accuracy=1e-13)
    assert run.modes[0, :: run.vehicle.rollers_per_wheel].all()
    wanted = differenced(taken, "chi[0]", 1e-4, accuracy=1e-13)
    assert np.abs(derivative(run, "chi[0]") - wanted).max() <= 1e-9 * np.abs(wanted).max()
    error = refused(taken, "begins to turn from rest", "contact_spins[1]")
    assert error.wheels == (1,) and error.t == 0


@pytest.mark.long
def test_bearings_that_pass_rest_together_and_turn_on_have_none_where_they_part():
    """Straight on, and strongly back: two wheels pass rest at one time, and turn back."""
    back = Torque((0.0, 0.05, -0.05))
    start = {"nu": (0.3, 0.0, 0.0), "chi": (0.1, 0.1, -0.1)}
    ahead = omniroll.kernel(omniroll.Vehicle.paper(), "massless", "python").wheel_speeds(start["nu"])
    torque = tuple(-0.05 * np.sign(np.round(ahead, 9)))
    case = Case("massless", effects=(replace(back, torque=torque), AXLES), start=start, duration=1.0)
    assert_is_differenced(case, ("mass", "wheel_coulomb"))
    with pytest.raises(NoDerivativeError, match=r"apart where a number changes; by nu\[2\]") as caught:
        case.run(sensitivities=("mass", "nu[2]"))
    turning = tuple(np.flatnonzero(np.abs(ahead) > 1e-9))
    rates = np.abs(Motion(case.run()).y[:, :3] @ omniroll.kernel(case.vehicle, "massless", "python").wheel_rows.T)
    row = int(np.argmin(np.abs(case.run().t - caught.value.t)))
    assert caught.value.wheels == turning and rates[row].max() < 1e-12


@pytest.mark.long
def test_a_number_by_which_what_sticks_leaves_less():
    """Two axles are parallel and stick: one of them turned a little, they leave nu one direction less."""
    side, angles = omniroll.Vehicle.paper().platform_radius, (0.0, 0.0, np.pi / 2, np.pi)
    places = ((side, side), (side, -side), (0.0, side), (-side, 0.0))
    vehicle = omniroll.Vehicle.paper().replace(wheels=4, wheel_angles=angles, wheel_places=places)
    case = Case("locked", vehicle=vehicle, effects=(Bearings(wheel_coulomb=(0.05, 0.05, 1e-3, 1e-3)),),
                start={"nu": (1.0, 0.0, 0.0), "chi": (0.1, 0.1, 0.1, 0.1)}, duration=0.3)  # fmt: skip
    assert modes(case.run()) == {"1101"}
    assert_is_differenced(case, ("mass", "wheel_coulomb[2]", "nu[0]"))
    with pytest.raises(NoDerivativeError, match=r"would leave other directions; by wheel_angles\[0\]") as caught:
        case.run(sensitivities=("wheel_angles[0]",))
    assert caught.value.wheels == (0, 1, 3) and caught.value.t == 0


@pytest.mark.long
def test_an_axle_that_only_just_comes_to_rest_has_none():
    """Slower by any amount it sticks for a while, faster it never rests."""

    turning_back = TorqueTable((0, 1), ((0.0, -0.06, 0.0), (0.0, 0.06, 0.0)))
    held_firmly = Bearings(wheel_coulomb=1e-3, wheel_break_away=0.05)

    def case(speed):
        start = {"nu": (0.0, -speed, 0.1), "chi": (0.1, -0.2, 0.15)}
        return Case("massless", effects=(turning_back, held_firmly), start=start, duration=0.8)

    def stops(speed):
        return any(own[0] == "1" for own in modes(case(speed).run()))

    assert_is_differenced(case(0.2), ("mass", "nu[1]"))
    speed = only_just(stops, 0.2, 1.0)
    with pytest.raises(NoDerivativeError, match="only just comes to rest") as caught:
        case(speed).run(sensitivities=("mass",))
    assert caught.value.wheels == (0,) and 0.5 < caught.value.t < 1
    for beside in (1 - 1e-3, 1 + 1e-3):
        assert_is_differenced(case(speed * beside), ("mass",), tolerance=1e-6, part=1e-5)


@pytest.mark.parametrize("before, is_followed", [(1e-3, True), (1e-9, False)])
def test_a_step_of_a_session_that_begins_just_before_a_break_away_says_so(before, is_followed):
    """How fast the torque rises it can tell from the step alone; over 1e-9 s rounding takes derivatives 3e-3 off."""
    case = Case("locked", effects=(UP_AND_DOWN, AXLES_HELD_LONGER), start=REST, duration=0.5)
    run = case.run(sensitivities=("mass",))
    sticks = run.modes == 0
    breaks = run.t[np.flatnonzero((sticks[:-1] & ~sticks[1:]).any(axis=1))[0]]
    session = omniroll.Session(
        VEHICLE, **(START | REST), effects=case.effects, roller_model="locked", accuracy=1e-13,
        sensitivities=("mass",),
    )  # fmt: skip
    session.step(breaks - before)
    session.step(case.duration - session.elapsed)
    if is_followed:
        own, stepped = derivative(run, "mass")[:3], session.sensitivity("mass").nu
        assert np.abs(own - stepped).max() <= 1e-9 * np.abs(own).max()
        return
    with pytest.raises(NoDerivativeError, match="this step of a session, began only 1e-09 s before") as caught:
        session.sensitivity("mass")
    assert caught.value.t == pytest.approx(breaks, abs=1e-12)


def at_edge():
    """Wheels whose slip comes to rest at 0.01 s under torques that are 1e-8 less than what keeps it up."""
    wheel, yaw, radius, arm, mass = (getattr(VEHICLE, name) for name in (
        "wheel_inertia", "yaw_inertia", "wheel_radius", "platform_radius", "mass"))  # fmt: skip
    torque = 0.3 * mass * STANDARD_GRAVITY / 3 * (radius + 3 * wheel * arm**2 / (radius * yaw))
    ground = Contact(law="coulomb", friction=0.3, wheel_rates=0.01 * 1e-8 * torque / wheel)
    start = LEVEL | {"chi": (0.0,) * 3}
    return Case("massless", effects=(ground, Torque((1 - 1e-8) * torque)), start=start, duration=0.02)


@pytest.mark.parametrize(
    "case, names, reason",
    [
        (Case("massless", effects=(LETS_GO, ramp(2.0, 2.0, 2.0)),
              start=LEVEL | {"chi": (0.0, 0.0, 0.0)}), ("torque[1][0]",), "apart where a number changes; by torque"),
        (Case("free", effects=(Contact(law="coulomb", friction=1.0),), start=TIED, duration=1.3), ("chi[0]",),
         "more than one order"),
        (at_edge(), ("mass",), "only just|all its friction"),
    ],
    ids=["together", "orders", "only just"],
)  # fmt: skip
def test_where_there_is_none(case, names, reason):
    with pytest.raises(NoDerivativeError, match=reason) as caught:
        case.run(sensitivities=names)
    assert 0 < caught.value.t < case.duration and caught.value.wheels
