"""Axles that stick: closed forms, linear programming, the regularised law.

The Python engine steps in time by Moreau's scheme: contact/test_time_stepping.py holds every kind of friction to it.
"""

import numpy as np
import pytest
from scipy.optimize import linprog

from omniroll import (
    Bearings,
    Contact,
    Controller,
    InvalidValueError,
    Motor,
    Slope,
    Torque,
    TorqueTable,
    Trajectory,
    Vehicle,
    reactions,
    simulate,
)
from omniroll.kernels.kernel import kernel

PAPER = Vehicle.paper()
FOUR = Vehicle.paper(4, 6).replace(wheel_angles=(0.1, 1.5, 3.3, 4.8))
RATIO = PAPER.platform_radius / PAPER.wheel_radius  # chi' = - RATIO theta' where the vehicle turns on the spot
TURNING = PAPER.yaw_inertia + PAPER.wheels * PAPER.wheel_inertia * RATIO**2
EXACT = {"roller_model": "massless", "accuracy": 1e-11, "control": False}


def load(force, rows, bounds):
    """The least part of their bounds with which torques give the force, by linear programming; inf where none do."""
    count = len(rows)
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_eq=np.column_stack([rows.T, np.zeros(3)]),
        b_eq=force,
        A_ub=np.block([[np.eye(count), -bounds[:, None]], [-np.eye(count), -bounds[:, None]]]),
        b_ub=np.zeros(2 * count),
        bounds=[(None, None)] * count + [(0, None)],
    )
    return found.fun if found.status == 0 else np.inf


def rows_of(vehicle):
    """(N, 3) the wheels' rates for each of nu."""
    return kernel(vehicle, "massless", "python").wheel_speeds(np.eye(3)).T


def bearing_torques(run):
    return run.drive[:, run.effects.drives().index("bearing_torque")]


@pytest.mark.long
@pytest.mark.parametrize("static", [1.0, 1.5])
def test_they_break_away_together_when_torques_have_grown(static):
    """Equal torques that grow: rest until they are at the break-away torque, then the sliding torque goes off."""
    sliding, growth = 2e-3, 1e-3
    effects = [
        Bearings(wheel_coulomb=sliding, wheel_break_away=static * sliding),
        TorqueTable([0, 10], [[0, 0, 0], [-10 * growth] * 3]),
    ]
    run = simulate(PAPER, nu=(0, 0, 0), duration=6, effects=effects, **EXACT)
    start = static * sliding / growth
    rate = PAPER.wheels * RATIO / TURNING * PAPER.yaw_scale
    after = np.maximum(run.t - start, 0)
    wanted = rate * (((static - 1) * sliding) * after + growth * after**2 / 2)
    np.testing.assert_allclose(run.nu[:, 2], wanted, atol=1e-10)
    resting = run.t < start
    np.testing.assert_allclose(bearing_torques(run)[resting], growth * run.t[resting, None] * np.ones(3), atol=1e-15)
    assert np.isclose(run.t, start, rtol=1e-12).any()


@pytest.mark.long
def test_rest_is_held_where_torques_of_least_norm_would_let_go():
    """Four wheels have torques to spare: one of the least-norm torques is above its bound, and others hold."""
    rows = rows_of(FOUR)
    wanted = rows.T @ np.array([1.0, 0.2, -0.3, 0.4]) * 1e-3
    least = np.linalg.lstsq(rows.T, wanted, rcond=None)[0]
    bounds = np.full(4, 2e-3)
    bounds[np.argmax(np.abs(least))] = 0.8 * np.abs(least).max()
    assert load(wanted, rows, bounds) < 1
    driven = np.linalg.lstsq(rows.T, -wanted, rcond=None)[0]
    effects = [Bearings(wheel_coulomb=bounds), Torque(driven)]
    run = simulate(FOUR, nu=(0, 0, 0), duration=1, effects=effects, **EXACT)
    assert (run.nu == 0).all()
    found = bearing_torques(run)
    assert (np.abs(found) <= bounds).all() and (np.abs(found).max(axis=0) == bounds).any()
    np.testing.assert_allclose(found @ rows, np.broadcast_to(wanted, (len(run), 3)), atol=1e-15)


