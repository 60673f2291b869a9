"""Massless rollers whose bearings stick and have viscous friction, too, beside the law coulomb: roots in many digits,
every body, closed forms, the laws in every row, and runs without viscous friction as it goes to zero."""

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf
from reactions.test_newton_euler import call

from contact.in_steps import assert_samples_are_those_of_finer_runs
from contact.test_massless_rollers import BOTH, by_bodies
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
    contact_torques,
    first_row,
    residuals,
    scene,
)
from contact.test_newton_euler import slipping_case
from omniroll import Bearings, Contact, Slope, Vehicle, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

EPS = float(np.finfo(float).eps)
DAMPED = ("contact", "contact_coulomb", "roller_sticking", "roller_viscous")


def dragging(number, size=1.0):
    """One of the scenes of rollers that stick, whose bearings have viscous friction: at speeds of 0.03 to 3 m/s along
    the axle it is all of the ground's. `size` times that."""
    vehicle, options = scene(number)
    contact, bearings, *others = options["effects"]
    rng = np.random.default_rng([92, number])
    friction = np.array(contact.friction)[0] * vehicle.mass * GRAVITY / vehicle.wheels
    damping = size * friction * RHO**2 / 10 ** rng.uniform(-1.5, 0.5, vehicle.wheels)
    damping[rng.random(vehicle.wheels) < 0.2] = 0.0
    return vehicle, options | {"effects": [contact, replace(bearings, roller_viscous=damping), *others]}


# Roots


FLOOR = mpf(10) ** -30  # m/s, which all slips have across


def root_in_digits(pull, drag, across):
    """across t and the cosine of t/sqrt(1 + t^2) + drag across t = pull."""
    k = drag * across
    low, high = mpf(0), pull / k
    t = high if pull >= 1 else pull / mp.sqrt(1 - pull**2)
    for _ in range(300):
        left = t / mp.sqrt(1 + t * t) + k * t - pull
        low, high = (low, t) if left > 0 else (t, high)
        following = t - left / ((1 + t * t) ** mpf(-1.5) + k)
        following = following if low < following < high else (low + high) / 2
        if abs(following - t) <= mpf(10) ** -45 * t:
            break
        t = following
    return across * t, 1 / mp.sqrt(1 + t * t)


def case_of_roots(rng, kind):
    """Numbers of three contacts that slip and whose rollers turn: pulls of all sizes, or near 1, or 1 but for a
    rounding, of which dampers take any part; slips along the rolling direction of all sizes, or none."""
    chi, nu, load = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3) * 10 ** rng.uniform(-6, 1), rng.uniform(1, 9, 3)
    friction, part = rng.uniform(0.05, 1.5, (3, 2)), 10 ** rng.uniform(-9, 0, 3)
    pull = 10 ** rng.uniform(-3, 1.5, 3) if kind < 2 else 1 + rng.choice((-1, 1), 3) * 10 ** rng.uniform(-15, -1, 3)
    pull = 1 + rng.choice((-2, 0, 1), 3) * EPS if kind >= 4 else pull
    across = 0.0 if kind % 2 else rng.choice((-1, 1), 3) * 10 ** rng.uniform(-20, 1, 3)
    return chi, nu, load, friction, part, pull, across


