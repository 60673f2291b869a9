"""Coulomb's friction of the ground as the set-valued law: closed forms, instants, directions, the smooth law."""

import numpy as np
import pytest

from omniroll import Contact, InvalidValueError, Torque, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel

pytestmark = pytest.mark.long

PAPER = Vehicle.paper()
PAIR = Vehicle.paper(2, 5).replace(wheel_angles=(0.0, np.pi))  # two wheels that face each other
INSTANT = 1e-10  # relative, of instants in closed form
MODELS = ("massless", "free")


def instants(run, wheel, sticks):
    """When the contact of a wheel begins to stick, or to slip."""
    mode = run.sticks[:, wheel]
    return run.t[1:][(mode[1:] != mode[:-1]) & (mode[1:] == sticks)]


@pytest.mark.parametrize("model", MODELS)
def test_a_skidding_vehicle_spins_its_wheels_up_until_it_rolls(model):
    """It starts across its axles while the wheels stand: s' = -k, k = mu load (2/M + l^2/J), and then nothing slips."""
    speed, load, friction = 6.0, 10.0, 0.4
    ground = Contact(law="coulomb", friction=friction, load=load, wheel_rates=0)
    run = simulate(PAIR, nu=(0, speed, 0), duration=0.05, effects=[ground], roller_model=model, control=False)
    strength = friction * load * (2 / PAIR.mass + PAIR.wheel_radius**2 / PAIR.wheel_inertia)
    start = PAIR.platform_radius * speed
    rolls = start / strength
    assert [*instants(run, 0, True), *instants(run, 1, True)] == pytest.approx([rolls, rolls], rel=INSTANT)
    after = run.slip[run.t > rolls * (1 + INSTANT)]
    assert after.size and not after.any()
    assert start - PAIR.platform_radius * run.nu[-1, 1] == pytest.approx(
        2 * friction * load * rolls / PAIR.mass, rel=1e-9
    )
    assert -run.contributions()["ground_loss"][-1] == pytest.approx(friction * load * start * rolls, rel=1e-9)
    assert run.ledger.residual == pytest.approx(0, abs=1e-9 * run.energy[0])


@pytest.mark.parametrize("model", MODELS)
def test_a_growing_torque_breaks_wheels_away(model):
    """Opposite torques T t drive the pair along; each wheel asks the ground for T t/l/(1 + 2 J/(M l^2))."""
    load, friction, growth = 10.0, 0.4, 2.0
    ground = Contact(law="coulomb", friction=friction, load=load)
    ramp = TorqueTable((0.0, 1.0), ((0, 0), (growth, -growth)))
    run = simulate(PAIR, nu=(0, 0, 0), duration=0.2, roller_model=model, effects=[ground, ramp], control=False)
    radius, inertia, mass = PAIR.wheel_radius, PAIR.wheel_inertia, PAIR.mass
    expected = friction * load * radius * (1 + 2 * inertia / (mass * radius**2)) / growth
    assert expected < 0.19
    assert [*instants(run, 0, False), *instants(run, 1, False)] == pytest.approx([expected, expected], rel=INSTANT)
    assert np.abs(run.slip[-1, :, 1]).min() > 1e-3
    assert np.abs(run.ground_force[-1, :, 1]) == pytest.approx([friction * load] * 2, rel=1e-12)


def test_static_friction_holds_and_sliding_friction_does_not():
    """One wheel alone is pushed beyond its static friction: it slips at once, under the sliding friction."""
    law = {"law": "coulomb", "friction": 0.3, "static_friction": 0.5, "load": 10.0}
    radius, inertia, mass = PAIR.wheel_radius, PAIR.wheel_inertia, PAIR.mass
    torque = 10.0 * radius * (1 + 2 * inertia / (mass * radius**2))  # asks for the whole load
    for part, sticks in ((0.49, True), (0.51, False)):
        drive = Torque((part * torque, -part * torque))
        run = simulate(
            PAIR, nu=(0, 0, 0), duration=0.01, roller_model="massless", effects=[Contact(**law), drive], control=False
        )
        assert (run.sticks == sticks).all()
        force = 10 * part if sticks else 3.0
        assert np.abs(run.ground_force[:, :, 1]) == pytest.approx(np.full((len(run), 2), force), rel=1e-12)


def test_what_makes_no_sense_is_refused():
    for changes, field in (
        ({"friction": None}, "friction"),
        ({"speed": 0.1}, "speed"),
        ({"static_friction": 0.2}, "static_friction"),
        ({"static_friction": (0.6, 0.2)}, "static_friction"),
    ):
        with pytest.raises(InvalidValueError) as caught:
            Contact(**{"law": "coulomb", "friction": 0.3} | changes)
        assert caught.value.field == field
    with pytest.raises(InvalidValueError, match="law regularised"):
        Contact(law="regularised", friction=0.3, speed=1e-3, static_friction=0.4)


