"""Axles whose bearings stick beside contacts that stick, under loads that follow the motion: every body in every mode,
closed forms, all modes tried, both engines, and the law in every row."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hard.ground_anywhere import GRAVITY as HARD_GRAVITY
from hard.ground_anywhere import scene as hard_scene
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from reactions.test_newton_euler import call
from scipy.optimize import linprog

from contact import test_axles_on_the_ground as static_loads
from contact.in_steps import assert_a_session_ends_as_the_run
from contact.laws import residuals
from contact.test_axles_on_the_ground import DRAGGED, ROLLS, SLIPS, STANDS, case_in_modes, changed
from contact.test_axles_under_loads import BEHIND, CART, FRONT
from contact.test_moving_loads import HEIGHT, LONG, TRICYCLE, numbers
from contact.test_moving_loads import by_bodies as loads_by_bodies
from contact.test_newton_euler import MODELS
from contact.test_sticking_bodies import by_bodies as slips_by_bodies
from contact.test_stuck_axles import ENGINES, bearing_torques, changes
from omniroll import Bearings, Contact, SimulationStopped, Torque, TorqueTable, Vehicle, simulate
from omniroll.effects.complementarity import directions_allowed
from omniroll.effects.ground_loads import carried
from omniroll.effects.loaded_ground_with_axles import LoadedGroundWithAxles
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

GRAVITY = 9.80665
INSTANT = 1e-10  # relative, of instants in closed form
RELATIVE = 1e-10
MASS, RADIUS, INERTIA = CART.mass, CART.wheel_radius, CART.wheel_inertia
WEIGHT = MASS * GRAVITY


# ---- every body ------------------------------------------------------------------------------------------------------


def by_kernel(case, contacts, axles, push, torque, turning):
    """Accelerations, forces and the sums of the loads, as the kernel gives them in these modes, with the forces on
    standing wheels and the torques of all bearings put in."""
    names = ("contact", "contact_coulomb", "contact_loads", "reactions", "drive", "axle_sticking")
    bound = kernel(case.vehicle, case.model, "python", effects=names)
    stands = contacts & axles
    directions = directions_allowed(bound.wheel_rows[stands], np.eye(3)) if stands.any() else np.eye(3)
    values = {"nu": case.nu, "chi": case.chi, "rates": case.rates, "spins": case.spins, "heading": case.heading}
    values |= {"torque": torque, "bearing_torque": np.where(axles, 0.0, turning), "axle_sticks": axles.astype(float)}
    values |= {"sticks": contacts.astype(float), "ground_push": np.where(contacts[:, None], 0.0, push)}
    values |= {"directions": directions.ravel(), "absent": (~directions.any(axis=0)).astype(float)}
    values |= numbers(case) | {"normal_gravity": GRAVITY, "load_factor": np.ones(len(axles))}
    values["spin_inertia"] = np.full(len(axles), case.vehicle.wheel_inertia)
    if case.model == "free":
        values["contact_omega"] = case.turns + case.nu[2] / case.vehicle.yaw_scale * np.sin(case.chi)
        values["axial"] = call(bound, "axial_speeds", values)
        values["momenta"] = call(bound, "momenta", values)
    outputs = [argument.name for argument in bound.signatures["standing_dynamics"].outputs]
    values |= dict(zip(outputs, call(bound, "standing_dynamics", values), strict=True))
    sums, places = call(bound, "slip_load_balance", values)
    rows, radius = bound.wheel_rows[stands], case.vehicle.wheel_radius
    along = np.linalg.lstsq(-radius * rows.T, values["held_force"], rcond=None)[0] if stands.any() else np.zeros(0)
    values["ground_force"][stands, 1] += along
    values["axle_holding"][stands] -= radius * along
    return values, sums, places


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    "modes",
    [
        (STANDS, ROLLS, SLIPS),
        (STANDS, DRAGGED, STANDS),
        (DRAGGED, SLIPS, ROLLS),
        (STANDS, STANDS, STANDS, STANDS),
        (STANDS, ROLLS, DRAGGED, SLIPS),
        (STANDS, SLIPS, STANDS, DRAGGED, STANDS, ROLLS),
    ],
)
def test_loads_in_all_modes_agree_with_every_body(model, modes):
    """The oracle is given forces and torques, and must find the same accelerations and loads with the same sums."""
    contacts, axles = np.array(modes, bool).T
    rng = np.random.default_rng([61, MODELS.index(model), *contacts.astype(int), *axles.astype(int)])
    case, count = case_in_modes(rng, model, contacts, axles), len(modes)
    push, torque, turning = rng.normal(size=(count, 2)), rng.normal(size=count), rng.normal(size=count)
    found, sums, places = by_kernel(case, contacts, axles, push, torque, turning)
    whole = torque + found["axle_holding"] + np.where(axles, 0.0, turning)
    given = Acting(wheel_torques=working_precision(lambda: [exact(t) for t in whole])())
    spare = rng.uniform(1, 5, count)
    wanted_nu, wanted_rates, loads = loads_by_bodies(case, found["ground_force"], spare, given)
    size = np.abs(wanted_nu).max() + np.abs(wanted_rates).max() + np.abs(torque).max() / INERTIA
    for value, wanted in ((found["nu_dot"], wanted_nu), (found["rates_dot"], wanted_rates)):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * size)
    rows = np.column_stack([np.ones(count), places.reshape(count, 2)])
    wanted = rows.T @ np.array(loads)
    assert sums == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * np.abs(wanted).max())


def standing_case(wheels, model):
    """A vehicle at an instant, of whose wheels some stand, some are dragged and some turn; its run, and its torques."""
    rng = np.random.default_rng([63, wheels, MODELS.index(model)])
    modes = np.array([STANDS, DRAGGED, ROLLS, STANDS, SLIPS, STANDS][:wheels], bool)
    for _ in range(200):
        case = case_in_modes(rng, model, *modes.T)
        case = replace(case, nu=case.nu / 8, rates=case.rates / 8, turns=case.turns / 8)
        torque = 0.02 * rng.normal(size=wheels)
        spins = {"contact_spins": case.turns} if model == "free" else {}
        ground = Contact(law="coulomb", friction=(0.8, 0.6), loads="dynamic", **numbers(case),
                         wheel_rates=case.rates, **spins)  # fmt: skip
        bearings = Bearings(wheel_coulomb=np.where(modes[:, 1], 2.0, 0.02))
        try:
            run = simulate(case.vehicle, **case.start(), duration=1e-9, effects=[ground, bearings, Torque(torque)],
                           engine="python", control=False)  # fmt: skip
        except SimulationStopped:
            continue  # it tips
        if run.ground_load[0].min() > 0 and (run.sticks[0] & (run.quantity("rates")[0] == 0)).any():
            return case, run, torque
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels, model", [(3, "massless"), (3, "free"), (4, "massless"), (5, "free")])
def test_what_a_run_finds_agrees_with_every_body(wheels, model):
    """The oracle gets a row's forces and torques; it must find its loads, and that what sticks stays at rest."""
    case, run, torque = standing_case(wheels, model)
    force, load, bearing = run.ground_force[0], run.ground_load[0], bearing_torques(run)[0]
    sticks, held = run.sticks[0], run.quantity("rates")[-1] == 0
    assert np.ptp(load) > 1e-2 * load.mean() and (sticks & held).any()
    given = Acting(wheel_torques=working_precision(lambda: [exact(t) for t in torque + bearing])())
    wanted_nu, wanted_rates, wanted = loads_by_bodies(case, force, load, given)
    assert load == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * load.max())
    free_of_guide = dict(enumerate(load)) if wheels > 3 else None
    _, _, slips = slips_by_bodies(case, replace(given, guide=True), force, free_of_guide or dict.fromkeys(range(3), 0))
    own = slice(0, 2) if model == "free" else slice(1, 2)
    size = np.abs(force).max() * RADIUS / INERTIA
    assert np.abs(wanted_rates[held]).max() <= RELATIVE * size
    assert np.abs(slips[sticks][:, own]).max(initial=0.0) <= RELATIVE * size
    found = (run.nu[-1] - run.nu[0]) / run.t[-1]
    assert found == pytest.approx(wanted_nu, rel=1e-5, abs=1e-5 * size)


