"""Rollers whose bearings stick where wheels may slip, under the laws viscous and regularised: closed forms, every body,
and the regularised friction of the bearings as its named speed falls."""

from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting, position, solve
from reactions.test_newton_euler import call
from scipy.linalg import expm
from scipy.optimize import brentq

from contact.test_massless_rollers import contact_torques
from contact.test_newton_euler import DAMPING, RELATIVE, by_bodies, slipping_case, viscous
from omniroll import (
    Bearings,
    Contact,
    Slope,
    Vehicle,
    simulate,
)
from omniroll.kernels.kernel import kernel

CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
RADIUS, MASS, DISTANCE = CROSS.wheel_radius, CROSS.mass, CROSS.platform_radius
ROLLER, BODY, WHEEL = CROSS.roller_inertia, CROSS.yaw_inertia, CROSS.wheel_inertia
RHO = RADIUS - CROSS.roller_axis_radius  # of a roller that touches the ground in its middle
GRAVITY, INCLINE = 9.80665, 0.2
INSTANT = 1e-10  # relative, of instants in closed form
ROUNDING = 1e-13  # rad/s, spins of rollers that stick


def all_spins(run):
    """(T, N, n) relative to the disks, by place: of rollers in contact, then of the free ones."""
    return np.concatenate([run.contact_spin[..., None], run.spins], axis=-1)


def stopped(spins):
    """The row in which a spin (T,) has come to zero, but for what rounding has left."""
    return int(np.flatnonzero(np.abs(spins) <= 1e-12 * np.abs(spins).max())[0])


def test_a_free_roller_spins_down_and_sticks():
    """B w' = -T, opposite to the ground, where its disk passes the reaction on to nobody."""
    torque, speed = 6e-3, 40.0
    spins = np.zeros((4, 3))
    spins[0, 1] = speed
    run = simulate(CROSS, nu=(0, 0, 0), spins=spins, duration=0.2, roller_model="free", control=False,
                   effects=[Contact(5.0), Bearings(roller_coulomb=torque)])  # fmt: skip
    stops = ROLLER * speed / torque
    assert 0.02 < stops < 0.15
    assert run.t[stopped(run.spins[:, 0, 1])] == pytest.approx(stops, rel=INSTANT)
    assert run.spins[-1, 0, 1] == 0
    assert np.abs(run.nu).max() <= 1e-13 * speed
    assert run.ledger.contributions["roller_loss"] == pytest.approx(-ROLLER * speed**2 / 2, rel=1e-10)


def test_rollers_in_contact_spin_down_and_stick():
    """B w' = -T - c rho^2 w, of two opposite wheels whose forces the platform takes from each other."""
    c, torque, speed = 3.0, 2e-4, 60.0
    effects = [Contact(c, contact_spins=(speed, 0, speed, 0)), Bearings(roller_coulomb=torque)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=0.1, roller_model="free", effects=effects, control=False,
                   accuracy=1e-11)  # fmt: skip
    stops = np.log(1 + c * RHO**2 * speed / torque) * ROLLER / (c * RHO**2)
    assert stops < 0.08
    row = stopped(run.contact_spin[:, 0])
    assert run.t[row] == pytest.approx(stops, rel=INSTANT)
    assert np.abs(run.contact_spin[row:]).max() <= ROUNDING and np.abs(contact_torques(run)[-1]).max() <= 1e-12 * torque


