"""Axles whose bearings stick where wheels may slip, under the laws viscous and regularised: closed forms, every body,
and a stiff ground."""


import numpy as np
import pytest
from scipy.linalg import expm

from contact.test_newton_euler import MODELS
from omniroll import (
    Bearings,
    Contact,
    Slope,
    TorqueTable,
    Vehicle,
    simulate,
)

CROSS = Vehicle.paper(4, 5)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
RADIUS, INERTIA, MASS = CROSS.wheel_radius, CROSS.wheel_inertia, CROSS.mass
GRAVITY, INCLINE = 9.80665, 0.2
FALL = GRAVITY * np.sin(INCLINE)
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
@pytest.mark.parametrize("above", [1.0, 1.6])
def test_bearings_hold_the_wheels_of_a_vehicle_that_slides_down_a_slope(above):
    """M v' = M g sin b - 2 c v while all axles stick; those of the two wheels across the slope let go where l c v is
    their break-away torque, and then J w' = l c (v - l w) - T."""
    c, sliding, end = 6.0, 0.02, 0.4
    breaks = above * sliding
    bearings = Bearings(wheel_coulomb=sliding, wheel_break_away=breaks)
    effects = [Contact(c), bearings, Slope(INCLINE, 0.0, gravity=GRAVITY)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, roller_model="massless", effects=effects,
                   accuracy=1e-11, control=False)  # fmt: skip
    rate, speed = 2 * c / MASS, breaks / (RADIUS * c)
    let_go = -np.log(1 - speed * rate / FALL) / rate
    assert let_go < end / 2
    for wheel in (1, 3):
        assert changes(run, wheel) == [pytest.approx(let_go, rel=INSTANT)]
    for wheel in (0, 2):
        assert not run.quantity("rates")[:, wheel].any()
    matrix = np.array([
        [-rate, rate * RADIUS, FALL],
        [RADIUS * c / INERTIA, -(RADIUS**2) * c / INERTIA, -sliding / INERTIA],
        [0, 0, 0],
    ])  # fmt: skip
    later = run.t > let_go * (1 + INSTANT)
    wanted = np.array([expm(matrix * (t - let_go)) @ (speed, 0, 1) for t in run.t[later]])
    assert later.sum() >= 2 and wanted[-1, 1] > 1
    assert run.nu[later, 0] * CROSS.platform_radius == pytest.approx(wanted[:, 0], rel=1e-9)
    assert np.abs(run.quantity("rates")[later, 1]) == pytest.approx(wanted[:, 1], rel=1e-8, abs=1e-8)
    first = np.flatnonzero(~later)[: -1 if above > 1 else None]  # the last torque may be that of axles that have let go
    held = np.abs(bearing_torques(run)[first, 1])
    assert held == pytest.approx(RADIUS * c * run.nu[first, 0] * CROSS.platform_radius, abs=1e-12)
    assert held.max() == pytest.approx(breaks, rel=1e-11)


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

