"""Massless rollers whose bearings stick beside the law coulomb where loads follow the motion: closed forms, every body,
the laws in every row, and free rollers as their inertia goes to zero."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from contact.in_steps import assert_samples_are_those_of_finer_runs
from contact.test_axles_under_loads import run_or_stop
from contact.test_massless_rollers import BOTH, contact_torques, first_row
from contact.test_massless_rollers_that_stick import (
    CROSS,
    DISTANCE,
    GRAVITY,
    INSTANT,
    LAW,
    MASS,
    MASSLESS,
    RADIUS,
    RHO,
    WEIGHT,
    WHEEL,
    assert_free_rollers_tend_to_it,
    residuals,
)
from contact.test_massless_rollers_that_stick import scene as scene_of_given_loads
from contact.test_massless_rollers_under_loads import by_bodies
from contact.test_moving_loads import numbers
from contact.test_newton_euler import slipping_case
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
from omniroll.kernels.kernel import kernel

RELATIVE = 1e-10

# ---- closed forms ----------------------------------------------------------------------------------------------------

HEIGHT, GROWS = 0.12, 10.0  # m; N m/s
AHEAD, BEHIND, WIDE = 0.2, -0.1, 0.15  # m
TRICYCLE = Vehicle.paper(3, 4).replace(
    wheel_places=((AHEAD, 0.0), (BEHIND, WIDE), (BEHIND, -WIDE)), wheel_angles=(0.0, np.pi / 2, np.pi / 2)
)  # the wheel in front rolls on its rollers as the others push
ROLLS = 2 * WHEEL / RADIUS**2  # kg, of two wheels that roll, beside the mass
TILTS = 2 * WHEEL / RADIUS  # kg m, beside the mass times the height: the moment that an acceleration asks of the loads


def pushed(vehicle, drive, friction, torque, engine, duration):
    """Two wheels push along x with torques that grow, drive (N,) of them."""
    table = TorqueTable((0.0, 1.0), np.array([np.zeros(len(drive)), GROWS * np.array(drive)]))
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=HEIGHT, normal_gravity=GRAVITY)
    effects = [ground, Bearings(roller_coulomb=torque), table]
    return run_or_stop(vehicle, {"nu": (0, 0, 0), "accuracy": 1e-9, "effects": effects, **MASSLESS}, engine, duration)


def instant(vehicle, acceleration, dragged):
    """When (M + 2 J/l^2) x'' = 2 tau/l - dragged."""
    return RADIUS * ((vehicle.mass + ROLLS) * acceleration + dragged) / (2 * GROWS)


@BOTH
def test_a_front_wheel_that_loses_its_load_stops_its_roller_and_the_vehicle_tips(engine):
    """The front roller breaks away at 2 tau/l = T/rho. It stops where mu N has fallen to T/rho, and its wheel drags
    with mu N until its load W/3 - (M h + 2 J/l) x''/0.3 is gone."""
    friction, torque = 1.5, 0.05
    held, weight = torque / RHO, TRICYCLE.mass * GRAVITY
    lifts = (TRICYCLE.mass * HEIGHT + TILTS) / (AHEAD - BEHIND)
    breaks = instant(TRICYCLE, 0, held)
    stops = instant(TRICYCLE, (weight / 3 - held / friction) / lifts, held)
    tips = instant(TRICYCLE, weight / 3 / lifts, 0)
    assert breaks < 0.5 * stops and stops < 0.99 * tips
    run, why = pushed(TRICYCLE, (0, 1, 1), friction, torque, engine, 1.2 * tips)
    assert "the vehicle tips over the edge of its wheels 1 and 2" in why
    spins = np.abs(run.contact_spin[:, 0])
    assert run.t[first_row(spins > 1e-12) - 1] == pytest.approx(breaks, rel=INSTANT)
    slipping = first_row(~run.sticks[:, 0])
    assert run.t[slipping] == pytest.approx(stops, rel=INSTANT)
    assert run.ground_load[slipping, 0] == pytest.approx(held / friction, rel=1e-9)
    assert not spins[slipping + 1 :].any() and abs(run.ground_load[-1, 0]) <= 1e-9 * weight
    assert run.t[-1] == pytest.approx(tips, rel=INSTANT)


@BOTH
def test_a_front_wheel_whose_friction_presses_it_down_has_several_solutions(engine):
    """Two wheels of four push along the axles of the others, whose rollers turn at 2 tau/l = 2 T/rho; of these the load
    in front is W/4 - (M h + 2 J/l) x''/(2 d). Where mu times that has fallen to T/rho its roller would stop. Friction
    which a load brings then presses it on the ground by more than that load: mu (M h + 2 J/l) > 2 d (M + 2 J/l^2)."""
    friction, torque = 3.0, 0.05
    held, lifts = torque / RHO, (MASS * HEIGHT + TILTS) / (2 * DISTANCE)
    assert friction * lifts > MASS + ROLLS
    stops = instant(CROSS, (WEIGHT / 4 - held / friction) / lifts, 2 * held)
    run, why = pushed(CROSS, (0, -1, 0, 1), friction, torque, engine, 1.2 * stops)
    assert "loads and friction have several solutions: in one of them wheel" in why
    assert run.t[-1] == pytest.approx(stops, rel=INSTANT)
    assert run.sticks.all() and (run.contact_spin[-1, [0, 2]] != 0).all()
    assert run.ground_load[-1].min() == pytest.approx(held / friction, rel=1e-9)


@BOTH
@pytest.mark.parametrize("more, holds", [(1 - 1e-9, True), (1 + 1e-9, False), (1.3, False)])
def test_bearings_below_friction_say_what_slope_holds(more, holds, engine):
    """All axles stick, two contacts hold mu N each, two T/rho, whatever loads move: 2 mu N + 2 T/rho. Beyond it
    M v' = M g sin b less that, and the loads of the wheels in front and behind differ by h/d of the ground's force."""
    mu, torque, incline = 0.5, 0.05, 0.3
    normal = GRAVITY * np.cos(incline)
    load = MASS * normal / 4
    most = 2 * mu * load + 2 * torque / RHO
    pull = more * most / MASS
    slope = Slope(incline, 0.0, gravity=pull / np.sin(incline))
    ground = Contact(law="coulomb", friction=mu, loads="dynamic", height=HEIGHT, normal_gravity=normal)
    moved = min(more, 1) * most * HEIGHT / (2 * DISTANCE)
    assert mu * (load - moved) > 1.1 * torque / RHO
    effects = [ground, Bearings(roller_coulomb=torque, wheel_coulomb=30.0), slope]
    run = simulate(CROSS, nu=(0, 0, 0), duration=0.1, effects=effects, accuracy=1e-12, engine=engine, **MASSLESS)
    speeds = np.linalg.norm(run.nu[:, :2], axis=1) * DISTANCE
    assert np.sort(run.ground_load[-1]) == pytest.approx([load - moved, load, load, load + moved], rel=1e-9)
    if holds:
        assert not speeds.any() and run.sticks.all()
        assert np.abs(contact_torques(run)).max() <= torque * (1 + LAW)
        return
    assert speeds[-1] == pytest.approx((pull - most / MASS) * 0.1, rel=1e-9, abs=1e-14)
    turning = np.abs(run.contact_spin[-1]) * RHO > 0.5 * speeds[-1]
    assert turning.sum() == 2 and (~run.sticks[-1]).sum() == 2 and not (turning & ~run.sticks[-1]).any()


@BOTH
def test_the_wheels_in_front_of_a_vehicle_that_slides_downhill_turn_their_rollers(engine):
    """It slides along the axles of wheels 1 and 3, whose bearings take T/rho between mu times the loads of the two: the
    lower roller turns, with T/rho, and the upper wheel drags with mu N. With F = 2 mu N_2 + T/rho + mu N_3 the loads
    are N_2 = W/4 and N_3 = W/4 - h F/(2 d)."""
    mu, incline, height = 0.4, 0.6, HEIGHT / 3
    normal = GRAVITY * np.cos(incline)
    load, lever = MASS * normal / 4, height / (2 * DISTANCE)
    torque = mu * load * RHO
    force = (3 * mu * load + torque / RHO) / (1 + mu * lever)
    upper = load - lever * force
    ground = Contact(law="coulomb", friction=mu, loads="dynamic", height=height, normal_gravity=normal)
    effects = [ground, Bearings(roller_coulomb=torque, wheel_coulomb=30.0), Slope(incline, 0.0, gravity=GRAVITY)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=0.1, effects=effects, accuracy=1e-12, engine=engine, **MASSLESS)
    speed = (GRAVITY * np.sin(incline) - force / MASS) * 0.1
    assert np.linalg.norm(run.nu[-1, :2]) * DISTANCE == pytest.approx(speed, rel=1e-10)
    assert np.sort(run.ground_load[-1]) == pytest.approx([upper, load, load, 2 * load - upper], rel=1e-10)
    lower = int(np.argmax(run.ground_load[-1]))
    assert abs(run.contact_spin[-1, lower]) * RHO == pytest.approx(speed, rel=1e-10)
    assert run.contact_spin[-1, (lower + 2) % 4] == 0 and not run.sticks[-1, (lower + 2) % 4]


# ---- every body ------------------------------------------------------------------------------------------------------


def standing_case(wheels, engine, attempts=300):
    """A machine that stands on all its wheels as it moves, its run over an instant, its drives' torques and those of
    its rollers' bearings; a contact sticks whose roller turns, others slip, with rollers that turn and that stick."""
    sliding = np.where(np.arange(wheels) % 3 == 2, 0.3, 8e-3)
    for attempt in range(attempts):
        rng = np.random.default_rng([77, wheels, attempt])
        case = slipping_case(rng, wheels, 4, "massless", has_layout=True)
        bare = kernel(case.vehicle, "massless", "python")
        nu, rates = case.nu / 8, case.rates / 8
        rates[0] = bare.wheel_rates(nu, case.chi)[0][0]
        case, torque = replace(case, nu=nu, rates=rates), 0.05 * rng.normal(size=wheels)
        ground = Contact(law="coulomb", friction=(0.5, 0.4), loads="dynamic", **numbers(case), wheel_rates=rates)
        with contextlib.suppress(InvalidValueError, SimulationStopped):  # it tips
            run = simulate(case.vehicle, **case.start(), duration=0, control=False, engine=engine,
                           effects=[ground, Bearings(roller_coulomb=sliding), Torque(torque)])  # fmt: skip
            turns, sticks = np.abs(run.contact_spin[0]) > 1e-6, run.sticks[0]
            kinds = (turns & sticks).any() and (turns & ~sticks).any() and (~turns & ~sticks).any()
            if run.ground_load[0].min() > 0 and kinds:
                return case, run, torque, sliding, turns
    raise AssertionError("none stands")


