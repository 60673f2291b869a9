"""Rollers whose bearings stick beside contacts that stick, and axles: every body in every mode, closed forms, forces
that are not determinate, and scenes whose rows were wrong once."""

from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from oracle.directions import allowed_by, directions_allowed
from reactions.newton_euler import Acting
from scipy.optimize import minimize

from contact.laws import judged
from contact.test_axles_on_the_ground import case_in_modes
from contact.test_massless_rollers import contact_torques
from contact.test_newton_euler import named
from contact.test_newton_euler import pushed as pushed_by
from contact.test_sticking_bodies import RELATIVE, by_bodies
from contact.test_stuck_axles import bearing_torques
from omniroll import Bearings, Contact, Slope, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel

CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
RADIUS, MASS, ARM = CROSS.wheel_radius, CROSS.mass, CROSS.platform_radius
ROLLER, WHEEL = CROSS.roller_inertia, CROSS.wheel_inertia
RHO = RADIUS - CROSS.roller_axis_radius  # of a roller that touches the ground in its middle
GRAVITY = 9.80665
ACCURACY = 1e-11
INSTANT = 1e-10  # relative, of instants in closed form
HOLDS = 9.0  # N m, more than any bearing is asked for


def run_of(effects, duration, nu=(0, 0, 0)):
    """A run of the cross."""
    return simulate(CROSS, nu=nu, duration=duration, roller_model="free", effects=effects, accuracy=ACCURACY,
                    control=False)  # fmt: skip


def pushed(growth, end=0.2):
    """Torques on wheels 2 and 4 that push the vehicle along x and grow by `growth` N m/s."""
    return TorqueTable((0.0, end), ((0, 0, 0, 0), (0, end * growth, 0, -end * growth)))


# ---- every body ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number, axles", [(number, ("axle_sticking",) * (number % 3 > 0)) for number in range(8)])
def test_modes_of_contacts_and_bearings_agree_with_every_body(number, axles):
    """The oracle is given forces and torques, and must find the same accelerations, and none of what sticks."""
    rng = np.random.default_rng([41, number, len(axles)])
    wheels, rollers = int(rng.choice((2, 3, 4))), 5
    contacts, stuck = rng.random(wheels) < 0.6, rng.random((wheels, rollers)) < 0.6
    still = (rng.random(wheels) < 0.5) & bool(axles)
    contacts[0], stuck[0, 0] = True, number % 3 > 0
    case = case_in_modes(rng, "free", contacts, still)
    case, along = at_rest(case, contacts, stuck, still)
    push, torque = rng.normal(size=(wheels, 2)), rng.normal(size=wheels)
    turning, spinning = rng.normal(size=wheels) * ~still * bool(axles), 0.01 * rng.normal(size=stuck.shape) * ~stuck
    found = by_kernel(case, (contacts, stuck, still), axles, push, torque, (turning, spinning), along)
    of_rollers = working_precision(lambda: [list(map(exact, row)) for row in found["rollers"]])()
    given = Acting(guide=True, wheel_torques=list(torque + found["axle_torque"]), roller_torques=of_rollers)
    wanted_nu, wanted_rates, slips = by_bodies(case, given, found["ground_force"])
    size = np.abs(slips).max() + np.abs(wanted_nu).max() + np.abs(wanted_rates).max()
    size += np.abs(torque).max() / case.vehicle.wheel_inertia
    for value, wanted in ((found["nu_dot"], wanted_nu), (found["rates_dot"], wanted_rates), (found["slip_dot"], slips)):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * size)
    assert np.abs(slips[contacts]).max(initial=0.0) <= RELATIVE * size
    assert not found["rates_dot"][still].any() and np.abs(wanted_rates[still]).max(initial=0.0) <= RELATIVE * size
    spin_dot = np.concatenate([found["contact_spin_dot"][:, None], found["spins_dot"]], axis=1)
    by_body = case.spins_by_bodies(pushed_by(given, found["ground_force"]))
    assert spin_dot == pytest.approx(by_body, rel=RELATIVE, abs=RELATIVE * np.abs(by_body).max())
    assert not found["spins_dot"][stuck[:, 1:]].any()
    assert np.abs(by_body[stuck]).max(initial=0.0) <= RELATIVE * max(np.abs(by_body).max(), size)