def assert_roots(rng, kind, roundings):
    """Slips along the axle and forces across are between those of pulls and drags that are rounded so often."""
    chi, nu, load, friction, part, pull, across = case_of_roots(rng, kind)
    vehicle, none = Vehicle.paper(3, 4), np.zeros(3)
    rolling, spins = kernel(vehicle, "massless", "python").wheel_rates(nu, chi)
    rho = vehicle.wheel_radius * np.cos(chi) - vehicle.roller_axis_radius
    speed, whole = rho * spins, pull * friction[:, 0] * load
    damping = part * whole * rho**2 / np.abs(speed)
    bound = kernel(vehicle, "massless", "python", effects=DAMPED,
                   constants=(("roller_damping", tuple(damping.tolist())),))  # fmt: skip
    torque = (whole - damping / rho**2 * np.abs(speed)) * rho
    values = {"nu": nu, "chi": chi, "rates": rolling + across / vehicle.wheel_radius, "load": load}
    values |= {"friction": friction, "slip_direction": np.tile([0.0, 1.0], (3, 1)), "contact_sticks": none}
    values |= {"contact_bearing": -np.sign(speed) * torque, "ground_yield": none, "ground_push": np.zeros((3, 2))}
    force, values["damped_yield"], _ = call(bound, "damped_corners", values)
    slip, _ = call(bound, "slip_forces", values)
    more, less = 1 + roundings * mpf(EPS), 1 - roundings * mpf(EPS)
    for i in range(3):
        mu, most = mpf(friction[i, 0]), mpf(friction[i, 0]) * mpf(load[i])
        damper, w = mpf(damping[i]) / mpf(rho[i]) ** 2, mp.hypot(mpf(friction[i, 1]) * mpf(slip[i, 1]), FLOOR)
        wanted, drag = abs(damper * abs(mpf(speed[i])) + mpf(torque[i]) / mpf(rho[i])) / most, damper / (mu * most)
        least, most_cos = root_in_digits(wanted * less, drag * more, w)
        largest, least_cos = root_in_digits(wanted * more, drag * less, w)
        found, cos = abs(mpf(slip[i, 0])) * mu, abs(mpf(force[i])) / mpf(friction[i, 1]) / mpf(load[i])
        assert least * less <= found <= largest * more
        assert least_cos * less <= cos <= most_cos * more


@pytest.mark.parametrize("kind", range(6))
def test_slips_and_forces_are_roots_as_well_as_the_pull_is_known(kind):
    """By chance; without a slip along the rolling direction, and where the bearing takes just what the ground gives."""
    rng = np.random.default_rng([5, kind])
    with mp.workdps(50):
        for _ in range(20):
            assert_roots(rng, kind, 6)


# Every body


