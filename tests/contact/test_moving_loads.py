"""Loads that follow the motion of wheels that slip: against every body, in closed forms, and what stops a run."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hard.ground_anywhere import scene
from oracle.balls import exact, working_precision
from reactions.machines import height, platform_products, wheel_mass
from reactions.newton_euler import Acting, position, solve
from reactions.test_newton_euler import acting, call, random_inputs

from contact.test_newton_euler import MODELS, nu_dot, slipping_case
from contact.test_sticking_bodies import OTHERS, sticking_case
from omniroll import (
    Contact,
    Instruments,
    InvalidValueError,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    reactions,
    simulate,
)
from omniroll.kernels.kernel import kernel

pytestmark = pytest.mark.long

RELATIVE = 1e-10
GRAVITY = 9.80665
INSTANT = 1e-10  # relative, of instants in closed form
# Three contacts on level ground under the centre of mass; the wheels roll along x and along the sides.
PAPER = Vehicle.paper()


def numbers(case):
    """Of the loads' balance, as Contact takes them."""
    return {
        "height": height(case.machine),
        "wheel_mass": wheel_mass(case.machine),
        "platform_products": platform_products(case.machine),
    }


def started(case, law, effects=(), **options):
    """The state of the case at an instant; loads and forces are those of its row."""
    ground = Contact(**law, loads="dynamic", **numbers(case), wheel_rates=case.rates, **options)
    if case.model == "free":
        ground = replace(ground, contact_spins=case.turns)
    return simulate(case.vehicle, **case.start(), duration=0, effects=[ground, *effects], engine="python")


@working_precision
def by_bodies(case, force, spare, given=None):
    """(nu', chi'', loads) under the forces (N, 2) of the ground; the loads of wheels beyond three are given."""
    machine, given = case.machine, given or Acting()
    at = position(machine, case.heading, case.chi)
    pushed = replace(given, ground=lambda i, *_: (exact(force[i, 0]), exact(force[i, 1])))
    loads = {i: float(load) for i, load in enumerate(spare) if i > 2}
    found = solve(machine, at, case.speeds(), pushed, model=case.model, loads=loads)
    return nu_dot(case, found), np.array([float(v) for v in found.second.chi]), [float(w[2]) for w in found.contact]


def kernel_loads(case, sticks, push, others=(), constants=(), **inputs):
    """nu', chi'', forces and the sums of the loads of given forces, by the generated functions."""
    names = ("contact", "contact_coulomb", "contact_loads", "reactions", *others)
    bound = kernel(case.vehicle, case.model, "python", effects=names, constants=constants)
    values = {"nu": case.nu, "chi": case.chi, "rates": case.rates, "spins": case.spins, "heading": case.heading}
    values |= numbers(case) | {
        "normal_gravity": GRAVITY,
        "spin_inertia": np.full(len(sticks), case.vehicle.wheel_inertia),
    }
    values |= inputs | {"sticks": sticks.astype(float), "ground_push": np.where(sticks[:, None], 0.0, push)}
    values["load_factor"] = np.ones(len(sticks))
    if case.model == "free":
        values["contact_omega"] = case.turns + case.nu[2] / case.vehicle.yaw_scale * np.sin(case.chi)
        values["axial"] = call(bound, "axial_speeds", values)
        values["momenta"] = call(bound, "momenta", values)
    if "slip_roller_rates" in bound.signatures:
        _, values["roller_drag"], _ = call(bound, "slip_roller_rates", values)
    if "coulomb_momenta" in bound.signatures:
        values["coulomb_momenta_dot"] = call(bound, "coulomb_momenta", values)
    outputs = [argument.name for argument in bound.signatures["ground_dynamics"].outputs]
    values |= dict(zip(outputs, call(bound, "ground_dynamics", values), strict=True))
    sums, places = call(bound, "slip_load_balance", values)
    return values, sums, places


def assert_same(values, wanted):
    assert values == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * np.abs(wanted).max())


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("sticks", [(0, 0, 0), (1, 0, 1), (1, 1, 1)])
def test_the_balance_agrees_with_every_body_in_every_mode(model, sticks):
    """With every effect at once: motors, bearings of both kinds, a slope."""
    rng, sticks = np.random.default_rng([21, MODELS.index(model), *sticks]), np.array(sticks, bool)
    case = sticking_case(rng, model, sticks)
    constants, inputs = random_inputs(rng, 3)
    slope = {"normal_gravity": constants["gravity"] * np.cos(constants["slope_angle"])}
    values, sums, places = kernel_loads(
        case, sticks, rng.normal(size=(3, 2)), OTHERS, tuple(constants.items()), **(inputs | slope)
    )
    forces = working_precision(acting(case, constants, inputs))(case.speeds())
    wanted_nu, wanted_rates, loads = by_bodies(case, values["ground_force"], (), forces)
    assert_same(values["nu_dot"], wanted_nu)
    assert_same(values["rates_dot"], wanted_rates)
    found = np.linalg.solve(np.vstack([np.ones(3), places.T]), sums)
    assert_same(found, loads)
    assert np.ptp(loads) > 1e-2 * np.mean(loads), "loads that differ by the motion"