def at_rest(case, contacts, stuck, still):
    """The case with what sticks at rest, and (N, 3) what a unit force along each axle does to nu."""
    bound = kernel(case.vehicle, "free", "python")
    reach = case.vehicle.wheel_radius - case.vehicle.roller_axis_radius
    along = bound.wheel_rates(np.eye(3), np.zeros(bound.wheels))[1].T * reach
    rows = np.concatenate([along[contacts & stuck[:, 0]], bound.wheel_rows[contacts & still]])
    nu = allowed_by(rows) @ case.nu if len(rows) else case.nu
    rolling, turning = bound.wheel_rates(nu, case.chi)
    rates = np.where(still, 0.0, np.where(contacts, rolling, case.rates))
    turns = np.where(stuck[:, 0], 0.0, np.where(contacts, turning, case.turns))
    return replace(case, nu=nu, rates=rates, turns=turns, spins=case.spins * ~stuck[:, 1:]), along


def by_kernel(case, modes, axles, push, torque, given, along):
    """What the kernel gives, by name, with forces put in along the directions in which wheels stand: of all that
    balance those of least norm. `rollers` (N, n) and `axle_torque` (N,) are the torques of all bearings."""
    contacts, stuck, still = modes
    turning, spinning = given
    vehicle = case.vehicle
    effects = ("contact", "contact_coulomb", "drive", "roller_sticking", *axles)
    bound = kernel(vehicle, "free", "python", effects=effects)
    stands = contacts[:, None] & np.stack([stuck[:, 0], still], axis=1)
    rows = np.stack([along, -vehicle.wheel_radius * bound.wheel_rows], axis=1)[stands]
    directions = directions_allowed(rows, np.eye(3)) if len(rows) else np.eye(3)
    values = {"torque": torque, "bearing_torque": turning, "axle_sticks": still.astype(float)}
    values |= {"sticks": contacts.astype(float), "ground_push": np.where(contacts[:, None], 0.0, push)}
    values |= {"contact_sticks": stuck[:, 0].astype(float), "free_sticks": stuck[:, 1:].astype(float)}
    values |= {"contact_bearing": spinning[:, 0], "free_bearing": spinning[:, 1:]}
    values |= {"directions": directions.ravel(), "absent": (~directions.any(axis=0)).astype(float)}
    found = named(bound, "bearing_dynamics", case.known(bound, **values))
    forces, *_ = np.linalg.lstsq(rows.T, found["held_force"], rcond=None) if len(rows) else (np.zeros(0), 0)
    held = found["held_force"]
    assert rows.T @ forces == pytest.approx(held, abs=1e-12 * (1 + np.abs(held).max()))
    along_ways = np.zeros(stands.shape)
    along_ways[stands] = forces
    found["ground_force"] = found["ground_force"] + along_ways
    rho = vehicle.wheel_radius * np.cos(case.chi) - vehicle.roller_axis_radius
    holding = found.get("axle_holding", np.zeros(len(contacts)))
    found["axle_torque"] = turning + holding - vehicle.wheel_radius * along_ways[:, 1]
    held = np.concatenate([(found["contact_holding"] + rho * along_ways[:, 0])[:, None], found["free_holding"]], axis=1)
    assert not held[~stuck].any()
    found["rollers"] = spinning + held
    return found


# ---- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [2.0, 0.2])
@pytest.mark.parametrize("part", [1 - 1e-9, 1 + 1e-9, 1.5])
def test_a_vehicle_stands_on_a_slope_until_bearings_and_ground_give(part, friction):
    """Two wheels hold it by their axles, S/l each or the ground's friction, and two by their rollers, T/rho each or the
    ground's friction: rest holds as long as some forces within these balance the weight."""
    gravity, angle, breaks, turns = 9.0, 0.1, 0.05, 0.01
    load = MASS * gravity / 4
    most = 2 * min(breaks / RADIUS, friction * load) + 2 * min(turns / RHO, friction * load)
    slope = Slope(angle, 0.0, gravity=part * most / (MASS * np.sin(angle)))
    run = run_of([Contact(law="coulomb", friction=friction, normal_gravity=gravity),
                  Bearings(wheel_coulomb=breaks, roller_coulomb=turns), slope], 0.01)  # fmt: skip
    if part < 1:
        assert not run.nu.any() and run.sticks.all() and not run.quantity("rates").any() and not run.spins.any()
        held = np.abs(run.ground_force[-1, [0, 1, 2, 3], [0, 1, 0, 1]]).sum()
        assert held == pytest.approx(part * most, rel=1e-12)
        return
    assert run.nu[-1, 0] > 0
    slips = [friction * load < turns / RHO, friction * load < breaks / RADIUS] * 2
    assert (~run.sticks[-1] == slips).all()
    mass = MASS + 2 * ROLLER / RHO**2 * (not slips[0]) + 2 * WHEEL / RADIUS**2 * (not slips[1])
    wanted = most * (part - 1) / mass * run.t[-1]
    assert run.nu[-1, 0] * ARM == pytest.approx(wanted, rel=1e-9, abs=1e-13 * most / mass * run.t[-1])


