"""Rollers whose bearings stick beside contacts that stick, and axles, under loads that follow the motion: every body in
every mode, closed forms, the law in every row, and the friction with named speeds that tends to it."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from hard import ground_anywhere
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from scipy.optimize import brentq

from contact import test_rollers_on_the_ground as static_loads
from contact.in_steps import assert_a_sweep_ends_where_its_runs_end
from contact.test_axles_on_the_ground import case_in_modes
from contact.test_moving_loads import by_bodies, numbers
from contact.test_rollers_on_the_ground import (
    ARM,
    CROSS,
    GRAVITY,
    HOLDS,
    INSTANT,
    MASS,
    RADIUS,
    RHO,
    ROLLER,
    WHEEL,
    assert_obeys_the_laws,
    assert_same_motion,
    at_rest,
    axle_torques,
    by_kernel,
    pushed,
)
from omniroll import (
    Bearings,
    Contact,
    InvalidValueError,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
)
from omniroll.effects import cones
from omniroll.effects.loaded_ground_with_bearings import LoadedGroundWithBearings
from omniroll.results.comparison import distance_at

RELATIVE = 1e-10
HEIGHT = 0.06
TURNED = {19: 0.14087119396098519, 90: 0.108806181498144}  # random scenes and their heights
TIP = {67, 71}  # random scenes whose vehicle tips
WEIGHT = MASS * GRAVITY
FOLLOW = {"loads": "dynamic", "height": HEIGHT}
BLOCKED = Bearings(wheel_coulomb=HOLDS, roller_coulomb=HOLDS)
ENGINES = ("compiled", "python")
EACH = ["compiled", pytest.param("python", marks=pytest.mark.long)]  # for tests of one engine at a time
run_of = static_loads.run_of  # a fixture: by each engine


# ---- every body ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axles", [(), ("axle_sticking",)])
@pytest.mark.parametrize("number", range(8))
def test_loads_in_all_modes_agree_with_every_body(number, axles):
    """The oracle is given forces and torques, and must find the same accelerations and loads with the same sums."""
    rng = np.random.default_rng([43, number, len(axles)])
    wheels, rollers = (3, 4)[number % 2], 5
    contacts, stuck = rng.random(wheels) < 0.6, rng.random((wheels, rollers)) < 0.6
    still = (rng.random(wheels) < 0.5) & bool(axles)
    contacts[0], stuck[0, 0] = True, number % 3 > 0
    case, along = at_rest(case_in_modes(rng, "free", contacts, still), contacts, stuck, still)
    push, torque = rng.normal(size=(wheels, 2)), rng.normal(size=wheels)
    given = rng.normal(size=wheels) * ~still * bool(axles), 0.01 * rng.normal(size=stuck.shape) * ~stuck
    balance = numbers(case) | {"normal_gravity": GRAVITY, "spin_inertia": np.full(wheels, case.vehicle.wheel_inertia)}
    found = by_kernel(case, (contacts, stuck, still), axles, push, torque, given, along, balance)
    acting = working_precision(lambda: Acting(
        wheel_torques=[exact(t) for t in torque + found["axle_torque"]],
        roller_torques=[list(map(exact, row)) for row in found["rollers"]],
    ))()  # fmt: skip
    wanted_nu, wanted_rates, loads = by_bodies(case, found["ground_force"], rng.uniform(1, 5, wheels), acting)
    size = np.abs(wanted_nu).max() + np.abs(wanted_rates).max() + np.abs(torque).max() / case.vehicle.wheel_inertia
    for value, wanted in ((found["nu_dot"], wanted_nu), (found["rates_dot"], wanted_rates)):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * size)
    rows = np.column_stack([np.ones(wheels), found["contact_places"].reshape(wheels, 2)])
    wanted = rows.T @ np.array(loads)
    assert found["load_sums"] == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * np.abs(wanted).max())


def standing_case(wheels, monkeypatch):
    """A vehicle at an instant, of whose wheels some stand along their axles or their rolling directions: the case, the
    start of its run and the run itself, its drives' torques, and the torques (B,) and modes (B,) of all bearings."""
    kept = []
    in_rows = LoadedGroundWithBearings.torques_in_rows

    def noted(self):
        kept.append((self.bearing_torques(), self.axles.modes.copy(), self.stands.copy()))
        return in_rows(self)

    monkeypatch.setattr(LoadedGroundWithBearings, "torques_in_rows", noted)
    for attempt in range(200):
        rng = np.random.default_rng([45, wheels, attempt])
        contacts, stuck = rng.random(wheels) < 0.7, rng.random((wheels, 5)) < 0.7
        still = rng.random(wheels) < 0.5
        case, _ = at_rest(case_in_modes(rng, "free", contacts, still), contacts, stuck, still)
        case = replace(case, nu=case.nu / 8, rates=case.rates / 8, turns=case.turns / 8, spins=case.spins / 8)
        torque = 0.02 * rng.normal(size=wheels)
        ground = Contact(law="coulomb", friction=(0.8, 0.6), loads="dynamic", **numbers(case),
                         wheel_rates=case.rates, contact_spins=case.turns)  # fmt: skip
        bearings = Bearings(wheel_coulomb=np.where(still, 2.0, 0.02), roller_coulomb=np.where(stuck[:, 0], 0.2, 1e-3))
        kept.clear()
        with contextlib.suppress(SimulationStopped, InvalidValueError):  # it tips
            start = case.start() | {"duration": 1e-9, "effects": [ground, bearings, Torque(torque)], "control": False}
            run = simulate(case.vehicle, **start, engine="python")
            torques, modes, stands = kept[0]
            if run.ground_load[0].min() > 0 and stands.any(axis=0).all():
                return case, start, run, torque, torques, modes
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels", [3, 4, 5])
def test_what_a_run_finds_agrees_with_every_body(wheels, monkeypatch):
    """The oracle gets forces and torques; it must find the loads from which the forces follow, and what rests. And the
    compiled engine finds the same."""
    case, start, run, torque, bearing, modes = standing_case(wheels, monkeypatch)
    force, load = run.ground_force[0], run.ground_load[0]
    assert np.ptp(load) > 1e-2 * load.mean()
    given = working_precision(lambda: Acting(
        wheel_torques=[exact(t) for t in torque + bearing[:wheels]],
        roller_torques=[list(map(exact, row)) for row in bearing[wheels:].reshape(wheels, 5)],
    ))()  # fmt: skip
    wanted_nu, wanted_rates, wanted = by_bodies(case, force, load, given)
    assert load == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * load.max())
    size = np.abs(force).max() * case.vehicle.wheel_radius / case.vehicle.wheel_inertia
    held = modes[:wheels] == 0
    assert held.any() and np.abs(wanted_rates[held]).max() <= RELATIVE * size
    found = (run.nu[-1] - run.nu[0]) / run.t[-1]
    assert found == pytest.approx(wanted_nu, rel=1e-5, abs=1e-5 * size)
    compiled = simulate(case.vehicle, **start, engine="compiled")
    assert np.array_equal(compiled.sticks[0], run.sticks[0])
    assert compiled.ground_load[0] == pytest.approx(load, rel=RELATIVE, abs=RELATIVE * load.max())
    assert compiled.ground_force[0] == pytest.approx(force, rel=RELATIVE, abs=RELATIVE * load.max())
    of_axles = pytest.approx(bearing[:wheels], rel=RELATIVE, abs=RELATIVE * np.abs(bearing).max())
    assert axle_torques(compiled)[0] == of_axles


