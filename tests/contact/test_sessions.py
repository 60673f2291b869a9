"""Sessions and sweeps of wheels that slip."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, Motor, Session, Springs, TorqueTable, Vehicle, simulate

PAPER = Vehicle.paper()
MOTOR = Motor((1.0, -2.0, 0.5), 0.01, 1.5, gear_ratio=5, current_limit=0.9)

GROUND, SKID = Contact(law="coulomb", friction=0.3), Contact(law="coulomb", friction=0.1, wheel_rates=0)
HELD = Bearings(wheel_coulomb=0.01, wheel_break_away=0.016)
ALL_HELD = Bearings(wheel_coulomb=0.01, wheel_break_away=0.016, roller_coulomb=1e-4, roller_break_away=1.5e-4)
RISING = TorqueTable((0.0, 0.5), ((0.0, 0.0, 0.0), (1.5, -0.7, -0.9)))
NEAR_EVENTS = {
    "slips come to rest, free": ("free", [SKID], (1.0, 0.3, 1.0)),
    "slips come to rest, massless": ("massless", [SKID], (1.0, 0.3, 1.0)),
    "slips come to rest on springs": ("free", [SKID, Springs(height=0.06)], (1.0, 0.3, 1.0)),
    "contacts let go, free": ("free", [GROUND, RISING], (0.0, 0.0, 0.0)),
    "contacts let go, massless": ("massless", [GROUND, RISING], (0.0, 0.0, 0.0)),
    "beside axles": ("massless", [GROUND, HELD, RISING], (0.0, 0.0, 0.0)),
    "beside axles and rollers": ("free", [GROUND, ALL_HELD, RISING], (0.0, 0.0, 0.0)),
}
NEXT_TO_EVENTS = NEAR_EVENTS | {"beside axles, free": ("free", [GROUND, HELD, RISING], (0.0, 0.0, 0.0))}


def run_with_events(options):
    """A run, and when its contacts and its axles change their modes."""
    run = simulate(PAPER, duration=0.2, **options)
    modes = np.concatenate([run.sticks, run.quantity("rates") == 0], axis=1)
    events = np.unique(run.t[np.flatnonzero((modes[:-1] != modes[1:]).any(axis=1))])
    return run, events[(events > 1e-3) & (events < 0.18)]


def assert_steps_make_the_run(run, options, steps, within):
    session = Session(PAPER, **options)
    for step in steps:
        session.step(step)
        wanted = run.sample(session.time).nu
        assert session.nu == pytest.approx(wanted, abs=within * np.abs(run.nu).max()), steps


@pytest.mark.parametrize("name", NEAR_EVENTS)
def test_a_step_may_end_however_little_before_an_event(name):
    """No step leads past its end; and a step so short that rounding moves its event farther than it is to be located
    ends there all the same."""
    model, effects, nu = NEAR_EVENTS[name]
    options = {"nu": nu, "effects": effects, "roller_model": model, "accuracy": 1e-12}
    run, events = run_with_events(options)
    assert len(events) >= 1
    for event in events[:3]:
        for before in (1e-5, 1e-7, 3e-10, 2e-11, 1e-12):
            assert_steps_make_the_run(run, options, (event - before, before / 2, 0.01), within=1e-11)


@pytest.mark.parametrize("name", NEXT_TO_EVENTS)
def test_a_step_may_end_where_rounding_hides_whether_it_is_an_event(name):
    """In what is left of the way to the event nothing rises by more than its rounding."""
    model, effects, nu = NEXT_TO_EVENTS[name]
    options = {"nu": nu, "effects": effects, "roller_model": model, "accuracy": 1e-11}
    run, events = run_with_events(options)
    assert len(events) >= 1
    for event in events[:6]:
        for before in (1e-13, 1e-14, 3e-15, -3e-15, -1e-14, -1e-13):
            assert_steps_make_the_run(run, options, (event - before, 0.01), within=1e-10)


def test_a_run_may_end_just_before_a_slip_comes_to_rest():
    options = {"nu": (1.0, 0.3, 1.0), "effects": [SKID], "roller_model": "free", "accuracy": 1e-12}
    run = simulate(PAPER, duration=0.1, **options)
    rest = run.t[np.flatnonzero((run.sticks[:-1] != run.sticks[1:]).any(axis=1))[0]]
    for before in (1e-4, 1e-6, 1e-9):
        short = simulate(PAPER, duration=rest - before, **options)
        assert short.nu[-1] == pytest.approx(run.sample(rest - before).nu, abs=1e-11)


@pytest.mark.long
def test_motors_read_the_rates_of_their_wheels():
    """Wheels that stand while the vehicle moves: no back EMF."""
    session = Session(PAPER, nu=(2, 1, 0), effects=[Contact(1.0, wheel_rates=0), MOTOR], driven=False)
    session.step(1e-9)
    stalled = np.clip(np.array(MOTOR.voltage) / MOTOR.resistance, -MOTOR.current_limit, MOTOR.current_limit)
    np.testing.assert_allclose(session.outputs["currents"], stalled, rtol=1e-6)
