"""Each element of friction in closed form: contacts under each law, axles and rollers, that slip, come to rest, stick
and let go, on free rollers and on massless ones in series with the ground."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from omniroll import Bearings, Contact, Slope, Torque, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel

PAIR = Vehicle.paper(2, 5).replace(wheel_angles=(0.0, np.pi))  # two wheels that face each other
CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
RADIUS, MASS, ARM, WHEEL = CROSS.wheel_radius, CROSS.mass, CROSS.platform_radius, CROSS.wheel_inertia
RHO, ROLLER = RADIUS - CROSS.roller_axis_radius, CROSS.roller_inertia  # of a roller that touches in its middle
GRAVITY, WEIGHT = 9.80665, MASS * 9.80665
INSTANT = 1e-10  # relative, of instants in closed form
CLOSED = 1e-8  # of the closed forms, at the accuracy 1e-9 of the runs
HOLDS = 9.0  # N m, more than any bearing is asked for
STILL = (0, 0, 0)
MODELS = pytest.mark.parametrize("model", ["massless", "free"])


def run_of(effects, duration, nu=STILL, model="massless", **options):
    """A run of the cross."""
    return simulate(CROSS, nu=nu, duration=duration, roller_model=model, effects=effects,
                    **{"accuracy": 1e-12, "control": False} | options)  # fmt: skip


def instants(run, wheel, sticks):
    """When the contact of a wheel begins to stick, or to slip."""
    mode = run.sticks[:, wheel]
    return run.t[1:][(mode[1:] != mode[:-1]) & (mode[1:] == sticks)]


def changes(run, wheel):
    """When an axle begins to turn, or stops."""
    stands = run.quantity("rates")[:, wheel] == 0
    turned = np.flatnonzero(stands[1:] != stands[:-1])
    return [run.t[k] if stands[k] else run.t[k + 1] for k in turned]  # the last row at rest, or the first


def torques_of(run, bearing="bearing_torque"):
    """(T, N) in N m, what the bearings of axles take in each row, or those of rollers, "contact_bearing"."""
    return run.drive[:, run.effects.drives().index(bearing)]


def first_row(happens):
    return int(np.flatnonzero(happens)[0])


# ---- contacts --------------------------------------------------------------------------------------------------------


@MODELS
def test_a_skidding_vehicle_spins_its_wheels_up_until_it_rolls(model):
    """It starts across its axles while the wheels stand: s' = -k, k = mu load (2/M + l^2/J), and then nothing slips."""
    speed, load, friction = 6.0, 10.0, 0.4
    ground = Contact(law="coulomb", friction=friction, load=load, wheel_rates=0)
    run = simulate(PAIR, nu=(0, speed, 0), duration=0.05, effects=[ground], roller_model=model, control=False)
    strength = friction * load * (2 / PAIR.mass + PAIR.wheel_radius**2 / PAIR.wheel_inertia)
    start = PAIR.platform_radius * speed
    rolls = start / strength
    assert [*instants(run, 0, True), *instants(run, 1, True)] == pytest.approx([rolls, rolls], rel=INSTANT)
    after = run.slip[run.t > rolls * (1 + INSTANT)]
    assert after.size and not after.any()
    assert start - PAIR.platform_radius * run.nu[-1, 1] == pytest.approx(
        2 * friction * load * rolls / PAIR.mass, rel=1e-9
    )
    assert -run.contributions()["ground_loss"][-1] == pytest.approx(friction * load * start * rolls, rel=1e-9)
    assert run.ledger.residual == pytest.approx(0, abs=1e-9 * run.energy[0])


@MODELS
def test_a_growing_torque_breaks_wheels_away(model):
    """Opposite torques T t drive the pair along; each wheel asks the ground for T t/l/(1 + 2 J/(M l^2))."""
    load, friction, growth = 10.0, 0.4, 2.0
    ground = Contact(law="coulomb", friction=friction, load=load)
    ramp = TorqueTable((0.0, 1.0), ((0, 0), (growth, -growth)))
    run = simulate(PAIR, nu=(0, 0, 0), duration=0.2, roller_model=model, effects=[ground, ramp], control=False)
    radius, inertia, mass = PAIR.wheel_radius, PAIR.wheel_inertia, PAIR.mass
    expected = friction * load * radius * (1 + 2 * inertia / (mass * radius**2)) / growth
    assert expected < 0.19
    assert [*instants(run, 0, False), *instants(run, 1, False)] == pytest.approx([expected, expected], rel=INSTANT)
    assert np.abs(run.slip[-1, :, 1]).min() > 1e-3
    assert np.abs(run.ground_force[-1, :, 1]) == pytest.approx([friction * load] * 2, rel=1e-12)


