"""Massless rollers whose bearings stick beside the law coulomb where loads follow the motion, on the compiled engine:
the Python engine's motion, how random scenes end, sessions and sweeps. Closed forms and every body are in
test_massless_rollers_and_loads.py."""

from dataclasses import replace

import numpy as np
import pytest

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_axles_under_loads import ENGINES, run_or_stop
from contact.test_massless_rollers_and_loads import assert_the_laws_hold, scene
from contact.test_massless_rollers_beside_coulomb import changes
from contact.test_massless_rollers_that_stick import LAW, residuals
from omniroll import Bearings, Contact, TorqueTable, Vehicle, simulate
from omniroll.engine.motion import Motion
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at
from omniroll.scenes.explanation import runs_on

SHORT = 0.006  # s, of which the Python engine takes a second
LONGER = 0.03
# How runs may stop, and no other way.
KINDS = ("the vehicle tips over the edge", "have no solution", "have several solutions", "do not determine each other")


def kind_of(why):
    """The place of a reason among KINDS, or of none behind them."""
    return next((k for k, kind in enumerate(KINDS) if kind in why), len(KINDS))


def assert_same_motion(number, duration=SHORT):
    vehicle, options = scene(number)
    (own, why), (other, same) = (run_or_stop(vehicle, options, engine, duration) for engine in ENGINES)
    assert [run.stats["engine"] for run in (own, other)] == list(ENGINES)
    assert kind_of(why) == kind_of(same) and bool(why) == bool(same)
    assert own.t[-1] == pytest.approx(other.t[-1], rel=0, abs=1e-10)
    if own.t[-1] == 0:  # it tips where it starts
        return
    assert own.stats["phases"] == other.stats["phases"]
    (instants, modes), (theirs, those) = (changes(run, options["effects"][1]) for run in (own, other))
    np.testing.assert_array_equal(modes, those)
    np.testing.assert_allclose(instants, theirs, rtol=0, atol=1e-10)
    end = min(own.t[-1], other.t[-1])
    assert distance_at(own, other, np.linspace(0, end, 7)) <= 1e-9


@pytest.mark.parametrize("number", [0, 2, 4])
def test_both_engines_make_the_same_motion(number):
    assert_same_motion(number)


@pytest.mark.long
def test_both_engines_make_the_same_motion_in_many_scenes():
    for number in range(5, 15):
        assert_same_motion(number)


@pytest.mark.parametrize("number", [1, 2, 4, 7])
def test_the_laws_hold_in_every_row(number):
    assert_the_laws_hold(number, "compiled")


@pytest.mark.long
def test_many_scenes_end():
    """None hangs, and what does not run to its end says why."""
    for number in range(120):
        assert kind_of(assert_the_laws_hold(number, "compiled", LONGER) or KINDS[0]) < len(KINDS), number


# Sessions and sweeps


@pytest.mark.parametrize("number", [2, 4])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    vehicle, options = scene(number)
    run = simulate(vehicle, duration=LONGER, **options)
    assert run.stats["phases"] > 1
    options.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **options)


def test_a_step_may_end_however_little_before_an_event():
    vehicle, options = scene(4)
    options["accuracy"] = 1e-12
    run = simulate(vehicle, duration=2 * LONGER, **options)
    instants, _ = changes(run, options["effects"][1])
    events = instants[(instants > 1e-4) & (instants < LONGER)]
    assert len(events) >= 1
    options.pop("control")
    assert_steps_may_end_beside(vehicle, run, events[:2], **options)


def test_a_sweep_ends_where_its_runs_end():
    """Its spins follow from the loads as the last step has them, to its accuracy; those of a row from its own loads."""
    vehicle, options = scene(4)
    assert_a_sweep_ends_where_its_runs_end(vehicle, options | {"duration": SHORT}, options["accuracy"])


# Events