LAWS = {
    "viscous": {"coefficient": (0.3, 0.2)},
    "regularised": {"law": "regularised", "friction": (0.3, 0.2), "speed": 0.05},
    "coulomb": {"law": "coulomb", "friction": (0.3, 0.2)},
}


@pytest.mark.parametrize("wheels, model", [(3, "massless"), (4, "free"), (5, "massless"), (6, "free")])
@pytest.mark.parametrize("law", LAWS)
def test_laws_with_moving_loads_agree_with_every_body(law, wheels, model):
    """The oracle gets the forces, and must find the loads from which these follow by the law."""
    rng = np.random.default_rng([22, wheels, MODELS.index(model)])
    case = slipping_case(rng, wheels, 4, model, has_layout=True)
    case = replace(case, nu=case.nu / 3, rates=case.rates / 3, turns=case.turns / 5)
    run = started(case, LAWS[law])
    slip, force, load = run.slip[0], run.ground_force[0], run.ground_load[0]
    assert load.min() > 0
    _, _, wanted = by_bodies(case, force, load)
    assert_same(load, wanted)
    if law == "viscous":
        expected = -np.array([0.3, 0.2]) * slip
    else:
        weighted = np.array([0.3, 0.2]) * slip
        fade = 0.3 * 0.2 * 0.05**2 if law == "regularised" else 0.0
        size = np.sqrt((weighted**2).sum(axis=1) + fade)
        expected = -load[:, None] * np.array([0.3, 0.2]) * weighted / size[:, None]
    components = slice(0, 2) if model == "free" else slice(1, 2)
    assert_same(force[:, components], expected[:, components])
    places = case.vehicle.places()
    spare = np.linalg.svd(np.vstack([np.ones(wheels), places.T]))[2][3:]
    assert spare @ load == pytest.approx(np.zeros(wheels - 3), abs=1e-10 * load.max()), "of least norm"


# Closed forms; massless rollers, so that a wheel's force is along its rolling direction.

HEIGHT = 0.12
CROSS = Vehicle.paper(4, 5).replace(wheel_angles=tuple(np.pi / 2 * np.arange(4)))
ARM = CROSS.platform_radius


def spinning(friction, rates, height=HEIGHT, **options):
    """The platform at rest; the wheels on the y axis spin and push along x."""
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=height, wheel_rates=rates)
    return simulate(CROSS, nu=(0, 0, 0), roller_model="massless", effects=[ground], control=False, **options)


def test_loads_of_a_vehicle_that_its_spinning_wheels_push():
    """M a = mu W/2, and the wheels along the way get and lose M (h - l) a/(2 R)."""
    weight, lever = CROSS.mass * GRAVITY, (HEIGHT - CROSS.wheel_radius) / ARM
    run = spinning(0.4, (0, 30, 0, -30), duration=0)
    pushed = np.sign(run.ground_force[0, 3, 1])
    assert (run.ground_force[0, [1, 3], 1] * [-1, 1]).tolist() == pytest.approx([pushed * 0.1 * weight] * 2, rel=1e-12)
    moved = pushed * 0.4 * weight / 4 * lever
    assert run.ground_load[0] == pytest.approx(weight / 4 + np.array([-moved, 0, moved, 0]), rel=1e-12)