def test_the_regularised_law_tends_to_it():
    start = {"nu": (1, 0, 0.3), "duration": 1.5, **EXACT}
    limit = simulate(PAPER, **start, effects=[Bearings(wheel_coulomb=4e-3)])
    errors = [
        np.abs(simulate(PAPER, **start, effects=[Bearings(wheel_coulomb=4e-3, wheel_speed=w)]).nu[-1] - limit.nu[-1])
        for w in (0.1, 0.01)
    ]
    assert errors[1].max() < 0.25 * errors[0].max() < 5e-3


@pytest.mark.long
@pytest.mark.parametrize("roller_model, switching", [("locked", "smooth"), ("free", "impact")])
def test_what_is_lost_is_the_torque_times_the_angle(roller_model, switching):
    """Also through switches, whose impacts may turn what stuck."""
    torque = np.array([3e-3, 2e-3, 4e-3])
    run = simulate(
        PAPER, nu=(1, 0.1, 0.6), duration=2.5, roller_model=roller_model, switching=switching, accuracy=1e-9,
        control=False, effects=[Bearings(wheel_coulomb=torque, wheel_break_away=1.3 * torque)],
    )  # fmt: skip
    rows = np.flatnonzero(np.diff(run.t) > 0)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    lengths = np.diff(run.t)[rows]
    inside = run.sample(run.t[rows, None] + lengths[:, None] * (1 + nodes) / 2)
    turned = (np.abs(inside.nu @ rows_of(PAPER).T).swapaxes(1, 2) @ weights / 2 * lengths[:, None]).sum(axis=0)
    assert run.quantity("axle_loss")[-1] == pytest.approx(torque @ turned, rel=1e-9)
    assert abs(run.ledger.residual) < 1e-9 * run.energy[0]
    assert len(run.switches) > 5
    if switching == "impact":
        assert (np.diff(run.energy) <= 1e-9 * run.energy[0]).all()


def test_a_controller_with_motors_stops_and_starts_what_sticks():
    effects = [
        Motor(0.0, 0.02, 1.5, gear_ratio=4, current_limit=0.3),
        Controller((0.4, 0.1, 0.2), 0.5, 0.02, integral=2.0, output="voltage"),
        Bearings(wheel_coulomb=2e-3, wheel_break_away=3e-3),
    ]
    run = simulate(PAPER, nu=(0, 0, 0), duration=1.2, effects=effects, accuracy=1e-9, control=False)
    assert np.abs(run.nu[-1] - [0.4, 0.1, 0.2]).max() < 0.2
    assert abs(run.ledger.residual) < 1e-9 * run.ledger.scale
    assert (run.nu[0] == 0).all()


@pytest.mark.long
def test_reactions_and_files_have_the_bearings_torques(tmp_path):
    """At rest on a slope the ground holds the vehicle by the wheels whose axles stick: sum of forces is the pull."""
    slope = Slope(0.02, 0.0)
    run = simulate(PAPER, nu=(0, 0, 0), duration=0.2, control=False, effects=[Bearings(wheel_coulomb=0.1), slope])
    assert (run.nu == 0).all()
    found = reactions(run, height=0.05, friction=0.5)
    angles = np.array(PAPER.wheel_angles)
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    across = np.column_stack([-np.sin(angles), np.cos(angles)])
    total = found.contact_force[..., 0] @ along + found.contact_force[..., 1] @ across
    pull = PAPER.mass * slope.gravity * np.sin(slope.angle)
    np.testing.assert_allclose(total, np.broadcast_to([-pull, 0], total.shape), atol=1e-12)
    for ending in (".npz", ".csv"):
        run.save(tmp_path / f"run{ending}")
        again = Trajectory.load(tmp_path / f"run{ending}")
        assert (again.drive == run.drive).all() and again.effects == run.effects
    assert "bearing_torque_1" in (tmp_path / "run.csv").read_text()


