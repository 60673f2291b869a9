"""Axles that stick: a closed form, the regularised law, what runs and files tell of them.

The Python engine steps in time by Moreau's scheme: contact/test_time_stepping.py holds every kind of friction to it.
"""

import numpy as np
import pytest

from omniroll import (
    Bearings,
    Contact,
    InvalidValueError,
    Slope,
    Torque,
    TorqueTable,
    Trajectory,
    Vehicle,
    reactions,
    simulate,
)
from omniroll.kernels.kernel import kernel
from omniroll.vocabulary import STANDARD_GRAVITY

PAPER = Vehicle.paper()
RATIO = PAPER.platform_radius / PAPER.wheel_radius  # chi' = - RATIO theta' where the vehicle turns on the spot
TURNING = PAPER.yaw_inertia + PAPER.wheels * PAPER.wheel_inertia * RATIO**2
EXACT = {"roller_model": "massless", "accuracy": 1e-11, "control": False}


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


def test_the_regularised_law_tends_to_it():
    start = {"nu": (1, 0, 0.3), "duration": 1.5, **EXACT}
    limit = simulate(PAPER, **start, effects=[Bearings(wheel_coulomb=4e-3)])
    errors = [
        np.abs(simulate(PAPER, **start, effects=[Bearings(wheel_coulomb=4e-3, wheel_speed=w)]).nu[-1] - limit.nu[-1])
        for w in (0.1, 0.01)
    ]
    assert errors[1].max() < 0.25 * errors[0].max() < 5e-3


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


@pytest.mark.parametrize("seed", [3, 6, 70])
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


# Axles that are locked: bearings with a bound that nothing reaches

GROUND = Contact(law="coulomb", friction=0.3, normal_gravity=9.8)
TORQUE = Torque((0.5, 0.02, 0.01))
ONE = (True, False, False)


def test_a_vehicle_whose_axles_are_locked_stands_where_its_wheels_roll():
    run = simulate(PAPER, nu=(0, 0, 0), duration=0.1, effects=[Bearings(wheel_locked=True), TORQUE])
    assert not run.nu.any() and not run.pose.any()


def test_a_locked_wheel_does_not_turn_and_the_others_do():
    run = simulate(PAPER, nu=(1, 0.2, 0.5), duration=0.5, effects=[Bearings(wheel_locked=ONE), GROUND, TORQUE])
    rates = run.quantity("rates")
    assert np.abs(rates[1:, 0]).max() < 1e-15 * np.abs(rates[0, 0]) and np.abs(rates[-1, 1:]).min() > 0.1
    assert abs(run.ledger.residual) < 1e-9 * run.ledger.scale


def test_it_is_a_torque_far_above_all_others():
    bound = 1e3 * PAPER.mass * STANDARD_GRAVITY * PAPER.wheel_radius
    task = {"nu": (1, 0.2, 0.5), "duration": 0.1}
    locked, held = (
        simulate(PAPER, **task, effects=[bearings, GROUND])
        for bearings in (Bearings(wheel_locked=ONE), Bearings(wheel_coulomb=(bound, 0, 0)))
    )
    np.testing.assert_array_equal(locked.nu, held.nu)


@pytest.mark.parametrize(("given", "bound"), [
    ({"wheel_locked": (True, 2)}, "true or false"),
    ({"wheel_locked": "yes"}, "true or false"),
    ({"wheel_locked": True, "wheel_coulomb": 1.0, "wheel_speed": 1.0}, "nothing rests"),
    ({"wheel_locked": False}, "at least one coefficient"),
])  # fmt: skip
def test_what_cannot_be_locked_is_refused(given, bound):
    with pytest.raises(InvalidValueError, match=bound):
        Bearings(**given)
