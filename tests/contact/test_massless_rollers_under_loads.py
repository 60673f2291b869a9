"""Massless rollers whose bearings stick where wheels may slip and loads follow the motion, under the laws viscous and
regularised: closed forms, every body, the laws in every row, and free rollers as their inertia goes to zero."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting, position, solve

from contact.in_steps import assert_samples_are_those_of_finer_runs
from contact.test_axles_under_loads import (
    GRAVITY,
    INSTANT,
    LAWS,
    RELATIVE,
    row_before_the_front_lets_go,
    run_or_stop,
    slide_downhill,
)
from contact.test_massless_rollers import BOTH, MASSLESS, contact_torques, first_row
from contact.test_massless_rollers import scene as scene_of_given_loads
from contact.test_moving_loads import HEIGHT, LONG, numbers
from contact.test_newton_euler import nu_dot, slipping_case
from contact.test_rollers_under_loads import ACROSS, BREAKS, DOWN, PARKED, RHO, TILT, WIDE, starts
from omniroll import (
    Bearings,
    Contact,
    InvalidValueError,
    SimulationStopped,
    Slope,
    Torque,
    simulate,
)
from omniroll.effects.ground_loads import Carried
from omniroll.effects.loads_beside_bearings import BesideBearings, settled
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

BLOCKED = {"wheel_coulomb": 3.0}  # N m, of axles that never turn

# ---- closed forms ----------------------------------------------------------------------------------------------------


@BOTH
def test_the_rollers_in_front_of_a_vehicle_that_slides_downhill_break_away_first(engine):
    bearings = Bearings(roller_coulomb=0.6 * BREAKS, roller_break_away=BREAKS, **BLOCKED)
    run = slide_downhill(bearings, ACROSS, engine=engine, **MASSLESS)
    assert run.stats["engine"] == engine
    row_before_the_front_lets_go(run, starts, BREAKS / RHO)


@BOTH
@pytest.mark.parametrize("d", [0.0, 1.5])
def test_rollers_that_turn_brake_a_vehicle_until_they_stop(d, engine):
    """On a viscous ground M v' = -4 c s with the slip s = (d v + T/rho)/(c + d) until rho c v is T, then -4 c v; each
    load changes by h F/(4 L). Where d is 0 the vehicle is braked evenly."""
    c, speed, end = 3.0, 0.6, 0.5
    torque = 0.4 * RHO * c * speed
    ground, bearings = Contact(c, loads="dynamic", height=HEIGHT, wheel_rates=0), Bearings(roller_coulomb=torque)
    bearings = replace(bearings, roller_viscous=d * RHO**2 if d else None, **BLOCKED)
    run = simulate(ACROSS, nu=(speed / ACROSS.platform_radius, 0, 0), duration=end, accuracy=1e-11, **MASSLESS,
                   engine=engine, effects=[ground, bearings])  # fmt: skip
    force, rate = torque / RHO, 4 * c / ACROSS.mass
    lost, last, turning = speed - force / c, 4 * force / ACROSS.mass, rate * d / (c + d)
    stops = np.log1p(turning * lost / last) / turning if d else lost / last
    assert 0.1 < stops < 0.9 * end
    spins = np.abs(run.contact_spin).max(axis=1)
    assert spins[0] == pytest.approx(c * lost / (RHO * (c + d)), rel=1e-12)
    assert run.t[first_row(spins < 1e-9)] == pytest.approx(stops, rel=INSTANT)
    before, after = np.maximum(stops - run.t, 0), np.maximum(run.t - stops, 0)
    braked = 4 * force * np.exp(turning * before - rate * after)
    assert run.nu[-1, 0] * ACROSS.platform_radius == pytest.approx(braked[-1] / (4 * c), rel=1e-9)
    moved = HEIGHT * braked[:, None] / (4 * LONG) * np.array([1, -1, -1, 1])
    assert run.ground_load == pytest.approx(ACROSS.mass * GRAVITY / 4 + moved, rel=1e-9)


@BOTH
def test_the_load_of_one_wheel_of_four_vanishes_as_the_vehicle_slides(engine):
    """All axles and rollers stick: M v' = M g sin b - 4 c v, and loads change by h F_x/(4 L) and by h F_y/(4 W)."""
    c, height, mass = 6.0, 0.2, ACROSS.mass
    ground = Contact(c, loads="dynamic", height=height, normal_gravity=GRAVITY * np.cos(TILT))
    options = {"nu": (0, 0, 0), "accuracy": 1e-11, "effects": [ground, PARKED, Slope(TILT, DOWN, gravity=GRAVITY)]}
    run, _ = run_or_stop(ACROSS, options | MASSLESS, engine, 0.3)
    force = mass * GRAVITY * np.cos(TILT) / 4 / (height * (0.8 / (4 * LONG) + 0.6 / (4 * WIDE)))
    rate = 4 * c / mass
    instant = -np.log(1 - force / (4 * c) * rate / (GRAVITY * np.sin(TILT))) / rate
    assert 0.02 < instant < 0.28
    lifted = run.ground_load.argmin() % 4
    gone = run.t[np.flatnonzero(run.ground_load[:, lifted] <= 1e-9)[0]]
    assert gone == pytest.approx(instant, rel=INSTANT)
    assert np.sign(ACROSS.places()[lifted]).tolist() == [-1, -1], "the wheel behind, at the other corner"
    off = run.t > instant * (1 + 1e-9)
    assert not contact_torques(run)[off, lifted].any() and not run.contact_spin[off, lifted].any()


