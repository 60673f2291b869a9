"""Massless rollers whose bearings stick and have viscous friction, too, under the laws viscous and regularised: closed
forms, every body, the laws in every row, and free rollers as their inertia goes to
zero."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from mpmath import mp, mpf
from reactions.test_newton_euler import call
from scipy.integrate import quad
from scipy.optimize import brentq

from contact.in_steps import (
    assert_a_session_goes_back_to_the_bit,
    assert_a_sweep_ends_where_its_runs_end,
    assert_steps_may_end_beside,
)
from contact.test_massless_rollers import (
    CROSS,
    DISTANCE,
    GRAVITY,
    INCLINE,
    INSTANT,
    MASS,
    MASSLESS,
    RHO,
    assert_free_rollers_tend_to_it,
    by_bodies,
    contact_torques,
    first_row,
    regularised,
    scene,
    viscous,
)
from contact.test_massless_rollers_compiled import DURATION, changes
from contact.test_newton_euler import DAMPING, FADE_SPEED, FRICTION, LOAD, RELATIVE, slipping_case
from contact.test_newton_euler import LAWS as GROUNDS
from omniroll import Bearings, Contact, Slope, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

EPS = float(np.finfo(float).eps)
LAWS = ("viscous", "regularised")
DAMPED = ("contact", "contact_regularised", "roller_sticking", "roller_viscous")
BOTH_LAWS = pytest.mark.parametrize("law", LAWS)
DAMPER = 4e-4  # N m s, of the bearings in closed forms: over rho^2 that is 2.8 N s/m, beside ground of 6 N s/m


def rubbing(number, law="viscous"):
    """One of scene()'s vehicles on the ground of a law, whose rollers have viscous friction: over rho^2 up to thrice
    the ground's force per slip, where that is slow."""
    vehicle, options = scene(4 * (number // 2) + number % 2 + 2 * LAWS.index(law))
    rng = np.random.default_rng([41, number])
    contact, bearings, *others = options["effects"]
    assert contact.law == law
    rho = vehicle.wheel_radius - vehicle.roller_axis_radius
    ground = contact.coefficient[0] if law == "viscous" else friction_of(contact, vehicle) / contact.speed
    damping = ground * rho**2 * 10 ** rng.uniform(-2, 0.5, vehicle.wheels)
    damping[rng.random(vehicle.wheels) < 0.2] = 0.0
    return vehicle, options | {"effects": [contact, replace(bearings, roller_viscous=damping), *others]}


def friction_of(contact, vehicle):
    """(N,) in N, the ground's whole friction along the axles under the law regularised."""
    return contact.friction[0] * contact.loads_at_rest(vehicle)


# Closed forms


def after(time, speed, rate, rest):
    """Of v' = -rate (v - rest) from `speed`."""
    return rest + (speed - rest) * np.exp(-rate * time)


@pytest.mark.parametrize("above", [1.0, 1.5])
def test_bearings_hold_a_vehicle_on_a_slope_and_brake_it(above):
    """All axles stick. Until rho c v is what two bearings hold, M v' = M g sin b - 4 c v; from there on their contacts
    slip with (d v + T/rho)/(c + d), d = c_phi/rho^2, and their rollers have the rest of v."""
    c, sliding, end = 6.0, 0.02, 0.25
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=above * sliding, wheel_coulomb=3.0)
    bearings = replace(bearings, roller_viscous=DAMPER)
    effects = [Contact(c), bearings, Slope(INCLINE, 0.0, gravity=GRAVITY)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, effects=effects, accuracy=1e-12, **MASSLESS)
    fall, stuck, d = GRAVITY * np.sin(INCLINE), 4 * c / MASS, DAMPER / RHO**2
    speed = above * sliding / (RHO * c)
    let_go = -np.log(1 - speed * stuck / fall) / stuck
    assert let_go < end / 2
    spins = np.abs(run.contact_spin)
    moving = np.flatnonzero((spins > 1e-9).any(axis=0))
    assert sorted(moving) in ([0, 2], [1, 3])
    for wheel in moving:
        assert run.t[first_row(spins[:, wheel] > 1e-9) - 1] == pytest.approx(let_go, rel=INSTANT)
    turning = (2 * c + 2 * c * d / (c + d)) / MASS
    rest = (fall - 2 * c / (c + d) * sliding / (RHO * MASS)) / turning
    wanted = after(end - let_go, speed, turning, rest)
    assert np.linalg.norm(run.nu[-1, :2]) * DISTANCE == pytest.approx(wanted, rel=1e-10)
    slip = (d * wanted + sliding / RHO) / (c + d)
    assert spins[-1, moving] == pytest.approx([(wanted - slip) / RHO] * 2, rel=1e-10)
    assert np.abs(run.slip[-1, moving, 0]) == pytest.approx([slip] * 2, rel=1e-10)


def test_rollers_that_turn_stop_on_their_disks():
    """Two wheels slip along their rolling directions, and the rollers of two turn, M v' = -2 c v - 2 c s with the slip
    s = (d v + T/rho)/(c + d), until c v = T/rho; then M v' = -4 c v."""
    c, torque, start, end = 6.0, 0.02, 1.0, 1.2
    effects = [Contact(c, wheel_rates=0), Bearings(roller_coulomb=torque, roller_viscous=DAMPER, wheel_coulomb=3.0)]
    options = {"duration": end, "effects": effects, "accuracy": 1e-12, **MASSLESS}
    run = simulate(CROSS, nu=(start / DISTANCE, 0, 0), **options)
    d, rests = DAMPER / RHO**2, torque / (RHO * c)
    rate = (2 * c + 2 * c * d / (c + d)) / MASS
    drag = 2 * c / (c + d) * torque / (RHO * MASS) / rate
    stops = np.log((start + drag) / (rests + drag)) / rate
    assert 0.05 < stops < end / 2
    spins = np.abs(run.contact_spin).max(axis=1)
    assert spins[0] == pytest.approx((c * start - torque / RHO) / (RHO * (c + d)), rel=1e-12)
    assert run.t[first_row(spins < 1e-9)] == pytest.approx(stops, rel=INSTANT)
    wanted = rests * np.exp(-4 * c / MASS * (end - stops))
    assert run.nu[-1, 0] * DISTANCE == pytest.approx(wanted, rel=1e-10)
    assert abs(run.ledger.residual) <= 1e-10 * run.energy[0]


@pytest.mark.parametrize("damping", [2e-6, 4e-4])
def test_rollers_that_turn_stop_on_sliding_ground(damping):
    """M v' = -2 F(v) - 2 F(s) with F(s) = mu N s/sqrt(s^2 + w^2), and v = s + (F(s) - T/rho)/d, until F(v) = T/rho. In
    the slip s as the variable that is an integral."""
    mu, named, torque, start = 0.4, 0.02, 0.03, 0.5
    ground = Contact(law="regularised", friction=mu, speed=named, normal_gravity=GRAVITY, wheel_rates=0)
    effects = [ground, Bearings(roller_coulomb=torque, roller_viscous=damping, wheel_coulomb=3.0)]
    load, d, held = MASS * GRAVITY / 4, damping / RHO**2, torque / RHO

    def force(slip):
        return mu * load * slip / np.hypot(slip, named)

    def speed(slip):
        return slip + (force(slip) - held) / d

    def time_by(slip):
        rises = 1 + mu * load * named**2 / np.hypot(slip, named) ** 3 / d
        return MASS * rises / (2 * force(speed(slip)) + 2 * force(slip))

    part = held / (mu * load)
    assert part < 0.95
    slowest = named * part / np.sqrt(1 - part**2)
    first = brentq(lambda slip: speed(slip) - start, slowest, start, xtol=1e-300, rtol=1e-15)
    stops, _ = quad(time_by, slowest, first, epsabs=0, epsrel=1e-13, limit=200)
    options = {"duration": 1.5 * stops, "effects": effects, "accuracy": 1e-12, **MASSLESS}
    run = simulate(CROSS, nu=(start / DISTANCE, 0, 0), **options)
    spins = np.abs(run.contact_spin).max(axis=1)
    assert spins[0] == pytest.approx((start - first) / RHO, rel=1e-10)
    assert run.t[first_row(spins < 1e-9)] == pytest.approx(stops, rel=INSTANT)
    assert abs(run.ledger.residual) <= 1e-10 * run.energy[0]


def test_what_bearings_take_is_of_both_kinds():
    """The ledger's loss is T |phi'| + c phi'^2, added up over finely sampled rows."""
    c, torque, end = 6.0, 0.02, 0.2
    effects = [Contact(c, wheel_rates=0), Bearings(roller_coulomb=torque, roller_viscous=DAMPER, wheel_coulomb=3.0)]
    options = {"duration": end, "effects": effects, "accuracy": 1e-12, **MASSLESS}
    run = simulate(CROSS, nu=(1 / DISTANCE, 0, 0), **options)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    spins = np.array([run.sample(end * (1 + node) / 2).contact_spin for node in nodes])
    power = (torque * np.abs(spins) + DAMPER * spins**2).sum(axis=1)
    assert (np.abs(spins).max(axis=1) > 1).all()
    assert -run.ledger.contributions["roller_loss"] == pytest.approx(end / 2 * weights @ power, rel=1e-9)


# Every body


def series(forces, speed, across, rho, torque, damping):
    """Of a wheel that moves with `speed` along its axle: the slip along it, the spin and the bearing's torque. The slip
    is found by bisection, where the ground's force times rho is what the bearing takes."""
    sign = np.sign(speed)

    def left(slip):
        return rho * abs(forces(slip, across)[0]) - torque - damping * abs(speed - slip) / rho

    slip = speed if left(speed) <= 0 else brentq(left, 0.0, speed, xtol=1e-300, rtol=1e-15)
    spin = (speed - slip) / rho
    return slip, spin, -sign * torque - damping * spin


@pytest.mark.parametrize("axles", [(), ("axle_sticking",)])
@BOTH_LAWS
@pytest.mark.parametrize("wheels, rollers", [(2, 4), (3, 5), (4, 6)])
def test_modes_agree_with_every_body(wheels, rollers, law, axles):
    rng = np.random.default_rng([23, wheels, len(axles)])
    ground, forces = f"contact_{law}", {"viscous": viscous, "regularised": regularised}[law]
    case = slipping_case(rng, wheels, rollers, "massless", has_layout=True)
    stands = np.arange(wheels) % 2 == 0 if axles else np.zeros(wheels, bool)
    case = replace(case, nu=case.nu * (0.1 if law == "viscous" else 0.01), rates=case.rates * ~stands * 0.1)
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    damping = tuple(DAMPING[0] * rho**2 * 10 ** rng.uniform(-1, 1, wheels))
    constants = (*GROUNDS[ground].items(), ("roller_damping", damping))
    effects = ("contact", ground, "roller_sticking", "roller_viscous", *axles)
    bound = kernel(case.vehicle, "massless", "python", constants=constants, effects=effects)
    rolling_rates, rolling_spins = bound.wheel_rates(case.nu, case.chi)
    speed, across = rho * rolling_spins, case.vehicle.wheel_radius * (case.rates - rolling_rates)
    sticks = np.arange(wheels) % 2 == 0
    asked = rho * np.array([abs(forces(*own)[0]) for own in zip(speed, across, strict=True)])
    torques = 0.4 * asked
    found = np.array([series(forces, *row) for row in zip(speed, across, rho, torques, damping, strict=True)])
    slip, spin, taken = np.where(sticks, [speed, 0 * speed, -np.sign(speed) * asked], found.T)
    assert (spin[~sticks] * speed[~sticks] > 0).all()
    values = {"nu": case.nu, "chi": case.chi, "rates": case.rates, "heading": case.heading}
    values |= {"contact_sticks": sticks.astype(float)}
    values |= {"contact_bearing": np.where(sticks, 0.0, -np.sign(speed) * torques)}
    values |= {"axle_sticks": stands.astype(float), "bearing_torque": np.zeros(wheels)}
    outputs = [argument.name for argument in bound.signatures["slip_dynamics"].outputs]
    rates = dict(zip(outputs, call(bound, "slip_dynamics", values), strict=True))
    shown, force = call(bound, "slip_forces", values)
    spins, held = call(bound, "slip_spins", values)
    assert shown == pytest.approx(np.stack([slip, across], axis=1), rel=RELATIVE)
    assert spins == pytest.approx(spin, rel=RELATIVE) and not spins[sticks].any()
    assert held == pytest.approx(np.where(sticks, taken, 0.0), rel=RELATIVE)
    loss = call(bound, "slip_contact_loss", values)
    assert loss == pytest.approx(-(taken * spin).sum(), rel=RELATIVE)
    lost = -(force[:, 0] * speed + force[:, 1] * across).sum()
    assert loss + call(bound, "ground_power", values).sum() == pytest.approx(lost, rel=RELATIVE)

    nu_rates, wheel_rates, along = by_bodies(case, taken, force[:, 1], rates.get("axle_holding"))
    assert rates["nu_dot"] == pytest.approx(nu_rates, rel=RELATIVE, abs=RELATIVE * np.abs(nu_rates).max())
    assert rates["rates_dot"] == pytest.approx(wheel_rates, rel=RELATIVE, abs=RELATIVE * np.abs(wheel_rates).max())
    assert force[:, 0] == pytest.approx(along, rel=RELATIVE)


@pytest.mark.parametrize("ratio", [1e-8, 1.0, 1e8])
def test_slip_and_spin_have_all_digits_whichever_is_small(ratio):
    """Of the ground's coefficient the bearing's damper over rho^2 is `ratio`. Beside fractions, to 16 roundings."""
    chi, nu, torque = np.zeros(4), np.array([0.3, -0.2, 0.1]), 1e-3
    constants = (("ground_damping", DAMPING), ("roller_damping", ratio * DAMPING[0] * RHO**2))
    effects = ("contact", "contact_viscous", "roller_sticking", "roller_viscous")
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=effects)
    speed = RHO * bound.wheel_rates(nu, chi)[1]
    values = {"nu": nu, "chi": chi, "rates": np.zeros(4), "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -np.sign(speed) * torque, "bearing_torque": np.zeros(4)}
    (slips, forces), (spins, _) = call(bound, "slip_forces", values), call(bound, "slip_spins", values)
    c, damping, rho = (Fraction(number) for number in (DAMPING[0], constants[1][1], RHO))
    for i, v in enumerate(map(Fraction, speed)):
        own = -Fraction(torque) if v > 0 else Fraction(torque)
        slip = (damping / rho**2 * v - own / rho) / (c + damping / rho**2)
        for found, wanted in ((slips[i, 0], slip), (spins[i], (v - slip) / rho), (forces[i, 0], -c * slip)):
            assert abs(Fraction(found) / wanted - 1) <= 16 * np.finfo(float).eps


@pytest.mark.parametrize("part", [0.0, 0.5, 1 - 1e-6, 1.0, 1 + 1e-6, 2.0, 1e3])
@pytest.mark.parametrize("drag", [0.0, 1e-12, 1e-6, 1e-3, 1.0, 1e6])
def test_slips_are_the_roots_as_well_as_the_pull_is_known(part, drag):
    """The ground and the damper d take P = d v + T/rho together; of the ground's whole friction A that is `part`, at
    least nearly, and d times the slip velocity where friction fades is `drag`. Beside roots in 40 digits; all bearings
    have a drag of 1e-24 beside."""
    law = {"contact_load": LOAD, "ground_friction": FRICTION, "ground_fade_speed": FADE_SPEED}
    whole, slow = FRICTION[0] * LOAD, np.sqrt(np.prod(FRICTION)) * FADE_SPEED / FRICTION[0]
    damping = drag * whole / slow * RHO**2
    constants = (*law.items(), ("roller_damping", damping))
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=DAMPED)
    nu, chi = np.array([0.3, -0.2, 0.1]) * min(1.0, 0.5 * part / max(drag, 1e-6)), np.zeros(4)
    rates, spins = bound.wheel_rates(nu, chi)
    speed = RHO * spins
    torque = np.sign(speed) * RHO * (part * whole - damping / RHO**2 * np.abs(speed))
    values = {"nu": nu, "chi": chi, "rates": rates, "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -torque, "bearing_torque": np.zeros(4)}
    slips, forces = call(bound, "slip_forces", values)
    assert np.isfinite(slips).all() and np.isfinite(forces).all()
    if drag == 0.0 and part >= 1.0:
        return  # there is no root
    with mp.workdps(40):
        mu, d = mpf(FRICTION[0]), mpf(damping) / mpf(RHO) ** 2
        fade = mu * mpf(FRICTION[1]) * mpf(FADE_SPEED) ** 2
        for slip, v, own in zip(map(mpf, slips[:, 0]), map(mpf, speed), map(mpf, torque), strict=True):
            pull, size = d * v + own / mpf(RHO), mp.sqrt((mu * slip) ** 2 + fade)
            left = mpf(LOAD) * mu**2 * slip / size + d * slip - pull
            slope = mpf(LOAD) * mu**2 * fade / size**3 + d
            least = mpf(10) ** -24 * mpf(whole) * mu * abs(slip) / mp.sqrt(fade)
            assert abs(left) <= 16 * EPS * (abs(slip) * slope + abs(pull)) + least


# Runs


@BOTH_LAWS
@pytest.mark.parametrize("number", [0, 2, 3])
def test_the_laws_hold_in_every_row(number, law):
    vehicle, options = rubbing(number, law)
    run = simulate(vehicle, duration=DURATION, **options)
    assert_laws(vehicle, options, run)
    spins = np.abs(run.contact_spin)
    assert (spins > 1e-3 * spins.max()).any() and (spins <= 1e-9 * spins.max()).any()


def of_ground(contact, vehicle, slip):
    """(T, N, 2) in N, the law's forces at slips (T, N, 2) in m/s."""
    if contact.law == "viscous":
        return -slip * np.array(contact.coefficient)
    mu, load = np.array(contact.friction), contact.loads_at_rest(vehicle)[:, None]
    return -load * mu**2 * slip / np.sqrt(((mu * slip) ** 2).sum(axis=-1, keepdims=True) + mu.prod() * contact.speed**2)


def assert_laws(vehicle, options, run, bound=1e-12):
    """The ground's force along the axle is that of the law, and the bearing's torque over rho: no more than it holds,
    or the sliding torque against the spin and c phi' beside that."""
    contact, bearings = options["effects"][:2]
    rho = vehicle.wheel_radius * np.cos(run.chi) - vehicle.roller_axis_radius
    taken, slip, force, spins = contact_torques(run), run.slip, run.ground_force, run.contact_spin
    of_bearing = taken - np.array(bearings.roller_viscous) * spins
    assert np.abs(force[..., 0] * rho - of_bearing).max() <= bound * np.abs(of_bearing).max()
    assert np.abs(force - of_ground(contact, vehicle, slip)).max() <= bound * np.abs(force).max()
    along = kernel(vehicle, "massless", "python").wheel_rates(run.nu, run.chi)[1] * rho
    scale = np.abs(along).max()
    assert np.abs(slip[..., 0] + rho * spins - along).max() <= bound * scale
    sliding, holding = np.array(bearings.roller_coulomb), np.array(bearings.roller_break_away)
    turns = np.abs(spins) * rho > 1e-9 * scale
    assert (np.abs(taken) <= holding * (1 + 1e-6)).all()
    assert np.abs(np.where(turns, taken + np.sign(spins) * sliding, 0.0)).max() <= bound * sliding.max()
    lost = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-9 * lost


@BOTH_LAWS
@pytest.mark.parametrize("number", [0, 3])
def test_free_rollers_tend_to_it_as_their_inertia_goes_to_zero(number, law):
    assert_free_rollers_tend_to_it(*rubbing(number, law))


@BOTH_LAWS
@pytest.mark.parametrize("number", [0, 3])
def test_without_viscous_friction_it_is_what_it_was(number, law):
    """At first order of the coefficient; where that is 0, to rounding."""
    vehicle, options = rubbing(number, law)
    contact, bearings, *others = options["effects"]

    def run(damping):
        effects = [contact, replace(bearings, roller_viscous=damping), *others]
        return simulate(vehicle, duration=0.1, **options | {"effects": effects})

    plain, times = run(None), np.linspace(0, 0.1, 11)
    far, near, none = (distance_at(run(damping), plain, times) for damping in (1e-6, 1e-7, 0.0))
    assert 1e-9 < far < 1e-2 and 0.98 <= np.log10(far / near) <= 1.02
    assert none <= 1e-11


@pytest.mark.parametrize("law, number", [("viscous", 3), ("regularised", 1)])
def test_a_session_is_the_run_and_goes_back_to_the_bit(law, number):
    vehicle, own = rubbing(number, law)
    run = simulate(vehicle, duration=DURATION, **own)
    own.pop("control")
    assert_a_session_goes_back_to_the_bit(vehicle, run, number, **own)
    instants = np.unique(np.concatenate([found for found, _ in changes(run)]))
    instants = instants[(instants > 1e-3) & (instants < 0.9 * DURATION)]
    assert len(instants) >= 3
    own |= {"accuracy": 1e-12}
    assert_steps_may_end_beside(vehicle, simulate(vehicle, duration=DURATION, **own), instants[:2], **own)


@BOTH_LAWS
def test_a_sweep_ends_where_its_runs_end(law):
    vehicle, own = rubbing(2, law)
    assert_a_sweep_ends_where_its_runs_end(vehicle, own | {"duration": DURATION})


@BOTH_LAWS
def test_beside_bearings_that_do_not_stick_contacts_do_not_slip_along_their_axles(law):
    constants = (*GROUNDS[f"contact_{law}"].items(), ("roller_damping", DAMPER))
    effects = ("contact", f"contact_{law}", "roller_viscous")
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=effects)
    slip, _ = call(bound, "slip_forces", {"nu": np.array([0.3, -0.2, 0.1]), "chi": np.zeros(4), "rates": np.zeros(4)})
    assert not slip[:, 0].any() and slip[:, 1].all()