@pytest.mark.parametrize("part", [1 - 1e-9, 1 + 1e-9, 1 + 1e-6, 1.3])
@pytest.mark.parametrize("way", [0.0, 0.3, np.pi / 4, 4.0])
def test_a_vehicle_with_blocked_bearings_is_a_block_on_a_slope(way, part):
    """It rests up to tan b = mu whichever way it stands: no polygon would say so. Then v' = g (sin b - mu cos b).

    Where contacts go is decided by what forces do to their slips. There the accelerations cancel that the ground and
    the bearing would give a roller by itself, F rho^2/B each, and v' is left: to the rounding of these two over v'
    contacts begin in directions that differ, as if the block turned by so much of its speed."""
    angle, eps = 0.25, np.finfo(float).eps
    friction = np.tan(angle) / part
    ground = Contact(law="coulomb", friction=friction, normal_gravity=GRAVITY * np.cos(angle))
    slope = Slope(angle, way, gravity=GRAVITY)
    run = run_of([ground, Bearings(wheel_coulomb=HOLDS, roller_coulomb=HOLDS), slope], 0.02)
    speed = np.linalg.norm(run.nu[-1, :2]) * ARM
    if part < 1:
        assert not run.nu.any() and run.sticks.all()
        return
    slides = GRAVITY * np.sin(angle) * (1 - 1 / part)
    assert speed == pytest.approx(slides * run.t[-1], rel=1e-6 if part < 1 + 1e-8 else 1e-9 if part < 1.1 else 1e-11)
    of_roller = MASS * GRAVITY * np.sin(angle) / 4 * RHO**2 / ROLLER
    rounding = eps * GRAVITY * run.t[-1] / ARM  # of the weight, which friction all but balances
    turns = 2 * eps * of_roller / slides * np.linalg.norm(run.nu[-1]) + rounding
    assert not run.sticks[1:].any() and np.abs(run.nu[-1, 2]) <= turns


def test_a_push_across_the_slope_breaks_a_round_bound():
    """On a slope along y wheels 2 and 4 push along x by P = (b t - S)/l each, and 1 and 3 hold against them; each also
    holds a quarter of the weight's part G along y. So all let go at P^2 = (mu N)^2 - (G/4)^2."""
    growth, breaks, friction, angle = 2.0, 0.02, 0.3, 0.2
    gravity = GRAVITY * np.cos(angle)
    ground = Contact(law="coulomb", friction=friction, normal_gravity=gravity)
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=HOLDS)
    run = run_of([ground, bearings, pushed(growth), Slope(angle, np.pi / 2, gravity=GRAVITY)], 0.1)
    push = np.sqrt((friction * MASS * gravity / 4) ** 2 - (MASS * GRAVITY * np.sin(angle) / 4) ** 2)
    moving = np.flatnonzero(np.abs(run.nu).max(axis=1) > 0)
    assert run.t[moving[0] - 1] == pytest.approx((breaks + RADIUS * push) / growth, rel=INSTANT)


# ---- forces that are not determinate ---------------------------------------------------------------------------------