def test_static_friction_holds_and_sliding_friction_does_not():
    """One wheel alone is pushed beyond its static friction: it slips at once, under the sliding friction."""
    law = {"law": "coulomb", "friction": 0.3, "static_friction": 0.5, "load": 10.0}
    radius, inertia, mass = PAIR.wheel_radius, PAIR.wheel_inertia, PAIR.mass
    torque = 10.0 * radius * (1 + 2 * inertia / (mass * radius**2))  # asks for the whole load
    for part, sticks in ((0.49, True), (0.51, False)):
        drive = Torque((part * torque, -part * torque))
        run = simulate(
            PAIR, nu=(0, 0, 0), duration=0.01, roller_model="massless", effects=[Contact(**law), drive], control=False
        )
        assert (run.sticks == sticks).all()
        force = 10 * part if sticks else 3.0
        assert np.abs(run.ground_force[:, :, 1]) == pytest.approx(np.full((len(run), 2), force), rel=1e-12)


@pytest.mark.parametrize("load, follows", [(10.4, True), (10.8, False)])
def test_who_exceeds_static_friction_slips_and_the_others_are_asked_again(load, follows):
    """A growing torque asks two wheels for the same force until the first slips, at F = 5 N, with 1 N from then on.

    The other then has to hold 5.37 N, for the vehicle is slower than it rolled, and hardly turns. It lets go at the
    same instant, in a second round, where its static friction is 5.2 N, and holds where that is 5.4 N. Neither sticks
    again.
    """
    vehicle = PAIR.replace(yaw_inertia=1.0)
    radius, inertia, mass = vehicle.wheel_radius, vehicle.wheel_inertia, vehicle.mass
    effects = [
        Contact(law="coulomb", friction=0.1, static_friction=0.5, load=(10.0, load)),
        TorqueTable((0.0, 1.0), ((0, 0), (2.0, -2.0))),
    ]
    run = simulate(vehicle, nu=(0, 0, 0), duration=0.25, roller_model="massless", effects=effects, control=False)
    instant = 5.0 * radius * (1 + 2 * inertia / (mass * radius**2)) / 2.0
    straight, turning = 1 / mass, vehicle.platform_radius**2 / vehicle.yaw_inertia
    share = inertia / radius**2
    other = (2.0 * instant / radius - share * 1.0 * (straight - turning)) / (1 + share * (straight + turning))
    assert 5.2 < other < 5.4
    assert instants(run, 0, False) == pytest.approx([instant], rel=INSTANT)
    last, first = np.flatnonzero(np.abs(run.t - instant) <= INSTANT * instant)
    assert np.abs(run.ground_force[last, :, 1]) == pytest.approx([5.0, 5.0], rel=1e-9)
    assert np.abs(run.ground_force[first, :, 1]) == pytest.approx([1.0, 0.1 * load if follows else other], rel=1e-9)
    assert run.sticks[first].tolist() == [False, not follows]
    (then,) = instants(run, 1, False)
    assert then == pytest.approx(instant, rel=INSTANT) if follows else then > 1.001 * instant
    assert not instants(run, 0, True).size and not instants(run, 1, True).size


def test_the_ground_spins_a_roller_up():
    """Along the axles, wheels at rest: s' = -c (2/M + rho^2/B) s in the middle of the rollers."""
    speed, c, end = 2.0, 0.3, 0.01
    run = simulate(PAIR, nu=(speed, 0, 0), duration=end, effects=[Contact((c, 7.0), contact_spins=0)])
    rho = PAIR.wheel_radius - PAIR.roller_axis_radius
    decay = c * (2 / PAIR.mass + rho**2 / PAIR.roller_inertia)
    slip = PAIR.platform_radius * speed * np.exp(-decay * run.t)
    assert decay * end > 0.3
    assert run.slip[:, 0, 0] == pytest.approx(slip, abs=CLOSED * slip[0])
    assert run.contact_spin[:, 0] == pytest.approx(
        (PAIR.platform_radius * run.nu[:, 0] - slip) / rho, rel=1e-8, abs=1e-6
    )