# ---- closed forms ----------------------------------------------------------------------------------------------------


def loads_behind(force, way):
    """The loads of a cross on which a force acts along `way` at the height of its centre of mass."""
    at = np.array([0, 1, 2, 3]) * np.pi / 2  # where the wheels are
    return WEIGHT / 4 + force * HEIGHT / (2 * ARM) * np.cos(at - way)


@pytest.mark.parametrize("part", [1 - 1e-9, 1 + 1e-9, 1 + 1e-6, 1.3])
@pytest.mark.parametrize("way", [0.0, 0.3, np.pi / 4, 4.0])
def test_a_vehicle_with_blocked_bearings_is_a_block_on_a_slope(run_of, way, part):
    """It rests up to tan b = mu, however its weight is shared: each contact takes mu times its own load then. Then
    v' = g (sin b - mu cos b)."""
    angle = 0.25
    friction, across = np.tan(angle) / part, GRAVITY * np.cos(angle)
    ground = Contact(law="coulomb", friction=friction, normal_gravity=across, **FOLLOW)
    run = run_of([ground, BLOCKED, Slope(angle, way, gravity=GRAVITY)], 0.02)
    held = min(np.sin(angle) * MASS * GRAVITY, friction * MASS * across)
    wanted = loads_behind(held, way) + (MASS * across - WEIGHT) / 4
    near = 1e-7 if 1 < part < 1 + 1e-8 else 1e-9 if part > 1 else RELATIVE
    assert run.ground_load == pytest.approx(np.broadcast_to(wanted, (len(run), 4)), rel=near)
    if part < 1:
        assert not run.nu.any() and run.sticks.all()
        return
    speed = np.linalg.norm(run.nu[-1, :2]) * ARM
    assert speed == pytest.approx(GRAVITY * np.sin(angle) * (1 - 1 / part) * run.t[-1],
                                  rel=1e-5 if part < 1 + 1e-8 else 1e-8 if part < 1.1 else 1e-11)  # fmt: skip
    assert not run.sticks[1:].any() and np.abs(run.nu[-1, 2]) <= 1e-4 * np.linalg.norm(run.nu[-1])
    assert run.stats["evaluations"] < 1000  # nothing makes its steps short


