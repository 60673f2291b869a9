"""What wheels that slip and contacts that stick cost on the compiled engine: evaluations, and instructions."""

import numpy as np
import pytest
from costs.contacts import STICKING
from costs.counting import counted, missing

from omniroll import Contact, Motor, Springs, Vehicle, simulate

PAPER = Vehicle.paper()
MOTION = {"nu": (2.0, 1.0, 0.0), "duration": 1.0, "control": False}


def evaluations(*effects):
    return simulate(PAPER, **MOTION, effects=effects).stats["evaluations"]


def regularised(speed):
    return Contact(law="regularised", friction=0.3, speed=speed, wheel_rates=0)


@pytest.mark.long
def test_a_small_named_speed_costs_at_most_five_times_a_large_one():
    """The wheels skid until they roll, and at each of six switches the entering roller does."""
    assert evaluations(regularised(1e-6)) <= 5 * evaluations(regularised(1e-2))


@pytest.mark.long
@pytest.mark.parametrize("coefficient, times", [(3.0, 10), (30.0, 12), (1e4, 16)])
def test_slip_on_a_viscous_ground_against_the_bare_vehicle(coefficient, times):
    """Rolling evaluates in long steps; with slip each switch begins with steps as short as the roller's spin-up."""
    assert evaluations(Contact(coefficient, wheel_rates=0)) <= times * evaluations()


def set_valued(friction):
    return Contact(law="coulomb", friction=friction, wheel_rates=0)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
def test_set_valued_friction_against_the_bare_vehicle(friction):
    """Contacts come to rest one after the other, and anew behind each of six switches."""
    assert evaluations(set_valued(friction)) <= 10 * evaluations()


@pytest.mark.parametrize("deflection, times", [(1e-3, 10), (1e-4, 20), (1e-5, 30)])
def test_set_valued_friction_on_springs_against_the_bare_vehicle(deflection, times):
    """The swing of the platform behind each event is followed, and no more."""
    springs = Springs(height=0.06, deflection=deflection)
    assert evaluations(set_valued(0.3), springs) <= times * evaluations()


@pytest.mark.long
@pytest.mark.skipif(bool(missing()), reason=f"counting needs {missing()}")
def test_instructions_against_those_of_rolling():
    """One process counts all: where contacts slip, free rollers' directions are solved for beside the rates; where all
    contacts stick, nothing switches. `python -m costs.contacts` has all."""
    slips = {friction: f"free|coulomb, friction {friction}|static loads" for friction in ("0.1", "1")}
    resting = [f"free|sticking|{ground}" for ground in STICKING]
    found = counted("costs.contacts", ["free||", *slips.values(), *resting])
    rolling = found["free||"].instructions
    for name in slips.values():
        assert 1e5 < rolling < found[name].instructions <= 10 * rolling
        assert found[name].rejected_steps <= found[name].steps / 4
    rolls, sticks = (found[name] for name in resting)
    assert rolls.switches == sticks.switches == 0
    assert 1e5 < rolls.instructions <= sticks.instructions <= 2 * rolls.instructions


def test_rates_that_a_decision_finds_serve_the_step_behind_it_alone():
    """The next step of a phase in which all stick begins with its own rates: a guess from older ones costs sweeps."""
    drive = Motor((3.0, -2.0, 1.0), torque_constant=0.02, resistance=0.5, gear_ratio=12)
    taken = [
        simulate(PAPER, nu=(0, 0, 0), duration=0.3, roller_model="massless", control=False, effects=effects,
                 accuracy=1e-13).stats
        for effects in ((drive,), (Contact(law="coulomb", friction=50.0), drive))
    ]  # fmt: skip
    assert taken[1]["steps"] > taken[1]["phases"]
    assert taken[1]["evaluations"] <= 1.4 * taken[0]["evaluations"]


@pytest.mark.parametrize("accuracy", [1e-9, 1e-13])
@pytest.mark.parametrize("rollers", ["massless", "free"])
def test_contacts_that_stick_beside_motors_against_rolling_with_them(rollers, accuracy):
    """The back-EMF damps the wheels' rates, which follow nu where contacts stick: the iteration must solve for nu as in
    rolling, and not for each wheel as if it turned by itself."""
    drive = Motor((0.3, -0.2, 0.1), torque_constant=0.02, resistance=0.5, gear_ratio=12)
    rolling, sticking = [
        simulate(PAPER, nu=(0, 0, 0), duration=0.3, roller_model=rollers, control=False, effects=effects,
                 accuracy=accuracy)
        for effects in ((drive,), (Contact(law="coulomb", friction=50.0), drive))
    ]  # fmt: skip
    assert sticking.sticks.all()
    assert sticking.stats["phases"] == rolling.stats["phases"] == 1
    assert sticking.stats["evaluations"] <= 2 * rolling.stats["evaluations"]
    assert np.abs(sticking.nu[-1] - rolling.nu[-1]).max() <= 2 * accuracy * np.abs(rolling.nu).max()


def test_slips_come_to_rest_whatever_the_accuracy():
    """On the way to rest directions turn ever faster, and are known the less the slower a slip is: steps
    that asked for more than that never ended."""
    random = np.random.default_rng(5)
    for _ in range(6):
        nu, friction = random.normal(size=3), random.uniform(0.05, 1)
        ends = []
        for accuracy in (1e-13, 1e-12, 1e-10, 1e-8):
            options = {"duration": 0.5, "control": False, "accuracy": accuracy, "effects": (set_valued(friction),)}
            run = simulate(PAPER, nu=nu, **options)
            assert run.stats["evaluations"] <= 1e5
            ends.append(np.concatenate([run.nu[-1], run.pose[-1]]))
            assert np.abs(ends[-1] - ends[0]).max() <= 10 * accuracy