# ---- every body ------------------------------------------------------------------------------------------------------


@working_precision
def by_bodies(case, taken, across, spare, axles):
    """nu', chi'', the ground's forces along the axles and the loads of a vehicle of bodies.

    taken   (N,) torques of the bearings of the rollers in contact
    across  (N,) forces of the ground along the rolling directions
    spare   (N,) loads, of which those beyond three wheels are given
    axles   (N,) torques at the axles
    """
    wheels, rollers = case.vehicle.wheels, case.vehicle.rollers_per_wheel
    in_contact = [[exact(torque), *[exact(0.0)] * (rollers - 1)] for torque in taken]
    given = Acting(ground=lambda i, *_: (0, exact(across[i])), roller_torques=in_contact,
                   wheel_torques=[exact(torque) for torque in axles])  # fmt: skip
    at = position(case.machine, case.heading, case.chi)
    loads = {i: float(spare[i]) for i in range(3, wheels)}
    found = solve(case.machine, at, case.speeds(), given, model="massless", loads=loads)
    along, carried = (np.array([float(own[k]) for own in found.contact]) for k in (0, 2))
    return nu_dot(case, found), np.array([float(v) for v in found.second.chi]), along, carried


def standing_case(law, wheels, damping):
    """A machine that stands on all its wheels as it moves, its run over an instant, and its drives' torques; some of
    its rollers turn and some stick. Those that turn have `damping` in N m s, too."""
    torques = np.where(np.arange(wheels) % 3 == 1, 2e-5 if law == "viscous" else 5e-3, 0.3)
    for attempt in range(300):
        rng = np.random.default_rng([71, wheels, attempt])
        case = slipping_case(rng, wheels, 4, "massless", has_layout=True)
        case = replace(case, nu=case.nu / 8, rates=case.rates / 8)
        torque = 0.1 * rng.normal(size=wheels)
        ground = Contact(**LAWS[law], loads="dynamic", **numbers(case), wheel_rates=case.rates)
        effects = [ground, Bearings(roller_coulomb=torques, roller_viscous=damping), Torque(torque)]
        with contextlib.suppress(InvalidValueError, SimulationStopped):  # it tips
            run = simulate(case.vehicle, **case.start(), duration=0, control=False, effects=effects)
            turns = np.abs(run.contact_spin[0]) > 1e-6
            if run.ground_load[0].min() > 0 and turns.any() and not turns.all():
                return case, run, torque, torques, turns
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels", [3, 4, 6])
@pytest.mark.parametrize("law, damping", [*((law, None) for law in LAWS), ("viscous", 1e-4), ("regularised", 2e-3)])
def test_rollers_and_loads_agree_with_every_body(law, damping, wheels):
    """The oracle gets the bearings' torques and the forces across; it must find the accelerations, the forces along the
    axles, and the loads from which by the law at the slip all forces follow."""
    case, run, torque, sliding, turns = standing_case(law, wheels, damping)
    slip, force, load, taken = run.slip[0], run.ground_force[0], run.ground_load[0], contact_torques(run)[0]
    of_bearings = taken - (damping or 0.0) * run.contact_spin[0]
    assert np.ptp(load) > 1e-2 * load.mean()
    found = run.contacts.accelerations(run.nu, run.chi)
    *wanted, along, carried = by_bodies(case, of_bearings, force[:, 1], load, torque)
    for value, other in zip((found["nu_dot"][0], found["rates_dot"][0], load, force[:, 0]), (*wanted, carried, along),
                            strict=True):  # fmt: skip
        assert value == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * np.abs(other).max())
    mu = np.array([0.3, 0.2])
    if law == "viscous":
        expected = -mu * slip
    else:
        size = np.sqrt(((mu * slip) ** 2).sum(axis=1) + mu.prod() * 0.05**2)
        expected = -(load / size)[:, None] * mu**2 * slip
    assert force == pytest.approx(expected, rel=RELATIVE, abs=RELATIVE * np.abs(expected).max())
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    speed = rho * kernel(case.vehicle, "massless", "python").wheel_rates(case.nu, case.chi)[1]
    assert slip[:, 0] + rho * run.contact_spin[0] == pytest.approx(speed, rel=RELATIVE, abs=1e-12)
    assert taken[turns] == pytest.approx((-np.sign(run.contact_spin[0]) * sliding)[turns], rel=1e-12)
    assert (np.abs(taken) <= sliding * (1 + 1e-12)).all() and not run.contact_spin[0, ~turns].any()