@pytest.mark.parametrize("number", range(6))
def test_contacts_that_are_only_just_pulled_go_where_the_vehicle_goes(number):
    """Forces of contacts against the motion x of a vehicle, which takes them away but for 1e-9 of it. Rounds that
    begin at no forces leave them 2e-5 to 2e-4 of the largest off."""
    rng = np.random.default_rng([73, number])
    count = int(rng.integers(3, 7))
    rows = rng.normal(size=(count, 2, 3))
    motion = 1e-9 * rng.normal(size=3)
    rate = rows @ motion
    reach = np.repeat(10 ** rng.uniform(-0.5, 0.5, (count, 1)), 2, axis=1)
    force = -reach * rate / np.linalg.norm(rate, axis=1, keepdims=True)
    matrix = np.einsum("kcx,jdx->kcjd", rows, rows)
    given = rate - np.tensordot(matrix, force, 2)
    found = cones.decide_semidefinite(matrix, given, reach, from_inside=True)
    assert found.force == pytest.approx(force, abs=1e-6 * reach.max())
    assert (found.pull > 0).all()


@pytest.mark.parametrize("way", [0.0, 1.0])
def test_a_skidding_vehicle_with_blocked_bearings_comes_to_rest(way, run_of):
    """v' = -mu g: the loads in front do not change what friction takes together."""
    friction, speed = 0.3, 3.0
    ground = Contact(law="coulomb", friction=friction, wheel_rates=0, contact_spins=0, **FOLLOW)
    nu = speed * np.array([np.cos(way), np.sin(way), 0])
    stops = ARM * speed / (friction * GRAVITY)
    run = run_of([ground, BLOCKED], 1.3 * stops, nu=nu)
    rest = np.flatnonzero(run.sticks.all(axis=1))[0]
    assert run.t[rest] == pytest.approx(stops, rel=INSTANT)
    assert run.ground_load[:rest] == pytest.approx(np.broadcast_to(loads_behind(friction * WEIGHT, way), (rest, 4)),
                                                   rel=RELATIVE)  # fmt: skip
    assert run.ground_load[-1] == pytest.approx(np.full(4, WEIGHT / 4), rel=RELATIVE)
    assert not run.nu[-1].any()
    assert np.linalg.norm(run.pose[-1, :2]) == pytest.approx((ARM * speed) ** 2 / (2 * friction * GRAVITY), rel=1e-10)
    assert -run.contributions()["ground_loss"][-1] == pytest.approx(run.energy[0], rel=1e-10)