def test_loads_at_rest():
    """Three wheels determine them; four share by the least norm; a given load stands."""
    paper = Vehicle.paper()
    aside = paper.replace(center_of_mass=(0.03, -0.01))
    ground = Contact(law="regularised", friction=0.5, speed=1e-2)
    loads = ground.loads_at_rest(aside)
    angles = np.array(paper.wheel_angles)
    places = paper.platform_radius * np.stack([np.cos(angles), np.sin(angles)])
    assert loads.sum() == pytest.approx(paper.mass * GRAVITY, rel=1e-14)
    assert places @ loads == pytest.approx(paper.mass * GRAVITY * np.array([0.03, -0.01]), rel=1e-12)
    four = Vehicle.paper(4, 5).replace(center_of_mass=(0.02, 0.0))
    spare = np.array([1, -1, 1, -1])
    assert ground.loads_at_rest(four) @ spare == pytest.approx(0, abs=1e-12)
    assert Contact(law="regularised", friction=0.5, speed=1e-2, load=3.0).loads_at_rest(PAIR).tolist() == [3.0, 3.0]


# ---- axles -----------------------------------------------------------------------------------------------------------


@MODELS
def test_wheels_that_spin_on_the_spot_come_to_rest(model):
    """Opposite wheels turn against each other, so that the vehicle stays: J w' = -T - c l^2 w, then nothing moves."""
    c, torque, speed = 3.0, 0.03, 12.0
    effects = [Contact(c, wheel_rates=(speed, -speed, speed, -speed)), Bearings(wheel_coulomb=torque)]
    run = run_of(effects, 0.2, model=model, chi=(0.5, -0.5, 0.5, -0.5))
    decay = c * RADIUS**2 / WHEEL
    stops = np.log(1 + c * RADIUS**2 * speed / torque) / decay
    assert len(run.switches) >= 4 and stops < 0.15
    for wheel in range(4):
        assert changes(run, wheel) == [pytest.approx(stops, rel=INSTANT)]
    assert np.abs(run.nu).max() <= 1e-12 * speed
    assert run.energy[-1] <= 1e-20 and abs(run.ledger.residual) <= 1e-10 * run.energy[0]
    assert np.abs(torques_of(run)[-1]).max() <= 1e-14 * torque


def test_a_growing_torque_breaks_an_axle_away():
    """At b t = S, and where the torque falls back below T long before it would turn the wheel back, it stops."""
    grows, breaks, sliding = 0.5, 0.06, 0.04
    table = TorqueTable((0.0, 0.2, 0.4), ((0, 0, 0, 0), (0.2 * grows, 0, 0, 0), (0, 0, 0, 0)))
    effects = [Contact(4.0), Bearings(wheel_coulomb=sliding, wheel_break_away=breaks), table]
    run = run_of(effects, 0.4, accuracy=1e-9)
    begins, stops = changes(run, 0)
    assert begins == pytest.approx(breaks / grows, rel=INSTANT)
    (row,) = np.flatnonzero(run.t == begins)[:1]
    assert torques_of(run)[row, 0] == pytest.approx(-breaks, rel=1e-11)
    assert torques_of(run)[row + 1, 0] == -sliding
    assert 0.2 < stops < 0.4 and not run.quantity("rates")[-1, 0]


# ---- free rollers ----------------------------------------------------------------------------------------------------


def test_a_free_roller_spins_down_and_sticks():
    """B w' = -T, opposite to the ground, where its disk passes the reaction on to nobody."""
    torque, speed = 6e-3, 40.0
    spins = np.zeros((4, 3))
    spins[0, 1] = speed
    run = run_of([Contact(5.0), Bearings(roller_coulomb=torque)], 0.2, model="free", spins=spins)
    stops = ROLLER * speed / torque
    assert 0.02 < stops < 0.15
    spin = np.abs(run.spins[:, 0, 1])
    assert run.t[np.flatnonzero(spin <= 1e-12 * speed)[0]] == pytest.approx(stops, rel=INSTANT)
    assert run.spins[-1, 0, 1] == 0
    assert np.abs(run.nu).max() <= 1e-13 * speed
    assert run.ledger.contributions["roller_loss"] == pytest.approx(-ROLLER * speed**2 / 2, rel=1e-10)


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
                  Bearings(wheel_coulomb=breaks, roller_coulomb=turns), slope], 0.01, model="free",
                 accuracy=1e-11)  # fmt: skip
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


# ---- massless rollers, in series with the ground ---------------------------------------------------------------------


def after(time, speed, rate, rest):
    """Of v' = -rate (v - rest) from `speed`."""
    return rest + (speed - rest) * np.exp(-rate * time)