@pytest.mark.parametrize("axles", [(), ("axle_sticking",)])
@pytest.mark.parametrize("wheels, rollers", [(3, 5), (4, 6)])
@pytest.mark.parametrize("pull", [0.7, 1.6])
def test_modes_agree_with_every_body(wheels, rollers, pull, axles):
    """One contact rolls, one roller sticks, of the last wheel contact and roller move, and where the bearing takes more
    than the ground along its axle alone: Newton's and Euler's equations with the bearings' torques and the forces of
    contacts that slip give the same accelerations, and the same forces along the axles."""
    rng = np.random.default_rng([43, wheels, len(axles)])
    case = slipping_case(rng, wheels, rollers, "massless", has_layout=True)
    rigid, sticks = (np.arange(wheels) == k for k in (0, 1))
    both, alone = ~rigid & ~sticks, np.arange(wheels) == 2
    stands = rigid if axles else np.zeros(wheels, bool)
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    friction, load = np.tile([0.7, 0.3], (wheels, 1)), rng.uniform(5, 9, wheels)
    plain = kernel(case.vehicle, "massless", "python")
    rolling_rates, rolling_spins = plain.wheel_rates(case.nu, case.chi)
    speed, most = rho * rolling_spins, friction[:, 0] * load
    rolls = sticks | alone if pull > 1 else sticks
    case = replace(case, rates=np.where(rolls, rolling_rates, case.rates * ~stands))
    torque = 0.3 * most * rho
    damping = np.where(sticks, 0.2, pull - 0.3) * most * rho**2 / np.abs(speed)
    bound = kernel(case.vehicle, "massless", "python", effects=(*DAMPED, *axles),
                   constants=(("roller_damping", tuple(damping.tolist())),))  # fmt: skip
    pair = np.stack([speed, case.vehicle.wheel_radius * (case.rates - rolling_rates)], axis=1)
    size = np.sqrt(((friction * pair) ** 2).sum(axis=1))
    arc = -load[:, None] * friction**2 * pair / np.where(size > 0, size, 1)[:, None]
    values = {"nu": case.nu, "chi": case.chi, "rates": case.rates, "heading": case.heading, "load": load}
    values |= {"friction": friction, "slip_direction": np.stack([0 * rho, np.sign(pair[:, 1] + 1e-300)], axis=1)}
    values |= {"contact_sticks": rigid.astype(float), "contact_bearing": np.where(rigid, 0, -np.sign(speed) * torque)}
    values |= {"axle_sticks": stands.astype(float), "bearing_torque": np.zeros(wheels), "sticks": sticks.astype(float)}
    values |= {"directions": np.eye(3).ravel(), "absent": np.zeros(3), "ground_yield": np.zeros(wheels)}
    across, per_force, slopes = call(bound, "damped_corners", values)
    values["damped_yield"] = np.where(both, per_force, 0.0)
    values["ground_push"] = np.where(rigid[:, None], arc, np.stack([0 * rho, across], axis=1)) * ~sticks[:, None]
    outputs = [argument.name for argument in bound.signatures["bearing_dynamics"].outputs]
    found = dict(zip(outputs, call(bound, "bearing_dynamics", values), strict=True))
    slip, force = call(bound, "slip_forces", values)
    spins = found["contact_spin"]
    taken = np.where(rigid, rho * arc[:, 0], values["contact_bearing"] - damping * spins)
    assert slip[:, 0] + rho * spins == pytest.approx(speed, rel=1e-12)
    assert (spins * speed > 0)[~rigid].all() and not spins[rigid].any()
    for i in np.flatnonzero(both):
        own = np.array([taken[i] / rho[i], across[i]])
        assert np.linalg.norm(own / friction[i]) == pytest.approx(load[i], rel=1e-12)
        normal = own / friction[i] ** 2
        assert slip[i] @ normal < 0
        assert slip[i, 0] * normal[1] == pytest.approx(slip[i, 1] * normal[0], rel=1e-11, abs=1e-14)
    if pull > 1:
        left = (pull - 1) * most[2] * rho[2] ** 2 / damping[2]
        assert slip[2] == pytest.approx([np.sign(speed[2]) * left, 0], rel=1e-12, abs=1e-13)
    loss = call(bound, "slip_contact_loss", values)
    assert loss == pytest.approx(-(taken * spins).sum(), rel=1e-11)

    nu_rates, wheel_rates, along = by_bodies(case, taken, found["ground_force"][:, 1], found.get("axle_holding"))
    assert found["nu_dot"] == pytest.approx(nu_rates, rel=1e-10, abs=1e-10 * np.abs(nu_rates).max())
    assert found["rates_dot"] == pytest.approx(wheel_rates, rel=1e-10, abs=1e-10 * np.abs(wheel_rates).max())
    assert found["ground_force"][:, 0] == pytest.approx(along, rel=1e-10)


# Closed forms: two wheels of the cross are dragged along their axles, the other two roll


SLIDING, FRICTION = 0.3, 0.3  # of mu N, what the bearings take at no spin; coefficient
MOST = FRICTION * WEIGHT / 4  # of a contact
DAMPER = 2 * MOST  # N s/m
WHOLE = MASS + 2 * WHEEL / RADIUS**2  # with the two wheels that roll
BEARINGS = Bearings(roller_coulomb=SLIDING * MOST * RHO, roller_viscous=DAMPER * RHO**2)
ENDS_AT = (1 - SLIDING) * MOST / DAMPER  # m/s, where the bearing takes what the ground gives


@pytest.mark.long
@BOTH
def test_a_vehicle_is_dragged_until_its_contacts_stop_slipping_along_their_axles_and_its_rollers_stop(engine):
    """(M + 2 J/l^2) v' = -2 mu N until d v + T/rho = mu N; from there on it is -2 (d v + T/rho), until v = 0."""
    start = 0.6
    rests = (start - ENDS_AT) * WHOLE / (2 * MOST)
    torque = SLIDING * MOST
    stops = rests + WHOLE / (2 * DAMPER) * np.log(1 + DAMPER * ENDS_AT / torque)
    ground = Contact(law="coulomb", friction=FRICTION)
    run = simulate(CROSS, nu=(start / DISTANCE, 0, 0), duration=1.1 * stops, effects=[ground, BEARINGS],
                   accuracy=1e-11, engine=engine, **MASSLESS)  # fmt: skip
    assert run.stats["engine"] == engine
    speed = run.nu[:, 0] * DISTANCE
    slides = run.t < rests * (1 - 1e-9)
    assert run.slip[slides, 0, 0] == pytest.approx(speed[slides] - ENDS_AT, rel=1e-9, abs=1e-11)
    assert (np.abs(run.slip[:, 0, 1]) <= 1e-12).all() and not run.sticks[slides, 0].any()
    row = first_row(run.sticks[:, 0])
    assert run.t[row] == pytest.approx(rests, rel=INSTANT)
    assert speed[row] == pytest.approx(ENDS_AT, rel=1e-10)
    later = first_row(run.contact_spin[:, 0] <= 1e-12)
    assert run.t[later] == pytest.approx(stops, rel=INSTANT)
    assert np.abs(run.nu[-1]).max() <= 1e-12 and run.sticks[-1].all()
    assert abs(run.ledger.residual) <= 1e-10 * run.energy[0]