def test_the_wheel_in_front_slips_and_lifts_as_the_vehicle_starts(run_of):
    """Wheels 2 and 4 push by (b t - S)/l each; 1 and 3 roll along x on rollers whose bearings take T. Acceleration
    moves load to wheel 3 behind, until T/rho + B a/rho^2 is more than the friction of wheel 1, and until that carries
    nothing: M h a and what turns faster, 2 J a/l and B w' of both rollers, are 2 R (W/4 - N). Then w' is -T/B of the
    roller in front, which its bearing stops."""
    growth, breaks, turns, friction, high = 40.0, 0.02, 0.004, 0.9, 0.15
    ground = Contact(law="coulomb", friction=(friction, 3.0), loads="dynamic", height=high)
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=turns)
    run = run_of([ground, bearings, pushed(growth)], 0.0165)
    starts = (breaks + RADIUS * turns / RHO) / growth
    moving = np.flatnonzero(np.abs(run.nu[:, 0]) > 0)
    assert run.t[moving[0] - 1] == pytest.approx(starts, rel=INSTANT)
    mass, high_mass = MASS + 2 * WHEEL / RADIUS**2, MASS * high + 2 * WHEEL / RADIUS
    lifts = (high_mass + 2 * ROLLER / RHO) / (2 * ARM)
    most = (friction * WEIGHT / 4 - turns / RHO) / (ROLLER / RHO**2 + friction * lifts)
    slips = starts + RADIUS * (mass + 2 * ROLLER / RHO**2) * most / (2 * growth)
    at = np.flatnonzero(~run.sticks[:, 0])[0]
    assert run.t[at] == pytest.approx(slips, rel=INSTANT)
    loads = [WEIGHT / 4 - lifts * most, WEIGHT / 4 + lifts * most]
    assert run.ground_load[at - 1, [0, 2]] == pytest.approx(loads, rel=1e-9)
    fastest = (ARM * WEIGHT / 2 + turns) / (high_mass + ROLLER / RHO)
    leaves = breaks / growth + RADIUS / (2 * growth) * ((mass + ROLLER / RHO**2) * fastest + turns / RHO)
    off = np.flatnonzero(run.drive[:, run.effects.drives().index("carries"), 0] == 0)[0]
    assert starts < slips < leaves < run.t[-1] and run.t[off] == pytest.approx(leaves, rel=INSTANT)


def test_wheels_that_drive_begin_to_slip_together_and_cannot_slip_aside(run_of):
    """Under static loads. Wheels 2 and 4 push by F = (b t - S)/l - J a/l^2 each, and 1 and 3 roll on rollers:
    (M + 2 B/rho^2) a is 2 F - 2 T/rho. Both push until F = mu W/4, and their slips have one direction: their rollers
    stick."""
    growth, breaks, turns, friction = 40.0, 0.02, 0.004, 0.9
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=turns)
    run = run_of([Contact(law="coulomb", friction=friction), bearings, pushed(growth)], 0.017)
    most, starts = friction * MASS * GRAVITY / 4, (breaks + RADIUS * turns / RHO) / growth
    fastest = 2 * (most - turns / RHO) / (MASS + 2 * ROLLER / RHO**2)
    slips = (breaks + RADIUS * most + WHEEL * fastest / RADIUS) / growth
    at = np.flatnonzero(~run.sticks.all(axis=1))[0]
    assert run.t[at] == pytest.approx(slips, rel=INSTANT)
    speed = fastest * (slips - starts) / 2 + fastest * (run.t[-1] - slips)
    assert run.nu[-1, 0] * ARM == pytest.approx(speed, rel=1e-9)
    assert run.sticks[-1].tolist() == [True, False, True, False]


