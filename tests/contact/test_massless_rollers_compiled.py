"""Massless rollers whose bearings stick where wheels may slip, on the compiled engine:
sessions, sweeps, and steps at events. Closed forms and the laws in every row are in test_massless_rollers.py."""

import numpy as np
import pytest

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_massless_rollers import contact_torques, scene
from omniroll import Bearings, Contact, Session, TorqueTable, Vehicle, simulate
from omniroll.engine.simulate import checked_task
from omniroll.kernels import sets
from omniroll.results.slipping import rollers_hold
from omniroll.scenes.explanation import runs_on

DURATION = 0.3


def changes(run):
    """Of each wheel when its roller in contact changes its mode, and the modes that follow: 0 where it sticks, else the
    sign of its spin. A row that ends a phase has the torque of that phase; where a spin is zero both modes have one. A
    roller that turns back has stuck between two rows."""
    taken = contact_torques(run)
    sticks = rollers_hold(taken, run.effects.sliding_of_massless_rollers(run._effect_kernel))
    found = []
    for mode in np.where(sticks, 0, -np.sign(taken)).T:
        instants, modes = [], []
        for row in np.flatnonzero(mode[1:] != mode[:-1]) + 1:
            if mode[row - 1] != 0:
                instants.append(run.t[row - 1])
                modes.append(0)
            if mode[row] != 0:
                instants.append(run.t[row])
                modes.append(mode[row])
        found.append((np.array(instants), modes))
    return found


def events(run):
    """The instants of all wheels in (0, 0.9 DURATION), in their order."""
    instants = np.unique(np.concatenate([own for own, _ in changes(run)]))
    return instants[(instants > 1e-3) & (instants < 0.9 * DURATION)]


# Sessions and sweeps


@pytest.mark.parametrize("number", [3, 4])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    """Also between the two torques of a bearing, where a roller stays in the mode that it is in."""
    vehicle, own = scene(number)
    run = simulate(vehicle, duration=DURATION, **own)
    assert len(events(run)) > 3
    own.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **own)


@pytest.mark.parametrize("number", [2, 4])
def test_a_step_may_end_however_little_before_an_event(number):
    vehicle, own = scene(number)
    own |= {"accuracy": 1e-12}
    run = simulate(vehicle, duration=DURATION, **own)
    assert len(events(run)) >= 3
    own.pop("control")
    assert_steps_may_end_beside(vehicle, run, events(run)[:4], **own)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, own = scene(4)
    assert_a_sweep_ends_where_its_runs_end(vehicle, own | {"duration": DURATION})


def test_a_session_has_the_derivatives_of_its_run():
    ramp = TorqueTable((0.0, 0.3), ((0, 0, 0), (0.3, -0.1, 0.2)))
    held = Bearings(roller_coulomb=1e-3, roller_break_away=2e-3)
    options = {"nu": (0, 0, 0), "roller_model": "massless", "effects": (Contact(5.0), held, ramp), "accuracy": 1e-11}
    options["sensitivities"] = ("mass", "roller_break_away")
    run = simulate(Vehicle.paper(), duration=DURATION, **options)
    assert run.stats["engine"] == "compiled" and (run.contact_spin[-1] != 0).any()
    session = Session(Vehicle.paper(), driven=False, **options)
    for _ in range(20):
        session.step(DURATION / 20)
    for name in options["sensitivities"]:
        found, wanted = session.sensitivity(name).nu, run.sensitivity(name).nu[-1]
        assert found == pytest.approx(wanted, rel=1e-8, abs=1e-8 * np.abs(wanted).max()) and wanted.any()


# Which engine runs


def test_the_compiled_engine_runs_them_and_says_so():
    vehicle, own = scene(0)
    own.pop("control")
    assert runs_on(checked_task(vehicle, duration=0.1, **own)) == "compiled engine, compiled kernel"


@pytest.mark.parametrize("law", ["contact_viscous", "contact_regularised", "contact_coulomb"])
@pytest.mark.parametrize("others", [(), ("axle_sticking",)])
def test_all_sets_have_a_header(law, others):
    assert sets.programs().kernel("massless", ("contact", law, "roller_sticking", *others)).files()["engine_set.h"]


def test_an_event_moves_a_step_to_it():
    """A step whose length comes to an event of a roller goes on with its iteration: halved again and again instead,
    steps were 2 to 4 times as many."""
    for number in (3, 4, 11):
        vehicle, own = scene(number)
        stats = simulate(vehicle, duration=DURATION, **own).stats
        assert stats["phases"] < stats["steps"] <= 5 * stats["phases"]
        assert stats["evaluations"] <= 700 * stats["phases"]