def test_a_vehicle_turns_on_the_spot_with_rollers_on_their_disks():
    """Its wheels stand at first: J chi'' = -l c s and I theta'' = -N R c s with s = l chi' + R theta', as of wheels
    that are rigid, until one roller would have to follow its disk faster than its bearing takes it along."""
    c, turn, break_away, sliding = 2.0, 20.0, 1e-3, 5e-4
    yaw = turn / CROSS.yaw_scale
    at = np.array([0.1, -0.3, 0.2, 0.05])

    def run(holds):
        bearings = Bearings(roller_coulomb=sliding, roller_break_away=holds)
        return simulate(CROSS, nu=(0, 0, turn), chi=at, duration=0.05, roller_model="free", control=False,
                        effects=[Contact(c, wheel_rates=0, contact_spins=0), bearings],
                        accuracy=1e-12)  # fmt: skip

    decay = c * (RADIUS**2 / WHEEL + 4 * DISTANCE**2 / BODY)
    slip = DISTANCE * yaw

    def motion(t):
        """theta'', theta', chi', and how far wheels have turned."""
        gone = slip * (1 - np.exp(-decay * t)) / decay
        way = slip * (t - (1 - np.exp(-decay * t)) / decay) / decay
        rate = -RADIUS * c / WHEEL * gone
        return -4 * DISTANCE * c / BODY * slip * np.exp(-decay * t), yaw - 4 * DISTANCE * c / BODY * gone, rate, (
            -RADIUS * c / WHEEL * way)  # fmt: skip

    def asked(t):
        """(N, n), what takes the rollers along."""
        angular, theta_dot, rate, turned = motion(t)
        places = at[:, None] + turned + 2 * np.pi / 4 * np.arange(4)
        return ROLLER * (angular * np.sin(places) + theta_dot * rate * np.cos(places))

    whole = run(1.0)
    assert np.abs(all_spins(whole)).max() <= ROUNDING
    assert len(whole) > 1
    for t, nu, rates in zip(whole.t, whole.nu, whole.quantity("rates"), strict=True):
        _, theta_dot, rate, _ = motion(t)
        assert nu[2] / CROSS.yaw_scale == pytest.approx(theta_dot, rel=1e-11)
        assert rates == pytest.approx(np.full(4, rate), rel=1e-10)
    assert contact_torques(whole)[0] == pytest.approx(asked(0.0)[:, 0], rel=1e-12)
    times = np.linspace(0, 0.05, 2001)
    most = np.array([np.abs(asked(t)).max() for t in times])
    first = np.flatnonzero(most > break_away)[0]
    assert first > 10
    breaks = brentq(lambda t: np.abs(asked(t)).max() - break_away, times[first - 1], times[first], xtol=1e-16)
    broken = run(break_away)
    (row,) = np.flatnonzero((np.abs(all_spins(broken)) > ROUNDING).any(axis=(1, 2)))[:1]
    assert broken.t[row - 1] == pytest.approx(breaks, rel=INSTANT)


@pytest.mark.parametrize("above", [1.0, 1.5])
def test_rollers_hold_a_vehicle_along_their_axles_until_they_break_away(above):
    """All axles stick: the vehicle slides down a slope, M v' = M g sin b - 4 c v, until rho c v is what the rollers'
    bearings hold; then B w' = rho c (v - rho w) - T."""
    c, sliding, end = 6.0, 0.02, 0.25
    breaks = above * sliding
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=breaks, wheel_coulomb=3.0)
    effects = [Contact(c), bearings, Slope(INCLINE, 0.0, gravity=GRAVITY)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, roller_model="free", effects=effects,
                   accuracy=1e-11, control=False)  # fmt: skip
    fall, rate, speed = GRAVITY * np.sin(INCLINE), 4 * c / MASS, breaks / (RHO * c)
    let_go = -np.log(1 - speed * rate / fall) / rate
    assert let_go < end / 2
    spins = np.abs(run.contact_spin)
    moving = np.flatnonzero((spins > ROUNDING).any(axis=0))
    assert sorted(moving) in ([0, 2], [1, 3])
    for wheel in moving:
        first = np.flatnonzero(spins[:, wheel] > ROUNDING)[0] - 1
        assert run.t[first] == pytest.approx(let_go, rel=INSTANT)
    assert not run.quantity("rates").any() and np.abs(run.spins).max() <= ROUNDING
    matrix = np.array([
        [-rate, 2 * c * RHO / MASS, fall],
        [RHO * c / ROLLER, -(RHO**2) * c / ROLLER, -sliding / ROLLER],
        [0, 0, 0],
    ])  # fmt: skip
    wanted = expm(matrix * (end - let_go)) @ (speed, 0, 1)
    assert np.linalg.norm(run.nu[-1, :2]) * DISTANCE == pytest.approx(wanted[0], rel=1e-9)
    assert spins[-1, moving] == pytest.approx([wanted[1]] * 2, rel=1e-8)
    assert np.abs(contact_torques(run)).max() == pytest.approx(breaks, rel=1e-11)


