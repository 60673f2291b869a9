"""Massless rollers whose bearings stick beside the law coulomb: an ellipse that is cut by a strip. Closed forms, every
body, rows that were wrong once, and free rollers as their inertia goes to zero."""

from dataclasses import replace

import numpy as np
import pytest
from corpus.replay import LAWS
from reactions.test_newton_euler import call
from sensitivities.costs import task as skid_of

from contact.laws import judged
from contact.test_massless_rollers import by_bodies, contact_torques, first_row
from contact.test_newton_euler import named, slipping_case
from omniroll import Bearings, Contact, Slope, Torque, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
MASS, DISTANCE, WHEEL = CROSS.mass, CROSS.platform_radius, CROSS.wheel_inertia
RADIUS = CROSS.wheel_radius
RHO = RADIUS - CROSS.roller_axis_radius  # of a roller that touches the ground in its middle
GRAVITY = 9.80665
WEIGHT = MASS * GRAVITY
INSTANT = 1e-10  # relative, of instants in closed form
MASSLESS = {"roller_model": "massless", "control": False}


# Closed forms


@pytest.mark.parametrize("above", [1.0, 1.5])
def test_a_vehicle_is_pushed_until_its_rollers_break_away(above):
    """Two wheels push along the axles of the other two, with a torque that grows: 2 tau/l = 2 T/rho lets these rollers
    turn, and then (M + 2 J/l^2) x'' = 2 tau/l - 2 T/rho, on contacts that all stick."""
    sliding, grows, end = 0.02, 0.5, 0.3
    table = TorqueTable((0.0, end), np.array([[0, 0, 0, 0], [0, -grows * end, 0, grows * end]]))
    ground = Contact(law="coulomb", friction=0.9)
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=above * sliding)
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, effects=[ground, bearings, table], accuracy=1e-12, **MASSLESS)
    breaks = above * sliding * RADIUS / (RHO * grows)
    assert breaks < end / 2
    spins = np.abs(run.contact_spin)
    assert run.t[first_row(spins[:, 0] > 1e-12) - 1] == pytest.approx(breaks, rel=INSTANT)
    assert run.sticks.all() and not run.slip.any()
    later = end - breaks
    force = grows * (end + breaks) / RADIUS - 2 * sliding / RHO
    speed = force * later / (MASS + 2 * WHEEL / RADIUS**2)
    assert abs(run.nu[-1, 0]) * DISTANCE == pytest.approx(speed, rel=1e-10)
    assert spins[-1, [0, 2]] == pytest.approx([speed / RHO] * 2, rel=1e-10)
    assert spins[:, [1, 3]].max() <= 1e-12 * spins.max()
    assert abs(run.ledger.residual) <= 1e-10 * run.energy[-1]


def test_a_vehicle_skids_askew_until_two_rollers_stop():
    """All axles stick, and all rollers turn at first: both components of the velocity fall at 2 (T/rho + F)/M with
    F = sqrt((mu N)^2 - (T/rho)^2), until the roller that is slower along its axle has no spin: v_y = v_x tan(phi),
    with sin(phi) = T/(rho mu N)."""
    mu, torque, start = 0.4, 0.04, np.array([1.0, 0.8])
    friction, along = mu * WEIGHT / 4, torque / RHO
    sine = along / friction
    tangent = sine / np.sqrt(1 - sine**2)
    assert 0.1 < tangent < 0.6
    falls = 2 * (along + np.sqrt(friction**2 - along**2)) / MASS
    stops = (start[1] - start[0] * tangent) / (falls * (1 - tangent))
    effects = [Contact(law="coulomb", friction=mu, wheel_rates=0), Bearings(roller_coulomb=torque, wheel_coulomb=30.0)]
    nu = (*(start / DISTANCE), 0)
    run = simulate(CROSS, nu=nu, duration=stops * 1.2, effects=effects, accuracy=1e-12, **MASSLESS)
    spins = np.abs(run.contact_spin)
    assert spins[0] * RHO == pytest.approx(np.repeat([start - tangent * start[::-1]], 2, axis=0).ravel(), rel=1e-12)
    stopped = first_row(spins[:, 1] <= 1e-12 * spins[0, 1])
    assert run.t[stopped] == pytest.approx(stops, rel=INSTANT)
    row = first_row(run.t >= stops * (1 - 1e-9))
    assert run.nu[row, :2] * DISTANCE == pytest.approx(start - falls * stops, rel=1e-10)
    assert spins[row, 0] > 1 and (np.abs(contact_torques(run)[-1, [1, 3]]) < torque * 0.999).all()