@pytest.mark.parametrize("ground", [[], [Contact(20.0)], [Contact(law="coulomb", friction=0.3)]])
def test_modes_are_the_signs_of_the_rates_and_files_keep_them(tmp_path, ground):
    """Of axles, then of rollers wheel by wheel, that in contact first; while one sticks its rate is rounding."""
    rubbing = Bearings(wheel_coulomb=0.05, roller_coulomb=2e-4)
    run = simulate(PAPER, nu=(0.5, 0.1, 0.3), spins=0.2, duration=1.5, control=False, effects=[rubbing, *ground])
    rates = run.quantity("rates") if ground else kernel(PAPER, "free").wheel_speeds(run.nu)
    of_rollers = np.concatenate([run.contact_spin[..., None], run.spins], axis=-1).reshape(len(run), -1)
    rates = np.concatenate([rates, of_rollers], axis=1)
    turns = np.abs(rates) > 1e-7
    assert run.modes.shape == rates.shape and turns.any(axis=0).all() and (run.modes == 0).any()
    assert (run.modes[turns] == np.sign(rates[turns])).all()
    for ending in (".npz", ".csv"):
        run.save(tmp_path / f"run{ending}")
        assert (Trajectory.load(tmp_path / f"run{ending}").modes == run.modes).all()


@pytest.mark.parametrize(("field", "make"), [
    ("wheel_break_away", lambda: Bearings(wheel_break_away=1.0)),
    ("wheel_break_away", lambda: Bearings(wheel_coulomb=1.0, wheel_speed=0.1, wheel_break_away=1.0)),
    ("wheel_break_away", lambda: Bearings(wheel_coulomb=1.0, wheel_break_away=-1.0)),
    ("wheel_speed", lambda: Bearings(wheel_viscous=1.0, wheel_speed=0.1)),
    (
        "wheel_break_away",
        lambda: simulate(PAPER, nu=(0, 0, 0), duration=0, effects=[Bearings(wheel_coulomb=2, wheel_break_away=1)]),
    ),
])  # fmt: skip
def test_what_does_not_fit_is_refused(field, make):
    with pytest.raises(InvalidValueError) as refused:
        make()
    assert refused.value.field == field


@pytest.mark.parametrize("seed", [*range(8), 70])
def test_any_vehicle_keeps_the_law_and_the_account(seed):
    """Random wheels, some with parallel axles, and what acts; 70: a rate lands where nu is left of larger numbers."""
    rng = np.random.default_rng(seed)
    wheels = int(rng.choice([1, 2, 3, 4, 5, 8]))
    angles = rng.choice([0, np.pi / 2, np.pi, 3 * np.pi / 2, 0.3, 2.0], wheels)
    vehicle = Vehicle.paper(wheels, int(rng.integers(4, 8))).replace(wheel_angles=tuple(angles))
    sliding = rng.uniform(0, 1e-2, wheels)
    holding = sliding * rng.choice([1.0, 1.0, 1.5])
    effects = [
        Bearings(wheel_coulomb=sliding, wheel_break_away=holding),
        TorqueTable([0, 0.2, 0.4], rng.normal(size=(3, wheels)) * 5e-3, str(rng.choice(["linear", "hold"]))),
        Slope(float(rng.choice([0.0, 0.02])), rng.uniform(0, 6)),
    ]
    run = simulate(
        vehicle, nu=rng.normal(size=3) * rng.choice([0.0, 0.3, 1.0]), duration=0.6, effects=effects,
        roller_model=str(rng.choice(["massless", "locked", "free"])), accuracy=1e-8, control=False,
    )  # fmt: skip
    torques, rates = bearing_torques(run), run.nu @ rows_of(vehicle).T
    assert (np.abs(torques) <= holding * (1 + 1e-12)).all()
    turns = np.abs(rates) > 1e-10
    np.testing.assert_allclose((torques * np.sign(rates) + sliding)[turns], 0, atol=1e-15)
    assert abs(run.ledger.residual) < 1e-7 * max(run.ledger.scale, 1e-9)