def test_forces_that_are_not_determinate_are_those_of_least_norm_within_the_bounds():
    """Eight directions in which wheels stand, three equations; two bearings cut forces off."""
    angle, breaks, turns, friction = 0.09, 0.05, 0.03, 0.6
    gravity = GRAVITY * np.cos(angle)
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=(turns, HOLDS, turns, HOLDS))
    run = run_of([Contact(law="coulomb", friction=friction, normal_gravity=gravity), bearings,
                  Slope(angle, 0.2, gravity=GRAVITY)], 0.01)  # fmt: skip
    assert run.sticks.all() and not run.nu.any()
    force, reach = run.ground_force[-1], friction * MASS * gravity / 4
    rows = kernel(CROSS, "free", "python").wheel_rows
    along = kernel(CROSS, "free", "python").wheel_rates(np.eye(3), np.zeros(4))[1].T * RHO
    columns = np.stack([along, -RADIUS * rows], axis=1).reshape(8, 3).T
    bounds = np.stack([np.array([turns, HOLDS] * 2) / RHO, np.array([HOLDS, breaks] * 2) / RADIUS], axis=1).ravel()
    wanted = minimize(
        lambda x: x @ x / 2, np.zeros(8), jac=lambda x: x, options={"ftol": 1e-15, "maxiter": 500}, method="SLSQP",
        constraints=[{"type": "eq", "fun": lambda x: columns @ (x - force.ravel()), "jac": lambda x: columns}],
        bounds=list(zip(-bounds, bounds, strict=True)),
    )  # fmt: skip
    assert np.linalg.norm(wanted.x.reshape(4, 2), axis=1).max() < reach  # the ellipses cut nothing off here
    assert force.ravel() == pytest.approx(wanted.x, abs=1e-7)
    assert (np.abs(np.abs(wanted.x) - bounds) < 1e-9).sum() >= 2
    assert contact_torques(run)[-1] == pytest.approx(RHO * force[:, 0], abs=1e-12)
    assert bearing_torques(run)[-1] == pytest.approx(-RADIUS * force[:, 1], abs=1e-12)


# ---- random scenes ---------------------------------------------------------------------------------------------------


def scene(number):
    """A vehicle whose contacts and rollers may all stick, in half of these beside its axles, and how it runs."""
    rng = np.random.default_rng([61, number])
    wheels = int(rng.choice((3, 4)))
    vehicle = Vehicle.paper(wheels, 4)
    friction = 10 ** rng.uniform(-1.0, 0.0)
    sliding = friction * np.array([1.0, rng.uniform(0.6, 1.6) if rng.random() < 0.5 else 1.0])
    static = sliding * rng.choice((1.0, 1.4))
    size = friction * vehicle.mass * 9.8 / wheels
    reach = vehicle.wheel_radius - vehicle.roller_axis_radius
    of_rollers = size * reach * 10 ** rng.uniform(-1.5, 0.5) * rng.uniform(0.7, 1.3, wheels)
    given = {"roller_coulomb": of_rollers, "roller_break_away": of_rollers * rng.choice((1.0, 1.3))}
    if number % 2:
        of_axles = size * vehicle.wheel_radius * 10 ** rng.uniform(-1.0, 0.5) * rng.uniform(0.7, 1.3, wheels)
        given |= {"wheel_coulomb": of_axles, "wheel_break_away": of_axles * rng.choice((1.0, 1.3))}
    driven = size * vehicle.wheel_radius * rng.normal(size=(3, wheels)) * (rng.random() < 0.8)
    nu = tuple(2 * rng.normal(size=3)) if rng.random() < 0.6 else (0.0, 0.0, 0.0)
    ground = Contact(law="coulomb", friction=sliding, static_friction=static, normal_gravity=9.8,
                     wheel_rates=0 if rng.random() < 0.3 else None)  # fmt: skip
    effects = [ground, Bearings(**given), TorqueTable((0.0, 0.02, 0.05), driven),
               Slope(rng.uniform(0, 0.2), rng.uniform(0, 6))]  # fmt: skip
    options = {"nu": nu, "roller_model": "free", "effects": effects, "duration": 0.04, "accuracy": 1e-8}
    return vehicle, options | {"control": False}


TURNS = 268  # a slip of this scene turns round in a phase, and rows before its rest had its force the wrong way


@pytest.mark.parametrize("number", [TURNS, 24, 30, 36, 39])
def test_the_compiled_engine_obeys_the_laws_in_every_row(number):
    """Forces in their ellipses, torques within their bounds and against the motion; and the ledger closes."""
    vehicle, options = scene(number)
    run = simulate(vehicle, **options)
    assert run.stats["engine"] == "compiled"
    for name, found in judged(run).items():
        assert found.max(initial=0.0) <= 5e-12, name
    scale = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-7 * scale
