"""Sessions and sweeps of wheels that slip."""

import numpy as np
import pytest

from contact.test_engines import slipping_task
from omniroll import Contact, Motor, Session, Vehicle, simulate, simulate_many

PAPER = Vehicle.paper()
MOTOR = Motor((1.0, -2.0, 0.5), 0.01, 1.5, gear_ratio=5, current_limit=0.9)


def stepped(session, steps):
    for step in steps:
        session.step(step)


def state(session):
    lost = session.outputs["ground_loss"]
    contacts = session.wheel_speeds, session.contact_spin, session.slip, session.ground_force, lost
    return [session.nu.copy(), session.pose.copy(), session.energy, *contacts]


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["viscous", "regularised", "coulomb", "loads, regularised, Coulomb's friction in rollers", "loads, coulomb"]
)
def test_a_session_is_the_run_and_goes_back_to_the_bit(name):
    vehicle, options = slipping_task(name, 0)
    duration = options.pop("duration")
    session = Session(vehicle, driven=False, **options)
    steps = np.random.default_rng(1).dirichlet(np.ones(30)) * duration
    stepped(session, steps[:10])
    saved = session.save()
    stepped(session, steps[10:])
    end = state(session)
    run = simulate(vehicle, **options, duration=duration, control=False)
    assert len(run.switches) >= 1
    wanted = [run.nu, run.pose, run.energy, run.quantity("rates"), run.contact_spin, run.slip, run.ground_force]
    for found, rows in zip(end, [*wanted, run.quantity("ground_loss")], strict=True):
        np.testing.assert_allclose(found, rows[-1], rtol=1e-7, atol=1e-8)
    session.restore(saved)
    stepped(session, steps[10:])
    assert all(np.array_equal(after, before) for after, before in zip(state(session), end, strict=True))
    session.reset()
    assert np.array_equal(session.wheel_speeds, run.quantity("rates")[0])


@pytest.mark.long
def test_motors_read_the_rates_of_their_wheels():
    """Wheels that stand while the vehicle moves: no back EMF."""
    session = Session(PAPER, nu=(2, 1, 0), effects=[Contact(1.0, wheel_rates=0), MOTOR], driven=False)
    session.step(1e-9)
    stalled = np.clip(np.array(MOTOR.voltage) / MOTOR.resistance, -MOTOR.current_limit, MOTOR.current_limit)
    np.testing.assert_allclose(session.outputs["currents"], stalled, rtol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("name", ["viscous", "coulomb", "loads, regularised, Coulomb's friction in rollers"])
def test_a_sweep_ends_where_its_runs_end(name):
    vehicle, options = slipping_task(name, 1)
    starts = [options.pop("nu"), np.array([1.0, 0.0, 1.0])]
    many = simulate_many(vehicle, nu=starts, **options, control=False)
    for k, nu in enumerate(starts):
        run = simulate(vehicle, nu=nu, **options, control=False)
        np.testing.assert_array_equal(many.end.nu[k], run.nu[-1])
        np.testing.assert_allclose(many.end.contact_spin[k], run.contact_spin[-1], rtol=1e-12)
        np.testing.assert_allclose(many.end.spins[k], run.spins[-1], rtol=1e-12)
        np.testing.assert_allclose([many.energy_start[k], many.end.energy[k]], run.energy[[0, -1]], rtol=1e-12)
