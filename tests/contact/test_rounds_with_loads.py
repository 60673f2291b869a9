"""Contacts that let go under loads that follow the motion, where modes and loads do not find each other in turn: a
closed form, Newton's rule by itself, random scenes, and both engines."""

from types import SimpleNamespace

import numpy as np
import pytest

from contact.test_rollers_and_loads_on_the_ground import (
    RELATIVE,
    WEIGHT,
    assert_engines_agree,
    assert_scene_obeys,
    scene,
)
from contact.test_rollers_on_the_ground import ARM, HOLDS, MASS, RADIUS, RHO, ROLLER, WHEEL, run_of
from omniroll import Bearings, Contact, Torque
from omniroll.effects import loaded_ground
from omniroll.effects.ground_loads import Carried, GroundFailsError, Loads
from omniroll.effects.rounds_with_loads import root

ENDS = (317, 360, 584, 609, 739, 741, 763, 870, 1018, 1131, 1178, 1241, 1318, 1350, 1424, 1426)  # random scenes
TIPS = (1168, 1468)
__all__ = ["run_of"]  # a fixture: by each engine


# ---- a closed form ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_wheel_that_slips_gets_the_load_under_which_it_would_have_stuck(run_of, part):
    """Wheels 2 and 4 of a cross drive it from rest along x by (b - S)/l each, beside J a/l^2; wheel 1 in front rolls on
    its roller, whose bearing takes T, and wheel 3 behind is held by its roller, whose bearing takes all. It gives way
    beyond mu_s W/4. Then M a is 2 (b - S)/l - T/rho - mu N, and acceleration moves load behind: 2 R (N - W/4) is what
    M h a is, what both wheels turn faster by, 2 J a/l, and the roller in front by, B a/rho. Under that load static
    friction would hold it, and where it holds there is no such load: it slips."""
    high, breaks, turns, sliding, static = 0.06, 0.02, 1e-4, 0.5, 0.7
    mass = MASS + 2 * WHEEL / RADIUS**2 + ROLLER / RHO**2
    moves = (MASS * high + 2 * WHEEL / RADIUS + ROLLER / RHO) / (2 * ARM)

    def fastest(force):
        return (force - sliding * WEIGHT / 4) / (mass + sliding * moves)

    least = static * WEIGHT / 4  # force that lets it go; where the load that it gets then would hold it to is most
    most = static * (WEIGHT / 4 - moves * sliding * WEIGHT / 4 / (mass + sliding * moves))
    most /= 1 - static * moves / (mass + sliding * moves)
    assert most > 1.01 * least
    force = least + part * (most - least)
    assert static * (WEIGHT / 4 + moves * fastest(force)) > force > least
    torque = breaks + RADIUS * (force + turns / RHO) / 2
    ground = Contact(
        law="coulomb", friction=(sliding, 3.0), static_friction=(static, 3.0), loads="dynamic", height=high
    )
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=(turns, HOLDS, HOLDS, HOLDS))
    run = run_of([ground, bearings, Torque((0, torque, 0, -torque))], 1e-6)
    moved = moves * fastest(force)
    loads = [WEIGHT / 4 - moved, WEIGHT / 4, WEIGHT / 4 + moved, WEIGHT / 4]
    assert run.ground_load[0] == pytest.approx(loads, rel=RELATIVE)
    assert run.sticks[0].tolist() == [True, True, False, True]
    assert run.nu[-1, 0] * ARM == pytest.approx(fastest(force) * run.t[-1], rel=1e-7)


# ---- Newton's rule ---------------------------------------------------------------------------------------------------


def bent(moments):
    """A map of the plane with an edge, less the identity. Its slopes are -9 and 0.9 beside it, so that no turns end."""
    x, y = moments - [0.3, -0.2]
    return np.array([-9 * x + 0.9 * y if x > 0 else -3 * x + 0.9 * y, 0.5 * x - 4 * y]) - [x, y]


def test_newtons_rule_passes_an_edge():
    assert root(bent, np.array([2.0, 1.5]), 1.0) == pytest.approx([0.3, -0.2], abs=1e-14)
    assert root(bent, np.array([-2.0, 1.5]), 1.0) == pytest.approx([0.3, -0.2], abs=1e-14)


def test_newtons_rule_says_where_there_is_nothing():
    assert root(lambda moments: np.array([1 + moments[0] ** 2, moments[1]]), np.array([1.0, 1.0]), 1.0) is None


@pytest.mark.parametrize("slip_is_zero, carries, what", [
    (True, True, "contacts hold or let go"),
    (True, False, "bearings hold or let go"),
    (False, True, "bearings hold or let go"),
])  # fmt: skip
def test_words_name_contacts_where_some_may_let_go(monkeypatch, slip_is_zero, carries, what):
    """Where all slip only bearings are decided; a contact that is off holds nothing."""
    monkeypatch.setattr(loaded_ground, "take_rounds", lambda *_: False)
    monkeypatch.setattr(loaded_ground.Kept, "of", lambda _: None)
    places = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
    loads = Loads(places, np.full(4, 10.0))
    loads.carries[0] = carries
    found = Carried(np.full(4, 10.0), loads.start, np.full(4, 10.0), np.array(1.0))
    ground = SimpleNamespace(
        loads=loads, pressing=found.loads, _take_turns=lambda *_: found, contacts_in_rounds=lambda rests: rests
    )
    rests = np.array([slip_is_zero, False, False, False])
    with pytest.raises(GroundFailsError, match=f"do not find each other where {what}: wheel"):
        loaded_ground.LoadedGround.find_modes_and_loads(ground, rests, None, None)


# ---- random scenes ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", ENDS)
def test_scenes_whose_turns_do_not_end_run_and_obey_the_laws(number):
    vehicle, options = scene(number)
    run, reason = assert_scene_obeys(vehicle, options)
    assert not reason and run.t[-1] == options["duration"]


@pytest.mark.parametrize("number", TIPS)
def test_such_vehicles_tip_later(number):
    _, reason = assert_scene_obeys(*scene(number))
    assert reason.startswith("the vehicle tips over the edge")


@pytest.mark.long
@pytest.mark.parametrize("number", [317, 870, 1468])
def test_both_engines_make_the_same_motion_behind_such_instants(number):
    assert_engines_agree(*scene(number))
