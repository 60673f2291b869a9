"""Massless rollers that stick under loads that follow the motion, on the compiled engine: the Python engine's motion,
how random scenes end, sessions, sweeps, and what they cost. Closed forms, every body and the laws in every row are in
test_massless_rollers_under_loads.py."""

import numpy as np
import pytest
from costs.counting import missing
from costs.massless_rollers_under_loads import GROUNDS, measured

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_axles_under_loads import ENGINES, run_or_stop
from contact.test_massless_rollers_compiled import assert_phases_agree, changes
from contact.test_massless_rollers_under_loads import assert_laws_hold, scene
from omniroll import simulate
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at
from omniroll.scenes.explanation import runs_on

SHORT = 0.02  # s, of which the Python engine takes a quarter of a minute


def assert_same_motion(number, low=True, duration=SHORT):
    vehicle, options = scene(number, low)
    options["accuracy"] = 1e-10
    (own, why), (other, same) = (run_or_stop(vehicle, options, engine, duration) for engine in ENGINES)
    assert [run.stats["engine"] for run in (own, other)] == list(ENGINES)
    assert bool(why) == bool(same) and own.t[-1] == pytest.approx(other.t[-1], rel=1e-8)
    if own.t[-1] == 0:  # loads and friction do not determine each other where it stands (tall scene 19)
        return
    assert_phases_agree(own, other, 1e-10)
    end = min(own.t[-1], other.t[-1])
    assert distance_at(own, other, np.linspace(0, end, 7)) < 1e-9
    size = own.energy.max() + sum(map(abs, own.ledger.contributions.values()))
    assert abs(own.ledger.residual) <= 1e-11 * size


@pytest.mark.parametrize("number", [0, 2, 4])
def test_both_engines_make_the_same_motion(number):
    assert_same_motion(number)


@pytest.mark.long
@pytest.mark.parametrize("low", [True, False])
@pytest.mark.parametrize("number", [*range(5, 13), 19])
def test_both_engines_make_the_same_motion_in_many_scenes(number, low):
    assert_same_motion(number, low, SHORT / 2)


@pytest.mark.long
def test_random_scenes_end():
    """None hangs, and the laws hold in every row."""
    turned = 0
    for number in range(70):
        vehicle, options = scene(number)
        run, why = run_or_stop(vehicle, options, "compiled", 0.05)
        assert not why, (number, why)
        turned += assert_laws_hold(vehicle, options, run).any()
    assert turned > 35


# Sessions and sweeps


@pytest.mark.parametrize("number", [1, 3])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    vehicle, options = scene(number)
    run = simulate(vehicle, duration=SHORT, **options | {"accuracy": 1e-10})
    assert run.stats["phases"] > 1
    options.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **options | {"accuracy": 1e-10})


def test_a_step_may_end_however_little_before_an_event():
    vehicle, options = scene(4)
    options["accuracy"] = 1e-12
    run = simulate(vehicle, duration=2 * SHORT, **options)
    instants = np.unique(np.concatenate([own for own, _ in changes(run)]))
    events = instants[(instants > 1e-4) & (instants < run.t[-1])]
    assert len(events) >= 1
    options.pop("control")
    assert_steps_may_end_beside(vehicle, run, events[:2], **options)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, options = scene(4)
    assert_a_sweep_ends_where_its_runs_end(vehicle, options | {"duration": SHORT})


# Which engine runs


def test_the_compiled_engine_runs_them_and_says_so():
    vehicle, options = scene(0)
    options.pop("control")
    assert runs_on(checked_task(vehicle, duration=0.1, **options)) == "compiled engine, compiled kernel"


def test_a_contact_that_neither_carries_nor_stays_off_stops_a_run():
    """Its load vanishes; off it takes no friction, and without that the others' loads would press it down at once."""
    vehicle, options = scene(25, low=False)
    ends = [run_or_stop(vehicle, options, engine, SHORT) for engine in ENGINES]
    assert all("loads and friction have no solution" in why for _, why in ends)
    assert ends[0][0].t[-1] == pytest.approx(ends[1][0].t[-1], rel=1e-6)


# Cost


@pytest.mark.long
@pytest.mark.skipif(bool(missing()), reason=f"counting needs {missing()}")
def test_rollers_that_stick_against_rollers_that_turn_on_the_same_ground():
    """Dearest is a named speed of 1e-4 m/s under torques that jump; the table is in docs/bearings-on-the-ground.md."""
    grounds = measured(("torque",))["torque"]
    assert set(grounds) == set(GROUNDS)
    for free, *bearings in grounds.values():
        assert free.instructions > 1e5
        for own in bearings:
            assert own.evaluations <= 5 * free.evaluations and own.instructions <= 7 * free.instructions