def test_blocked_wheels_that_hold_tip_the_vehicle(run_of):
    """On a ground that holds, a cross tips over the edge between two wheels where mu h is more than R/sqrt 2."""
    way, speed = np.pi / 4, 3.0
    nu = speed * np.array([np.cos(way), np.sin(way), 0])

    def run(height):
        ground = Contact(law="coulomb", friction=0.5, wheel_rates=0, contact_spins=0, loads="dynamic", height=height)
        return run_of([ground, BLOCKED], 0.01, nu=nu)

    edge = ARM / np.sqrt(2) / 0.5
    left = WEIGHT / 4 * np.array([1.999, 1.999, 0.001, 0.001])
    assert run(0.999 * edge).ground_load[0] == pytest.approx(left, rel=1e-9)
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 0 and 1"):
        run(1.001 * edge)


# ---- random scenes ---------------------------------------------------------------------------------------------------


def scene(number, height=None):
    """The scenes of static loads, with loads that follow the motion of a vehicle as low as it is wide, or higher."""
    vehicle, options = static_loads.scene(number)
    ground, *others = options["effects"]
    height = height or 10 ** np.random.default_rng([67, number]).uniform(-1.5, -0.5)
    return vehicle, options | {"effects": [replace(ground, loads="dynamic", height=float(height)), *others]}


def high_scene(number):
    """A vehicle of four or five wheels, as high as friction can tip it: wheels lift."""
    rng = np.random.default_rng([69, number])
    wheels = int(rng.choice((4, 5)))
    vehicle = Vehicle.paper(wheels, 4)
    friction = rng.uniform(0.3, 0.8)
    size = friction * vehicle.mass * 9.8 / wheels
    of_rollers = size * RHO * 10 ** rng.uniform(-0.5, 0.5) * rng.uniform(0.7, 1.3, wheels)
    given = {"roller_coulomb": of_rollers, "roller_break_away": of_rollers * rng.choice((1.0, 1.3))}
    if number % 2:
        of_axles = size * RADIUS * 10 ** rng.uniform(-1.0, 0.5) * rng.uniform(0.7, 1.3, wheels)
        given |= {"wheel_coulomb": of_axles, "wheel_break_away": of_axles * rng.choice((1.0, 1.3))}
    driven = size * RADIUS * rng.normal(size=(3, wheels))
    nu = tuple(2 * rng.normal(size=3)) if rng.random() < 0.6 else (0.0, 0.0, 0.0)
    height = float(rng.uniform(0.6, 1.2) * ARM * np.cos(np.pi / wheels) / friction)
    ground = Contact(law="coulomb", friction=friction, normal_gravity=9.8, loads="dynamic", height=height,
                     wheel_rates=0 if rng.random() < 0.3 else None)  # fmt: skip
    effects = [ground, Bearings(**given), TorqueTable((0.0, 0.02, 0.05), driven),
               Slope(rng.uniform(0, 0.1), rng.uniform(0, 6))]  # fmt: skip
    options = {"nu": nu, "roller_model": "free", "effects": effects, "duration": 0.06, "accuracy": 1e-8}
    return vehicle, options | {"control": False}


def run_or_stop(vehicle, options, engine):
    """A run, or what there is of one that stops, how many rows are its own, and why it stopped."""
    try:
        run = simulate(vehicle, engine=engine, **options)
    except SimulationStopped as stopped:
        run = stopped.trajectory
        return run, len(run) - (len(run) == 1 or run.t[-1] == run.t[-2]), stopped.reason
    return run, len(run), ""