@pytest.mark.parametrize("model", MODELS)
def test_behind_a_break_away_a_named_speed_misses_by_its_power_four_fifths(model):
    """The slip grows as t^2, and what F lacks as (v/s)^2: both are alike at t ~ v^(2/5), where s ~ v^(4/5)."""
    ramp = TorqueTable((0.0, 1.0), ((0, 0), (2.0, -2.0)))

    def at_end(**law):
        effects = [Contact(friction=0.4, load=10.0, **law), ramp]
        options = {"roller_model": model, "accuracy": 1e-12, "control": False}
        return simulate(PAIR, nu=(0, 0, 0), duration=0.2, effects=effects, **options).nu[-1]

    speeds, wanted = np.array([1e-4, 1e-5, 1e-6, 1e-7]), at_end(law="coulomb")
    left = [np.abs(at_end(law="regularised", speed=speed) - wanted).max() for speed in speeds]
    slopes = np.diff(np.log(left)) / np.diff(np.log(speeds))
    assert slopes == pytest.approx(0.8, abs=2e-3)


@pytest.mark.parametrize("load, follows", [(10.4, True), (10.8, False)])
def test_who_exceeds_static_friction_slips_and_the_others_are_asked_again(load, follows):
    """A growing torque asks two wheels for the same force until the first slips, at F = 5 N, with 1 N from then on.

    The other then has to hold 5.37 N, for the vehicle is slower than it rolled, and hardly turns. It lets go at the
    same instant, in a second round, where its static friction is 5.2 N, and holds where that is 5.4 N. Neither sticks
    again.
    """
    vehicle = PAIR.replace(yaw_inertia=1.0)
    radius, inertia, mass = vehicle.wheel_radius, vehicle.wheel_inertia, vehicle.mass
    effects = [
        Contact(law="coulomb", friction=0.1, static_friction=0.5, load=(10.0, load)),
        TorqueTable((0.0, 1.0), ((0, 0), (2.0, -2.0))),
    ]
    run = simulate(vehicle, nu=(0, 0, 0), duration=0.25, roller_model="massless", effects=effects, control=False)
    instant = 5.0 * radius * (1 + 2 * inertia / (mass * radius**2)) / 2.0
    straight, turning = 1 / mass, vehicle.platform_radius**2 / vehicle.yaw_inertia
    share = inertia / radius**2
    other = (2.0 * instant / radius - share * 1.0 * (straight - turning)) / (1 + share * (straight + turning))
    assert 5.2 < other < 5.4
    assert instants(run, 0, False) == pytest.approx([instant], rel=INSTANT)
    last, first = np.flatnonzero(np.abs(run.t - instant) <= INSTANT * instant)
    assert np.abs(run.ground_force[last, :, 1]) == pytest.approx([5.0, 5.0], rel=1e-9)
    assert np.abs(run.ground_force[first, :, 1]) == pytest.approx([1.0, 0.1 * load if follows else other], rel=1e-9)
    assert run.sticks[first].tolist() == [False, not follows]
    (then,) = instants(run, 1, False)
    assert then == pytest.approx(instant, rel=INSTANT) if follows else then > 1.001 * instant
    assert not instants(run, 0, True).size and not instants(run, 1, True).size


@pytest.mark.parametrize("wheels", [1, 2, 3, 6, 8])
def test_heavy_rollers_make_the_forces_of_sticking_contacts_determinate(wheels):
    """Each wheel has a rate and its roller an axial speed of its own: 2N rows of the slip, whatever the layout is."""
    rng = np.random.default_rng(wheels)
    vehicle = PAPER.replace(
        wheels=wheels, wheel_angles=tuple(rng.uniform(0, 2 * np.pi, wheels)),
        wheel_places=tuple(map(tuple, rng.normal(size=(wheels, 2)))),
    )  # fmt: skip
    bound = kernel(vehicle, "free", "python", effects=("layout", "contact"))
    chi = rng.uniform(-1, 1, wheels) * np.pi / vehicle.rollers_per_wheel
    speeds = np.eye(3 + 2 * wheels)
    parts = speeds[:, :3], speeds[:, 3 : 3 + wheels], speeds[:, 3 + wheels :]
    slip, _ = bound.call("slip_forces", parts[0], chi, *parts[1:])
    rows = slip.reshape(len(speeds), -1).T
    least = min(vehicle.wheel_radius, vehicle.wheel_radius * np.cos(chi).min() - vehicle.roller_axis_radius)
    assert rows.shape == (2 * wheels, 3 + 2 * wheels)
    assert np.linalg.svd(rows, compute_uv=False).min() >= least * (1 - 1e-12) > 0
    if wheels > 1:  # without these speeds of their own they would not be: a rolling platform has three
        assert np.linalg.matrix_rank(rows[:, :3]) < 2 * wheels
