"""Sensitivities of runs in which bearings come to rest, stick and break away, against differences of runs."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, NoDerivativeError, Torque, TorqueTable
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import START, VEHICLE, Case, derivative
from tests.sensitivities.test_runs import check

AXLES = Bearings(wheel_coulomb=0.002)
NUMBERS = {"nu[0]": 1e-4, "chi[1]": 1e-4, "mass": 1e-3, "wheel_inertia": 1e-6}
TURNING = {"wheel_angles[1]": 1e-5, "wheel_coulomb": 1e-6, "wheel_coulomb[1]": 1e-6}
RAMP = TorqueTable((0, 1, 2, 3), ((0, 0, 0), (0.05, -0.02, 0.03), (-0.04, 0.05, -0.02), (0, 0.02, 0.03)))
AT_REST = {"nu": (0.0, 0.0, 0.0)}
BREAKING_AWAY = {"mass": 1e-3, "torque[1][0]": 1e-5, "times[1]": 1e-4, "wheel_coulomb[0]": 1e-5, "chi[1]": 1e-4}
HELD_LONGER = Bearings(wheel_coulomb=0.01, wheel_break_away=0.016)
ROLLERS = Bearings(wheel_coulomb=1e-3, roller_coulomb=2e-3, roller_break_away=4e-3)
RUBBING = Bearings(roller_coulomb=1e-4, roller_speed=0.8, wheel_coulomb=0.003)
OF_ROLLERS = {"roller_coulomb": 1e-7, "roller_break_away": 1e-7, "wheel_radius": 1e-6, "roller_axis_radius": 1e-6}


def modes(run):
    """What the sets of bearings that stick together are, as text."""
    return {"".join(map(str, own.astype(int))) for own in Motion(run).held.sets}


@pytest.mark.long
@pytest.mark.parametrize("roller_model, law", [("massless", "impact"), ("locked", "smooth"), ("free", "impact")])
def test_axles_stick_one_after_the_other_up_to_the_end(roller_model, law):
    """Over a dozen switches; at the end everything rests, and what nu was does not matter for it any more."""
    case = Case(roller_model, law, effects=(AXLES,), duration=12.0)
    check(case, NUMBERS | TURNING)
    run = case.run(sensitivities=("nu[0]", "wheel_coulomb"))
    assert {"000", "111"} <= modes(run) and len(modes(run)) == 4
    for name in ("nu[0]", "wheel_coulomb"):
        assert np.abs(run.sensitivity(name).nu[-1]).max() < 1e-12
        assert np.abs(run.sensitivity(name).pose[-1]).max() > 1


@pytest.mark.long
@pytest.mark.parametrize("roller_model, bearings", [
    ("massless", HELD_LONGER), ("locked", Bearings(wheel_coulomb=0.01)), ("free", HELD_LONGER),
], ids=["massless", "locked, at the torque", "free"])  # fmt: skip
def test_torques_that_grow_break_axles_away(roller_model, bearings):
    """Above the sliding torque the rates jump at the break-away, whose time is that of a facet."""
    start = AT_REST | ({"spins": 0.0} if roller_model == "free" else {})
    case = Case(roller_model, effects=(RAMP, bearings), start=start, duration=3.5)
    names = BREAKING_AWAY | {"wheel_angles[1]": 1e-5}
    check(case, names | ({"wheel_break_away[0]": 1e-5} if bearings is HELD_LONGER else {}))
    assert len(modes(case.run())) >= 5


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "locked"])
def test_rollers_in_contact_stick_and_break_away(roller_model):
    """What holds them acts over rho, which changes as wheels turn."""
    case = Case(roller_model, effects=(RAMP, ROLLERS), start=AT_REST, duration=3.5)
    check(case, {"mass": 1e-3, "torque[1][0]": 5e-6, "wheel_coulomb[2]": 1e-7} | OF_ROLLERS)
    assert {"111111", "000111"} <= modes(case.run())


@pytest.mark.parametrize("bearings", [Bearings(wheel_coulomb=0.01), HELD_LONGER], ids=["at the torque", "above it"])
def test_backwards_they_are_the_same_through_break_aways(bearings):
    case, names = Case("locked", effects=(RAMP, bearings), start=AT_REST, duration=3.5), ("mass", "torque[1][0]")
    run, weights = case.run(sensitivities=names), np.array([[1.0, 2.0, 3.0]])
    found = omniroll.gradient(run, names, [3.3], nu=weights)
    for name in names:
        assert found[name] == pytest.approx((weights * run.sensitivity(name, 3.3).nu).sum(), rel=1e-11)


@pytest.mark.long
def test_a_speed_that_friction_takes_at_once_does_nothing():
    """At rest under friction a little speed is gone before the vehicle has moved by more than its square."""
    run = Case("locked", effects=(AXLES,), start=AT_REST).run(sensitivities=("nu[0]", "chi[1]"))
    assert not derivative(run, "nu[0]").any()
    assert derivative(run, "chi[1]").tolist() == [0, 0, 0, 0, 1, 0, 0, 0, 0]


@pytest.mark.long
def test_bearings_that_pass_rest_together_and_turn_on_have_none_where_they_part():
    """Straight on, and strongly back: two wheels pass rest at one time, and turn back."""
    back = Torque((0.0, 0.05, -0.05))
    start = {"nu": (0.3, 0.0, 0.0), "chi": (0.1, 0.1, -0.1)}
    ahead = omniroll.kernel(omniroll.Vehicle.paper(), "massless", "python").wheel_speeds(start["nu"])
    torque = tuple(-0.05 * np.sign(np.round(ahead, 9)))
    case = Case("massless", effects=(replace(back, torque=torque), AXLES), start=start, duration=1.0)
    check(case, {"mass": 1e-3, "wheel_coulomb": 1e-6})
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
    check(case, {"mass": 1e-3, "wheel_coulomb[2]": 1e-6, "nu[0]": 1e-4}, switches=0)
    with pytest.raises(NoDerivativeError, match=r"would leave other directions; by wheel_angles\[0\]") as caught:
        case.run(sensitivities=("wheel_angles[0]",))
    assert caught.value.wheels == (0, 1, 3) and caught.value.t == 0


TURNING_BACK = TorqueTable((0, 1), ((0.0, -0.06, 0.0), (0.0, 0.06, 0.0)))
HELD_FIRMLY = Bearings(wheel_coulomb=1e-3, wheel_break_away=0.05)


def only_just(makes, low, high):
    """The last value, from `low` on, for which `makes` is true; it is not for `high`."""
    assert makes(low) and not makes(high)
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if makes(middle) else (low, middle)
    return low


@pytest.mark.long
def test_an_axle_that_only_just_comes_to_rest_has_none():
    """Slower by any amount it sticks for a while, faster it never rests."""

    def case(speed):
        start = {"nu": (0.0, -speed, 0.1), "chi": (0.1, -0.2, 0.15)}
        return Case("massless", effects=(TURNING_BACK, HELD_FIRMLY), start=start, duration=0.8)

    def stops(speed):
        return any(own[0] == "1" for own in modes(case(speed).run()))

    check(case(0.2), {"mass": 1e-4, "nu[1]": 1e-5}, switches=0)
    speed = only_just(stops, 0.2, 1.0)
    with pytest.raises(NoDerivativeError, match="only just comes to rest") as caught:
        case(speed).run(sensitivities=("mass",))
    assert caught.value.wheels == (0,) and 0.5 < caught.value.t < 1
    check(case(speed * (1 - 1e-3)), {"mass": 1e-5}, tolerance=1e-6, switches=0)
    check(case(speed * (1 + 1e-3)), {"mass": 1e-5}, tolerance=1e-6, switches=0)


@pytest.mark.long
def test_an_axle_that_only_just_breaks_away_has_none():
    """What holds it grows while the others slow down, falls with the torque, and passes its largest value smoothly."""
    across = omniroll.kernel(omniroll.Vehicle.paper(), "massless", "python").wheel_rows[0]
    nu = np.cross((1.0, 0.0, -0.3), across)
    falling = TorqueTable((0, 1), ((0.004, 0, 0), (0.0035, 0, 0)))

    def case(most):
        bearings = Bearings(wheel_viscous=5e-3, wheel_coulomb=1e-6, wheel_break_away=(most, 1e-6, 1e-6))
        start = {"nu": tuple(0.5 * nu / np.linalg.norm(nu))}
        return Case("massless", effects=(falling, bearings), start=start, duration=0.8)

    def breaks(most):
        return len(modes(case(most).run())) > 1

    most = only_just(breaks, 0.00316, 0.004)
    check(case(0.99 * most), {"mass": 1e-4, "wheel_break_away[0]": 1e-7}, switches=0)
    with pytest.raises(NoDerivativeError, match="only just comes to its bound") as caught:
        case(most).run(sensitivities=("mass",))
    assert caught.value.wheels == (0,) and 0.2 < caught.value.t < 0.7


@pytest.mark.parametrize("before, is_followed", [(1e-3, True), (1e-9, False)])
def test_a_step_of_a_session_that_begins_just_before_a_break_away_says_so(before, is_followed):
    """How fast the torque rises it can tell from the step alone; over 1e-9 s rounding takes derivatives 3e-3 off."""
    case = Case("locked", effects=(RAMP, HELD_LONGER), start=AT_REST, duration=0.5)
    run = case.run(sensitivities=("mass",))
    sticks = run.modes == 0
    breaks = run.t[np.flatnonzero((sticks[:-1] & ~sticks[1:]).any(axis=1))[0]]
    session = omniroll.Session(
        VEHICLE, **(START | AT_REST), effects=case.effects, roller_model="locked", accuracy=1e-13,
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
