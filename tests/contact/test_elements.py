"""Every kind of friction, and loads from springs, in the steps of a session, in a sweep, between rows and in its
account of energy; and under a controller from the start.

The scenes are those of the corpus, whose tests judge the law of each element in every row of a run.
"""

import numpy as np
import pytest
from corpus.kinds import DURATION, KINDS, name_of, scene
from corpus.test_corpus import QUICK

from omniroll import (
    Bearings,
    Contact,
    FunctionController,
    Motor,
    Session,
    Springs,
    Torque,
    Vehicle,
    simulate,
    simulate_many,
)

BESIDE = (1e-5, 3e-10, 1e-14, 0.0, -1e-14, -1e-12)  # s before an event
SPRINGS = ("springs", "free", "none")


def each(*kinds):
    marked = [pytest.param(kind, marks=() if kind in (*QUICK, SPRINGS) else pytest.mark.long) for kind in kinds]
    return pytest.mark.parametrize("kind", marked, ids=name_of)


EACH = each(*KINDS, SPRINGS)
MOVES = 1  # a scene whose vehicle moves and lets go in every kind


def on_springs():
    """Slips come to rest while the platform heaves and tilts."""
    effects = [Contact(law="coulomb", friction=0.1, wheel_rates=0), Springs(height=0.06)]
    return Vehicle.paper(), {"nu": (1.0, 0.3, 1.0), "effects": effects, "duration": DURATION, "control": False}


def of_kind(kind, accuracy):
    """The run, its vehicle, and the options that a session takes, too."""
    vehicle, task = on_springs() if kind is SPRINGS else scene(kind, MOVES)
    options = {name: task[name] for name in task.keys() - {"duration", "control"}} | {"accuracy": accuracy}
    return simulate(vehicle, duration=DURATION, control=False, **options), vehicle, options


def events_of(run):
    """Instants at which rows stand on both sides of a transition."""
    instants = np.unique(run.t[1:][np.diff(run.t) == 0])
    return instants[(instants > 1e-3) & (instants < 0.9 * DURATION)]


def state_of(moving, forces=True):
    """What a session has now, or a run in its rows."""
    slips = [] if moving.slip is None else [moving.slip, moving.ground_force][: 1 + forces]
    return [np.array(own) for own in (moving.nu, moving.pose, moving.contact_spin, *slips)]


@EACH
def test_a_session_is_the_run_and_goes_back_to_the_bit(kind):
    run, vehicle, options = of_kind(kind, 1e-11)
    session = Session(vehicle, driven=False, **options)
    steps = np.random.default_rng(1).dirichlet(np.ones(20)) * DURATION

    def go(steps):
        for step in steps:
            session.step(step)
        return state_of(session)

    go(steps[:8])
    saved = session.save()
    end = go(steps[8:])
    for found, rows in zip(end, state_of(run), strict=True):
        np.testing.assert_allclose(found, rows[-1], rtol=0, atol=1e-9 * np.abs(rows).max())
    session.restore(saved)
    assert all(np.array_equal(after, before) for after, before in zip(go(steps[8:]), end, strict=True))
    session.reset()
    assert all(np.array_equal(after, before) for after, before in zip(go(steps), end, strict=True))


@EACH
def test_a_step_may_end_however_little_before_an_event_or_behind_it(kind):
    run, vehicle, options = of_kind(kind, 1e-12)
    for event in events_of(run)[:2]:
        for before in BESIDE:
            session = Session(vehicle, driven=False, **options)
            for step in (event - before, 1e-9, 0.01):
                session.step(step)
            wanted = run.sample(session.time).nu
            assert session.nu == pytest.approx(wanted, abs=1e-10 * np.abs(run.nu).max()), (event, before)


@each(*KINDS)
def test_a_sweep_ends_where_its_runs_end(kind):
    run, vehicle, options = of_kind(kind, 1e-9)
    starts = [options.pop("nu"), (0.5, 0.0, 1.0)]
    many = simulate_many(vehicle, nu=starts, duration=DURATION, control=False, **options)
    other = simulate(vehicle, nu=starts[1], duration=DURATION, control=False, **options)
    for k, own in enumerate((run, other)):
        np.testing.assert_array_equal(many.end.nu[k], own.nu[-1])
        np.testing.assert_allclose(many.end.contact_spin[k], own.contact_spin[-1], rtol=1e-12, atol=1e-12)
        assert many.end.energy[k] == pytest.approx(own.energy[-1], rel=1e-12)


@EACH
def test_between_rows_a_run_is_one_with_finer_steps_and_its_account_closes(kind):
    (run, *_), (finer, *_) = (of_kind(kind, accuracy) for accuracy in (1e-11, 1e-12))
    determinate = kind[0] != "coulomb"  # elsewhere forces at rest may balance themselves
    for t in np.linspace(0.003, 0.997, 37) * DURATION:
        states = (state_of(moving, determinate) for moving in (run.sample(t), finer.sample(t), run))
        for one, other, rows in zip(*states, strict=True):
            assert one == pytest.approx(other, abs=max(1e-6 * np.abs(rows).max(), 1e-15)), t
    assert abs(run.ledger.residual) <= 1e-9 * run.ledger.scale


GROUND, STICKS = Contact(law="coulomb", friction=0.3), Bearings(wheel_coulomb=0.05, roller_coulomb=0.01)


@pytest.mark.parametrize("friction", [(GROUND,), (GROUND, STICKS), (STICKS,)])
def test_friction_is_decided_under_what_a_controller_gives_at_the_start(friction):
    vehicle, start = Vehicle.paper(4, 5), {"nu": (3, 0, 1), "roller_model": "massless"}
    given = FunctionController(lambda t, state: 1.0, 0.02)
    found, wanted = (
        simulate(vehicle, **start, duration=0.02, effects=[*friction, acts]) for acts in (given, Torque(1.0))
    )
    np.testing.assert_array_equal(found.nu[-1], wanted.nu[-1])
    session = Session(vehicle, **start, effects=[*friction, given])
    session.step(0.01)
    session.step(0.01)
    np.testing.assert_allclose(session.nu, wanted.nu[-1], rtol=0, atol=1e-8)


def test_motors_read_the_rates_of_wheels_that_stand():
    """While the vehicle moves: no back EMF."""
    motor = Motor((1.0, -2.0, 0.5), 0.01, 1.5, gear_ratio=5, current_limit=0.9)
    session = Session(Vehicle.paper(), nu=(2, 1, 0), effects=[Contact(1.0, wheel_rates=0), motor], driven=False)
    session.step(1e-9)
    stalled = np.clip(np.array(motor.voltage) / motor.resistance, -motor.current_limit, motor.current_limit)
    np.testing.assert_allclose(session.outputs["currents"], stalled, rtol=1e-6)
