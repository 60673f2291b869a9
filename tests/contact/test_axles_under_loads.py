"""Axles whose bearings stick where wheels may slip and loads follow the motion, under the laws viscous and regularised:
closed forms, every body, both engines, and all modes tried."""

import contextlib
import itertools
from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from scipy.integrate import quad

from contact.in_steps import assert_a_session_ends_as_the_run
from contact.test_moving_loads import HEIGHT, LONG, TRICYCLE, by_bodies, numbers
from contact.test_newton_euler import MODELS, slipping_case
from contact.test_stuck_axles import bearing_torques, changes
from omniroll import (
    Bearings,
    Contact,
    Controller,
    InvalidValueError,
    Motor,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
)
from omniroll.effects.loaded_axles import GroundBesideAxles
from omniroll.results.comparison import distance_at

ENGINES = ("compiled", "python")
GRAVITY = 9.80665
INSTANT = 1e-10  # relative, of instants in closed form
RELATIVE = 1e-10
WIDE = 0.15
# Four wheels at the corners of a rectangle, which all roll along x.
CART = Vehicle.paper(4, 5).replace(
    wheel_places=((LONG, WIDE), (-LONG, WIDE), (-LONG, -WIDE), (LONG, -WIDE)),
    wheel_angles=(np.pi / 2,) * 4,
)
FRONT, BEHIND = [0, 3], [1, 2]
LAWS = {
    "viscous": {"coefficient": (0.3, 0.2)},
    "regularised": {"law": "regularised", "friction": (0.3, 0.2), "speed": 0.05},
}


# ---- closed forms ----------------------------------------------------------------------------------------------------


ANGLE, FRICTION, FADES = 0.3, 0.25, 0.02  # of a vehicle that slides downhill: rad, of the ground, m/s
WEIGHT = CART.mass * GRAVITY * np.cos(ANGLE)  # N, across the slope


def slide_downhill(bearings, vehicle=CART, **options):
    """A run of a vehicle whose wheels all stand, so far."""
    ground = Contact(law="regularised", friction=FRICTION, speed=FADES, loads="dynamic", height=HEIGHT,
                     normal_gravity=GRAVITY * np.cos(ANGLE))  # fmt: skip
    options |= {"control": False, "effects": [ground, bearings, Slope(ANGLE, 0.0, gravity=GRAVITY)]}
    return simulate(vehicle, nu=(0, 0, 0), duration=0.02, accuracy=1e-11, **options)


def row_before_the_front_lets_go(run, starts, force):
    """M v' = M g sin b - F with F = mu W v/sqrt(v^2 + v0^2), and each wheel in front carries W/4 + h F/(4 L). Its
    bearing lets go where mu v/sqrt(v^2 + v0^2) of that is `force`, in N, and the wheels behind later.

    starts  (run, wheel): when the bearing of a wheel begins to turn
    """
    lever, mass = FRICTION * HEIGHT / LONG, CART.mass
    part = (np.sqrt(1 + 16 * lever * force / (FRICTION * WEIGHT)) - 1) / (2 * lever)  # of its friction
    fall = GRAVITY * np.sin(ANGLE)
    let_go, _ = quad(lambda turn: FADES / np.cos(turn) ** 2 / (fall - FRICTION * WEIGHT / mass * np.sin(turn)), 0,
                     np.arcsin(part), epsabs=0, epsrel=1e-13)  # fmt: skip
    assert 0.002 < let_go < 0.018
    for wheel in FRONT:
        assert starts(run, wheel)[0] == pytest.approx(let_go, rel=INSTANT)
    assert all(not len(starts(run, wheel)) or starts(run, wheel)[0] > 1.1 * let_go for wheel in BEHIND)
    row = np.flatnonzero(np.abs(run.t / let_go - 1) <= INSTANT)[0]
    carried = WEIGHT / 4 * (1 + lever * part)
    assert run.ground_load[row, FRONT] == pytest.approx([carried] * 2, rel=1e-9)
    assert run.ground_load[row, BEHIND] == pytest.approx([WEIGHT / 2 - carried] * 2, rel=1e-9)
    return row