# ---- closed forms ----------------------------------------------------------------------------------------------------


def run_of(engine, effects, duration, vehicle=CART, nu=(0, 0, 0), model="massless"):
    return simulate(vehicle, nu=nu, duration=duration, roller_model=model, effects=effects, engine=engine,
                    accuracy=1e-11, control=False)  # fmt: skip


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_skidding_vehicle_with_blocked_wheels_comes_to_rest(engine, model):
    """All wheels are dragged: M v' = -mu W, and mu W h/(4 L) more on each wheel in front. At rest all stand."""
    friction, speed = 0.3, 0.5
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=HEIGHT, wheel_rates=0)
    run = run_of(engine, [ground, Bearings(wheel_coulomb=1.0)], 0.25, nu=(speed / CART.platform_radius, 0, 0),
                 model=model)  # fmt: skip
    rest = speed / (friction * GRAVITY)
    assert changed(run.sticks[:, 0], run.t) == [pytest.approx(rest, rel=INSTANT)]
    moved = friction * WEIGHT * HEIGHT / (4 * LONG)
    assert run.ground_load[0, FRONT] == pytest.approx([WEIGHT / 4 + moved] * 2, rel=RELATIVE)
    assert run.ground_load[0, BEHIND] == pytest.approx([WEIGHT / 4 - moved] * 2, rel=RELATIVE)
    assert run.ground_load[-1] == pytest.approx([WEIGHT / 4] * 4, rel=RELATIVE)
    held = RADIUS * friction * run.ground_load[0]
    assert np.abs(bearing_torques(run)[0]) == pytest.approx(held, rel=RELATIVE)
    assert run.sticks[-1].all() and not run.quantity("rates").any()
    assert np.abs(run.nu[-1]).max() <= 1e-14  # massless rollers hold nothing along the axles


