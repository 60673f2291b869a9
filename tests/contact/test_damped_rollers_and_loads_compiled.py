"""Massless rollers whose bearings stick and have viscous friction, too, beside the law coulomb where loads follow the
motion, on the compiled engine: the Python engine's motion, the laws in every row of many scenes, sessions and sweeps.
Bodies and closed forms are in test_damped_rollers_and_loads.py."""

import numpy as np
import pytest

from contact.in_steps import assert_a_session_goes_back_to_the_bit, assert_a_sweep_ends_where_its_runs_end
from contact.test_damped_rollers_and_loads import assert_the_laws_hold, scene
from contact.test_massless_rollers_beside_coulomb import assert_runs_agree, changes
from omniroll import simulate
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at
from omniroll.scenes.explanation import runs_on

SHORT = 0.02
LOCATED = 1e-11  # of its bound: as near to that polynomials of a step tell where a torque comes to it


@pytest.mark.long
@pytest.mark.parametrize("number", [12, 14])
def test_both_engines_make_the_same_motion(number):
    vehicle, options = scene(number)
    own, other = (simulate(vehicle, duration=0.0015, **options | {"engine": e}) for e in ("compiled", "python"))
    assert_runs_agree(own, other, options["effects"][1], 0.0015)


def assert_the_laws_hold_in_scenes(numbers):
    """Also where contacts slip on rollers that turn, as they do in some."""
    slipped = 0
    for number in numbers:
        run = assert_the_laws_hold(number, SHORT, "compiled", LOCATED)
        slipped += (~run.sticks & (np.abs(run.contact_spin) > 1e-6)).any()
    assert slipped >= len(numbers) / 3


def test_the_laws_hold_in_every_row():
    assert_the_laws_hold_in_scenes([9, 12, 61])


@pytest.mark.long
def test_the_laws_hold_in_every_row_of_many_scenes():
    assert_the_laws_hold_in_scenes(range(4, 40))


@pytest.mark.parametrize("number", [61, 103])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    """Where contacts come to rest and let go, and their rollers do."""
    vehicle, own = scene(number)
    run = simulate(vehicle, duration=SHORT, **own)
    assert len(changes(run, own["effects"][1])[0]) >= 3
    own.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **own)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, own = scene(61)
    assert_a_sweep_ends_where_its_runs_end(vehicle, own | {"duration": SHORT})


@pytest.mark.parametrize("number, heights, changed", [(12, (0.02, 0.06), {"nu": (0.5, 0, 1)}), (25, (0.1, 0.3), {})])
def test_contacts_that_go_almost_along_their_axles_take_few_evaluations(number, heights, changed):
    """There a little less of a load turns a way by much, and loads feel the ways. In the first scene one such contact
    comes to rest, in the second two turn each other."""
    vehicle, own = scene(number, *heights)
    run = simulate(vehicle, duration=SHORT, **own | changed)
    along = ~run.sticks & (np.abs(run.slip[..., 1]) < 0.2 * np.abs(run.slip[..., 0])) & (run.contact_spin != 0)
    assert along.any()
    assert run.stats["evaluations"] <= 1e5


def test_a_roller_is_let_go_as_near_to_that_as_it_is_located():
    """At this accuracy so little before it that the state still says a spin against the one that begins."""
    vehicle, own = scene(14, 0.1, 0.3)
    run, finer = (simulate(vehicle, duration=SHORT, **own | {"accuracy": accuracy}) for accuracy in (1e-9, 1e-11))
    begun, as_finer = (of.sample(0.004).contact_spin for of in (run, finer))
    assert run.contact_spin[0, 3] == 0 and begun[3] < -0.01
    assert begun == pytest.approx(as_finer, abs=1e-7)
    assert distance_at(run, finer, np.linspace(0, SHORT, 9)) <= 1e-9


def test_the_compiled_engine_runs_them_and_says_so():
    vehicle, own = scene(12)
    own.pop("control")
    assert runs_on(checked_task(vehicle, duration=SHORT, **own)) == "compiled engine, compiled kernel"