def test_reactions_and_instruments_of_wheels_that_slip():
    """Reactions find the loads that the run had; an accelerometer reads mu g/2, encoders the wheels' own rates."""
    run = spinning(0.4, (0, 30, 0, -30), duration=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = reactions(run, height=HEIGHT)
    assert found.load == pytest.approx(run.ground_load, rel=1e-10)
    assert found.contact_force == pytest.approx(run.ground_force)
    assert found.needed_friction[0, [1, 3]] == pytest.approx([0.4, 0.4], rel=1e-10) and found.doubts == ()
    times = np.linspace(0, 0.01, 5)
    read = run.measure(times, Instruments(place=(0.1, 0.0)))
    assert np.abs(read["accelerometer"][:, 0]) == pytest.approx(np.full(5, 0.2 * GRAVITY), rel=1e-9)
    assert read["accelerometer"][:, 1] == pytest.approx(np.zeros(5), abs=1e-9)
    turned = np.diff(run.measure(times)["wheel_angle"][:, 1]) / np.diff(times)
    middle = run.measure((times[1:] + times[:-1]) / 2)["wheel_rate"][:, 1]
    assert middle == pytest.approx(turned, rel=1e-9) and middle[0] > 28, "not those of rolling"
    assert "slip" not in str(found.doubts)


@pytest.mark.parametrize("law", ["viscous", "regularised", "coulomb"])
def test_reactions_judge_loads_that_the_run_took_as_at_rest(law):
    """A tall vehicle that brakes on static loads: the ground would have to pull on the wheel behind."""
    own = {"coefficient": 60.0} if law == "viscous" else {"law": law, "friction": 0.7}
    own |= {"speed": 0.01} if law == "regularised" else {}
    run = simulate(CROSS, nu=(9, 0, 0), duration=0.001, roller_model="massless", control=False,
                   effects=[Contact(**own, wheel_rates=0)])  # fmt: skip
    with pytest.warns(UserWarning, match="the motion needs a load of -"):
        found = reactions(run, height=0.6)
    assert {doubt.reason for doubt in found.doubts} == {"load"}
    sums = np.stack([np.ones(4), *CROSS.places().T]) @ found.load[0]
    lever = 0.6 - CROSS.wheel_radius  # the wheels take up what the ground gives, and their own spin's momentum with it
    force = np.abs(run.ground_force[0, :, 1]).sum()
    assert sums == pytest.approx([CROSS.mass * GRAVITY, force * lever, 0], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("ratio", [1.25, 4.0])
def test_a_contact_that_is_off_comes_back_when_the_wheels_stop_slipping(ratio):
    """Beyond mu (h - l)/R = k = 1 a wheel is off: the one behind carries W k/(1 + k), the others W/(2 (1 + k)) each.

    Their slip comes to rest at s/(F (l^2/J + 2/M)), and then all carry the same.
    """
    friction, rate = 1.3, 30.0
    height = CROSS.wheel_radius + ratio * ARM / friction
    run = spinning(friction, (0, rate, 0, -rate), height, duration=0.12)
    weight = CROSS.mass * GRAVITY
    force = friction * weight / (2 * (1 + ratio))
    ahead, behind = (0, 2) if run.ground_force[0, 3, 1] > 0 else (2, 0)
    wanted = np.full(4, weight / (2 * (1 + ratio)))
    wanted[[ahead, behind]] = 0, weight * ratio / (1 + ratio)
    assert run.ground_load[0] == pytest.approx(wanted, rel=1e-12, abs=1e-12)
    radius, inertia = CROSS.wheel_radius, CROSS.wheel_inertia
    rests = radius * rate / (force * (radius**2 / inertia + 2 / CROSS.mass))
    assert 0 < rests < 0.11
    back = run.t[1:][(run.ground_load[1:, ahead] > 0) & (run.ground_load[:-1, ahead] == 0)]
    assert back == pytest.approx([rests], rel=INSTANT)
    assert run.ground_load[-1] == pytest.approx(np.full(4, weight / 4), rel=1e-10)
    assert run.sticks[-1].all()
    assert run.ledger.residual == pytest.approx(0, abs=1e-9 * run.energy[0])


# A tricycle: a wheel in front that rolls freely along x, two driven ones behind.
LONG, WIDE = 0.2, 0.15
TRICYCLE = Vehicle.paper(3, 5).replace(
    wheel_places=((LONG, 0.0), (-LONG / 2, WIDE), (-LONG / 2, -WIDE)),
    wheel_angles=(0.0, np.pi / 2, np.pi / 2),
    center_of_mass=(0.0, 0.0),
)


def driven(effects, duration, height=HEIGHT, friction=20.0, engine="compiled", **options):
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=height, **options)
    task = {"nu": (0, 0, 0), "roller_model": "massless", "duration": duration, "control": False, "engine": engine}
    return simulate(TRICYCLE, effects=[ground, *effects], **task)


def test_a_vehicle_tips_at_an_exact_acceleration():
    """The front load is gone where M h a + 2 J a/l = W LONG/2; two torques T t give (M + 2 J/l^2) a = 2 T t/l."""
    mass, radius, inertia = TRICYCLE.mass, TRICYCLE.wheel_radius, TRICYCLE.wheel_inertia
    acceleration = mass * GRAVITY * LONG / 2 / (mass * HEIGHT + 2 * inertia / radius)
    growth = 10.0
    instant = acceleration * (mass + 2 * inertia / radius**2) * radius / (2 * growth)
    ramp = TorqueTable((0.0, 1.0), ((0, 0, 0), (0, growth, growth)))
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 1 and 2") as caught:
        driven([ramp], duration=0.9)
    stopped = caught.value
    assert stopped.t == pytest.approx(instant, rel=INSTANT) and stopped.trajectory.t[-1] == stopped.t
    assert stopped.trajectory.ground_load[-1, 0] == pytest.approx(0, abs=1e-9 * mass * GRAVITY)
    half = stopped.trajectory.sample(instant / 2)
    assert half.ground_load[0] == pytest.approx(mass * GRAVITY / 6, rel=1e-9), "half of what it carries at rest"


def test_a_vehicle_holds_on_a_slope_as_long_as_its_lower_wheels_do():
    """Wheels that are held by their drives ask for M g sin/2 each; the slope moves load M g sin h/(3 LONG/2) over."""
    angle = 0.25
    mass, across = TRICYCLE.mass, GRAVITY * np.cos(angle)
    for direction in (0.0, np.pi):
        down = GRAVITY * np.sin(angle) * np.cos(direction)
        front = mass * (across * LONG / 2 + HEIGHT * down) / (1.5 * LONG)
        rear = (mass * across - front) / 2
        needed = mass * abs(down) / 2 / rear
        held = -mass * down / 2 * TRICYCLE.wheel_radius
        for part, holds in ((1.001, True), (0.999, False)):
            effects = [Slope(angle, direction), Torque((0, held, held))]
            run = driven(effects, 0.01, friction=part * needed, normal_gravity=across)
            assert (run.sticks[:, 1:] == holds).all()
            assert (np.abs(run.pose[-1, 0]) < 1e-12) == holds
            if holds:
                assert run.ground_load[-1] == pytest.approx([front, rear, rear], rel=1e-9)


@pytest.mark.parametrize("engine", ["compiled", "python"])
@pytest.mark.parametrize("friction", [0.3, 1.0, 20.0])
def test_what_cannot_stand_stops_at_once(engine, friction):
    """A vehicle whose driven wheels would lift its front at the start; the first row is kept. With a friction of 20 the
    two rear wheels hold if they carry all; under the loads at rest they would slip, and no loads follow from that."""
    with pytest.raises(SimulationStopped, match="tips over the edge of its wheels 1 and 2") as caught:
        driven([Torque((0, 20.0, 20.0))], duration=0.1, friction=friction, engine=engine)
    assert caught.value.t == 0 and len(caught.value.trajectory) == 1


def test_what_makes_no_sense_is_refused():
    law = {"law": "coulomb", "friction": 0.3}
    for changes, field in (
        ({"loads": "dynamic"}, "height"),
        ({"loads": "dynamic", "height": 0.1, "load": 3.0}, "load"),
        ({"height": 0.1}, "height"),
        ({"loads": "moving"}, "loads"),
        ({"loads": "dynamic", "height": -0.1}, "height"),
    ):
        with pytest.raises(InvalidValueError) as caught:
            Contact(**law | changes)
        assert caught.value.field == field
    aside = PAPER.replace(center_of_mass=(0.03, -0.01))
    with pytest.raises(InvalidValueError, match="wheel_mass"):
        simulate(aside, nu=(0, 0, 0), duration=0.1, effects=[Contact(**law, loads="dynamic", height=0.1)])


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_forces_where_a_slip_comes_to_rest_are_those_of_the_way_there(engine):
    """What is left of a slip is rounding: its direction once made loads of up to 1.4 weights that pull."""
    for number, duration in ((317, 1.8e-4), (1143, 4e-3)):
        vehicle, task = scene(number)
        run = simulate(vehicle, **task | {"duration": duration}, engine=engine)
        weight = run.ground_load[0].sum()
        rests = np.flatnonzero((run.sticks[1:] > run.sticks[:-1]).any(axis=1) & (np.diff(run.t) == 0))
        assert rests.size and run.ground_load.min() >= 0
        for row in rests:
            before = run.sample(run.t[row] - 1e-9).ground_load
            assert np.abs(run.ground_load[row] - before).max() < 1e-3 * weight


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_a_contact_lets_go_before_its_load_vanishes(engine):
    """A wheel that rolls asks the ground for what turns it; 66 microseconds before nothing presses on it any more, that
    is all of its friction."""
    pushed = TorqueTable((0.0, 0.2, 0.4), ((0, 0, 0, 0), (0, 0.5, 0, -0.5), (0, 0, 0, 0)))
    ground = Contact(law="coulomb", friction=0.5, loads="dynamic", height=0.25)
    start = {"nu": (0.3, 0.1, 0.05), "chi": (0.1, -0.2, 0.15, 0.05), "roller_model": "massless"}
    for accuracy in (1e-11, 1e-12, 1e-13):
        run = simulate(
            Vehicle.paper(4, 5), **start, duration=0.2, effects=[ground, pushed], engine=engine, accuracy=accuracy,
            control=False,
        )  # fmt: skip
        vanishes = int(np.argmax(run.ground_load[:, 0] < 1e-12))
        lets_go = int(np.argmin(run.sticks[:, 0]))
        assert run.t[[lets_go, vanishes]] == pytest.approx([0.15382437577, 0.15389083104], abs=1e-10)
        assert run.ground_force[lets_go, 0, 1] == pytest.approx(0.5 * run.ground_load[lets_go, 0], rel=1e-9)