@pytest.mark.parametrize("engine", ENGINES)
def test_dragged_axles_in_front_break_away_where_torque_and_load_are_too_much(engine):
    """All slide forwards, and a torque b t joins l mu N at each bearing in front, which takes S at most."""
    friction, speed, growth, breaks = 0.3, 0.5, 2.0, 0.2
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=HEIGHT, wheel_rates=0)
    carried = WEIGHT / 4 * (1 + friction * HEIGHT / LONG)
    instant = (breaks - RADIUS * friction * carried) / growth
    assert 0.01 < instant < 0.1
    driven = np.where(np.isin(range(4), FRONT), -0.2 * growth, 0.0)
    effects = [ground, Bearings(wheel_coulomb=breaks), TorqueTable((0.0, 0.2), (np.zeros(4), driven))]
    probe = run_of(engine, effects, 1e-3, nu=(speed / CART.platform_radius, 0, 0))
    way = np.sign(bearing_torques(probe)[0, 0])  # the torques act against it
    effects[2] = TorqueTable((0.0, 0.2), (np.zeros(4), -way * np.abs(driven)))
    run = run_of(engine, effects, 0.12, nu=(speed / CART.platform_radius, 0, 0))
    for wheel in FRONT:
        assert changes(run, wheel)[0] == pytest.approx(instant, rel=INSTANT)
    assert not any(changes(run, wheel) for wheel in BEHIND)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_vehicle_that_starts_against_its_brakes_lets_go_in_front_first(engine):
    """Torques b t on all wheels. They stand until b t = S; then l F = b t - S - J a/l with M a = 4 F, and each wheel in
    front carries (h M a + 4 J a/l)/(4 L) less than at rest, until F is mu times that."""
    friction, growth, breaks = 0.3, 2.0, 0.05
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=HEIGHT)
    table = TorqueTable((0.0, 0.3), (np.zeros(4), np.full(4, -0.3 * growth)))
    run = run_of(engine, [ground, Bearings(wheel_coulomb=breaks), table], 0.2)
    first = breaks / growth
    assert all(changes(run, wheel)[0] == pytest.approx(first, rel=INSTANT) for wheel in range(4))
    per_torque = 1 / (RADIUS * MASS / 4 + INERTIA / RADIUS)  # a over b t - S
    forces, lifts = MASS / 4 * per_torque, (HEIGHT * MASS + 4 * INERTIA / RADIUS) / (4 * LONG) * per_torque
    beyond = friction * WEIGHT / 4 / (forces + friction * lifts)
    let_go = (breaks + beyond) / growth
    assert first < let_go < 0.19
    ahead = FRONT if run.nu[-1, 0] > 0 else BEHIND
    (slips,) = {round(changed(run.sticks[:, wheel], run.t)[0], 15) for wheel in ahead}
    assert slips == pytest.approx(let_go, rel=INSTANT)
    row = np.flatnonzero(np.abs(run.t / let_go - 1) <= INSTANT)[0]
    assert run.ground_load[row, ahead] == pytest.approx([WEIGHT / 4 - lifts * beyond] * 2, rel=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_braking_vehicle_tips_where_its_load_behind_vanishes(engine):
    """Two wheels in front roll along x and brake with b t, and with S that their bearings take: h F = W LONG/2."""
    backwards = TRICYCLE.replace(wheel_places=tuple((-x, y) for x, y in TRICYCLE.wheel_places))
    growth, sliding, height = 40.0, 0.05, 0.3
    ground = Contact(law="coulomb", friction=3.0, loads="dynamic", height=height)
    rolling = np.abs(np.sin(TRICYCLE.wheel_angles)) > 0.5
    probe = run_of(engine, [ground, Bearings(wheel_coulomb=sliding)], 1e-4, backwards, nu=(2, 0, 0))
    way = np.sign(bearing_torques(probe)[0]) * rolling
    table = TorqueTable((0.0, 0.5), (np.zeros(3), 0.5 * growth * way))
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 1 and 2") as caught:
        run_of(engine, [ground, Bearings(wheel_coulomb=sliding), table], 0.5, backwards, nu=(2, 0, 0))
    mass, inertia = TRICYCLE.mass, TRICYCLE.wheel_inertia
    turning = int(rolling.sum())
    per_torque = turning / RADIUS / (mass + turning * inertia / RADIUS**2)  # the acceleration over b t + S
    needed = mass * GRAVITY * LONG / 2 / (height * mass + turning * inertia / RADIUS) / per_torque
    assert caught.value.t == pytest.approx((needed - sliding) / growth, rel=INSTANT)


# ---- what is found together ------------------------------------------------------------------------------------------


def some_forces_hold(rows, radius, held, low, high):
    """Whether forces between low and high on the wheels that stand make what holds nu: a linear program."""
    if (low > high + 1e-12).any():
        return False
    if not len(rows):
        return True
    bounds = list(zip(low, np.maximum(low, high), strict=True))
    return linprog(np.zeros(len(rows)), A_eq=-radius * rows.T, b_eq=held, bounds=bounds).success


def obeys(ground, contacts, axles, found, friction, breaks):
    """Whether modes (-1, 0, 1) of contacts and axles, all at rest so far, obey the laws in the last computed rates."""
    force, holding = ground.held["ground_force"][:, 1], ground.held["axle_holding"]
    stands, reach = (contacts == 0) & (axles == 0), friction * found.loads
    rolls, dragged = (contacts == 0) & (axles != 0), (contacts != 0) & (axles == 0)
    low, high = ((holding + side * breaks) / ground.radius for side in (-1, 1))
    return (
        (found.loads >= 0).all()
        and (contacts * ground.held["slip_dot"][:, 1] >= 0)[contacts != 0].all()
        and (axles * ground.held["rates_dot"] >= 0)[axles != 0].all()
        and (np.abs(force) <= reach + 1e-12)[rolls].all()
        and (np.abs(holding) <= breaks + 1e-12)[dragged].all()
        and some_forces_hold(
            ground.rows[stands],
            ground.radius,
            ground.held["held_force"],
            np.maximum(-reach, low)[stands],
            np.minimum(reach, high)[stands],
        )
    )


@pytest.mark.parametrize("number", range(6))
def test_the_accelerations_are_those_of_all_modes_that_obey_the_laws(number, monkeypatch):
    """A vehicle at rest under torques, of whose contacts and axles all 9^3 modes are tried, each with its own loads."""
    rng = np.random.default_rng([67, number])
    friction, breaks = rng.uniform(0.1, 0.6), rng.uniform(0.02, 0.12, 3)
    fits, taken = [], {}
    check = LoadedGroundWithAxles._refuse_unless_determined

    def noted(self, slip, dynamics):
        check(self, slip, dynamics)
        modes, towards, springs = self.axles.modes, self.towards, self.loads.springs
        taken["contacts"], taken["axles"] = np.where(self.sticks, 0, towards[:, 1]), modes.copy()
        self.towards = towards.copy()
        everything = np.ones(3, bool)
        for choice in itertools.product((-1, 0, 1), repeat=6):
            contacts, self.axles.modes = np.array(choice[:3]), np.array(choice[3:])
            self.towards[:, 1] = np.where(contacts == 0, 1, contacts)
            unit = self.sliding_forces(np.ones(3)) * (contacts != 0)[:, None]

            def sums_of(loads, contacts=contacts, unit=unit):
                self._under(loads, dynamics, contacts == 0, unit)
                return self.balance()

            found = carried(springs.shares(everything), everything, sums_of, self.loads.start, self.loads.arm)
            sums_of(found.loads)
            if obeys(self, contacts, self.axles.modes, found, friction, breaks):
                motion = np.concatenate([self.held["nu_dot"], self.held["rates_dot"], found.loads])
                fits.append((contacts.tolist(), self.axles.modes.tolist(), motion))
        self.axles.modes, self.towards = modes, towards

    monkeypatch.setattr(LoadedGroundWithAxles, "_refuse_unless_determined", noted)
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=0.08)
    effects = [ground, Bearings(wheel_coulomb=breaks), Torque(0.15 * rng.normal(size=3))]
    simulate(Vehicle.paper(3, 5), nu=(0, 0, 0), duration=0, effects=effects, engine="python",
             roller_model="massless", control=False)  # fmt: skip
    own = [motion for *modes, motion in fits if modes == [taken["contacts"].tolist(), taken["axles"].tolist()]]
    assert len(own) == 1
    for *_, motion in fits:
        assert motion == pytest.approx(own[0], rel=1e-9, abs=1e-9 * np.abs(own[0]).max())