def test_a_roller_stops_where_its_contact_gives_way_and_cannot_drag_it():
    """On a slope static friction holds two contacts whose rollers turn with more than sliding friction: mu N < T/rho.
    Torques that balance push them along their rolling directions until (T/rho)^2 + (tau/l)^2 = (mu_s N)^2. Behind it
    their rollers stand, and they slip along their axles, with mu N."""
    mu, above, pull, grows, incline = 0.3, 1.5, 6.0, 0.5, 0.3
    load = WEIGHT / 4
    torque = 1.2 * mu * load * RHO
    push = np.sqrt((above * mu * load) ** 2 - (torque / RHO) ** 2)
    breaks = push * RADIUS / grows
    ground = Contact(law="coulomb", friction=mu, static_friction=above * mu, normal_gravity=GRAVITY)
    bearings = Bearings(roller_coulomb=(torque, 9.0, torque, 9.0))
    table = TorqueTable((0.0, 1.0), np.array([[0.0] * 4, [grows, -grows, grows, -grows]]))
    slope = Slope(incline, 0.0, gravity=pull / MASS / np.sin(incline))
    options = MASSLESS | {"effects": [ground, bearings, table, slope]}
    run = simulate(CROSS, nu=(0, 0, 0), duration=1.01 * breaks, accuracy=1e-12, **options)
    row = first_row(~run.sticks[:, 0])
    assert run.t[row] == pytest.approx(breaks, rel=INSTANT)
    speed = (pull - 2 * torque / RHO) * breaks / (MASS + 2 * WHEEL / RADIUS**2)
    for wheel in (0, 2):
        assert abs(run.contact_spin[row - 1, wheel]) * RHO == pytest.approx(speed, rel=1e-10)
        assert np.abs(run.slip[row, wheel]) == pytest.approx([speed, 0], rel=1e-10, abs=1e-10)
        assert np.abs(run.ground_force[row, wheel]) == pytest.approx([mu * load, 0], rel=1e-10, abs=1e-10)
        assert not run.contact_spin[row:, wheel].any() and not run.sticks[row:, wheel].any()


# Every body