def assert_moves_as_every_body(case, run, taken, torque):
    """The first row's accelerations, loads and forces along the axles are those of every body, which gets torques (N,)
    of the bearings and of the axles, and the forces across; the loads differ. Returns nu' and the wheels' chi''."""
    force, load = run.ground_force[0], run.ground_load[0]
    assert np.ptp(load) > 1e-2 * load.mean()
    found = run.contacts.accelerations(run.nu, run.chi)
    *wanted, along, carried = by_bodies(case, taken, force[:, 1], load, torque)
    for value, other in zip((found["nu_dot"][0], found["rates_dot"][0], load, force[:, 0]), (*wanted, carried, along),
                            strict=True):  # fmt: skip
        assert value == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * np.abs(other).max())
    return wanted


@BOTH
@pytest.mark.parametrize("wheels", [3, 4, 6])
def test_modes_and_loads_agree_with_every_body(wheels, engine):
    """The oracle gets the bearings' torques and the forces across; it must find the accelerations, the forces along the
    axles, and the loads from which by the law at the slip all forces follow."""
    case, run, torque, sliding, turns = standing_case(wheels, engine)
    slip, force, load, taken = run.slip[0], run.ground_force[0], run.ground_load[0], contact_torques(run)[0]
    wanted = assert_moves_as_every_body(case, run, taken, torque)
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    mu, sticks = np.array([0.5, 0.4]), run.sticks[0]
    bare = kernel(case.vehicle, "massless", "python")
    speed = rho * bare.wheel_rates(case.nu, case.chi)[1]
    rigid = np.stack([speed, slip[:, 1]], axis=1)
    size = np.linalg.norm(mu * rigid, axis=1)
    across = np.sign(slip[:, 1]) * mu[1] * np.sqrt(np.maximum(load**2 - (sliding / rho / mu[0]) ** 2, 0))
    expected = np.where(turns[:, None], np.stack([-np.sign(speed) * sliding / rho, -across], axis=1),
                        -(load / size)[:, None] * mu**2 * rigid)  # fmt: skip
    assert force[~sticks] == pytest.approx(expected[~sticks], rel=RELATIVE, abs=RELATIVE * np.abs(expected).max())
    assert force[sticks, 0] == pytest.approx(expected[sticks, 0], rel=RELATIVE)
    assert np.linalg.norm(force[sticks] / mu, axis=1) <= load[sticks]
    rolls = bare.wheel_rates(np.array(wanted[0]), case.chi)[0]  # its rows do not move
    assert wanted[1][sticks] == pytest.approx(rolls[sticks], rel=1e-9)
    normal = force / mu**2
    corner = turns & ~sticks
    turned = slip[:, 0] * normal[:, 1] - slip[:, 1] * normal[:, 0]
    assert np.abs(turned[corner]).max() <= RELATIVE * np.abs(slip).max() * np.abs(normal).max()
    assert slip[:, 0] + rho * run.contact_spin[0] == pytest.approx(speed, rel=RELATIVE, abs=1e-12)