@pytest.mark.parametrize("others", [[], [Bearings(wheel_coulomb=0.01)]])
@pytest.mark.parametrize("engine", ENGINES)
def test_wheels_that_spin_do_not_tip_a_vehicle_that_they_would_if_they_held(engine, others):
    """Torques that would lift the front if all contacts stuck. They slip: mu W (h - l) and the torques tilt it."""
    friction, torque, height = 0.2, 0.5, 0.3
    slides = sum(bearings.wheel_coulomb for bearings in others)
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=height)
    run = run_of(engine, [ground, *others, Torque((-torque,) * 4)], 0.01)
    assert not run.sticks.any() and abs(run.nu[-1, 0]) > 0
    tilts = (friction * WEIGHT * (height - RADIUS) + 4 * (torque - slides)) / (4 * LONG)
    assert np.sort(run.ground_load[-1]) == pytest.approx(WEIGHT / 4 + tilts * np.array([-1, -1, 1, 1]), rel=RELATIVE)


@pytest.mark.parametrize("engine", ENGINES)
def test_axles_that_feed_themselves_are_refused(engine):
    """A wheel whose own acceleration presses it on the ground more than its inertia takes: spin_inertia says so."""
    ground = Contact(law="coulomb", friction=2.0, loads="dynamic", height=0.03, wheel_rates=0,
                     spin_inertia=60 * INERTIA)  # fmt: skip
    with pytest.raises(SimulationStopped, match="loads and friction do not determine each other") as caught:
        run_of(engine, [ground, Bearings(wheel_coulomb=3.0)], 0.1, nu=(2.0, 0, 0))
    assert caught.value.t == 0


