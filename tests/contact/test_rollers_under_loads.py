"""Rollers whose bearings stick where wheels may slip and loads follow the motion, under the laws viscous and
regularised: closed forms, every body, both engines, the law in every row, and the friction with a named speed that
tends to it."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from scipy.integrate import quad

from contact.test_axles_under_loads import (
    CART,
    ENGINES,
    FRICTION,
    FRONT,
    GRAVITY,
    INSTANT,
    LAWS,
    RELATIVE,
    WEIGHT,
    WIDE,
    row_before_the_front_lets_go,
    run_or_stop,
    slide_downhill,
)
from contact.test_moving_loads import HEIGHT, LONG, TRICYCLE, by_bodies, numbers
from contact.test_newton_euler import slipping_case
from contact.test_stuck_rollers import all_spins, contact_torques
from omniroll import (
    Bearings,
    Contact,
    InvalidValueError,
    Session,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
    simulate_many,
)
from omniroll.effects.loaded_bearings import GroundBesideBearings
from omniroll.results.comparison import distance_at

ACROSS = CART.replace(wheel_angles=(0.0,) * 4)  # four wheels at the corners of a rectangle, whose axles look along x
RHO = ACROSS.wheel_radius - ACROSS.roller_axis_radius  # of a roller that touches the ground in its middle
STILL = 1e-11  # rad/s


def starts(run, wheel):
    """When the roller in contact begins to turn."""
    turns = np.abs(run.contact_spin[:, wheel]) > STILL
    return run.t[:-1][turns[1:] & ~turns[:-1]]


# ---- closed forms ----------------------------------------------------------------------------------------------------


BREAKS = 0.6 * RHO * FRICTION * WEIGHT / 4  # N m, of rollers on a vehicle that slides downhill


@pytest.mark.parametrize("engine", ENGINES)
def test_the_rollers_in_front_of_a_vehicle_that_slides_downhill_break_away_first(engine):
    bearings = Bearings(roller_coulomb=0.6 * BREAKS, roller_break_away=BREAKS, wheel_coulomb=3.0)
    run = slide_downhill(bearings, ACROSS, roller_model="free", engine=engine)
    assert run.stats["engine"] == engine
    row = row_before_the_front_lets_go(run, starts, BREAKS / RHO)
    assert np.abs(contact_torques(run)[row, FRONT]).max() <= BREAKS * (1 + 1e-11)


@pytest.mark.parametrize("engine", ENGINES)
def test_wheels_held_by_their_rollers_load_the_front_as_the_platform_stops(engine):
    """On a viscous ground M v' = -4 c v, and each load changes by 4 c v h/(4 L). The rollers never let go, since
    rho c v only falls."""
    c, speed = 3.0, 1.2
    ground = Contact(c, loads="dynamic", height=HEIGHT, wheel_rates=0, contact_spins=0)
    bearings = Bearings(roller_coulomb=1.01 * RHO * c * speed)
    run = simulate(ACROSS, nu=(speed / ACROSS.platform_radius, 0, 0), duration=0.3, roller_model="free",
                   effects=[ground, bearings], accuracy=1e-11, control=False, engine=engine)  # fmt: skip
    assert np.abs(all_spins(run)).max() <= STILL
    braked = 4 * c * speed * np.exp(-4 * c / ACROSS.mass * run.t)
    moved = HEIGHT * braked[:, None] / (4 * LONG) * np.array([1, -1, -1, 1])
    assert run.ground_load == pytest.approx(ACROSS.mass * GRAVITY / 4 + moved, rel=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_stuck_rollers_tip_a_vehicle_at_an_exact_speed_of_the_ground_force(engine):
    """A tricycle slides forwards down a slope across its two wheels in front, whose rollers stick; no wheel is braked
    along its rolling direction: M v' = M g sin - 2 c v. The load of the wheel behind is gone where h F = W LONG/2."""
    c, height, mass = 8.0, 0.3, TRICYCLE.mass
    across = TRICYCLE.replace(wheel_places=tuple((-x, y) for x, y in TRICYCLE.wheel_places),
                              wheel_angles=tuple(np.array(TRICYCLE.wheel_angles) - np.pi / 2))  # fmt: skip
    ground = Contact((c, 0.0), loads="dynamic", height=height, normal_gravity=GRAVITY)
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 1 and 2") as caught:
        simulate(across, nu=(0, 0, 0), duration=2.0, roller_model="free", engine=engine, control=False,
                 effects=[ground, Bearings(roller_coulomb=1.0), Slope(0.9, 0.0, gravity=GRAVITY)],
                 accuracy=1e-11)  # fmt: skip
    speed, rate = mass * GRAVITY * LONG / 2 / height / (2 * c), 2 * c / mass
    instant = -np.log(1 - speed * rate / (GRAVITY * np.sin(0.9))) / rate
    assert caught.value.t == pytest.approx(instant, rel=INSTANT)
    assert np.abs(all_spins(caught.value.trajectory)).max() <= STILL


