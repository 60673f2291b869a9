"""Massless rollers whose bearings stick where wheels may slip, under the laws viscous and regularised: closed forms,
every body, and free rollers as their inertia goes to zero."""

from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting
from reactions.test_newton_euler import call
from scipy.optimize import brentq

from contact.test_newton_euler import DAMPING, FADE_SPEED, FRICTION, LAWS, LOAD, RELATIVE, named, nu_dot, slipping_case
from omniroll import Bearings, Contact, Slope, Torque, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
MASS, DISTANCE = CROSS.mass, CROSS.platform_radius
RHO = CROSS.wheel_radius - CROSS.roller_axis_radius  # of a roller that touches the ground in its middle
INSTANT = 1e-10  # relative, of instants in closed form
MASSLESS = {"roller_model": "massless", "control": False}


def contact_torques(run):
    """(T, N) in N m, what the bearings of the rollers in contact take in each row."""
    return run.drive[:, run.effects.drives().index("contact_bearing")]


def first_row(happens):
    return int(np.flatnonzero(happens)[0])


# Closed forms


def test_rollers_that_turn_stop_on_their_disks():
    """M v' = -2 c v - 2 T/rho along two axles until c v = T/rho, then -4 c v."""
    c, torque, start, end = 6.0, 0.02, 1.0, 1.2
    effects = [Contact(c, wheel_rates=0), Bearings(roller_coulomb=torque, wheel_coulomb=3.0)]
    options = {"duration": end, "effects": effects, "accuracy": 1e-12, **MASSLESS}
    run = simulate(CROSS, nu=(start / DISTANCE, 0, 0), **options)
    rate, drag, rests = 2 * c / MASS, torque / (RHO * c), torque / (RHO * c)
    stops = np.log((start + drag) / (rests + drag)) / rate
    assert 0.05 < stops < end / 2
    spins = np.abs(run.contact_spin).max(axis=1)
    assert spins[0] == pytest.approx((start - rests) / RHO, rel=1e-12)
    assert run.t[first_row(spins < 1e-9)] == pytest.approx(stops, rel=INSTANT)
    wanted = rests * np.exp(-2 * rate * (end - stops))
    assert run.nu[-1, 0] * DISTANCE == pytest.approx(wanted, rel=1e-10)
    assert run.ledger.contributions["roller_loss"] < 0
    assert abs(run.ledger.residual) <= 1e-10 * run.energy[0]


# Every body


def series(law, speed, across, rho, torque, damping):
    """Of a wheel that moves with `speed` along its axle and slips with `across`: the slip along it, the spin and the
    bearing's torque. The slip is found by bisection, where the ground's force times rho is what the bearing takes: at
    most `torque`, and its viscous friction beside that."""

    def beyond(slip):
        return rho * abs(law(slip, across)[0]) - torque - damping * abs(speed - slip) / rho

    if beyond(speed) <= 0:
        return speed, 0.0, rho * law(speed, across)[0]
    slip = np.sign(speed) * brentq(lambda s: beyond(np.sign(speed) * s), 0.0, abs(speed), xtol=1e-300, rtol=1e-15)
    spin = (speed - slip) / rho
    return slip, spin, -np.sign(speed) * torque - damping * spin


def viscous(along, across):
    return -DAMPING[0] * along, -DAMPING[1] * across


def regularised(along, across):
    axle, rolling = FRICTION
    size = np.sqrt((axle * along) ** 2 + (rolling * across) ** 2 + axle * rolling * FADE_SPEED**2)
    return -LOAD * axle**2 * along / size, -LOAD * rolling**2 * across / size


@working_precision
def by_bodies(case, taken, across, holding):
    """Rates of nu (3,) and of the wheels (N,), and the ground's forces along the axles (N,), of a vehicle of bodies.

    taken    (N,) torques of the bearings of the rollers in contact
    across   (N,) forces of the ground along the rolling directions
    holding  (N,) torques that hold axles, or None
    """
    wheels, rollers = case.vehicle.wheels, case.vehicle.rollers_per_wheel
    in_contact = [[exact(torque), *[exact(0.0)] * (rollers - 1)] for torque in taken]
    given = Acting(ground=lambda i, *_: (0, exact(across[i])), guide=wheels != 3, roller_torques=in_contact,
                   wheel_torques=[exact(t) for t in (np.zeros(wheels) if holding is None else holding)])  # fmt: skip
    solved = case.solved(given)
    along = np.array([float(axle) for axle, *_ in solved.contact])
    return nu_dot(case, solved), np.array([float(v) for v in solved.second.chi]), along