# ---- random scenes ---------------------------------------------------------------------------------------------------

VANISHES = 161  # a scene in which a load vanishes beside a slip of 1.2e-7 m/s, which turns by 1e8 rad/s


def scene(number):
    """A vehicle whose contacts and axles may all stick under loads that follow, and the arguments of its run."""
    vehicle, options = static_loads.scene(number)
    ground, *others = options["effects"]
    height = float(np.random.default_rng([77, number]).uniform(0.03, 0.2))
    return vehicle, options | {"effects": [replace(ground, loads="dynamic", height=height), *others]}


def run_or_stop(vehicle, options, engine):
    """The run, and how many of its rows have modes: none that are tried where it stops are its own."""
    try:
        run = simulate(vehicle, engine=engine, **options)
    except SimulationStopped as stopped:
        run = stopped.trajectory
        return run, len(run) - (len(run) == 1 or run.t[-1] == run.t[-2])
    return run, len(run)


def assert_obeys_the_laws(number, engine):
    """In each row cone, complementarity and dissipation of the ground, its loads, and the bearings' torques."""
    vehicle, options = scene(number)
    ground, bearings, *_ = options["effects"]
    run, rows = run_or_stop(vehicle, options, engine)
    for name, residual in residuals(vehicle, ground, run, vehicle.mass * 9.8).items():
        assert residual[:rows].max(initial=0.0) <= 1e-12, name
    torque, rates = bearing_torques(run)[:rows], run.quantity("rates")[:rows]
    assert (np.abs(torque) <= np.array(bearings.wheel_break_away) * (1 + 1e-12)).all()
    turns = np.abs(rates) > 1e-9 * np.abs(rates).max(initial=1e-300)
    assert (torque == -np.sign(rates) * np.array(bearings.wheel_coulomb))[turns].all()
    scale = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-8 * scale
    return run


@pytest.mark.parametrize("number", [2, 6])
def test_the_python_engine_obeys_the_laws_in_every_row(number):
    run = assert_obeys_the_laws(number, "python")
    assert (run.sticks & (run.quantity("rates") == 0)).any()