@pytest.mark.long
@BOTH
def test_a_slope_pulls_a_vehicle_until_its_contacts_slip_along_their_axles(engine):
    """From rest, by P > 2 mu N: (M + 2 J/l^2) v' = P - 2 (d v + T/rho) until d v + T/rho = mu N, then P - 2 mu N."""
    pull, torque, incline = 3 * MOST, SLIDING * MOST, 0.3
    falls = 2 * DAMPER / WHOLE
    rest = (pull / 2 - torque) / DAMPER
    slides = -np.log(1 - ENDS_AT / rest) / falls
    ground = Contact(law="coulomb", friction=FRICTION, normal_gravity=GRAVITY)
    slope = Slope(incline, 0.0, gravity=pull / MASS / np.sin(incline))
    end = 1.3 * slides
    effects = [ground, BEARINGS, slope]
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, effects=effects, accuracy=1e-11, engine=engine, **MASSLESS)
    speed = np.linalg.norm(run.nu[:, :2], axis=1) * DISTANCE
    dragged = first_row(np.abs(run.contact_spin[-1]) > 1)
    row = first_row(~run.sticks[:, dragged])
    assert run.t[row] == pytest.approx(slides, rel=INSTANT)
    assert speed[row] == pytest.approx(ENDS_AT, rel=1e-10)
    assert speed[-1] == pytest.approx(ENDS_AT + (pull - 2 * MOST) / WHOLE * (end - slides), rel=1e-10)
    assert np.abs(run.contact_spin[-1, dragged]) * RHO == pytest.approx(ENDS_AT, rel=1e-10)
    assert np.abs(run.slip[-1, dragged]) == pytest.approx([speed[-1] - ENDS_AT, 0], rel=1e-9, abs=1e-12)


@BOTH
def test_static_friction_holds_a_roller_that_turns_and_lets_go_along_the_axle(engine):
    """The same where static friction is 1.5 times the sliding one: it holds until d v + T/rho is that. There the
    contact slips along its axle at once, and its roller goes on turning with the speed that leaves it mu N."""
    above, pull, incline = 1.5, 4 * MOST, 0.3
    torque, breaks = SLIDING * MOST, (above - SLIDING) * MOST / DAMPER
    rest = (pull / 2 - torque) / DAMPER
    slides = -np.log(1 - breaks / rest) / (2 * DAMPER / WHOLE)
    ground = Contact(law="coulomb", friction=FRICTION, static_friction=above * FRICTION, normal_gravity=GRAVITY)
    slope = Slope(incline, 0.0, gravity=pull / MASS / np.sin(incline))
    options = MASSLESS | {"effects": [ground, BEARINGS, slope], "accuracy": 1e-12, "engine": engine}
    run = simulate(CROSS, nu=(0, 0, 0), duration=1.2 * slides, **options)
    dragged = first_row(np.abs(run.contact_spin[-1]) > 1)
    row = first_row(~run.sticks[:, dragged])
    assert run.t[row] == pytest.approx(slides, rel=INSTANT)
    assert np.abs(run.slip[row, dragged]) == pytest.approx([breaks - ENDS_AT, 0], rel=1e-9, abs=1e-12)
    assert np.abs(run.contact_spin[row:, dragged]) * RHO == pytest.approx(ENDS_AT, rel=1e-9)
    assert np.abs(run.ground_force[row:, dragged, 0]) == pytest.approx(MOST, rel=1e-10)
    speed = np.linalg.norm(run.nu[-1, :2]) * DISTANCE
    assert speed == pytest.approx(breaks + (pull - 2 * MOST) / WHOLE * 0.2 * slides, rel=1e-10)