@pytest.mark.parametrize("above", [1.0, 1.5])
@pytest.mark.parametrize("damper", [0.0, 4e-4])
def test_bearings_hold_a_vehicle_on_a_slope_and_brake_it(damper, above):
    """All axles stick. Until rho c v is what two bearings hold, M v' = M g sin b - 4 c v; from there on their contacts
    slip with (d v + T/rho)/(c + d), d = c_phi/rho^2, and their rollers have the rest of v."""
    c, sliding, end = 6.0, 0.02, 0.25
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=above * sliding, wheel_coulomb=3.0)
    bearings = replace(bearings, roller_viscous=damper) if damper else bearings
    effects = [Contact(c), bearings, Slope(0.2, 0.0, gravity=GRAVITY)]
    run = run_of(effects, end)
    fall, stuck, d = GRAVITY * np.sin(0.2), 4 * c / MASS, damper / RHO**2
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
    assert np.linalg.norm(run.nu[-1, :2]) * ARM == pytest.approx(wanted, rel=1e-10)
    slip = (d * wanted + sliding / RHO) / (c + d)
    assert spins[-1, moving] == pytest.approx([(wanted - slip) / RHO] * 2, rel=1e-10)
    assert np.abs(run.slip[-1, moving, 0]) == pytest.approx([slip] * 2, rel=1e-10)
    most = above * sliding if damper == 0 else above * sliding + damper * spins.max()
    assert above * sliding <= np.abs(torques_of(run, "contact_bearing")).max() * (1 + 1e-10) <= most * (1 + 2e-10)
    assert not run.quantity("rates").any()


@pytest.mark.parametrize("above", [1.0, 1.5])
def test_a_vehicle_is_pushed_until_its_rollers_break_away(above):
    """Two wheels push along the axles of the other two, with a torque that grows: 2 tau/l = 2 T/rho lets these rollers
    turn, and then (M + 2 J/l^2) x'' = 2 tau/l - 2 T/rho, on contacts that all stick."""
    sliding, grows, end = 0.02, 0.5, 0.3
    table = TorqueTable((0.0, end), np.array([[0, 0, 0, 0], [0, -grows * end, 0, grows * end]]))
    ground = Contact(law="coulomb", friction=0.9)
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=above * sliding)
    run = run_of([ground, bearings, table], end)
    breaks = above * sliding * RADIUS / (RHO * grows)
    assert breaks < end / 2
    spins = np.abs(run.contact_spin)
    assert run.t[first_row(spins[:, 0] > 1e-12) - 1] == pytest.approx(breaks, rel=INSTANT)
    assert run.sticks.all() and not run.slip.any()
    later = end - breaks
    force = grows * (end + breaks) / RADIUS - 2 * sliding / RHO
    speed = force * later / (MASS + 2 * WHEEL / RADIUS**2)
    assert abs(run.nu[-1, 0]) * ARM == pytest.approx(speed, rel=1e-10)
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
    run = run_of(effects, stops * 1.2, (*(start / ARM), 0))
    spins = np.abs(run.contact_spin)
    assert spins[0] * RHO == pytest.approx(np.repeat([start - tangent * start[::-1]], 2, axis=0).ravel(), rel=1e-12)
    stopped = first_row(spins[:, 1] <= 1e-12 * spins[0, 1])
    assert run.t[stopped] == pytest.approx(stops, rel=INSTANT)
    row = first_row(run.t >= stops * (1 - 1e-9))
    assert run.nu[row, :2] * ARM == pytest.approx(start - falls * stops, rel=1e-10)
    assert spins[row, 0] > 1 and (np.abs(torques_of(run, "contact_bearing")[-1, [1, 3]]) < torque * 0.999).all()


# ---- forces that are not determinate ---------------------------------------------------------------------------------


def test_forces_that_are_not_determinate_are_those_of_least_norm_within_the_bounds():
    """Eight directions in which wheels stand, three equations; two bearings cut forces off."""
    angle, breaks, turns, friction = 0.09, 0.05, 0.03, 0.6
    gravity = GRAVITY * np.cos(angle)
    bearings = Bearings(wheel_coulomb=(HOLDS, breaks, HOLDS, breaks), roller_coulomb=(turns, HOLDS, turns, HOLDS))
    run = run_of([Contact(law="coulomb", friction=friction, normal_gravity=gravity), bearings,
                  Slope(angle, 0.2, gravity=GRAVITY)], 0.01, model="free")  # fmt: skip
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
    assert torques_of(run, "contact_bearing")[-1] == pytest.approx(RHO * force[:, 0], abs=1e-12)
    assert torques_of(run)[-1] == pytest.approx(-RADIUS * force[:, 1], abs=1e-12)