def test_the_compiled_engine_obeys_the_laws_in_every_row():
    stand = sum((run.sticks & (run.quantity("rates") == 0)).any() for run in map(by_compiled, range(8)))
    assert stand >= 4


def by_compiled(number):
    return assert_obeys_the_laws(number, "compiled")


@pytest.mark.long
def test_the_compiled_engine_obeys_the_laws_in_every_row_of_more_scenes():
    """All modes are among them, and loads that vanish."""
    modes, off = set(), 0
    for number in range(8, 90):
        run = by_compiled(number)
        modes |= set(zip(run.sticks.ravel().tolist(), (run.quantity("rates") == 0).ravel().tolist(), strict=True))
        off += (run.drive[:, run.effects.drives().index("carries")] == 0).any()
    assert len(modes) == 4 and off >= 1


def test_the_law_holds_where_a_load_vanishes_beside_a_slow_slip():
    """Rounding of the slip turns its force by 1e-9, which moves the loads by 5e-12 of the weight: the row goes in the
    direction by whose loads it has been located."""
    by_compiled(VANISHES)


def test_no_load_pulls_and_no_friction_drives_where_a_load_vanishes_beside_a_slow_slip():
    """One load was -2e-12 of the weight, and its friction drove."""
    vehicle, options = scene(VANISHES)
    run, rows = run_or_stop(vehicle, options, "compiled")
    off = run.drive[:rows, run.effects.drives().index("carries")] == 0
    assert (off[1:] & ~off[:-1]).any()
    assert run.ground_load[:rows].min() >= 0
    found = residuals(vehicle, options["effects"][0], run, vehicle.mass * 9.8)
    assert found["slips: against it"][:rows].max() <= 1e-12 and found["slips: on the ellipse"][:rows].max() <= 1e-12


def test_loads_settle_where_a_contact_only_just_begins_to_slip():
    """The rate of its slip is a part of 1e-6 of what forces give it: with the direction of that the loads changed by
    3e-10 of the weight from turn to turn, and the run stopped."""
    vehicle, options = hard_scene(9111)
    run = simulate(vehicle, **options)
    assert run.t[-1] == options["duration"]
    for name, found in residuals(vehicle, options["effects"][0], run, vehicle.mass * HARD_GRAVITY).items():
        assert found.max(initial=0.0) <= 1e-12, name


@pytest.mark.long
def test_a_vehicle_tips_of_which_one_wheel_is_off_already():
    """Where the second load vanishes those that are left act on a line: with the wheel that is off they would have the
    same loads, and none on it."""
    vehicle, options = scene(58)
    instants = []
    for engine in ENGINES:
        with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 0 and 3") as caught:
            simulate(vehicle, engine=engine, **options)
        instants.append(caught.value.t)
    assert instants[0] == pytest.approx(instants[1], rel=1e-10)


@pytest.mark.parametrize("number", [2, 6])
def test_both_engines_make_the_same_motion(number):
    compare(number)


@pytest.mark.long
@pytest.mark.parametrize("number", [0, 3, 8, 14, 18, 22])
def test_both_engines_make_the_same_motion_in_more_scenes(number):
    compare(number)


def compare(number):
    vehicle, options = scene(number)
    (one, _), (other, _) = (run_or_stop(vehicle, options, engine) for engine in ENGINES)
    assert one.stats["engine"] == "compiled" and other.stats["engine"] == "python"
    assert one.t[-1] == pytest.approx(other.t[-1], rel=1e-8)
    assert distance_at(one, other, np.linspace(0, min(one.t[-1], other.t[-1]), 40)) <= 1e-8
    rates, wanted = one.quantity("rates")[-1], other.quantity("rates")[-1]
    assert (one.sticks[-1] == other.sticks[-1]).all() and ((rates == 0) == (wanted == 0)).all()
    assert rates == pytest.approx(wanted, rel=1e-7, abs=1e-7 * np.abs(other.quantity("rates")).max())
    assert one.ground_load[-1] == pytest.approx(other.ground_load[-1], abs=1e-7 * other.ground_load.max())
    largest = np.abs(bearing_torques(other)).max()
    assert bearing_torques(one)[-1] == pytest.approx(bearing_torques(other)[-1], abs=1e-7 * largest)


@pytest.mark.long
def test_a_session_is_the_run():
    vehicle, options = scene(6)
    assert_a_session_ends_as_the_run(vehicle, **options)
