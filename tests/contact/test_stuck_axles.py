"""Axles whose bearings stick where wheels may slip on a viscous ground, in closed form."""

import numpy as np
import pytest

from contact.test_newton_euler import MODELS
from omniroll import Bearings, Contact, TorqueTable, Vehicle, simulate

CROSS = Vehicle.paper(4, 5)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
RADIUS, INERTIA = CROSS.wheel_radius, CROSS.wheel_inertia
INSTANT = 1e-10  # relative, of instants in closed form


def changes(run, wheel):
    """When an axle begins to turn, or stops."""
    stands = run.quantity("rates")[:, wheel] == 0
    turned = np.flatnonzero(stands[1:] != stands[:-1])
    return [run.t[k] if stands[k] else run.t[k + 1] for k in turned]  # the last row at rest, or the first


def bearing_torques(run):
    """(T, N) in N m, what the bearings take in each row."""
    return run.drive[:, run.effects.drives().index("bearing_torque")]


@pytest.mark.long
@pytest.mark.parametrize("model", MODELS)
def test_wheels_that_spin_on_the_spot_come_to_rest(model):
    """Opposite wheels turn against each other, so that the vehicle stays: J w' = -T - c l^2 w, then nothing moves."""
    c, torque, speed = 3.0, 0.03, 12.0
    effects = [Contact(c, wheel_rates=(speed, -speed, speed, -speed)), Bearings(wheel_coulomb=torque)]
    run = simulate(CROSS, nu=(0, 0, 0), chi=(0.6, -0.6, 0.6, -0.6), duration=0.2, roller_model=model, effects=effects,
                   accuracy=1e-11, control=False)  # fmt: skip
    decay = c * RADIUS**2 / INERTIA
    stops = np.log(1 + c * RADIUS**2 * speed / torque) / decay
    assert len(run.switches) >= 4 and stops < 0.15
    for wheel in range(4):
        assert changes(run, wheel) == [pytest.approx(stops, rel=INSTANT)]
    assert np.abs(run.nu).max() <= 1e-12 * speed
    assert run.energy[-1] <= 1e-20 and abs(run.ledger.residual) <= 1e-10 * run.energy[0]
    assert np.abs(bearing_torques(run)[-1]).max() <= 1e-14 * torque


def test_a_growing_torque_breaks_an_axle_away():
    """At b t = S, and where the torque falls back below T long before it would turn the wheel back, it stops."""
    grows, breaks, sliding = 0.5, 0.06, 0.04
    table = TorqueTable((0.0, 0.2, 0.4), ((0, 0, 0, 0), (0.2 * grows, 0, 0, 0), (0, 0, 0, 0)))
    effects = [Contact(4.0), Bearings(wheel_coulomb=sliding, wheel_break_away=breaks), table]
    run = simulate(CROSS, nu=(0, 0, 0), duration=0.4, roller_model="massless", effects=effects,
                   control=False)  # fmt: skip
    begins, stops = changes(run, 0)
    assert begins == pytest.approx(breaks / grows, rel=INSTANT)
    (row,) = np.flatnonzero(run.t == begins)[:1]
    assert bearing_torques(run)[row, 0] == pytest.approx(-breaks, rel=1e-11)
    assert bearing_torques(run)[row + 1, 0] == -sliding
    assert 0.2 < stops < 0.4 and not run.quantity("rates")[-1, 0]
