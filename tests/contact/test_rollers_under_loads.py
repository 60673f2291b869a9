"""Rollers whose bearings stick where wheels may slip and loads follow the motion, under the laws viscous and
regularised: closed forms, every body, the law in every row, and the friction with a named speed that tends to it."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from scipy.integrate import quad

from contact.test_axles_under_loads import CART, FRONT, GRAVITY, INSTANT, LAWS, RELATIVE, run_or_stop
from contact.test_moving_loads import HEIGHT, LONG, by_bodies, numbers
from contact.test_newton_euler import slipping_case
from contact.test_stuck_rollers import all_spins, contact_torques
from omniroll import (
    Bearings,
    Contact,
    InvalidValueError,
    KernelsMissingError,
    Session,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
)
from omniroll.effects.loaded_bearings import GroundBesideBearings
from omniroll.results.comparison import distance_at

ACROSS = CART.replace(wheel_angles=(0.0,) * 4)  # four wheels at the corners of a rectangle, whose axles look along x
RHO = ACROSS.wheel_radius - ACROSS.roller_axis_radius  # of a roller that touches the ground in its middle
BEHIND = [1, 2]
STILL = 1e-11  # rad/s


def starts(run, wheel):
    """When the roller in contact begins to turn."""
    turns = np.abs(run.contact_spin[:, wheel]) > STILL
    return run.t[:-1][turns[1:] & ~turns[:-1]]


# ---- closed forms ----------------------------------------------------------------------------------------------------


def test_the_rollers_in_front_of_a_vehicle_that_slides_downhill_break_away_first():
    """All axles and rollers stick: M v' = M g sin b - F with F = mu W v/sqrt(v^2 + v0^2), and each wheel in front
    carries W/4 + h F/(4 L). Its roller lets go where rho mu v/sqrt(v^2 + v0^2) of that is its break-away torque."""
    angle, friction, fades = 0.3, 0.25, 0.02
    mass, weight, fall = ACROSS.mass, ACROSS.mass * GRAVITY * np.cos(0.3), GRAVITY * np.sin(0.3)
    breaks = 0.6 * RHO * friction * weight / 4
    ground = Contact(law="regularised", friction=friction, speed=fades, loads="dynamic", height=HEIGHT,
                     normal_gravity=GRAVITY * np.cos(angle))  # fmt: skip
    bearings = Bearings(roller_coulomb=0.6 * breaks, roller_break_away=breaks, wheel_coulomb=3.0)
    run = simulate(ACROSS, nu=(0, 0, 0), duration=0.02, roller_model="free", accuracy=1e-11, control=False,
                   effects=[ground, bearings, Slope(angle, 0.0, gravity=GRAVITY)])  # fmt: skip
    assert run.stats["engine"] == "python"
    lever = friction * HEIGHT / LONG
    part = (np.sqrt(1 + 16 * lever * breaks / (RHO * friction * weight)) - 1) / (2 * lever)  # of its friction
    let_go, _ = quad(lambda turn: fades / np.cos(turn) ** 2 / (fall - friction * weight / mass * np.sin(turn)), 0,
                     np.arcsin(part), epsabs=0, epsrel=1e-13)  # fmt: skip
    assert 0.002 < let_go < 0.018
    for wheel in FRONT:
        assert starts(run, wheel)[0] == pytest.approx(let_go, rel=INSTANT)
    assert all(not starts(run, wheel).size or starts(run, wheel)[0] > 1.1 * let_go for wheel in BEHIND)
    row = np.flatnonzero(np.abs(run.t / let_go - 1) <= INSTANT)[0]  # the row before they let go
    carried = weight / 4 * (1 + lever * part)
    assert run.ground_load[row, FRONT] == pytest.approx([carried] * 2, rel=1e-9)
    assert run.ground_load[row, BEHIND] == pytest.approx([weight / 2 - carried] * 2, rel=1e-9)
    assert np.abs(contact_torques(run)[row, FRONT]).max() <= breaks * (1 + 1e-11)


def test_wheels_held_by_their_rollers_load_the_front_as_the_platform_stops():
    """On a viscous ground M v' = -4 c v, and each load changes by 4 c v h/(4 L). The rollers never let go, since
    rho c v only falls."""
    c, speed = 3.0, 1.2
    ground = Contact(c, loads="dynamic", height=HEIGHT, wheel_rates=0, contact_spins=0)
    bearings = Bearings(roller_coulomb=1.01 * RHO * c * speed)
    run = simulate(ACROSS, nu=(speed / ACROSS.platform_radius, 0, 0), duration=0.3, roller_model="free",
                   effects=[ground, bearings], accuracy=1e-11, control=False)  # fmt: skip
    assert np.abs(all_spins(run)).max() <= STILL
    assert len(run) > 5
    braked = 4 * c * speed * np.exp(-4 * c / ACROSS.mass * run.t)
    moved = HEIGHT * braked[:, None] / (4 * LONG) * np.array([1, -1, -1, 1])
    assert run.ground_load == pytest.approx(ACROSS.mass * GRAVITY / 4 + moved, rel=1e-9)


# ---- every body ------------------------------------------------------------------------------------------------------


def standing_case(law, wheels, monkeypatch):
    """A machine that stands on all its wheels as it moves, its run over an instant, its drives' torques, the torques of
    all bearings (B,), and which rollers are at rest (N, n)."""
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
            run = simulate(case.vehicle, **case.start(), duration=1e-9, effects=[ground, bearings, Torque(torque)],
                           control=False)  # fmt: skip
            if run.ground_load[0].min() > 0:
                return case, run, torque, *kept[0], rests
    raise AssertionError("none stands")


@pytest.mark.parametrize("wheels", [3, 4, 6])
@pytest.mark.parametrize("law", LAWS)
def test_rollers_and_loads_agree_with_every_body(law, wheels, monkeypatch):
    """The oracle gets forces and torques; it must find the accelerations, none of the spins of rollers that stick, and
    the loads from which the forces follow."""
    case, run, torque, bearing, modes, rests = standing_case(law, wheels, monkeypatch)
    force, load = run.ground_force[0], run.ground_load[0]
    assert np.ptp(load) > 1e-2 * load.mean()
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
    """On the compiled engine, in whose runs no roller sticks."""
    paper = Vehicle.paper(3, 5)
    ground = Contact(20.0, loads="dynamic", height=0.05)
    spins = 30 * np.random.default_rng(3).normal(size=(3, 4))
    options = {"nu": (0.0, 0.0, 0.3), "spins": spins, "duration": 0.15, "roller_model": "free", "control": False}
    bearings, times = Bearings(roller_coulomb=400 * paper.roller_inertia), np.linspace(0, 0.15, 16)

    def run(of_rollers):
        return simulate(paper, effects=[ground, of_rollers], accuracy=1e-9, **options)

    sticks = run(bearings)
    distances = [distance_at(run(replace(bearings, roller_speed=speed)), sticks, times) for speed in (1e-2, 1e-3)]
    assert sticks.stats["engine"] == "python" and (np.abs(sticks.spins[-1]) < 1e-11).any()
    assert 0.9 <= np.log10(distances[0] / distances[1]) <= 1.1


def test_sessions_are_refused_and_say_why():
    effects = [Contact(3.0, loads="dynamic", height=0.05), Bearings(roller_coulomb=1e-4)]
    with pytest.raises(KernelsMissingError, match="rollers that stick where loads follow the motion"):
        Session(ACROSS, nu=(0, 0, 0), roller_model="free", effects=effects)