DOWN, TILT = np.arctan2(0.6, 0.8), 0.7  # a slope that falls to a corner of the vehicle
PARKED = Bearings(roller_coulomb=1.0, wheel_coulomb=5.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_load_of_one_wheel_of_four_vanishes_as_the_vehicle_slides(engine):
    """All axles and rollers stick: M v' = M g sin b - 4 c v, and loads change by h F_x/(4 L) and by h F_y/(4 W)."""
    c, height, mass = 6.0, 0.2, ACROSS.mass
    gravity = GRAVITY * np.cos(TILT)
    ground = Contact(c, loads="dynamic", height=height, normal_gravity=gravity)
    run, _ = run_or_stop(ACROSS, {"nu": (0, 0, 0), "roller_model": "free", "accuracy": 1e-11, "control": False,
                                  "effects": [ground, PARKED, Slope(TILT, DOWN, gravity=GRAVITY)]},
                         engine, 0.3)  # fmt: skip
    force = mass * gravity / 4 / (height * (0.8 / (4 * LONG) + 0.6 / (4 * WIDE)))
    rate = 4 * c / mass
    instant = -np.log(1 - force / (4 * c) * rate / (GRAVITY * np.sin(TILT))) / rate
    assert 0.02 < instant < 0.28
    lifted = run.ground_load.argmin() % 4
    gone = run.t[np.flatnonzero(run.ground_load[:, lifted] <= 1e-9)[0]]
    assert gone == pytest.approx(instant, rel=INSTANT)
    assert np.sign(ACROSS.places()[lifted]).tolist() == [-1, -1], "the wheel behind, at the other corner"


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("tilt, speed", [(0.0, 0.5), (TILT, 0.0)], ids=["comes back", "vanishes"])
def test_the_load_of_a_wheel_comes_back_as_the_vehicle_brakes_and_vanishes_as_it_slides(tilt, speed, engine):
    """Friction in proportion to loads acts where these do, ahead of the vehicle's centre: it does not turn, however
    many wheels carry, and M v' = M g sin b - mu W s with s = v/sqrt(v^2 + v0^2). The load behind is gone where
    s mu h (cos/L + sin/W) is more than 1, of the way's direction."""
    friction, fades, height, normal = 0.8, 0.1, 0.2, GRAVITY * np.cos(tilt)
    least = 1 / (friction * height * (0.8 / LONG + 0.6 / WIDE))
    bound, fall = fades * least / np.sqrt(1 - least**2), GRAVITY * np.sin(tilt)
    instant, _ = quad(lambda v: 1 / (fall - friction * normal * v / np.hypot(v, fades)), speed, bound, epsabs=0,
                      epsrel=1e-13)  # fmt: skip
    ground = Contact(law="regularised", friction=friction, speed=fades, loads="dynamic", height=height,
                     normal_gravity=normal, wheel_rates=0, contact_spins=0)  # fmt: skip
    nu = np.array([0.8, 0.6, 0.0]) * speed / ACROSS.platform_radius
    run = simulate(ACROSS, nu=nu, duration=1.2 * instant, roller_model="free", accuracy=1e-11, control=False,
                   engine=engine, effects=[ground, PARKED, Slope(tilt, DOWN, gravity=GRAVITY)])  # fmt: skip
    behind = int(np.argmin(ACROSS.places() @ [0.8, 0.6]))
    gone = run.ground_load[:, behind] <= 1e-12 * run.ground_load.max()
    assert gone.any() and (gone != gone[0]).any()
    changes = run.t[np.flatnonzero(gone[1:] != gone[:-1]) + (gone[0] == 0)]
    assert changes == pytest.approx([instant], rel=INSTANT)
    assert np.abs(all_spins(run)).max() <= STILL and np.abs(run.nu[:, 2]).max() <= 1e-11


# ---- every body ------------------------------------------------------------------------------------------------------


def standing_case(law, wheels, monkeypatch):
    """A machine that stands on all its wheels as it moves, its runs over an instant by engine, its drives' torques, the
    torques and modes of all bearings (B,), and which rollers are at rest (N, n)."""
    kept = []
    in_rows = GroundBesideBearings.torques_in_rows

    def noted(self):
        kept.append((self.axles.torques() + self.holding, self.axles.modes.copy()))
        return in_rows(self)

    monkeypatch.setattr(GroundBesideBearings, "torques_in_rows", noted)
    bearings = Bearings(roller_coulomb=np.where(np.arange(wheels) == 1, 1e-9, 1e-2), wheel_coulomb=0.02)
    for attempt in range(100):
        rng = np.random.default_rng([53, wheels, attempt])
        case = slipping_case(rng, wheels, 4, "free", has_layout=True)
        rests = rng.random((wheels, 4)) < 0.7
        case = replace(case, nu=case.nu / 8, rates=case.rates / 8, turns=case.turns / 10 * ~rests[:, 0],
                       spins=case.spins / 10 * ~rests[:, 1:])  # fmt: skip
        torque = 0.1 * rng.normal(size=wheels)
        speeds = {"wheel_rates": case.rates, "contact_spins": case.turns}
        ground = Contact(**LAWS[law], loads="dynamic", **numbers(case), **speeds)
        kept.clear()
        with contextlib.suppress(InvalidValueError, SimulationStopped):  # it tips
            runs = {engine: simulate(case.vehicle, **case.start(), duration=1e-9, control=False, engine=engine,
                                     effects=[ground, bearings, Torque(torque)]) for engine in ENGINES}  # fmt: skip
            if runs["python"].ground_load[0].min() > 0:
                return case, runs, torque, *kept[0], rests
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels", [3, 4, 6])
@pytest.mark.parametrize("law", LAWS)
def test_rollers_and_loads_agree_with_every_body(law, wheels, monkeypatch):
    """The oracle gets forces and torques; it must find the accelerations, none of the spins of rollers that stick, and
    the loads from which the forces follow."""
    case, runs, torque, bearing, modes, rests = standing_case(law, wheels, monkeypatch)
    run = runs["python"]
    force, load = run.ground_force[0], run.ground_load[0]
    assert np.ptp(load) > 1e-2 * load.mean()
    for name in ("ground_load", "ground_force"):
        found, other = (getattr(run, name)[0] for run in (runs["compiled"], run))
        assert found == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * np.abs(other).max()), name
    of_rollers = bearing[wheels:].reshape(wheels, 4)
    given = working_precision(lambda: Acting(
        wheel_torques=[exact(t) for t in torque + bearing[:wheels]],
        roller_torques=[list(map(exact, row)) for row in of_rollers],
    ))()  # fmt: skip
    wanted_nu, wanted_rates, wanted = by_bodies(case, force, load, given)
    assert load == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * load.max())
    sticks = modes[wheels:].reshape(wheels, 4) == 0
    assert sticks.any() and not sticks[~rests].any() and (rests & ~sticks).any()
    found = (run.nu[-1] - run.nu[0]) / run.t[-1], (run.quantity("rates")[-1] - run.quantity("rates")[0]) / run.t[-1]
    for value, other in zip(found, (wanted_nu, wanted_rates), strict=True):
        assert value == pytest.approx(other, rel=1e-5, abs=1e-5 * np.abs(wanted_rates).max())