# ---- random scenes ---------------------------------------------------------------------------------------------------


def scene(number, low=True):
    """A vehicle whose massless rollers stick on one of both grounds, in half of these beside its axles; one that is not
    low may be lifted by friction."""
    vehicle, options = scene_of_given_loads(number)
    rng = np.random.default_rng([73, number, low])
    contact, *others = options["effects"]
    height = float(rng.uniform(0.02, 0.06) if low else rng.uniform(0.06, 0.25))
    ground = replace(contact, loads="dynamic", height=height, normal_gravity=9.7)
    return vehicle, options | {"effects": [ground, *others], "accuracy": 1e-8}


def assert_laws_hold(vehicle, options, run, bound=1e-12):
    """In every row the ground's force along the axle is the bearing's torque over rho, and both forces are those of the
    law under the load at the slip; a bearing takes its sliding torque against the spin, or what it holds at most.
    Viscous friction is there beside that."""
    contact, bearings = options["effects"][:2]
    rho = vehicle.wheel_radius * np.cos(run.chi) - vehicle.roller_axis_radius
    taken, slip, force, spins, load = (
        contact_torques(run), run.slip, run.ground_force, run.contact_spin, run.ground_load)  # fmt: skip
    of_bearings = taken if bearings.roller_viscous is None else taken - np.array(bearings.roller_viscous) * spins
    weight = vehicle.mass * 9.7
    carries = load > 0
    if contact.law == "viscous":
        wanted = -slip * np.array(contact.coefficient) * carries[..., None]
    else:
        mu = np.array(contact.friction)
        size = np.sqrt(((mu * slip) ** 2).sum(axis=-1, keepdims=True) + mu.prod() * contact.speed**2)
        wanted = -load[..., None] * mu**2 * slip / size
    scale = np.abs(wanted).max() + 1e-3 * weight
    assert np.abs(force - wanted).max() <= bound * scale
    assert np.abs(force[..., 0] * rho - of_bearings).max() <= bound * scale * rho.max()
    assert load.min() >= -1e-9 * weight and load.sum(axis=1) == pytest.approx([weight] * len(run), rel=1e-11)
    sliding, holding = np.array(bearings.roller_coulomb), np.array(bearings.roller_break_away)
    assert (np.abs(taken) <= holding * (1 + 1e-10)).all()
    turns = np.abs(spins) * rho > 1e-7 * np.abs(slip).max()
    assert np.abs(taken + np.sign(spins) * sliding)[turns].max(initial=0) <= 1e-12 * sliding.max()
    along = kernel(vehicle, "massless", "python").wheel_rates(run.nu, run.chi)[1] * rho
    assert np.abs(slip[..., 0] + rho * spins - along).max() <= 1e-12 * np.abs(along).max()
    return turns


