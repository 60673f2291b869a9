"""Sensitivities of runs in which massless rollers stick beside contacts that stick, and their bearings have viscous
friction, too, against differences of runs in 40 digits, in which the way of each contact that slips while its roller
turns is an unknown number (hard.true_damped_strips)."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, OmnirollError, TorqueTable, Vehicle
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import (
    Case,
    assert_the_same_backwards_and_in_sessions,
    derivative,
    differenced,
)
from tests.sensitivities.test_compiled_beside_contacts import apart
from tests.sensitivities.test_massless_rollers_beside_contacts import assert_true, ways

SKID = Contact(law="coulomb", friction=(0.37, 0.39), wheel_rates=(-3.8, -0.6, -3.1))
DRAGGING = Bearings(roller_coulomb=(0.037, 0.036, 0.023), roller_viscous=(0.001, 0.003, 0.002))
PUSH = TorqueTable((0.0, 0.05), ((0.0, 0.0, 0.0), (0.3, -0.2, 0.4)))
SLOW = {"nu": (0.136, 0.03, 0.046), "chi": (0.475, 0.32, 0.16)}
SKIDDING = Case("massless", effects=(SKID, DRAGGING, PUSH), start=SLOW, duration=0.004)
HELD = Contact(law="coulomb", friction=(0.3, 0.25), static_friction=(0.36, 0.3), wheel_rates=(3.0, -2.0, 1.0))
HELD_LONGER = Bearings(
    roller_coulomb=0.02, roller_break_away=0.03, roller_viscous=0.001, wheel_coulomb=0.05, wheel_break_away=0.07
)
# On a cross whose wheels 0 and 2 are dragged along their axles by what bearings would take more than the ground gives.
CROSS, STRAIGHT = Vehicle.paper(4, 4), {"chi": (0.1, 0.05, -0.1, 0.02), "pose": (0, 0, 0)}
RUBBING = Bearings(roller_coulomb=0.026, roller_viscous=0.0078)
SPUN = Contact(law="coulomb", friction=0.3, wheel_rates=(1.0, -9.0, -0.5, 10.0))
TO_AND_FRO = TorqueTable((0.0, 0.04), ((-0.1, 0, 0.1, 0), (0.1, 0.05, -0.1, 0)))
DRAGGED = Case(
    "massless", vehicle=CROSS, effects=(SPUN, RUBBING, TO_AND_FRO), start=STRAIGHT | {"nu": (4.0, 0.1, 0.3)},
    duration=0.018,
)  # fmt: skip
STICKING = Contact(law="coulomb", friction=0.3, static_friction=0.4)
TURNED = TorqueTable((0.0, 0.012), ((-0.1, 0, -0.02, 0), (1.2, 0, -0.1, 0)))
LETS_GO = Case(
    "massless", vehicle=CROSS, effects=(STICKING, replace(RUBBING, roller_viscous=0.0053), TURNED),
    start={"nu": (3.3, 0.1, 15.0), "chi": (-0.24, 0.05, 0.1, 0.02), "pose": (0, 0, 0)}, duration=0.003,
)  # fmt: skip
CASES = {
    "rests, stops and break-aways": (
        replace(SKIDDING, duration=0.0095), ("roller_viscous[1]",), {"ms mm", "mm sm", "sm ss"}
    ),
    "with jumps, beside axles": (
        Case("massless", effects=(HELD, HELD_LONGER), start={"nu": (0.3, 0.1, 0.2)}, duration=0.02),
        ("roller_break_away",), {"ms mm", "mm sm"}
    ),
    "a slip along the rolling direction passes zero": (DRAGGED, ("nu[1]",), set()),
    "a contact lets go and slips along its axle at once": (LETS_GO, ("static_friction[0]",), {"sm mm"}),
}  # fmt: skip


@pytest.mark.parametrize("name, change", [("mass", 1e-4), ("roller_viscous[1]", 1e-5)])
def test_where_rollers_turn_and_contacts_come_to_rest(name, change):
    run = SKIDDING.run(sensitivities=(name,), accuracy=1e-12)
    assert {"ms mm", "mm sm"} <= ways(run)
    wanted = differenced(SKIDDING, name, change, accuracy=1e-12)
    assert np.abs(derivative(run, name) - wanted).max() <= 1e-7 * np.abs(wanted).max()


@pytest.mark.long
@pytest.mark.parametrize("case, names, seen", CASES.values(), ids=CASES)
def test_they_are_the_differences_of_runs_in_40_digits(case, names, seen):
    assert_true(case, names, seen)


@pytest.mark.long
def test_those_cases_are_what_they_say():
    """One slip passes zero along the rolling direction and not along the axle; the other begins along the axle."""
    run = DRAGGED.run(accuracy=1e-9)
    assert run.slip[0, 0, 1] > 0 > run.slip[-1, 0, 1] and (run.slip[:, 0, 0] > 0.1).all()
    run = LETS_GO.run(accuracy=1e-9)
    begins = np.flatnonzero(~run.sticks[:, 0])[0]
    assert run.slip[begins, 0, 0] > 1e-3 and not run.slip[begins - 1, 0].any() and not run.slip[begins, 0, 1]


@pytest.mark.long
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same():
    assert_the_same_backwards_and_in_sessions(replace(SKIDDING, duration=0.0126))


def at_random(number):
    """The paper's vehicle, whose bearings take any part of the ground's friction at speeds of 0.03 to 3 m/s."""
    random = np.random.default_rng([77, number])
    friction = random.uniform(0.15, 0.5, 2)
    moment = 0.15 * friction[0]  # N m, about what the ground gives on the arm of a roller, of 2 cm
    coulomb = moment * random.uniform(0.05, 0.7, 3)
    numbers = {"roller_coulomb": coulomb, "roller_break_away": coulomb * random.choice([1.0, 1.3])}
    numbers["roller_viscous"] = 0.02 * moment / 10 ** random.uniform(-1.5, 0.5, 3)
    ground = Contact(law="coulomb", friction=friction, static_friction=friction * random.choice([1.0, 1.3]),
                     wheel_rates=random.normal(size=3) * 3)  # fmt: skip
    push = TorqueTable((0.0, 0.06), random.normal(size=(2, 3)) * 0.6)
    start = {"nu": random.normal(size=3) * 10 ** random.uniform(-1, 0.5), "chi": random.uniform(-0.55, 0.55, 3)}
    return Case("massless", effects=(ground, Bearings(**numbers), push), start=start, duration=0.02)


@pytest.mark.long
def test_c_gives_what_python_gives_in_random_scenes(monkeypatch):
    """In scene 64 a slip passes zero along the rolling direction, and a roller begins to turn elsewhere after that."""
    found = Counter()
    for number in (*range(5), 64):
        try:
            own, difference = apart(at_random(number), ("mass", "roller_viscous[0]", "friction[1]"), monkeypatch)
        except OmnirollError:  # something only just happens
            continue
        assert difference <= 1e-11, number
        found.update(ways(own))
    assert {"ms mm", "mm sm", "mm ms"} <= found.keys(), found


@pytest.mark.long
def test_a_rest_along_the_axle_alone_has_none():
    """There the force is at its bound."""
    ground, start = Contact(law="coulomb", friction=0.3), {"nu": (4.0, 0, 0), "chi": (0.1, 0, -0.1, 0)}
    effects, start = (ground, RUBBING), start | {"pose": (0, 0, 0)}
    case = Case("massless", vehicle=CROSS, effects=effects, start=start, duration=0.3)
    run = case.run(accuracy=1e-9)
    rests = np.flatnonzero(Motion(run).contacts.sticks[:, 0])[0]
    assert run.slip[rests - 2, 0, 0] > 0 and abs(run.slip[rests - 2, 0, 1]) < 1e-12
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        case.run(sensitivities=("mass",), accuracy=1e-9)
    assert error.value.wheels == (0, 2) and error.value.t == pytest.approx(run.t[rests], abs=1e-9)
