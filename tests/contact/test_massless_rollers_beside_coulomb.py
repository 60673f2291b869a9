"""Massless rollers whose bearings stick beside the law coulomb the
laws in every row of many scenes, sessions and sweeps. Closed forms are in test_massless_rollers_that_stick.py."""

from dataclasses import replace

import numpy as np
import pytest
from costs.massless_rollers_beside_coulomb import task
from sensitivities.costs import task as skid_of

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_massless_rollers_that_stick import LAW, contact_torques, residuals, scene
from omniroll import simulate
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at
from omniroll.results.slipping import rollers_hold
from omniroll.scenes.explanation import runs_on

DURATION = 0.1
EPS = float(np.finfo(float).eps)
COMPILED = {"engine": "compiled"}


def changes(run, bearings):
    """The instants at which a contact or a roller changes its mode, and the modes (., 2 N) of the steps between them:
    of contacts 1 where they stick, of rollers 0 where they stick, else the signs of their spins. One that sticks may
    have its sliding torque where its phase begins or ends."""
    names, first = run.effects.drives(), run.step_rows
    taken, heading = contact_torques(run), run.drive[:, names.index("slip_heading")]
    turns = ~rollers_hold(taken, np.array(bearings.roller_coulomb), heading)
    turns = turns[first] & turns[first + 1]
    modes = np.concatenate([run.sticks[first], np.where(turns, -np.sign(taken[first]), 0)], axis=1)
    at = np.flatnonzero((modes[1:] != modes[:-1]).any(axis=1)) + 1
    return run.t[first[at]], modes[np.append(0, at)]


def assert_the_laws_hold(number, bound=LAW):
    vehicle, options = scene(number)
    run = simulate(vehicle, duration=0.2, **options | COMPILED)
    assert run.stats["engine"] == "compiled" and np.isfinite(run.nu).all()
    for name, residual in residuals(vehicle, options["effects"], run).items():
        assert residual <= bound, (number, name)
    lost = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-9 * lost, number


def test_the_laws_hold_in_every_row_of_scenes():
    for number in range(30):
        assert_the_laws_hold(number)


def test_slips_that_keep_their_direction_come_to_rest_together():
    """Two contacts come to rest at once, each in the direction that it has kept: 4e-11 m/s are left of one where the
    other rests. In that row its direction was that of what is left, and a force 36 % beyond its ellipse."""
    assert_the_laws_hold(601)


def test_a_scene_runs_however_its_start_is_rounded():
    """A contact gives way there that is pulled by next to nothing: of starts some roundings apart a quarter stopped, as
    no step was small enough."""
    vehicle, options = scene(143)
    for number in range(24):
        roundings = np.random.default_rng([143, number]).integers(-3, 4, 3)
        nu = tuple(np.array(options["nu"]) * (1 + 4e-16 * roundings))
        run = simulate(vehicle, duration=0.2, **options | {"nu": nu} | COMPILED)
        for name, residual in residuals(vehicle, options["effects"], run).items():
            assert residual <= LAW, (number, name)


def skids():
    """A vehicle on wheels that turn, pulled to and fro, 1.9 s long; with the friction that residuals() asks for."""
    options = skid_of("in series, coulomb, skid, torque") | {"duration": 1.9, "control": False} | COMPILED
    contact, *others = options["effects"]
    options["effects"] = [replace(contact, static_friction=contact.friction), *others]
    options.pop("sensitivities")
    return options.pop("vehicle"), options


@pytest.mark.parametrize("accuracy", [1e-8, 1e-9, 1e-10, 1e-11])
def test_a_roller_stops_as_its_bearing_comes_to_take_all_of_the_friction(accuracy):
    """A wheel slips along its axle with 0.26 m/s and across it with 4e-6 m/s. As its contact moves to the middle of
    its roller, the bearing comes to take all friction but 2e-10 of it, and the spin passes zero by 1e12 rad/s^2. No
    instant is nearer to that than 2e-5 rad/s: the run stepped there on the spot. The spin of such a row is a difference
    over what is left of the friction, and rounded accordingly."""
    vehicle, options = skids()
    run, finer = (simulate(vehicle, **options | {"accuracy": given}) for given in (accuracy, 1e-12))
    before, after = np.searchsorted(run.t, (1.794, 1.79403))
    assert run.contact_spin[before, 2] < -20 and run.contact_spin[after, 2] == 0
    assert abs(run.slip[before, 2]).max() < 1e-3 and abs(run.slip[after, 2, 0]) > 0.2
    found = residuals(vehicle, options["effects"], run)
    found.pop("against the spin")
    assert {name: residual for name, residual in found.items() if residual > LAW} == {}
    contact, bearings = options["effects"][:2]
    rho = vehicle.wheel_radius * np.cos(run.chi) - vehicle.roller_axis_radius
    part = bearings.roller_coulomb / (rho * contact.friction[0] * run.ground_load)
    rounded = 16 * EPS * np.linalg.norm(run.slip, axis=-1) / (rho * np.abs(1 - part**2))
    turns = np.abs(run.contact_spin) > np.maximum(rounded, 1e-9 / rho)
    assert turns[before, 2] and rounded[before, 2] < 1e-9
    against = contact_torques(run) + np.sign(run.contact_spin) * bearings.roller_coulomb
    assert np.abs(against[turns]).max() <= LAW * bearings.roller_coulomb
    assert distance_at(run, finer, np.linspace(0, 1.9, 7)) <= accuracy


# Cost


@pytest.mark.parametrize("drive", ["torque", "motor", "speed"])
def test_slow_slips_of_rollers_that_stick_beside_free_rollers(drive):
    """Their directions turn, and are found together; with a torque a slow slip comes to rest on the way, whose instant
    the sweeps of a step did not find: the run took 9.6 times the evaluations."""

    def run(bearings, accuracy=1e-9):
        return simulate(**task(f"{drive}|slips|{bearings}") | {"accuracy": accuracy, "control": False} | COMPILED)

    free, stick = run(""), run("stick")
    assert 100 < free.stats["evaluations"] < stick.stats["evaluations"] <= 3 * free.stats["evaluations"]
    assert distance_at(stick, run("stick", 1e-12), np.linspace(0, 0.3, 7)) <= 1e-9


# Sessions and sweeps


@pytest.mark.parametrize("number", [2, 9])
def test_a_session_is_the_run_and_goes_back_to_the_bit(number):
    """Without axles that stick, and with such."""
    vehicle, own = scene(number)
    run = simulate(vehicle, duration=DURATION, **own)
    assert len(changes(run, own["effects"][1])[0]) > 3
    own.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **own)


@pytest.mark.parametrize("number", [2, 9])
def test_a_step_may_end_however_little_before_an_event(number):
    vehicle, own = scene(number)
    own |= {"accuracy": 1e-12}
    run = simulate(vehicle, duration=DURATION, **own)
    instants, _ = changes(run, own["effects"][1])
    instants = instants[(instants > 1e-3) & (instants < 0.8 * DURATION)]
    assert len(instants) >= 3
    own.pop("control")
    assert_steps_may_end_beside(vehicle, run, instants[:4], **own)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, own = scene(2)
    assert_a_sweep_ends_where_its_runs_end(vehicle, own | {"duration": 0.03})


# Which engine runs


@pytest.mark.parametrize("number", [2, 9])
def test_the_compiled_engine_runs_them_and_says_so(number):
    vehicle, own = scene(number)
    own.pop("control")
    assert runs_on(checked_task(vehicle, duration=DURATION, **own)) == "compiled engine, compiled kernel"