def assert_scene_obeys(vehicle, options, engine="compiled"):
    run, rows, reason = run_or_stop(vehicle, options, engine)
    assert run.stats["engine"] == engine
    if rows:  # it moves
        assert_obeys_the_laws(vehicle, run, options, rows)
    return run, reason


def assert_engines_agree(vehicle, options):
    """Both obey the laws, and make the same motion, or stop at the same time for the same reason."""
    (here, stopped), (there, reason) = (assert_scene_obeys(vehicle, options, engine) for engine in ENGINES)
    assert stopped == reason and here.t[-1] == pytest.approx(there.t[-1], abs=1e-10)
    if there.t[-1] > 0:  # the engines count phases otherwise where there is none
        assert_same_motion(here, there)
        assert here.ground_load[-1] == pytest.approx(there.ground_load[-1], abs=1e-8 * there.ground_load.max())
    return here


@pytest.mark.parametrize("number", [7, 36])
def test_both_engines_make_the_same_motion_and_obey_the_laws_in_every_row(number):
    assert_engines_agree(*scene(number))


@pytest.mark.long
@pytest.mark.parametrize("number", [4, 13])
def test_both_engines_make_the_same_motion_where_wheels_lift(number):
    assert_engines_agree(*high_scene(number))


@pytest.mark.parametrize("engine", EACH)
@pytest.mark.parametrize("number", [4, 5, 10, 13, 16])
def test_wheels_that_lift_obey_the_laws_in_every_row(number, engine):
    run, _ = assert_scene_obeys(*high_scene(number), engine)
    assert (run.drive[:, run.effects.drives().index("carries")] == 0).any()


@pytest.mark.long
@pytest.mark.parametrize("number", [2, 14, 39, 53, 67])
def test_both_engines_make_the_same_motion_in_more_scenes(number):
    vehicle, options = scene(number)
    run = assert_engines_agree(vehicle, options)
    assert run.t[-1] == options["duration"] or number in TIP


@pytest.mark.parametrize("engine", EACH)
@pytest.mark.parametrize("number", [71, 72, 81, 90, 97, 100, 107])
def test_each_engine_obeys_the_laws_in_every_row(number, engine):
    vehicle, options = scene(number)
    run, _ = assert_scene_obeys(vehicle, options, engine)
    assert run.t[-1] == options["duration"] or number in TIP


@pytest.mark.parametrize("number", range(40, 60))
def test_the_compiled_engine_obeys_the_laws_in_every_row(number):
    assert_scene_obeys(*scene(number))


@pytest.mark.parametrize("number", [0, 1, 6, 27])
def test_both_engines_stop_for_the_same_reason(number):
    """The vehicle tips, or friction and loads have no solution."""
    run = assert_engines_agree(*high_scene(number))
    assert run.t[-1] == 0


def test_directions_that_contacts_share_are_found_before_loads_are_found_for_them():
    """With directions 1e-3 off, loads and modes did not find each other."""
    vehicle, options = high_scene(18)
    run, reason = assert_scene_obeys(vehicle, options)
    assert run.t[-1] == options["duration"] and not reason


class Enumerated(Exception):
    """Carries the directions (K,) in rad in which a contact that lets go may slip, and its rates (K,) in m/s^2."""


def enumerate_slips(ground, evaluate):
    """All directions along which the rate of contact 0 of three would be, under the loads that it asks for then, and
    these rates. The bearings of all rollers stick, and the other contacts slip."""

    def dynamics(sticks, pushed):
        evaluate(sticks, ground.axles.modes == 0, pushed, ground.axles.torques())
        return ground.held["ground_force"].copy(), ground.held["slip_dot"].copy()

    def across_and_along(angle):
        ground.towards[0] = np.cos(angle), np.sin(angle)
        ground.sticks[:] = False
        unit, none = ground.sliding_forces(np.ones(3)), np.zeros(3, bool)
        found = ground._carry(unit, none, dynamics)
        _, rates = ground._under(found.loads, dynamics, none, unit)
        (x, y), rate = ground.towards[0], rates[0]
        return x * rate[1] - y * rate[0], x * rate[0] + y * rate[1]

    angles = np.linspace(-np.pi, np.pi, 721)
    across = [across_and_along(angle)[0] for angle in angles]
    roots = [brentq(lambda angle: across_and_along(angle)[0], *angles[k : k + 2], xtol=1e-14)
             for k in range(720) if across[k] * across[k + 1] < 0]  # fmt: skip
    return np.array(roots), np.array([across_and_along(root)[1] for root in roots])