@pytest.mark.parametrize("engine", ENGINES)
def test_the_front_axles_of_a_vehicle_that_slides_downhill_break_away_first(engine):
    breaks = 0.05
    bearings = Bearings(wheel_coulomb=0.6 * breaks, wheel_break_away=breaks)
    run = slide_downhill(bearings, roller_model="massless", engine=engine)
    row = row_before_the_front_lets_go(run, changes, breaks / CART.wheel_radius)
    assert np.abs(bearing_torques(run)[row, FRONT]).max() <= breaks * (1 + 1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_wheels_held_by_their_bearings_load_the_front_as_the_platform_stops(engine):
    """On a viscous ground M v' = -4 c v, and each load changes by 4 c v h/(4 L). The axles never let go, since l c v
    only falls."""
    c, speed = 3.0, 1.2
    ground = Contact(c, loads="dynamic", height=HEIGHT, wheel_rates=0)
    bearings = Bearings(wheel_coulomb=1.01 * CART.wheel_radius * c * speed)
    run = simulate(CART, nu=(speed / CART.platform_radius, 0, 0), duration=0.3, roller_model="massless", engine=engine,
                   effects=[ground, bearings], accuracy=1e-11, control=False)  # fmt: skip
    assert not run.quantity("rates").any()
    times = np.linspace(0, 0.3, 7)
    braked = 4 * c * speed * np.exp(-4 * c / CART.mass * times)
    for t, force in zip(times, braked, strict=True):
        moved = HEIGHT * force / (4 * LONG)
        wanted = CART.mass * GRAVITY / 4 + moved * np.array([1, -1, -1, 1])
        assert run.sample(t).ground_load == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_axle_that_turns_loads_the_other_wheels(engine):
    """A torque that grows as b t turns a wheel of a platform at rest where it comes to the break-away torque. Then
    I w' = b t - T, a moment that the loads must give: each changes by I w'/(4 L)."""
    grows, breaks, sliding = 0.5, 0.06, 0.04
    table = TorqueTable((0.0, 0.4), ((0, 0, 0, 0), (0.4 * grows, 0, 0, 0)))
    ground = Contact(0.0, loads="dynamic", height=HEIGHT)
    effects = [ground, Bearings(wheel_coulomb=sliding, wheel_break_away=breaks), table]
    run = simulate(CART, nu=(0, 0, 0), duration=0.3, roller_model="massless", engine=engine, effects=effects,
                   accuracy=1e-11, control=False)  # fmt: skip
    (begins,) = changes(run, 0)
    assert begins == pytest.approx(breaks / grows, rel=INSTANT)
    before, later = run.sample(0.9 * begins).ground_load, run.sample(0.25).ground_load
    assert before == pytest.approx(np.full(4, CART.mass * GRAVITY / 4), rel=1e-12)
    moved = (grows * 0.25 - sliding) / (4 * LONG)
    assert np.abs(later - before) == pytest.approx(np.full(4, moved), rel=1e-9)
    assert (np.sign(later - before) * np.sign(later - before)[0]).tolist() == [1, -1, -1, 1]


@pytest.mark.parametrize("engine", ENGINES)
def test_stuck_axles_tip_a_vehicle_at_an_exact_speed_of_the_ground_force(engine):
    """Brakes on all wheels of a tricycle that slides forwards, its two wheels in front: the load of the one behind is
    gone where h F = W LONG/2."""
    mass = TRICYCLE.mass
    backwards = TRICYCLE.replace(wheel_places=tuple((-x, y) for x, y in TRICYCLE.wheel_places))
    c, height = 8.0, 0.3
    needed = mass * GRAVITY * LONG / 2 / height
    ramp = Slope(0.9, 0.0, gravity=GRAVITY)
    ground = Contact(c, loads="dynamic", height=height, normal_gravity=GRAVITY)
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 1 and 2") as caught:
        simulate(backwards, nu=(0, 0, 0), duration=2.0, roller_model="massless", engine=engine, control=False,
                 effects=[ground, Bearings(wheel_coulomb=5.0), ramp], accuracy=1e-11)  # fmt: skip
    # Only the two wheels that roll along x hold it: M v' = M g sin - 2 c v.
    speed, rate = needed / (2 * c), 2 * c / mass
    instant = -np.log(1 - speed * rate / (GRAVITY * np.sin(0.9))) / rate
    assert caught.value.t == pytest.approx(instant, rel=INSTANT)
    assert not caught.value.trajectory.quantity("rates").any()


# ---- every body ------------------------------------------------------------------------------------------------------


def standing_case(law, wheels, model):
    """A machine that stands on all its wheels as it moves, its run over an instant, its torques, and which wheels
    turn."""
    turns = np.arange(wheels) % 3 == 1
    bearings = Bearings(wheel_coulomb=np.where(np.arange(wheels) == 2, 0.02, 2.0))
    for attempt in range(100):
        rng = np.random.default_rng([41, wheels, MODELS.index(model), attempt])
        case = slipping_case(rng, wheels, 4, model, has_layout=True)
        case = replace(case, nu=case.nu / 8, rates=case.rates / 8 * turns, turns=case.turns / 10)
        torque = 0.1 * rng.normal(size=wheels)
        spins = {"contact_spins": case.turns} if model == "free" else {}
        ground = Contact(**LAWS[law], loads="dynamic", **numbers(case), wheel_rates=case.rates, **spins)
        with contextlib.suppress(InvalidValueError, SimulationStopped):  # it tips
            run = simulate(case.vehicle, **case.start(), duration=1e-9, effects=[ground, bearings, Torque(torque)],
                           engine="python", control=False)  # fmt: skip
            if run.ground_load[0].min() > 0:
                return case, run, torque, turns
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels, model", [(3, "massless"), (3, "free"), (4, "free"), (5, "massless"), (6, "free")])
@pytest.mark.parametrize("law", LAWS)
def test_axles_and_loads_agree_with_every_body(law, wheels, model):
    """The oracle gets forces and torques; it must find the accelerations, none of the wheels whose axles stick, and the
    loads from which the forces follow."""
    case, run, torque, turns = standing_case(law, wheels, model)
    force, load, bearing = run.ground_force[0], run.ground_load[0], bearing_torques(run)[0]
    assert np.ptp(load) > 1e-2 * load.mean()
    given = Acting(wheel_torques=working_precision(lambda: [exact(t) for t in torque + bearing])())
    wanted_nu, wanted_rates, wanted = by_bodies(case, force, load, given)
    assert load == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * load.max())
    size = np.abs(torque).max() / case.vehicle.wheel_inertia
    stuck = ~turns & (np.arange(wheels) != 2)
    assert stuck.any() and np.abs(wanted_rates[stuck]).max() <= RELATIVE * size
    assert np.abs(wanted_rates[~stuck]).min() > 1e-3 * size
    assert np.sign(wanted_rates[2]) == -np.sign(bearing[2]) and abs(bearing[2]) == 0.02
    found = (run.nu[-1] - run.nu[0]) / run.t[-1], (run.quantity("rates")[-1] - run.quantity("rates")[0]) / run.t[-1]
    for value, other in zip(found, (wanted_nu, wanted_rates), strict=True):
        assert value == pytest.approx(other, rel=1e-5, abs=1e-5 * np.abs(wanted_rates).max())