# ---- random scenes ---------------------------------------------------------------------------------------------------


def scene(number):
    """A vehicle whose rollers stick on one of both grounds under loads that follow, in half of these with its axles."""
    rng = np.random.default_rng([57, number])
    law, wheels = ("viscous", "regularised")[number // 2 % 2], int(rng.choice((3, 4, 5)))
    vehicle = Vehicle.paper(wheels, 4)
    friction = 10 ** rng.uniform(-2, 0)
    numbers_of_law = {"coefficient": 20 * friction}
    if law == "regularised":
        numbers_of_law = {"friction": friction, "speed": 10 ** rng.uniform(-2, -1)}
    torques = vehicle.roller_inertia * 10 ** rng.uniform(0.5, 3) * rng.uniform(0.5, 1.5, wheels)
    given = {"roller_coulomb": torques, "roller_break_away": torques * rng.choice((1.0, 1.4))}
    if number % 2:
        given["wheel_coulomb"] = 10 ** rng.uniform(-3, -0.5) * rng.uniform(0.5, 1.5, wheels)
    ground = Contact(law=law, loads="dynamic", height=float(rng.uniform(0.03, 0.12)), normal_gravity=9.7,
                     contact_spins=0 if rng.random() < 0.5 else None, **numbers_of_law)  # fmt: skip
    spins = rng.normal(size=(wheels, 3)) * rng.choice((0, 3, 30))
    nu = rng.normal(size=3) if rng.random() < 0.8 else (0.0, 0.0, 0.0)
    effects = [ground, Bearings(**given), TorqueTable((0.0, 0.03, 0.06), 0.2 * rng.normal(size=(3, wheels))),
               Slope(rng.uniform(0, 0.2), 1.0)]  # fmt: skip
    options = {"nu": nu, "spins": spins, "roller_model": "free", "effects": effects, "accuracy": 1e-8}
    return vehicle, options | {"control": False}


@pytest.mark.parametrize("number", [1, 2, *(pytest.param(k, marks=pytest.mark.long) for k in (0, *range(3, 14)))])
def test_the_law_holds_in_every_row(number):
    """A roller that rests takes at most its break-away torque, one that spins its sliding torque; no load pulls, and
    the ledger closes."""
    vehicle, options = scene(number)
    run, _ = run_or_stop(vehicle, options, "python", 0.05)
    spins, torque, bearings = run.contact_spin, contact_torques(run), options["effects"][1]
    assert (np.abs(torque) <= np.array(bearings.roller_break_away) * (1 + 1e-11)).all()
    turning = np.abs(spins) > 1e-9 * max(np.abs(spins).max(), 1.0)
    assert (torque == -np.sign(spins) * np.array(bearings.roller_coulomb))[turning].all()
    assert run.ground_load.min() >= -1e-9 * vehicle.mass * 9.7
    scale = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-7 * scale


@pytest.mark.long
def test_friction_with_a_named_speed_tends_to_it_at_first_order():
    """Nothing of the set-valued law has a part in those runs."""
    paper = Vehicle.paper(3, 5)
    ground = Contact(20.0, loads="dynamic", height=0.05)
    spins = 30 * np.random.default_rng(3).normal(size=(3, 4))
    options = {"nu": (0.0, 0.0, 0.3), "spins": spins, "duration": 0.15, "roller_model": "free", "control": False}
    bearings, times = Bearings(roller_coulomb=400 * paper.roller_inertia), np.linspace(0, 0.15, 16)

    def run(of_rollers):
        return simulate(paper, effects=[ground, of_rollers], accuracy=1e-9, **options)

    sticks = run(bearings)
    distances = [distance_at(run(replace(bearings, roller_speed=speed)), sticks, times) for speed in (1e-2, 1e-3)]
    assert (np.abs(sticks.spins[-1]) < 1e-11).any()
    assert 0.9 <= np.log10(distances[0] / distances[1]) <= 1.1


# ---- both engines ----------------------------------------------------------------------------------------------------


def high_scene(number):
    """A vehicle of four or five wheels, so high that friction may lift some of them."""
    rng = np.random.default_rng([61, number])
    law, wheels = ("viscous", "regularised")[number // 2 % 2], int(rng.choice((4, 5)))
    vehicle = Vehicle.paper(wheels, 4)
    friction = float(rng.uniform(0.4, 1.2))
    numbers_of_law = {"coefficient": 20 * friction}
    if law == "regularised":
        numbers_of_law = {"friction": friction, "speed": 10 ** rng.uniform(-2, -1)}
    size = friction * vehicle.mass * 9.7 / wheels
    torques = 0.01 * size * 10 ** rng.uniform(-1.5, 0.5) * rng.uniform(0.7, 1.3, wheels)
    given = {"roller_coulomb": torques, "roller_break_away": torques * rng.choice((1.0, 1.4))}
    if number % 2:
        given["wheel_coulomb"] = 0.05 * size * 10 ** rng.uniform(-1, 0.5) * rng.uniform(0.7, 1.3, wheels)
    height = float(rng.uniform(0.4, 1.1) * vehicle.platform_radius * np.cos(np.pi / wheels) / friction)
    ground = Contact(law=law, loads="dynamic", height=height, normal_gravity=9.7, wheel_rates=0,
                     contact_spins=0 if rng.random() < 0.5 else None, **numbers_of_law)  # fmt: skip
    nu = tuple(1.5 * rng.normal(size=3))
    effects = [ground, Bearings(**given), TorqueTable((0.0, 0.03, 0.06), 0.03 * size * rng.normal(size=(3, wheels))),
               Slope(rng.uniform(0, 0.2), 1.0)]  # fmt: skip
    options = {"nu": nu, "roller_model": "free", "effects": effects, "accuracy": 1e-8}
    return vehicle, options | {"control": False}


ASKED_THE_OTHER_WAY = 23  # a roller there turns in the way in which it is pushed back where all stick


def assert_engines_agree(vehicle, options, duration):
    """Ends to the accuracy, the same phases and modes, loads to ten times the accuracy."""
    (one, why), (other, same) = (run_or_stop(vehicle, options, engine, duration) for engine in ENGINES)
    assert one.stats["engine"] == "compiled" and other.stats["engine"] == "python"
    assert bool(why) == bool(same) and one.t[-1] == pytest.approx(other.t[-1], rel=1e-8)
    if one.t[-1] == 0:
        return
    accuracy = options["accuracy"]
    assert distance_at(one, other, np.linspace(0, one.t[-1], 40)) <= accuracy
    assert one.stats["phases"] == other.stats["phases"]
    rows = len(one) - bool(why)
    for found, wanted in ((all_spins(one), all_spins(other)), (one.quantity("rates"), other.quantity("rates"))):
        size = np.abs(wanted).max()
        assert found[-1] == pytest.approx(wanted[-1], rel=0, abs=10 * accuracy * size)
        assert (np.abs(found[-1]) <= accuracy * size).tolist() == (np.abs(wanted[-1]) <= accuracy * size).tolist()
    weight = vehicle.mass * 9.7
    assert one.ground_load[rows - 1] == pytest.approx(other.ground_load[-1 - bool(why)], abs=10 * accuracy * weight)


@pytest.mark.parametrize("number", [ASKED_THE_OTHER_WAY])
def test_both_engines_make_the_same_motion_of_high_vehicles(number):
    assert_engines_agree(*high_scene(number), 1e-4)


@pytest.mark.long
@pytest.mark.parametrize("number", range(5))
@pytest.mark.parametrize("make", [scene, high_scene])
def test_both_engines_make_the_same_motion(make, number):
    assert_engines_agree(*make(number), 0.02)


# ---- sessions and sweeps ---------------------------------------------------------------------------------------------


def without_control(options):
    return {name: value for name, value in options.items() if name != "control"}


def test_a_session_is_the_run_and_may_pause_however_close_to_an_event():
    vehicle, options = scene(0)
    options |= {"accuracy": 1e-10}
    run = simulate(vehicle, duration=0.05, **options)
    events = np.unique(run.t[:-1][np.diff(run.t) == 0])
    assert len(events) >= 5
    for event in events[:3]:
        for before in (1e-9, 1e-12, 1e-13, 1e-14, 3e-15, -3e-15, -1e-14):
            session = Session(vehicle, driven=False, **without_control(options))
            for step in (event - before, max(before, 1e-12) / 2, 1e-3):
                session.step(step)
            assert session.nu == pytest.approx(run.sample(session.time).nu, abs=1e-10 * np.abs(run.nu).max())


def test_a_session_goes_back_to_the_bit():
    vehicle, options = scene(0)
    session = Session(vehicle, driven=False, **without_control(options))
    session.step(0.01)
    saved = session.save()
    session.step(0.02)
    end = np.concatenate([session.nu, session.wheel_speeds, session.contact_spin, session.ground_force.ravel()])
    session.restore(saved)
    session.step(0.02)
    again = np.concatenate([session.nu, session.wheel_speeds, session.contact_spin, session.ground_force.ravel()])
    assert np.array_equal(end, again)


def test_a_sweep_ends_where_its_runs_end():
    vehicle, options = scene(0)
    starts = [options.pop("nu"), np.array([0.5, 0.0, 1.0])]
    many = simulate_many(vehicle, nu=starts, duration=0.03, **options)
    for k, nu in enumerate(starts):
        run = simulate(vehicle, nu=nu, duration=0.03, **options)
        np.testing.assert_array_equal(many.end.nu[k], run.nu[-1])
        np.testing.assert_allclose(many.end.spins[k], run.spins[-1], rtol=1e-12)