STOPPING = {
    "nu": (-0.50383388, 0.36680109, -0.15133744), "chi": (-0.46279298, -0.56904078, -0.52358438), "effects": [
        Contact(law="coulomb", friction=(0.3, 0.25), static_friction=(0.4, 0.35), loads="dynamic", height=0.06,
                wheel_rates=(0.0266188, 3.11377031, 3.9311959)),
        Bearings(roller_coulomb=(0.0010472, 0.01968064, 0.00394484),
                 roller_break_away=(0.00164048, 0.02268021, 0.00565381)),
        TorqueTable((0.0, 0.025), ((0, 0, 0), (0.48382411, -0.37471067, -0.35763075))),
    ], "duration": 0.025, "accuracy": 1e-12, "roller_model": "massless", "control": False,
}  # fmt: skip


@pytest.mark.parametrize("by", [0, *(sign * size for size in (1e-10, 1e-9, 3e-9, 1e-8) for sign in (1, -1))])
def test_a_roller_stops_where_its_spin_is_zero(by):
    """Its spin at a step's end follows from the load there: by that of the step before it seemed to have passed zero,
    and the roller stopped with 0.06 rad/s left, in runs whose wheels differ by rounding."""
    paper = Vehicle.paper()
    run = simulate(paper.replace(wheel_radius=paper.wheel_radius * (1 + by)), **STOPPING)
    modes = Motion(run).massless.modes.reshape(len(run), -1)[:, 1]
    (stop,) = np.flatnonzero((modes[:-1] == 1) & (modes[1:] == 0))
    assert run.contact_spin[:, 1].max() > 1 and abs(run.contact_spin[stop, 1]) < 1e-9


TALL = 0.25  # m, up to which the centre of mass of tall scenes is


def test_modes_and_loads_are_found_where_rollers_break_away_under_loads_that_follow():
    """Each roller that turns takes less than the one that has held, and the loads that follow would not let it go."""
    vehicle, options = scene(632, TALL)
    own, other = (simulate(vehicle, duration=1e-4, engine=engine, **options) for engine in ENGINES)
    assert max(residuals(vehicle, options["effects"], own).values()) <= LAW
    assert own.ground_load[0] == pytest.approx(other.ground_load[0], rel=1e-10)
    assert own.nu[-1] == pytest.approx(other.nu[-1], rel=1e-10, abs=1e-12)


def test_a_roller_stops_in_a_fold_of_friction_and_loads():
    """It still turns where the solution in which it does ends; that in which it sticks is the one which the Python
    engine finds there, beginning with loads at rest."""
    vehicle, options = scene(409)
    run = simulate(vehicle, duration=LONGER, **options)
    modes = Motion(run).massless.modes.reshape(len(run), -1)
    stops = (np.diff(run.t) == 0)[:, None] & (modes[:-1] != 0) & (modes[1:] == 0)
    ((fold, wheel),) = np.argwhere(stops & (np.abs(run.contact_spin[:-1]) > 0.01))
    assert run.contact_spin[fold + 1, wheel] == 0
    ground, *others = options["effects"]
    state = {"nu": run.nu[fold], "chi": run.chi[fold], "pose": run.pose[fold], "start_time": run.t[fold]}
    effects = [replace(ground, wheel_rates=run.quantity("rates")[fold]), *others]
    options |= state | {"effects": effects}
    at_once = simulate(vehicle, duration=1e-9, engine="python", **options)
    assert run.ground_load[fold + 1] == pytest.approx(at_once.ground_load[0], rel=1e-10)
    behind = simulate(vehicle, duration=LONGER - run.t[fold], **options)
    assert max(residuals(vehicle, effects, behind).values()) <= LAW
    assert behind.nu[-1] == pytest.approx(run.nu[-1], rel=1e-8)


@pytest.mark.parametrize("number, words", [(1589, "where contacts hold or let go:"), (1006, "behind a fold, in which")])
def test_what_is_not_found_is_said_where_it_is(number, words):
    """Behind the fold are loads just above what a bearing takes all of, which are not found so far."""
    vehicle, options = scene(number, TALL)
    _, why = run_or_stop(vehicle, options, "compiled", LONGER)
    assert f"loads and friction do not find each other {words}" in why


# Which engine runs


def test_the_compiled_engine_runs_them_and_says_so():
    vehicle, options = scene(0)
    options.pop("control")
    assert runs_on(checked_task(vehicle, duration=SHORT, **options)) == "compiled engine, compiled kernel"