# ---- what is found together ------------------------------------------------------------------------------------------


def all_modes(case_of, holding, sliding):
    """All modes (-1, 0, 1) of the axles at rest that obey the law, each by itself; case_of gives what holds and what
    accelerations there are from the modes and torques."""
    fits = []
    for modes in itertools.product((-1, 0, 1), repeat=len(holding)):
        modes = np.array(modes)
        asked, gains = case_of(modes, -modes * sliding)
        if (np.abs(asked) <= holding + 1e-12)[modes == 0].all() and (modes * gains >= 0)[modes != 0].all():
            fits.append(modes)
    return fits


@pytest.mark.parametrize("number", range(12))
def test_modes_are_the_only_ones_of_all_that_obey_the_law(number, monkeypatch):
    """Vehicles with wheels at rest on a ground that they skid over: tried are all modes in the set that carries."""
    rng = np.random.default_rng([43, number])
    wheels, held = int(rng.choice((3, 4, 5))), {}
    take = GroundBesideAxles._take

    def noted(self, settled):
        resting, carries = self.axles.resting.copy(), self.loads.carries

        def case_of(modes, torques):
            self._put(modes, np.abs(torques))
            shares = self.loads.springs.shares(carries)
            self.loads._evaluated(shares, carries, held["sums_of"])
            return self.holding.copy(), self.buffers["rates_dot"].copy()

        assert resting.all()
        held["fits"] = all_modes(case_of, self.axles.sliding, self.axles.sliding)
        held["taken"] = settled.modes.copy()
        take(self, settled)

    check = GroundBesideAxles._refuse_unless_determined

    def kept(self, settled, sums_of):
        held["sums_of"] = sums_of
        check(self, settled, sums_of)

    monkeypatch.setattr(GroundBesideAxles, "_take", noted)
    monkeypatch.setattr(GroundBesideAxles, "_refuse_unless_determined", kept)
    ground = Contact(law="regularised", friction=float(rng.uniform(0.3, 1.0)), speed=0.05, loads="dynamic",
                     height=0.06, wheel_rates=0)  # fmt: skip
    effects = [ground, Bearings(wheel_coulomb=rng.uniform(0.02, 0.15, wheels)), Torque(0.1 * rng.normal(size=wheels))]
    simulate(Vehicle.paper(wheels, 5), nu=rng.normal(size=3), duration=0, effects=effects, engine="python",
             roller_model=MODELS[number % 2], control=False)  # fmt: skip
    assert [modes.tolist() for modes in held["fits"]] == [held["taken"].tolist()]


