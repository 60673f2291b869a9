"""Massless rollers whose bearings stick and have viscous friction, too, beside the law coulomb, on the compiled engine:
the Python engine's motion, the laws in every row of more scenes, sessions and sweeps. Roots, bodies and closed forms
are in test_massless_rollers_that_stick_and_drag.py."""

import numpy as np
import pytest

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_massless_rollers_beside_coulomb import assert_runs_agree, changes
from contact.test_massless_rollers_that_stick_and_drag import assert_the_laws_hold, dragging
from omniroll import simulate
from omniroll.engine.simulate import checked_task
from omniroll.scenes.explanation import runs_on

SHORT = 0.02


def assert_same_motion(number):
    vehicle, options = dragging(number)
    own, other = (simulate(vehicle, duration=SHORT, **options | {"engine": e}) for e in ("compiled", "python"))
    assert_runs_agree(own, other, options["effects"][1], SHORT)


@pytest.mark.parametrize("number", [2, 14])
def test_both_engines_make_the_same_motion(number):
    assert_same_motion(number)


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 7, 9, 12])
def test_both_engines_make_the_same_motion_in_more_scenes(number):
    assert_same_motion(number)


@pytest.mark.long
def test_the_laws_hold_in_every_row_of_many_scenes():
    slipped = 0
    for number in range(60):
        run = assert_the_laws_hold(number, 0.05, "compiled")
        slipped += (~run.sticks & (np.abs(run.contact_spin) > 1e-6)).any()
    assert slipped > 20


# Sessions and sweeps


@pytest.mark.parametrize("number", [2, 9])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    """Without axles that stick, and with such."""
    vehicle, own = dragging(number)
    run = simulate(vehicle, duration=SHORT, **own)
    assert len(changes(run, own["effects"][1])[0]) >= 3
    own.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **own)


@pytest.mark.parametrize("number", [2, 9])
def test_a_step_may_end_however_little_before_an_event(number):
    vehicle, own = dragging(number)
    own |= {"accuracy": 1e-12}
    run = simulate(vehicle, duration=SHORT + 0.02, **own)
    instants, _ = changes(run, own["effects"][1])
    instants = instants[instants < SHORT]
    assert len(instants) >= 3
    own.pop("control")
    assert_steps_may_end_beside(vehicle, run, instants[:4], **own)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, own = dragging(2)
    assert_a_sweep_ends_where_its_runs_end(vehicle, own | {"duration": SHORT})


# Which engine runs


def test_the_compiled_engine_runs_them_and_says_so():
    vehicle, own = dragging(2)
    own.pop("control")
    assert runs_on(checked_task(vehicle, duration=SHORT, **own)) == "compiled engine, compiled kernel"