@pytest.mark.parametrize("wheels, rollers, axles", [(2, 4, ("axle_sticking",)), (3, 5, ()), (4, 6, ("axle_sticking",))])
def test_what_holds_rollers_stops_them_in_the_equations_of_every_body(wheels, rollers, axles):
    """Newton's and Euler's equations with the torques that the kernel says give the same accelerations, and none of the
    spins of rollers that stick, in contact and not."""
    rng = np.random.default_rng([12, wheels, len(axles)])
    case = slipping_case(rng, wheels, rollers, "free", has_layout=True)
    sticks = rng.random((wheels, rollers)) < 0.6
    sticks[0, 0], sticks[-1, 0] = True, False
    stands = np.arange(wheels) % 2 == 0 if axles else np.zeros(wheels, bool)
    case = replace(case, turns=case.turns * ~sticks[:, 0], spins=case.spins * ~sticks[:, 1:],
                   rates=case.rates * ~stands)  # fmt: skip
    torques = np.where(sticks, 0.0, 0.01 * rng.normal(size=(wheels, rollers)))
    constants = (("ground_damping", DAMPING),)
    bound = kernel(case.vehicle, "free", "python", constants=constants,
                   effects=("contact", "contact_viscous", "roller_sticking", *axles))  # fmt: skip
    values = {"nu": case.nu, "chi": case.chi, "rates": case.rates, "spins": case.spins, "heading": case.heading}
    values["contact_omega"] = case.turns + case.nu[2] / case.vehicle.yaw_scale * np.sin(case.chi)
    values["axial"] = call(bound, "axial_speeds", values)
    values["momenta"] = call(bound, "momenta", values)
    values |= {"contact_sticks": sticks[:, 0].astype(float), "free_sticks": sticks[:, 1:].astype(float)}
    values |= {"contact_bearing": torques[:, 0], "free_bearing": torques[:, 1:]}
    values |= {"axle_sticks": stands.astype(float), "bearing_torque": np.zeros(wheels)}
    outputs = [argument.name for argument in bound.signatures["disk_dynamics"].outputs]
    found = dict(zip(outputs, call(bound, "disk_dynamics", values), strict=True))
    held = np.concatenate([found["contact_holding"][:, None], found["free_holding"]], axis=1)
    assert not held[~sticks].any() and np.abs(held[sticks]).min() > 0
    wheel_torques = found.get("axle_holding", np.zeros(wheels))

    def exactly(array):
        return working_precision(lambda: [[exact(t) for t in row] for row in np.atleast_2d(array)])()

    given = Acting(ground=viscous, guide=wheels != 3, roller_torques=exactly(torques + held),
                   wheel_torques=exactly(wheel_torques)[0])  # fmt: skip
    wanted = by_bodies(case, given)
    for name, other in zip(("nu_dot", "rates_dot", "contact_omega_dot"), wanted, strict=True):
        assert found[name] == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * np.abs(wanted[1]).max())
    assert not found["rates_dot"][stands].any()

    @working_precision
    def spin_accelerations():
        at = position(case.machine, case.heading, case.chi)
        loads = dict.fromkeys(range(wheels), 0) if given.guide else None
        second = solve(case.machine, at, case.speeds(), given, model="free", loads=loads).second
        return np.array([[float(v) for v in row] for row in second.phi])

    spin_dot = np.concatenate([found["contact_spin_dot"][:, None], found["spins_dot"]], axis=1)
    by_body = spin_accelerations()
    scale = np.abs(by_body).max()
    assert spin_dot == pytest.approx(by_body, rel=RELATIVE, abs=RELATIVE * scale)
    assert not spin_dot[sticks].any() and np.abs(by_body[sticks]).max() <= RELATIVE * scale