# Runs


def laws(vehicle, options, run):
    """residuals() of the laws, by name, where bearings take c phi' beside their torque."""
    damping = np.array(options["effects"][1].roller_viscous)
    found = residuals(vehicle, options["effects"], run)
    rho = vehicle.wheel_radius * np.cos(run.chi) - vehicle.roller_axis_radius
    most = np.array(options["effects"][1].roller_coulomb)
    taken = contact_torques(run) - damping * run.contact_spin
    found["one force"] = float((np.abs(run.ground_force[..., 0] * rho - taken) / (most + np.abs(taken))).max())
    return found


def assert_rows_obey(vehicle, options, run, number, bound=LAW):
    """The laws in every row, and the ledger."""
    for name, residual in laws(vehicle, options, run).items():
        assert residual <= bound, (number, name, residual)
    lost = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    assert abs(run.ledger.residual) <= 1e-9 * lost, number


def assert_the_laws_hold(number, duration=0.2, engine="python"):
    vehicle, options = dragging(number)
    run = simulate(vehicle, duration=duration, **options | {"engine": engine})
    assert_rows_obey(vehicle, options, run, number)
    return run


@pytest.mark.parametrize("number", [8, 16])
def test_the_laws_hold_in_every_row(number):
    run = assert_the_laws_hold(number, 0.02)
    assert (~run.sticks & (np.abs(run.contact_spin) > 1e-6)).any(), "none slips and turns"


@pytest.mark.long
@pytest.mark.parametrize("number", [2, 12, 14, 17])
def test_the_laws_hold_in_every_row_of_more_scenes(number):
    assert_the_laws_hold(number, 0.05)


@pytest.mark.parametrize("end, order", [(0.03, 2), (0.3, 1)])
def test_the_smooth_law_tends_to_it_as_its_speed_goes_to_zero(end, order):
    """While all contacts slip and all rollers turn, at second order of that speed, and behind rests of contacts, of
    which one gives way again, at first: the motion there is that of another law, on the compiled engine."""
    times = np.linspace(0, end, 7)
    numbers = {"friction": FRICTION, "wheel_rates": 0, "normal_gravity": GRAVITY}
    options = MASSLESS | {"nu": (0.6 / DISTANCE, 0.4 / DISTANCE, 3.0), "duration": end, "accuracy": 1e-10}
    others = [BEARINGS, Slope(0.2, 1.0)]
    limit = simulate(CROSS, effects=[Contact(law="coulomb", **numbers), *others], **options)
    assert limit.sticks.any() == (order == 1) and (np.abs(limit.contact_spin) > 1).any(axis=0).all()

    def distance(speed):
        ground = Contact(law="regularised", speed=speed, **numbers)
        return distance_at(simulate(CROSS, effects=[ground, *others], **options), limit, times)

    far, near = distance(1e-3), distance(1e-4)
    assert far < 1e-3
    assert np.log10(far / near) == pytest.approx(order, abs=0.05)


@pytest.mark.long
def test_runs_tend_to_those_without_viscous_friction():
    """At first order of it."""
    end, times = 0.02, np.linspace(0, 0.02, 5)
    vehicle, options = scene(2)
    limit = simulate(vehicle, duration=end, engine="python", **options)
    far, near = (
        distance_at(simulate(vehicle, duration=end, **dragging(2, size)[1]), limit, times) for size in (1e-3, 1e-5)
    )
    assert 0 < far < 1e-2
    assert np.log10(far / near) == pytest.approx(2, abs=0.1)


def test_samples_between_rows_are_those_of_finer_runs():
    vehicle, options = dragging(16)
    times = np.linspace(0.001, 0.019, 7)
    assert_samples_are_those_of_finer_runs(vehicle, options | {"duration": 0.02}, times, ("slip", "contact_spin"), 1e-9)