@pytest.mark.long
def test_a_contact_may_let_go_with_a_jump(monkeypatch):
    """Scene 120: where contact 0 has used its friction up, it may stick at its bound, or slip faster and faster in
    another direction under other loads. Behind that instant it cannot stick, and a slip in the direction of the force
    at rest would not be turned back to it. Engines take the other direction."""
    begin = LoadedGroundWithBearings.begin

    def enumerating(self, slip, evaluate):
        if self.released[0]:
            begin(self, slip, evaluate)
            raise Enumerated(*enumerate_slips(self, evaluate))
        begin(self, slip, evaluate)

    vehicle, options = scene(120)
    with monkeypatch.context() as context, pytest.raises(Enumerated) as found:
        context.setattr(LoadedGroundWithBearings, "begin", enumerating)
        simulate(vehicle, engine="python", **options)
    roots, rates = found.value.args
    assert (np.abs(rates) < 1e-6).sum() == 1  # it sticks, at its bound
    (way,), (rate,) = roots[rates > 1e-6], rates[rates > 1e-6]
    assert rate > 0.1 and abs(way - roots[np.abs(rates).argmin()]) > 0.01
    run = simulate(vehicle, engine="python", **options)
    row = np.flatnonzero(~run.sticks[:, 0])[0]  # the first in which it slips
    towards = -run.ground_force[row, 0]  # friction is the same in all directions
    assert np.arctan2(towards[1], towards[0]) == pytest.approx(way, abs=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("duration", [0.04, 0.016])
def test_both_engines_go_on_where_a_contact_lets_go_with_a_jump(duration):
    """The Python engine had the step too small in the first of these runs, and the compiled one stopped in the second,
    where modes and loads did not find each other."""
    vehicle, options = scene(120)
    run = assert_engines_agree(vehicle, options | {"duration": duration})
    assert run.t[-1] == duration


def test_the_compiled_engine_goes_on_where_a_contact_lets_go_with_a_jump():
    vehicle, options = scene(120)
    run, reason = assert_scene_obeys(vehicle, options | {"duration": 0.016})
    assert run.t[-1] == 0.016 and not reason


@pytest.mark.parametrize("engine", EACH)
def test_a_contact_lets_go_where_loads_feel_more_of_its_direction_than_it_has_turned(engine):
    """Scene 566: contact 2 has just used its friction up, beside two that slip. From turn to turn its direction was off
    by three times more, till it stuck, from where that began anew; both engines stopped."""
    vehicle, options = scene(566)
    run, reason = assert_scene_obeys(vehicle, options | {"duration": 0.0279}, engine)
    assert run.t[-1] == 0.0279 and not reason
    assert run.sticks[-1].tolist() == [False, False, False]


def test_a_contact_that_cannot_go_aside_slips_forward():
    """Scene 1309: contact 0 lets go while its roller sticks, and two standing wheels leave the vehicle one way, along
    the rolling direction of contact 0. Rounding turned its direction aside, where its roller would be asked for too
    much: the step became too small."""
    vehicle, options = scene(1309)
    run, reason = assert_scene_obeys(vehicle, options)
    assert run.t[-1] == options["duration"] and not reason
    alone = (run.slip[:, 0] != 0).any(axis=1) & (run.quantity("rates")[:, 1:] == 0).all(axis=1)
    assert alone.any() and (run.contact_spin[alone, 0] == 0).all()
    across, along = run.ground_force[alone, 0].T
    assert np.abs(across).max() <= 1e-12 * along.min()


def test_a_contact_whose_load_comes_back_may_go_aside():
    """Scene 475: at 0.7 ms the load of contact 0, which slips, comes back from zero. No force moves its slip there yet,
    and its roller sticks; it was taken for one that cannot go aside."""
    vehicle, options = scene(475)
    run = assert_engines_agree(vehicle, options | {"duration": 0.002})
    assert run.t[-1] == 0.002 and run.ground_load[0, 0] == 0 and run.ground_load[-1, 0] > 0


def test_axles_that_are_at_their_bound_together_break_away_together():
    """All four are there at the end of one step, and nothing pulls at any of them yet. Where a round of the proximal
    point found no minimum its forces were taken, under which all contacts seemed to slip: loads and modes went to and
    fro for minutes."""
    vehicle, options = scene(271)
    run, reason = assert_scene_obeys(vehicle, options | {"duration": 0.028})
    assert run.t[-1] == 0.028 and not reason
    assert run.sticks[-1].all() and (run.quantity("rates")[-1] < 0).all()


@pytest.mark.parametrize("number", [0, *(pytest.param(number, marks=pytest.mark.long) for number in (2, 4))])
def test_both_engines_make_the_same_motion_where_rollers_pass_on(number):
    vehicle, options = static_loads.switching_scene(number)
    ground, *others = options["effects"]
    run = assert_engines_agree(vehicle, options | {"effects": [replace(ground, **FOLLOW), *others]})
    assert len(run.switches) >= 1


@pytest.mark.parametrize("engine", EACH)
@pytest.mark.parametrize("number, height", TURNED.items())
def test_a_slip_comes_to_rest_in_the_direction_that_it_has_turned_to(number, height, engine):
    """These slips have turned far since their phases began. With the direction of that time a row had forces 19 %
    beyond static friction, and the other run stopped."""
    vehicle, options = scene(number, height)
    run, _ = assert_scene_obeys(vehicle, options, engine)
    assert run.t[-1] == options["duration"]


@pytest.mark.parametrize("engine", EACH)
def test_contacts_that_slip_at_once_beside_one_that_sticks(engine):
    """All but one of these contacts slip at once. Newton's rule inside their discs had no other direction left there:
    the Python engine raised a LinAlgError, the compiled one stopped as its step became too small."""
    vehicle, task = ground_anywhere.rollers_stick_on_coulomb(158)
    run = simulate(vehicle, **task, engine=engine)
    assert run.t[-1] == task["duration"]
    assert run.sticks[0].tolist() == [True, False, False, False, False]


@pytest.mark.long
def test_friction_with_named_speeds_tends_to_it():
    """Where speeds are named no bearing sticks: friction fades. All rollers stop, and the vehicle."""
    breaks, turns = 0.02, 0.002
    options = {"nu": (0.05, 0.03, 0.0), "roller_model": "free", "duration": 0.3, "control": False}
    ground, times = Contact(law="coulomb", friction=0.5, **FOLLOW), np.linspace(0, 0.3, 31)

    def run(**speeds):
        bearings = Bearings(wheel_coulomb=breaks, roller_coulomb=turns, **speeds)
        return simulate(CROSS, effects=[ground, bearings], accuracy=1e-9, **options)

    sticks = run()
    assert not sticks.nu[-1].any() and sticks.stats["engine"] == "compiled"
    distances = [distance_at(run(wheel_speed=speed, roller_speed=speed), sticks, times) for speed in (1e-3, 1e-4)]
    assert distances[1] < 1e-4 and distances[0] > 8 * distances[1]


@pytest.mark.parametrize("number", [0, 3, 11])
def test_a_session_with_pauses_is_the_run_and_goes_back_to_the_bit(number):
    static_loads.assert_a_session_is_the_run(*scene(number))


def test_a_sweep_ends_where_its_runs_end():
    assert_a_sweep_ends_where_its_runs_end(*scene(3))