# ---- random scenes ---------------------------------------------------------------------------------------------------


def scene(number, highest=0.12):
    """A vehicle whose massless rollers stick beside contacts that do, in half of these beside its axles."""
    vehicle, options = scene_of_given_loads(number)
    rng = np.random.default_rng([17, number])
    contact, *others = options["effects"]
    ground = replace(contact, loads="dynamic", height=float(rng.uniform(0.02, highest)))
    return vehicle, options | {"effects": [ground, *others], "accuracy": 1e-9}


def assert_the_laws_hold(number, engine, duration=0.006, bound=LAW):
    """In every row of a run; returns why it has stopped, or nothing."""
    vehicle, options = scene(number)
    run, why = run_or_stop(vehicle, options, engine, duration)
    assert run.stats["engine"] == engine
    if not run.t[-1]:
        assert why  # nothing is decided there
        return why
    for name, residual in residuals(vehicle, options["effects"], run).items():
        assert residual <= bound, (number, name)
    lost = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-9 * lost, number
    return why


@pytest.mark.parametrize("number", [0, 2, 4, 7])
def test_the_laws_hold_in_every_row(number):
    assert_the_laws_hold(number, "python")


@pytest.mark.long
def test_the_laws_hold_in_every_row_of_more_scenes():
    for number in range(8, 30):
        assert_the_laws_hold(number, "python")


@pytest.mark.long
@BOTH
def test_modes_and_loads_are_found_together_where_turns_do_not_end(engine):
    """A contact slips under the loads of one that sticks on a roller which turns, and the other way round."""
    assert not assert_the_laws_hold(84, engine)


def test_free_rollers_tend_to_it_as_their_inertia_goes_to_zero():
    limit = assert_free_rollers_tend_to_it(0.02, loads="dynamic", height=0.08)
    assert np.ptp(limit.ground_load[-1]) > 0.1 * WEIGHT


def test_samples_between_rows_are_those_of_finer_runs():
    vehicle, options = scene(2)
    names = ("slip", "ground_force", "ground_load", "contact_spin")
    options |= {"duration": 0.006}
    assert_samples_are_those_of_finer_runs(vehicle, options, np.linspace(0.0005, 0.0055, 11), names, 1e-9)