def test_axles_that_feed_themselves_are_refused():
    """A wheel whose own acceleration presses it on the ground more than its inertia takes: spin_inertia says so."""
    ground = Contact(law="regularised", friction=2.0, speed=1e-3, loads="dynamic", height=0.03, wheel_rates=0,
                     spin_inertia=60 * CART.wheel_inertia)  # fmt: skip
    for engine in ENGINES:
        with pytest.raises(SimulationStopped, match="loads and friction do not determine each other") as caught:
            simulate(CART, nu=(2.0, 0, 0), duration=0.1, roller_model="massless", engine=engine, control=False,
                     effects=[ground, Bearings(wheel_coulomb=3.0)])  # fmt: skip
        assert caught.value.t == 0


# ---- both engines ----------------------------------------------------------------------------------------------------


def scene(number):
    """A vehicle whose axles stick on one of both grounds under loads that follow, and the arguments of its run."""
    rng = np.random.default_rng([47, number])
    model, law, wheels = MODELS[number % 2], ("viscous", "regularised")[number // 2 % 2], int(rng.choice((3, 4, 5, 6)))
    friction = 10 ** rng.uniform(-2, 0.3)
    rates = tuple(rng.normal(size=wheels) * (rng.random(wheels) < 0.6)) if rng.random() < 0.7 else None
    numbers_of_law = {"coefficient": 20 * friction}
    if law == "regularised":
        numbers_of_law = {"friction": friction, "speed": 10 ** rng.uniform(-3, -1)}
    torques = 10 ** rng.uniform(-3, -0.5) * rng.uniform(0.5, 1.5, wheels)
    bearings = Bearings(wheel_coulomb=torques, wheel_break_away=torques * rng.choice((1.0, 1.4)), roller_viscous=1e-6)
    acts = (
        Torque(0.2 * rng.normal(size=wheels)),
        TorqueTable((0.0, 0.02, 0.05, 0.1), 0.3 * rng.normal(size=(4, wheels))),
        Motor(rng.normal(scale=4, size=wheels), 0.02, 1.5, gear_ratio=4, current_limit=1.0),
        Controller(rng.normal(size=3), 0.02, 0.02, limit=0.3),
    )[number // 4 % 4]
    ground = Contact(law=law, wheel_rates=rates, loads="dynamic", height=float(rng.uniform(0.03, 0.15)),
                     normal_gravity=9.7, **numbers_of_law)  # fmt: skip
    nu = rng.normal(size=3) if rng.random() < 0.8 else (0.0, 0.0, 0.0)
    effects = [ground, bearings, acts, Slope(rng.uniform(0, 0.3), 1.0)]
    options = {"nu": nu, "roller_model": model, "effects": effects, "accuracy": 1e-10, "control": False}
    return Vehicle.paper(wheels, int(rng.integers(4, 7))), options


def run_or_stop(vehicle, options, engine, duration=0.15):
    """The run, and the reason for which it has stopped, or nothing."""
    try:
        return simulate(vehicle, duration=duration, engine=engine, **options), ""
    except SimulationStopped as stopped:
        return stopped.trajectory, str(stopped)


@pytest.mark.long
@pytest.mark.parametrize("number", range(6))
def test_both_engines_make_the_same_motion(number):
    vehicle, options = scene(number)
    (one, why), (other, same) = (run_or_stop(vehicle, options, engine) for engine in ENGINES)
    assert one.stats["engine"] == "compiled" and other.stats["engine"] == "python"
    assert bool(why) == bool(same) and one.t[-1] == pytest.approx(other.t[-1], rel=1e-8)
    assert distance_at(one, other, np.linspace(0, min(one.t[-1], other.t[-1]), 40)) <= 1e-8
    rates, wanted = one.quantity("rates"), other.quantity("rates")
    assert rates[-1] == pytest.approx(wanted[-1], rel=1e-7, abs=1e-7 * np.abs(wanted).max())
    assert one.ground_load[-1] == pytest.approx(other.ground_load[-1], rel=1e-6, abs=1e-6 * one.ground_load.max())
    assert (rates[-1] == 0).tolist() == (wanted[-1] == 0).tolist()


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 5, 10])
@pytest.mark.parametrize("engine", ENGINES)
def test_the_law_holds_in_every_row(engine, number):
    """In each row an axle at rest takes at most its break-away torque, and one that turns its sliding torque; no load
    pulls, and the ledger closes."""
    vehicle, options = scene(number)
    run, _ = run_or_stop(vehicle, options, engine)
    bearings = options["effects"][1]
    rates, torque = run.quantity("rates"), bearing_torques(run)
    sliding, holding = np.array(bearings.wheel_coulomb), np.array(bearings.wheel_break_away)
    assert (np.abs(torque) <= holding * (1 + 1e-11)).all()
    turning = np.abs(rates) > 1e-12 * np.abs(rates).max()
    assert (torque == -np.sign(rates) * sliding)[turning].all()
    assert turning.any() and (rates == 0).any()
    assert run.ground_load.min() >= -1e-9 * vehicle.mass * GRAVITY
    scale = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-8 * scale


@pytest.mark.long
def test_a_session_is_the_run():
    vehicle, options = scene(6)
    run = assert_a_session_ends_as_the_run(vehicle, duration=0.15, **options)
    assert len({tuple(row) for row in run.quantity("rates") == 0}) > 1, "axles that stop or break away"