@pytest.mark.parametrize("wheels, rollers, axles", [(2, 4, ("axle_sticking",)), (3, 5, ()), (4, 6, ("axle_sticking",))])
def test_modes_agree_with_every_body(wheels, rollers, axles):
    """Newton's and Euler's equations with the bearings' torques and the forces of contacts that slip give the same
    accelerations, and the same forces along the axles; those that hold contacts and axles stop them."""
    rng = np.random.default_rng([41, wheels, len(axles)])
    case = slipping_case(rng, wheels, rollers, "massless", has_layout=True)
    stands = np.arange(wheels) % 2 == 0 if axles else np.zeros(wheels, bool)
    sticks = np.arange(wheels) == 1  # rolls: its roller turns
    rigid = np.arange(wheels) == 0  # its roller sticks, and slips with it
    own = ("contact", "contact_coulomb", "roller_sticking", *axles)
    bound = kernel(case.vehicle, "massless", "python", effects=own)
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    rolling_rates, rolling_spins = bound.wheel_rates(case.nu, case.chi)
    case = replace(case, rates=np.where(sticks, rolling_rates, case.rates * ~stands))
    stands &= ~sticks
    friction, load = np.tile([0.7, 0.3], (wheels, 1)), rng.uniform(5, 9, wheels)
    pair = np.stack([rho * rolling_spins, case.vehicle.wheel_radius * (case.rates - rolling_rates)], axis=1)
    size = np.sqrt(((friction * pair) ** 2).sum(axis=1))
    arc = -load[:, None] * friction**2 * pair / np.where(size > 0, size, 1)[:, None]
    taken = np.where(rigid, rho * arc[:, 0], -0.4 * np.sign(pair[:, 0]) * rho * friction[:, 0] * load)
    values = {
        "load": load,
        "friction": friction,
        "slip_direction": np.stack([0 * rho, np.sign(pair[:, 1] + 1e-300)], axis=1),
    }
    values |= {"contact_sticks": rigid.astype(float), "contact_bearing": np.where(rigid, 0.0, taken)}
    values |= {"axle_sticks": stands.astype(float), "bearing_torque": np.zeros(wheels), "sticks": sticks.astype(float)}
    values |= {"directions": np.eye(3).ravel(), "absent": np.zeros(3)}
    values = case.known(bound, **values)
    corner, per_slip = call(bound, "corner_forces", values)
    values["ground_yield"] = np.where(sticks | rigid, 0.0, per_slip)
    values["ground_push"] = np.where(rigid[:, None], arc, np.stack([0 * rho, corner], axis=1)) * ~sticks[:, None]
    found = named(bound, "bearing_dynamics", values)
    slip, force = call(bound, "slip_forces", values)
    both = ~sticks & ~rigid
    for i in np.flatnonzero(both):  # on the ellipse, against its normal, and the roller takes the rest
        mu = friction[i]
        own = np.array([taken[i] / rho[i], corner[i]])
        assert np.linalg.norm(own / mu) == pytest.approx(load[i], rel=1e-13)
        normal = own / mu**2
        assert slip[i] @ normal < 0
        assert slip[i, 0] * normal[1] == pytest.approx(slip[i, 1] * normal[0], rel=1e-12)
        assert found["ground_force"][i] == pytest.approx(own, rel=1e-13)
    assert slip[:, 0] + rho * found["contact_spin"] == pytest.approx(pair[:, 0], rel=1e-11, abs=1e-12)
    assert slip[:, 1] == pytest.approx(pair[:, 1], abs=1e-12) and not found["contact_spin"][rigid].any()
    loss = call(bound, "slip_contact_loss", values)
    assert loss == pytest.approx(-(taken * found["contact_spin"]).sum(), rel=1e-11)

    across = found["ground_force"][:, 1]
    nu_rates, wheel_rates, along = by_bodies(case, taken, across, found.get("axle_holding"))
    assert found["nu_dot"] == pytest.approx(nu_rates, rel=1e-10, abs=1e-10 * np.abs(nu_rates).max())
    assert found["rates_dot"] == pytest.approx(wheel_rates, rel=1e-10, abs=1e-10 * np.abs(wheel_rates).max())
    assert found["ground_force"][:, 0] == pytest.approx(along, rel=1e-10)
    assert np.abs(found["slip_dot"][sticks, 1]).max() <= 1e-10 * np.abs(nu_rates).max() * DISTANCE


# Runs


