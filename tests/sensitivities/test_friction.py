"""Sensitivities of runs in which contacts, axles and rollers come to rest, stick and let go, of every kind of friction:
against differences of runs, by numbers that do nothing, and where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, Slope, Torque, TorqueTable, Vehicle
from omniroll.engine import compiled_variations
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import (
    SPINS,
    START,
    VEHICLE,
    Case,
    assert_the_same_backwards_and_in_sessions,
    derivative,
    differenced,
    motion,
)
from tests.sensitivities.test_sticking import only_just

DISKS = np.zeros_like(SPINS).tolist()  # spins of rollers that rest on their disks
REST = {"nu": (0.0, 0.0, 0.0)}
STILL = REST | {"spins": DISKS}
SLOW = {"nu": (0.2, 0.1, 0.2)}
AT_A_JOINT = {"chi": (0.61, -0.2, -0.61)}
ALONG_AN_AXLE = {"nu": (0, 1.0, 0), "spins": DISKS, "chi": (0.1, 0.2, -0.2)}
SKIDDING = {"wheel_rates": (3.0, -2.0, 1.0)}


def ramp(*torques, end=1.0):
    return TorqueTable((0.0, end), ((0.0,) * len(torques), torques))


# ---- wheels that may slip, under smooth laws -------------------------------------------------------------------------

REGULARISED = Contact(law="regularised", friction=(0.3, 0.4), speed=0.05)
AXLES = Bearings(wheel_coulomb=0.02)
AXLES_HELD = Bearings(wheel_coulomb=0.02, wheel_break_away=0.03)
AXLE_RAMP, ROLLER_RAMP = ramp(0.1, -0.06, 0.04), ramp(0.3, -0.1, 0.2, end=0.3)
BESIDE_SMOOTH = {
    "axles, stop": (Case("massless", effects=(Contact(20.0), AXLES), duration=0.9), ("nu[0]", "wheel_coulomb[1]")),
    "axles, break-aways": (
        Case("massless", effects=(Contact(5.0), AXLES_HELD, AXLE_RAMP), start=REST, duration=0.9),
        ("wheel_break_away", "mass"),
    ),
    "axles, regularised": (
        Case("massless", effects=(REGULARISED, AXLES_HELD, AXLE_RAMP), start=REST, duration=0.7),
        ("friction[1]", "wheel_coulomb"),
    ),
    "axles, free": (Case("free", effects=(Contact(5.0), AXLES), duration=0.3), ("mass", "wheel_coulomb")),
}  # fmt: skip

RUBBING = Bearings(roller_coulomb=0.01)
HELD = Bearings(roller_coulomb=0.001, roller_break_away=0.002)
STOPPING = Case("massless", effects=(Contact(5.0), RUBBING), duration=0.6)
BREAKING_AWAY = Case("massless", effects=(Contact(5.0), HELD, ROLLER_RAMP), start=REST, duration=0.3)
BRAKED = replace(BREAKING_AWAY, effects=(Contact(5.0), replace(HELD, roller_viscous=2e-5), ROLLER_RAMP))
ALL_STICK = replace(HELD, wheel_coulomb=0.02, wheel_break_away=0.03)
MASSLESS = {
    "massless, stops and a switch": (STOPPING, ("mass", "roller_coulomb")),
    "massless, break-aways": (BREAKING_AWAY, ("mass", "roller_break_away")),
    "massless, regularised": (
        replace(BREAKING_AWAY, effects=(REGULARISED, HELD, ROLLER_RAMP)), ("roller_break_away",)),
    "massless, braked": (
        replace(STOPPING, effects=(Contact(5.0), replace(RUBBING, roller_viscous=2e-4))), ("roller_viscous", "mass")),
    "massless, braked break-aways": (BRAKED, ("roller_viscous", "roller_break_away")),
    "massless, braked on regularised": (
        replace(BRAKED, effects=(REGULARISED, *BRAKED.effects[1:])), ("roller_viscous",)),
    "massless beside axles, regularised": (
        replace(BREAKING_AWAY, effects=(REGULARISED, ALL_STICK, ROLLER_RAMP)), ("wheel_break_away", "speed")),
}  # fmt: skip

FREE_HELD = Bearings(roller_coulomb=0.003, roller_break_away=0.004)
FREE_STOPPING = Case("free", effects=(Contact(5.0), Bearings(roller_coulomb=2e-5)), duration=0.02)
FREE_BREAKING_AWAY = Case("free", effects=(Contact(20.0), FREE_HELD, ROLLER_RAMP), start=STILL, duration=0.1)
FREE = {
    "free rollers, stop": (FREE_STOPPING, ("nu[2]", "roller_coulomb[1]")),
    "free rollers, a switch": (replace(FREE_STOPPING, start=AT_A_JOINT), ("mass",)),
    "free rollers, one enters sticking and lets go": (
        Case("free", effects=(Contact(20.0), FREE_HELD), start=AT_A_JOINT | {"spins": DISKS}, duration=0.015),
        ("mass",),
    ),
    "free rollers, break-aways": (FREE_BREAKING_AWAY, ("roller_break_away",)),
    "free rollers, break-aways without a jump": (
        replace(FREE_BREAKING_AWAY, effects=(Contact(20.0), Bearings(roller_coulomb=0.003), ROLLER_RAMP)),
        ("roller_coulomb",),
    ),
    "free rollers, with axles": (
        Case("free", effects=(REGULARISED, Bearings(roller_coulomb=0.001, wheel_coulomb=0.05)), duration=0.03),
        ("wheel_coulomb[0]", "roller_coulomb"),
    ),
}  # fmt: skip

# ---- contacts that stick, and bearings beside them -------------------------------------------------------------------

GROUND = Contact(law="coulomb", friction=0.1)
GRIPS = replace(GROUND, static_friction=0.15)
SKID = replace(GROUND, **SKIDDING)
LIGHT = Contact(law="coulomb", friction=0.3, static_friction=0.4, load=(12.0, 2.0, 2.0))
STRONG = ramp(0.9, -0.5, 0.4)
STANDING = {
    "axles beside contacts, come to rest": (Case("massless", effects=(SKID, AXLES), duration=0.9), ("nu[0]", "mass")),
    "axles beside contacts, free": (
        Case("free", effects=(GROUND, Bearings(wheel_coulomb=0.05, wheel_break_away=0.06)), duration=0.36),
        ("mass", "wheel_coulomb"),
    ),
    "axles let go beside contacts": (
        Case("massless", effects=(GROUND, AXLES_HELD, ramp(0.2, -0.1, 0.05)), start=REST, duration=0.9),
        ("wheel_break_away", "wheel_radius"),
    ),
    "contacts let go beside axles": (
        Case("massless", effects=(GRIPS, Bearings(wheel_coulomb=0.2, wheel_break_away=0.3), STRONG), start=REST,
             duration=0.9), ("wheel_break_away", "mass")
    ),
    "a wheel that is pushed lets go": (
        Case("massless", effects=(LIGHT, Bearings(wheel_coulomb=(0.01, 0.5, 0.5)), ramp(0.4, 0.0, 0.0)), start=REST,
             duration=0.8), ("static_friction", "load[1]")
    ),
}  # fmt: skip

ROLLERS = Bearings(roller_coulomb=0.002)
BESIDE_CONTACTS = Case("free", effects=(SKID, ROLLERS), duration=0.002)
SIDEWAYS = Case("free", effects=(GRIPS, Bearings(roller_coulomb=0.002, roller_break_away=0.003),
                                 ramp(0, 0.3, -0.3, end=0.1)), start=ALONG_AN_AXLE, duration=0.04)  # fmt: skip
OF_BOTH = {
    "rollers beside contacts, stop": (BESIDE_CONTACTS, ("roller_coulomb",)),
    "rollers beside contacts, break away": (SIDEWAYS, ("wheel_radius",)),
}

FLAT = Contact(law="coulomb", friction=(0.3, 0.25))
SERIES_GRIPS = replace(FLAT, static_friction=(0.4, 0.35))
SERIES_SKID, SERIES_SKID_GRIPS = replace(FLAT, **SKIDDING), replace(SERIES_GRIPS, **SKIDDING)
SERIES_HELD = Bearings(roller_coulomb=0.02, roller_break_away=0.03)
ONE_TURNS = Bearings(roller_coulomb=(0.02, 0.025, 0.002), roller_break_away=(0.03, 0.035, 0.002))
RIGID = Bearings(roller_coulomb=(0.2, 0.25, 0.002))
PUSH = ramp(0.0, -0.9, 0.9, end=0.05)
SLIPPING = Case("massless", effects=(SERIES_SKID, Bearings(roller_coulomb=0.02)), duration=0.035)
JUMPING = Case("massless", effects=(SERIES_SKID_GRIPS, SERIES_HELD), start={"nu": (0.3, 0.1, 0.2)}, duration=0.04)
PUSHED = Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, ramp(0.9, -0.5, 0.4, end=0.3)), start=REST, duration=0.1)
SERIES = {
    "in series, rollers let go and contacts come to rest": (SLIPPING, ("mass", "roller_coulomb[1]")),
    "in series, break-aways with a jump, and a wheel that stands": (JUMPING, ("mass", "roller_break_away")),
    "in series, rigid wheels come to rest": (
        Case("massless", effects=(SERIES_SKID, RIGID), start=SLOW, duration=0.026), ("nu[1]",)),
    "in series, a contact that stands lets go": (
        Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, ramp(0.2, 0.9, -0.6, end=0.05)), start=SLOW,
             duration=0.018), ("mass", "static_friction[1]")),
    "in series, a roller that stands lets go, then its contact": (
        Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, PUSH), start=SLOW, duration=0.023),
        ("roller_break_away[1]",)),
    "in series, switches": (
        replace(SLIPPING, effects=(SERIES_SKID, SERIES_HELD), start={"chi": (0.627, -0.2, -0.61)}, duration=0.03),
        ("mass",)),
    "in series, a roller that turns gives way to one that stands": (
        replace(JUMPING, start={"nu": (6.0, 2.0, 5.0), "chi": (0.1, 0.33, 0.1)}, effects=(SERIES_GRIPS, SERIES_HELD),
                duration=0.032), ("mass", "chi[1]")),
    "in series, axles stop and stick": (
        replace(JUMPING, effects=(SERIES_SKID, replace(SERIES_HELD, wheel_coulomb=0.05, wheel_break_away=0.07)),
                duration=0.0265), ("wheel_coulomb[0]",)),
}  # fmt: skip

CASES = BESIDE_SMOOTH | MASSLESS | FREE | STANDING | OF_BOTH | SERIES
BACKWARDS = {"massless": BREAKING_AWAY, "in series": SLIPPING, "free": FREE_BREAKING_AWAY,
             "rollers beside contacts": BESIDE_CONTACTS}  # fmt: skip


def size_of(case, name):
    """The size of a number, so that its change makes no other events."""
    number = name.split("[")[0]
    holders = [case.start, *(vars(one) for one in (*case.effects, case.vehicle) if hasattr(one, "__dict__"))]
    value = next((holder[number] for holder in holders if holder.get(number) is not None), 1.0)
    return min(1.0, np.abs(value).max())


@pytest.mark.long
@pytest.mark.parametrize("case, names", CASES.values(), ids=CASES)
def test_they_are_differences_of_runs(case, names):
    run = case.run(sensitivities=names, accuracy=1e-13)
    assert run.stats["phases"] > max(1, len(run.switches))  # else nothing has happened; modes may change at a switch
    for name in names:
        wanted = differenced(case, name, 3e-4 * size_of(case, name), accuracy=1e-13)
        assert np.abs(derivative(run, name) - wanted).max() <= 1e-8 * np.abs(wanted).max(), name


@pytest.mark.long
@pytest.mark.parametrize("case", BACKWARDS.values(), ids=BACKWARDS)
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same(case):
    assert_the_same_backwards_and_in_sessions(case)


@pytest.mark.parametrize("rollers, bearings", [("massless", ()), ("massless", (
    Bearings(wheel_coulomb=0.02, wheel_break_away=0.05),)), ("free", ())])  # fmt: skip
def test_behind_a_let_go_on_a_slope_they_are_differences_of_runs(rollers, bearings):
    """What holds rises there also because gravity's direction turns with the heading."""
    rng, let_go = np.random.default_rng(5), 0
    ground = Contact(law="coulomb", friction=0.25, static_friction=0.35, normal_gravity=9.6)
    for _ in range(4):
        nu, torque = rng.normal(size=3) * (0.5, 0.5, 2), rng.normal(size=3) * 0.4
        case = Case(rollers, effects=(ground, Slope(0.2, 0.3), ramp(*torque, end=0.4), *bearings), duration=0.4,
                    start={"nu": tuple(nu), "chi": (0, 0, 0), "pose": (0, 0, 0), "spins": DISKS})  # fmt: skip
        found = case.run(sensitivities=("mass", "nu[2]"), accuracy=1e-12)
        let_go += np.count_nonzero(found.sticks[1:] < found.sticks[:-1])
        for name, change in (("mass", 5e-6 * VEHICLE.mass), ("nu[2]", 5e-6)):
            ends = [case.changed(name, side * change).run(accuracy=1e-12).nu[-1] for side in (1, -1)]
            wanted = (ends[0] - ends[1]) / (2 * change)
            assert np.abs(found.sensitivity(name).nu[-1] - wanted).max() <= 3e-8 * np.abs(wanted).max()
    assert let_go >= 2