@pytest.mark.parametrize("wheels, rollers, law, axles, rubs", [
    (wheels, rollers, law, ("axle_sticking",) * ((k + wheels) % 2), (k + wheels) % 3 > 0)
    for wheels, rollers in ((2, 4), (3, 5), (4, 6)) for k, law in enumerate(LAWS)
])  # fmt: skip
def test_modes_agree_with_every_body(wheels, rollers, law, axles, rubs):
    """Newton's and Euler's equations with the bearings' torques give the same accelerations and the same forces along
    the axles, which are those of the law at the slip that bisection finds. Every second roller turns."""
    rng = np.random.default_rng([21, wheels, len(axles), len(law)])
    case = slipping_case(rng, wheels, rollers, "massless", has_layout=True)
    stands = np.arange(wheels) % 2 == 0 if axles else np.zeros(wheels, bool)
    case = replace(case, nu=case.nu * (0.1 if law == "contact_viscous" else 0.01), rates=case.rates * ~stands * 0.1)
    forces = viscous if law == "contact_viscous" else regularised
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    damping = DAMPING[0] * rho**2 * 10 ** rng.uniform(-1, 1, wheels) * rubs
    constants = (*LAWS[law].items(), *([("roller_damping", tuple(damping))] if rubs else []))
    effects = ("contact", law, "roller_sticking", *(["roller_viscous"] if rubs else []), *axles)
    bound = kernel(case.vehicle, "massless", "python", constants=constants, effects=effects)
    rolling_rates, rolling_spins = bound.wheel_rates(case.nu, case.chi)
    speed, across = rho * rolling_spins, case.vehicle.wheel_radius * (case.rates - rolling_rates)
    asked = rho * np.array([abs(forces(*own)[0]) for own in zip(speed, across, strict=True)])
    sticks = np.arange(wheels) % 2 == 0
    torques = asked * np.where(sticks, 2.5, 0.4)
    found = [series(forces, *row) for row in zip(speed, across, rho, torques, damping, strict=True)]
    slip, spin, taken = np.array(found).T
    assert ((spin == 0) == sticks).all() and (spin * speed >= 0).all()
    modes = {"axle_sticks": stands.astype(float), "contact_sticks": sticks.astype(float)}
    turning = np.where(sticks, 0.0, -np.sign(speed) * torques)
    values = case.known(bound, **modes, contact_bearing=turning, bearing_torque=np.zeros(wheels))
    rates = named(bound, "slip_dynamics", values)
    shown, force = call(bound, "slip_forces", values)
    spins, held = call(bound, "slip_spins", values)
    scale = RELATIVE * np.abs(speed).max()
    assert shown == pytest.approx(np.stack([slip, across], axis=1), rel=RELATIVE, abs=scale)
    assert spins * rho == pytest.approx(spin * rho, rel=RELATIVE, abs=scale) and not spins[sticks].any()
    assert held == pytest.approx(np.where(sticks, taken, 0.0), rel=RELATIVE)
    wanted = np.array([forces(*row) for row in zip(slip, across, strict=True)])
    assert force == pytest.approx(wanted, rel=RELATIVE)
    loss = call(bound, "slip_contact_loss", values)
    assert loss == pytest.approx(-(taken * spins).sum(), rel=RELATIVE)
    of_ground = call(bound, "ground_power", values)
    lost = -(force[:, 0] * speed + force[:, 1] * across).sum()
    assert loss + of_ground.sum() == pytest.approx(lost, rel=RELATIVE)

    nu_rates, wheel_rates, along = by_bodies(case, taken, force[:, 1], rates.get("axle_holding"))
    assert rates["nu_dot"] == pytest.approx(nu_rates, rel=RELATIVE, abs=RELATIVE * np.abs(nu_rates).max())
    assert rates["rates_dot"] == pytest.approx(wheel_rates, rel=RELATIVE, abs=RELATIVE * np.abs(wheel_rates).max())
    assert force[:, 0] == pytest.approx(along, rel=RELATIVE)


# Runs


def scene(number):
    """A vehicle whose massless rollers stick on one of both grounds, in half of these beside its axles."""
    rng = np.random.default_rng([31, number])
    law, wheels = ("viscous", "regularised")[number // 2 % 2], int(rng.choice((3, 4, 5)))
    vehicle = Vehicle.paper(wheels, int(rng.integers(4, 7)))
    numbers = {"coefficient": tuple(20 * 10 ** rng.uniform(-1, 0.3, 2))}
    if law == "regularised":
        numbers = {"friction": tuple(rng.uniform(0.2, 1.0, 2)), "speed": 10 ** rng.uniform(-2.5, -1)}
        numbers |= {"normal_gravity": 9.7}
    torques = 10 ** rng.uniform(-3, -1.3) * rng.uniform(0.5, 1.5, wheels)
    given = {"roller_coulomb": torques, "roller_break_away": torques * rng.choice((1.0, 1.4))}
    if number % 2:
        of_axles = 10 ** rng.uniform(-3, -0.5) * rng.uniform(0.5, 1.5, wheels)
        given |= {"wheel_coulomb": of_axles, "wheel_break_away": of_axles * rng.choice((1.0, 1.4))}
    acts = (Torque(0.2 * rng.normal(size=wheels)), TorqueTable((0.0, 0.05, 0.2), 0.3 * rng.normal(size=(3, wheels))))
    effects = [Contact(law=law, **numbers), Bearings(**given), acts[number // 4 % 2], Slope(rng.uniform(0, 0.3), 1.0)]
    return vehicle, {"nu": 2 * rng.normal(size=3), "effects": effects, "accuracy": 1e-10, **MASSLESS}


@pytest.mark.parametrize("number", [0, 3])
def test_free_rollers_tend_to_it_as_their_inertia_goes_to_zero(number):
    """At first order of their inertia: nothing of massless rollers has a part in those runs."""
    vehicle, options = scene(number)
    contact, bearings, *others = options["effects"]
    options |= {"effects": [contact, replace(bearings, roller_break_away=None), *others]}
    limit, times = simulate(vehicle, duration=0.1, **options), np.linspace(0, 0.1, 21)

    def distance(inertia):
        own = options | {"roller_model": "free", "accuracy": 1e-9}
        run = simulate(replace(vehicle, roller_inertia=inertia), duration=0.1, **own)
        return distance_at(run, limit, times)

    far, near = distance(1e-8), distance(1e-9)
    assert far < 1e-2
    assert 0.9 <= np.log10(far / near) <= 1.1