@pytest.mark.parametrize("number", [2, 4, 5, *(pytest.param(k, marks=pytest.mark.long) for k in (3, *range(6, 14)))])
def test_the_laws_hold_in_every_row(number):
    vehicle, options = scene(number)
    run, why = run_or_stop(vehicle, options, "compiled", 0.02)
    assert "pace" not in why
    assert assert_laws_hold(vehicle, options, run).any(), "none turns"
    lost = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-7 * lost


@pytest.mark.parametrize("number", [2, 4, pytest.param(0, marks=pytest.mark.long)])
def test_free_rollers_tend_to_it_as_their_inertia_goes_to_zero(number):
    """At first order: nothing of massless rollers has a part in those runs."""
    vehicle, options = scene(number)
    contact, bearings, *others = options["effects"]
    options |= {"effects": [contact, replace(bearings, roller_break_away=None), *others], "accuracy": 1e-9}
    limit, times = simulate(vehicle, duration=0.02, **options), np.linspace(0, 0.02, 11)

    def distance(inertia):
        own = options | {"roller_model": "free"}
        return distance_at(simulate(replace(vehicle, roller_inertia=inertia), duration=0.02, **own), limit, times)

    far, near = distance(1e-8), distance(1e-9)
    assert far < 1e-4
    assert 0.99 <= np.log10(far / near) <= 1.01


@pytest.mark.long
def test_a_roller_that_comes_to_rest_beside_others_that_turn_stays_there():
    """What it is asked for is at its bound to rounding, and beyond it where the others stick, too. A run stood still
    there."""
    vehicle, options = scene(3)
    contact, bearings, *others = options["effects"]
    options |= {"effects": [contact, replace(bearings, roller_break_away=None), *others], "accuracy": 1e-6}
    run, why = run_or_stop(vehicle, options, "compiled", 0.012)
    assert not why and run.t[-1] == 0.012
    turns = run.contact_spin != 0
    assert turns[0].all() and (~turns[-1]).sum() == 2


def test_samples_between_rows_are_those_of_finer_runs():
    vehicle, options = scene(2)
    names = ("slip", "ground_force", "ground_load", "contact_spin")
    options |= {"duration": 0.02}
    assert_samples_are_those_of_finer_runs(vehicle, options, np.linspace(0.001, 0.019, 19), names, 1e-9)


# ---- loads beside bearings -------------------------------------------------------------------------------------------


def test_loads_beside_bearings_are_found():
    """N = 1 + c left(N) with left(N) = sqrt(N^2 - b^2), of which N is known in closed form; for c > 1 there is no such
    load: what is found has no positive determinant."""
    b, c = 0.5, 0.6

    def solving(slope):
        def solve(about):
            at = BesideBearings.at(lambda n: (np.full(1, b), n**2 / ((n - b) * (n + b))), np.ones(1, bool), about)
            left = np.sqrt((at.about - b) * (at.about + b)) / at.about  # per load, as the law at 1 N has it
            gain = slope * left * at.gain
            load = (1 + slope * left * at.factor(np.zeros(1))) / (1 - gain)
            return Carried(load, np.zeros(3), load, 1 - gain[0])

        return solve

    found = settled(solving(c), np.full(1, 0.1), 1.0)
    wanted = (1 + c * np.sqrt(1 - b**2 * (1 - c**2))) / (1 - c**2)
    assert found.loads[0] == pytest.approx(wanted, rel=1e-14)
    assert found.determinant == pytest.approx(1 - c * wanted / np.sqrt(wanted**2 - b**2), rel=1e-6)
    assert not settled(solving(2.0), np.full(1, 0.7), 1.0).determinant > 0