# ---- numbers that do nothing -----------------------------------------------------------------------------------------

FIRM = Bearings(roller_coulomb=1.0, roller_break_away=2.0)
DO_NOTHING = {
    "axles stick, and a rate is taken away at once": (
        Case("massless", effects=(Contact(20.0, wheel_rates=0.0), Bearings(wheel_coulomb=10.0)), duration=0.1),
        ("wheel_rates[0]",), ("nu[0]",)),
    "a vehicle stands by its axles": (
        Case("massless", effects=(GROUND, AXLES, Torque((0.01, 0, 0))), start=REST, duration=0.1),
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


def test_a_roller_turns_whose_bearing_takes_nothing_while_it_does():
    """Its torque does not tell its mode; the speed along its axle does."""
    loose = Bearings(roller_coulomb=(0.02, 0.0, 0.02), roller_break_away=(0.02, 0.01, 0.02))
    case = Case("massless", effects=(SERIES_SKID, loose), duration=0.01)
    run = case.run(sensitivities=("mass", "roller_coulomb[1]"), accuracy=1e-12)
    assert run.contact_spin[-1, 1] and not run.sticks[:, 1].any()
    assert derivative(run, "mass") == pytest.approx(differenced(case, "mass", 1e-4, accuracy=1e-12), rel=1e-7, abs=1e-9)
    by, change = derivative(run, "roller_coulomb[1]"), 1e-6  # it has none below
    more = motion(case.changed("roller_coulomb[1]", change).run(accuracy=1e-12))
    assert np.abs((more - motion(run)) / change - by).max() <= 1e-3 * np.abs(by).max()


# ---- where there are none --------------------------------------------------------------------------------------------


def refused(case, match, *names, **options):
    with pytest.raises(NoDerivativeError, match=match) as error:
        case.run(sensitivities=names or ("mass",), **options)
    assert error.value.wheels
    return error.value


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


@pytest.mark.long
def test_a_number_that_turns_one_of_two_parallel_axles_whose_wheels_stand_has_none():
    start = {"nu": (0, 1.0, 0), "spins": np.zeros((4, 4)).tolist(), "chi": (0.1, 0.2, -0.2, 0.1)}
    refused(Case("free", effects=(GROUND, FIRM), start=start, duration=0.001, vehicle=Vehicle.paper(4, 5)), None,
            "wheel_angles[0]")  # fmt: skip


@pytest.mark.parametrize("ground", [Contact(20.0), GROUND], ids=["viscous", "coulomb"])
def test_an_axle_that_sticks_by_all_its_friction_has_none(ground):
    case = Case("massless", effects=(ground, AXLES, Torque((0.02, 0, 0))), start=REST, duration=0.1)
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


def test_a_roller_that_holds_a_vehicle_by_all_its_friction_has_none():
    """Two wheels push it sideways, whose third one's roller holds it."""

    def case(held):
        effects = GRIPS, Bearings(roller_coulomb=(held, 0.002, 0.002)), Torque((0.0, 0.01, -0.01))
        return replace(SIDEWAYS, effects=effects, duration=1e-5)

    asked = asked_of_rollers(case(1.0).run())[0]
    assert np.isfinite(derivative(case(1.001 * asked).run(sensitivities=("mass",)), "mass")).all()
    error = refused(case(asked * (1 + 1e-9)), "all its friction")
    assert error.wheels == (0,) and error.t == 0


def test_axles_that_only_just_come_to_rest_have_none():
    """Between a torque by which wheels that turn on the spot stop and one by which they do not, to the last double."""

    def pushed(first):
        push = TorqueTable((0.0, 1.0), ((first,) * 3, (0.04,) * 3))
        return Case("massless", effects=(Contact(1.0), AXLES, push), start={"nu": (0, 0, -1.0), "chi": (0, 0, 0)})

    def stops(first):
        return not pushed(first).run().modes.any(axis=1).all()

    error = refused(pushed(only_just(stops, -0.02, 0.02)), "only just")
    assert error.wheels == (0, 1, 2) and 0 < error.t < 1


def test_an_axle_that_is_asked_for_ever_so_slowly_more_than_it_takes_has_none():
    most = AXLES_HELD.wheel_break_away
    push = TorqueTable((0.0, 1.0, 2.0), ((0,) * 3, (0, most * (1 - 1e-8), 0), (0, most * (1 + 1e-8), 0)))
    error = refused(Case("massless", effects=(Contact(20.0), AXLES_HELD, push), start=REST, duration=2.0), "only just")
    assert error.wheels == (1,) and error.t == pytest.approx(1.5, abs=0.1)


@pytest.mark.long
def test_a_roller_that_is_asked_for_ever_so_slowly_more_than_it_takes_has_none():
    """A vehicle with blocked wheels slides downhill. What holds a roller rises as 1 - exp(-t/T), with T = M/(3 c)."""
    time = VEHICLE.mass / 60

    def sliding(holding):
        bearings = Bearings(roller_coulomb=holding / 2, roller_break_away=holding, wheel_coulomb=100.0)
        return Case("free", effects=(Contact(20.0), bearings, Slope(0.2, 0.3)), start=STILL, duration=40 * time)

    most = asked_of_rollers(sliding(100.0).run(), -1)
    assert np.isfinite(derivative(sliding(most.max() * (1 - 1e-4)).run(sensitivities=("mass",)), "mass")).all()
    error = refused(sliding(most.max() * (1 - 1e-8)), "only just")
    assert error.wheels == (int(most.argmax()),) and error.t == pytest.approx(-np.log(1e-8) * time, rel=1e-4)


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