def scene(number):
    """A vehicle whose massless rollers stick beside contacts that do, in half of these beside its axles."""
    rng = np.random.default_rng([91, number])
    wheels = int(rng.choice((3, 4, 5)))
    vehicle = Vehicle.paper(wheels, int(rng.integers(4, 7)))
    share = vehicle.mass * GRAVITY / wheels
    friction = 10 ** rng.uniform(-0.8, 0) * np.array([1.0, rng.choice((1.0, rng.uniform(0.6, 1.7)))])
    static = friction * rng.choice((1.0, 1.3))
    torques = friction[0] * share * RHO * 10 ** rng.uniform(-1, 0.2) * rng.uniform(0.7, 1.3, wheels)
    given = {"roller_coulomb": torques, "roller_break_away": torques * rng.choice((1.0, 1.4))}
    size = friction[1] * share * RADIUS
    if number % 2:
        given["wheel_coulomb"] = size * 10 ** rng.uniform(-1, 0.3) * rng.uniform(0.7, 1.3, wheels)
    rates = tuple(5 * rng.normal(size=wheels)) if rng.random() < 0.5 else None
    acts = (Torque(size * rng.normal(size=wheels)),
            TorqueTable((0.0, 0.05, 0.2), 1.5 * size * rng.normal(size=(3, wheels))))  # fmt: skip
    numbers = {"friction": friction, "static_friction": static, "normal_gravity": GRAVITY}
    ground = Contact(law="coulomb", wheel_rates=rates, **numbers)
    effects = [ground, Bearings(**given), acts[number // 4 % 2], Slope(rng.uniform(0, 0.3), 1.0)]
    nu = tuple(2 * rng.normal(size=3)) if rng.random() < 0.7 else (0.0, 0.0, 0.0)
    return vehicle, {"nu": nu, "effects": effects, "accuracy": 1e-10, **MASSLESS}


def assert_obeys_the_laws(run, *but):
    assert {law for law, residual in judged(run).items() if not residual.max() <= LAWS} <= set(but)


def test_slips_that_keep_their_direction_come_to_rest_together():
    """Two contacts come to rest at once, each in the direction that it has kept: 4e-11 m/s are left of one where the
    other rests. In that row its direction was that of what is left, and a force 36 % beyond its ellipse."""
    vehicle, options = scene(601)
    assert_obeys_the_laws(simulate(vehicle, duration=0.2, **options))


def test_a_scene_runs_however_its_start_is_rounded():
    """A contact gives way there that is pulled by next to nothing: of starts some roundings apart a quarter stopped, as
    no step was small enough."""
    vehicle, options = scene(143)
    for number in range(24):
        roundings = np.random.default_rng([143, number]).integers(-3, 4, 3)
        nu = tuple(np.array(options["nu"]) * (1 + 4e-16 * roundings))
        assert_obeys_the_laws(simulate(vehicle, duration=0.2, **options | {"nu": nu}))


@pytest.mark.parametrize("accuracy", [1e-8, 1e-11])
def test_a_roller_stops_as_its_bearing_comes_to_take_all_of_the_friction(accuracy):
    """A wheel slips along its axle with 0.26 m/s and across it with 4e-6 m/s. As its contact moves to the middle of
    its roller, the bearing comes to take all friction but 2e-10 of it, and the spin passes zero by 1e12 rad/s^2. No
    instant is nearer to that than 2e-5 rad/s: the run stepped there on the spot."""
    options = skid_of("in series, coulomb, skid, torque") | {"duration": 1.9, "control": False}
    options.pop("sensitivities")
    run, finer = (simulate(**options | {"accuracy": given}) for given in (accuracy, 1e-12))
    before, after = np.searchsorted(run.t, (1.794, 1.79403))
    assert run.contact_spin[before, 2] < -20 and run.contact_spin[after, 2] == 0
    assert abs(run.slip[before, 2]).max() < 1e-3 and abs(run.slip[after, 2, 0]) > 0.2
    assert_obeys_the_laws(run, "roller in contact")  # such a spin is a difference over what is left of the friction
    assert distance_at(run, finer, np.linspace(0, 1.9, 7)) <= accuracy


def test_free_rollers_tend_to_it_as_their_inertia_goes_to_zero():
    """At first order of their inertia, of a vehicle whose contacts all slip and whose rollers begin to turn."""
    end, ground = 0.03, Contact(law="coulomb", friction=0.4, wheel_rates=0)
    effects = [ground, Bearings(roller_coulomb=0.04, wheel_coulomb=30.0)]
    options = {"nu": (1.0 / DISTANCE, 0.8 / DISTANCE, 3.0), "duration": end, "control": False}
    limit = simulate(CROSS, effects=effects, accuracy=1e-10, roller_model="massless", **options)
    assert (np.abs(limit.contact_spin[-1]) > 1).any() and not limit.sticks[-1].all()
    times = np.linspace(0, end, 11)

    def distance(inertia):
        from_disks = [replace(ground, contact_spins=0.0), *effects[1:]]  # where massless ones begin
        vehicle = replace(CROSS, roller_inertia=inertia)
        own = options | {"accuracy": 1e-9, "roller_model": "free"}
        run = simulate(vehicle, effects=from_disks, **own)
        return distance_at(run, limit, times)

    far, near = distance(1e-6), distance(1e-7)
    assert far < 1e-2
    assert 0.9 <= np.log10(far / near) <= 1.1
