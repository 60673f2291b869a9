"""Loads from springs: the platform heaves and tilts on its wheels, and contacts leave the ground and come back.

Accelerations are those of rigid bodies, each by itself (spring_bodies.py); a box that tips does so as its closed form
says; with stiffer and stiffer springs loads become those of rigid bodies; the energy's account closes.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import omniroll
from omniroll.effects.effect_set import EffectSet

from .spring_bodies import Bodies, Revolution

GRAVITY = 9.80665
FRICTION, SPEED, LAMBDA = 0.7, 0.02, 0.8


def some_bodies(massless: bool) -> Bodies:
    """Four wheels anywhere; the platform's products of inertia leave none about the horizontal axes for the whole."""
    angles = np.array([0.3, 1.7, 3.4, 4.9])
    places = np.array([[0.21, 0.05], [-0.02, 0.19], [-0.2, -0.04], [0.03, -0.23]])
    roller = Revolution(0.0, 0.0, 0.0) if massless else Revolution(0.02, 3e-5, 5e-6)
    found = Bodies(
        places, angles, 5, 0.05, 0.04, Revolution(0.3, 4e-4, 2e-4), roller, 4.0, np.array([0.02, -0.01, 0.13]),
        np.diag([0.05, 0.07, 0.11]),
    )  # fmt: skip
    inertia = found.platform_inertia.copy()
    inertia[0, 1] = inertia[1, 0] = -found.matrix(np.zeros(found.size)).real[3, 4]
    return replace(found, platform_inertia=inertia)


def numbers_of(bodies: Bodies) -> tuple[omniroll.Vehicle, omniroll.Springs]:
    """The vehicle and the springs under it, read off the bodies' kinetic energy."""
    matrix = bodies.matrix(np.zeros(bodies.size)).real
    height = bodies.center[2]
    of_tilt = matrix[3:5, 3:5] - bodies.mass * height**2 * np.eye(2)
    axles = np.stack([np.cos(bodies.angles), np.sin(bodies.angles)])
    spin = (axles * matrix[3:5, 6 : 6 + bodies.wheels]).sum(axis=0)
    vehicle = omniroll.Vehicle(
        wheels=bodies.wheels, rollers_per_wheel=bodies.rollers, mass=bodies.mass, yaw_inertia=matrix[2, 2],
        wheel_inertia=matrix[6, 6], roller_inertia=matrix[-1, -1] or 1e-9, yaw_scale=LAMBDA, platform_radius=0.2,
        wheel_radius=bodies.wheel_radius, roller_axis_radius=bodies.roller_axis_radius,
        wheel_angles=tuple(bodies.angles), wheel_places=tuple(map(tuple, bodies.places)),
        center_of_mass=tuple(bodies.center[:2]),
    )  # fmt: skip
    products = -matrix[2, 3:5] - bodies.mass * height * bodies.center[:2]
    return vehicle, omniroll.Springs(
        height=height, deflection=2e-3, damping_ratio=0.4, tilt_inertia=tuple(np.diag(of_tilt)),
        products=tuple(products), spin_inertia=tuple(spin), normal_gravity=GRAVITY,
    )  # fmt: skip


def on_a_slope(massless: bool, **law):
    """Bodies, their kernel on a ground of this law, and a function that compares what it says of a state with the
    bodies."""
    bodies = some_bodies(massless)
    vehicle, springs = numbers_of(bodies)
    slope = omniroll.Slope(angle=0.2, direction=0.7)
    springs = replace(springs, normal_gravity=slope.normal_gravity)
    contact = omniroll.Contact(**law, friction=FRICTION, normal_gravity=slope.normal_gravity)
    acting = EffectSet.checked((omniroll.Torque(0.0), slope, contact, springs), vehicle)

    def assert_same(found, state):
        for name, value in judged(bodies, springs, state, slope, massless).items():
            assert np.abs(found[name] - value).max() < 1e-10 * max(1.0, np.abs(value).max()), name

    return bodies, acting.kernel(vehicle, "massless" if massless else "free", "python"), assert_same


@pytest.mark.parametrize("massless", [False, True])
def test_accelerations_are_those_of_rigid_bodies(massless):
    rng, (bodies, bound, assert_same) = np.random.default_rng(5), on_a_slope(massless, law="regularised", speed=SPEED)
    for _ in range(5):
        state = random_state(bodies, rng, massless)
        assert_same(computed(bound, bodies, state), state)


@pytest.mark.parametrize("massless", [False, True])
def test_accelerations_of_contacts_that_stick_are_those_of_rigid_bodies(massless):
    """Each contact sticks, slips or is off: those that stick keep their zero slip, by forces that nobody gives."""
    rng, (bodies, bound, assert_same) = np.random.default_rng(6), on_a_slope(massless, law="coulomb")
    modes = rng.permutation([(sticks, presses) for sticks, presses in np.ndindex(2, 2) for _ in range(6)])[:20]
    for sticks_presses in modes.reshape(5, 4, 2):
        state = random_state(bodies, rng, massless)
        state["sticks"], state["presses"] = (sticks_presses * [1, 1]).astype(float).T
        state["sticks"] *= state["presses"]
        state["ground_push"] = 3 * rng.normal(size=(4, 2)) * (state["presses"] - state["sticks"])[:, None]
        roll(bound, state)
        found = computed(bound, bodies, state, "sprung_dynamics")
        assert_same(found, state)
        assert np.abs(found["slip_dot"][state["sticks"] > 0]).max(initial=0.0) < 1e-9


def roll(bound, state: dict[str, np.ndarray]) -> None:
    """Wheels whose contacts stick roll, while the platform tilts."""
    sticks = state["sticks"] > 0
    state["rates"] = np.where(sticks, bound.wheel_rates(state["nu"], state["chi"])[0], state["rates"])
    if "contact_omega" in state:
        asked = (state[name] for name in ("nu", "chi", "tilt", "tilt_rate"))
        state["contact_omega"] = np.where(sticks, bound.call("leaning_axial", *asked), state["contact_omega"])


def random_state(bodies: Bodies, rng: np.random.Generator, massless: bool) -> dict[str, np.ndarray]:
    wheels, joint = bodies.wheels, np.pi / bodies.rollers
    found = {
        "nu": rng.normal(size=3), "chi": rng.uniform(-joint, joint, wheels), "heading": np.array(rng.normal()),
        "rates": 10 * rng.normal(size=wheels), "contact_omega": 20 * rng.normal(size=wheels),
        "axial": 20 * rng.normal(size=(wheels, bodies.rollers - 1)), "torque": rng.normal(size=wheels),
        "tilt": rng.normal(size=3) * [5e-4, 3e-3, 3e-3], "tilt_rate": rng.normal(size=3) * [0.02, 0.3, 0.3],
        "presses": (rng.random(wheels) < 0.8).astype(float),
    }  # fmt: skip
    return {name: value for name, value in found.items() if not massless or name not in ("contact_omega", "axial")}


def computed(
    bound, bodies: Bodies, state: dict[str, np.ndarray], dynamics: str = "spring_dynamics"
) -> dict[str, np.ndarray]:
    given = dict(state)
    if "axial" in given:
        given["momenta"] = bound.momenta(given["axial"])

    def call(name: str) -> dict[str, np.ndarray]:
        signature = bound.signatures[name]
        found = bound.call(name, *(given[argument.name] for argument in signature.inputs))
        found = found if isinstance(found, tuple) else (found,)
        return {argument.name: value for argument, value in zip(signature.outputs, found, strict=True)}

    return call("slip_forces") | call("support_state") | call(dynamics)


def judged(bodies: Bodies, springs, state: dict[str, np.ndarray], slope, massless: bool) -> dict[str, np.ndarray]:
    """The same of the bodies by themselves."""
    wheels, rollers = bodies.wheels, bodies.rollers
    q, rates = coordinates(bodies, state)
    loads_at_rest = rest_loads(bodies, slope.normal_gravity)
    stiffness = loads_at_rest / springs.deflection
    damping = 2 * springs.damping_ratio * np.sqrt(stiffness * loads_at_rest / slope.normal_gravity)
    rises = bodies.rises(q)
    rise_rates = np.array([bodies.rises(q + 1j * 1e-40 * rates).imag / 1e-40]).ravel()
    margins = loads_at_rest - stiffness * rises - damping * rise_rates
    loads = state["presses"] * margins
    rows = bodies.slip_rows(q)
    slips = rows @ rates
    if massless:  # their rollers turn with the ground along the axle
        slips[:, 0] = 0
    pull = slope.gravity * np.sin(slope.angle)
    gravity = np.array([pull * np.cos(slope.direction), pull * np.sin(slope.direction), slope.normal_gravity])
    known = 6 + wheels if massless else None

    def accelerated(forces: np.ndarray) -> np.ndarray:
        return bodies.accelerations(q, rates, forces, loads, state["torque"], gravity, known)

    sizes = np.hypot(*slips.T)
    forces = -FRICTION * loads[:, None] * slips / np.sqrt(sizes**2 + SPEED**2)[:, None]
    if "sticks" in state:
        forces = held(bodies, q, rates, state, accelerated, massless)
    q_dot_dot = accelerated(forces)
    found = {"ground_force": forces, "slip": slips, "support_loads": loads, "support_margins": margins}
    found["rates_dot"] = q_dot_dot[6 : 6 + wheels]
    c, s = np.cos(q[2]), np.sin(q[2])
    turn = np.array([[c, s], [-s, c]])
    quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])  # how components turn as the platform does
    velocity, yaw = turn @ rates[:2], rates[2]
    found["nu_dot"] = np.append((turn @ q_dot_dot[:2] + yaw * quarter @ velocity) / 0.2, LAMBDA * q_dot_dot[2])
    tilt, tilt_speed = turn @ q[3:5], turn @ rates[3:5]
    of_speed = turn @ q_dot_dot[3:5] + yaw * quarter @ tilt_speed
    of_tilt = of_speed + q_dot_dot[2] * quarter @ tilt + yaw * quarter @ (tilt_speed + yaw * quarter @ tilt)
    found["tilt_rate_dot"] = np.append(q_dot_dot[5], of_tilt)
    if not massless:
        chi, chi_dot = q[6 : 6 + wheels], rates[6 : 6 + wheels]
        own = 6 + wheels + rollers * np.arange(wheels)
        across = np.stack([-np.sin(bodies.angles), np.cos(bodies.angles)])
        lean, lean_dot = tilt_speed @ across, of_speed @ across
        found["contact_omega_dot"] = (
            q_dot_dot[own] + q_dot_dot[2] * np.sin(chi) + yaw * np.cos(chi) * chi_dot
            + lean_dot * np.cos(chi) - lean * np.sin(chi) * chi_dot
        )  # fmt: skip
    return found


def held(bodies: Bodies, q, rates, state: dict[str, np.ndarray], accelerated, massless: bool) -> np.ndarray:
    """(N, 2) in N, the forces that are given, and those that keep the slips of contacts that stick at zero; along the
    axles of massless rollers there are none."""
    forces = state["ground_push"].copy()
    if massless:
        forces[:, 0] = 0
    places = [(i, k) for i in np.flatnonzero(state["sticks"]) for k in range(1 if massless else 0, 2)]
    size = 6 + bodies.wheels if massless else bodies.size
    rows, later = bodies.slip_rows(q)[..., :size], bodies.slip_rows(q + 1e-6 * rates)[..., :size]
    turned = (later - bodies.slip_rows(q - 1e-6 * rates)[..., :size]) / 2e-6 @ rates[:size]

    def slip_rates(pushed: np.ndarray) -> np.ndarray:
        found = rows @ accelerated(pushed) + turned
        return np.array([found[place] for place in places])

    if places:
        without, columns = slip_rates(forces), []
        for place in places:
            pushed = forces.copy()
            pushed[place] += 1
            columns.append(slip_rates(pushed) - without)
        for place, force in zip(places, np.linalg.solve(np.transpose(columns), -without), strict=True):
            forces[place] += force
    return forces


def coordinates(bodies: Bodies, state: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The coordinates of the bodies and their rates, from the state."""
    wheels, theta, yaw = bodies.wheels, float(state["heading"]), state["nu"][2] / LAMBDA
    back = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    heave, *tilt = state["tilt"]
    heave_rate, *tilt_rate = state["tilt_rate"]
    speeds = np.array([tilt_rate[0] - yaw * tilt[1], tilt_rate[1] + yaw * tilt[0]])
    q, rates = np.zeros(bodies.size), np.zeros(bodies.size)
    q[2], q[3:5], q[5], q[6 : 6 + wheels] = theta, back @ tilt, heave, state["chi"]
    rates[:2], rates[2] = back @ (0.2 * state["nu"][:2]), yaw
    rates[3:5], rates[5], rates[6 : 6 + wheels] = back @ speeds, heave_rate, state["rates"]
    if "axial" in state:
        axial = np.concatenate([state["contact_omega"][:, None], state["axial"]], axis=1)
        beta = state["chi"][:, None] + 2 * np.pi * np.arange(bodies.rollers) / bodies.rollers
        lean = speeds[1] * np.cos(bodies.angles) - speeds[0] * np.sin(bodies.angles)
        rates[6 + wheels :] = (axial - yaw * np.sin(beta) - lean[:, None] * np.cos(beta)).ravel()
    return q, rates


def rest_loads(bodies: Bodies, gravity: float) -> np.ndarray:
    """(N,) of least norm that carry the weight below the centre of mass."""
    sums = np.vstack([np.ones(bodies.wheels), bodies.places.T])
    return np.linalg.pinv(sums) @ (bodies.mass * gravity * np.array([1.0, *bodies.center[:2]]))


# Closed forms: a box on four contacts at (R, 0), (0, R), (-R, 0), (0, -R), without friction, which heaves and pitches

BOX = {"height": 0.3, "deflection": 2e-3, "damping_ratio": 0.1, "tilt_inertia": 0.2}


class Box:
    """Heave, pitch and their rates are linear in time in each set of contacts that press, and mode by mode exact."""

    def __init__(self, vehicle: omniroll.Vehicle):
        self.mass, self.reach = vehicle.mass, vehicle.platform_radius
        self.inertia = BOX["tilt_inertia"] - 2 * vehicle.wheel_inertia  # two wheels turn about the axis of the pitch
        self.places = self.reach * np.array([1.0, 0.0, -1.0, 0.0])
        self.load = self.mass * GRAVITY / 4
        self.stiffness = self.load / BOX["deflection"]
        self.damping = 2 * BOX["damping_ratio"] * self.load / np.sqrt(BOX["deflection"] * GRAVITY)
        rise = np.stack([np.ones(4), -self.places], axis=-1)
        self.margins = -np.concatenate([self.stiffness * rise, self.damping * rise], axis=1)  # beside the load at rest

    def system(self, presses: np.ndarray) -> np.ndarray:
        """(5, 5) of the state and a one behind it."""
        found = np.zeros((5, 5))
        found[:2, 2:4] = np.eye(2)
        lift = np.concatenate([self.margins, np.full((4, 1), self.load)], axis=1)[presses]
        found[2] = lift.sum(axis=0) / self.mass
        found[2, 4] -= GRAVITY
        found[3] = -self.places[presses] @ lift / self.inertia
        found[3, 1] += self.mass * GRAVITY * BOX["height"] / self.inertia
        return found

    def loads(self, state: np.ndarray) -> np.ndarray:
        return self.load + self.margins @ state[:4]

    def beyond(self, elapsed: float, system, state, presses, most_tilt: float, event=slice(None)) -> np.ndarray:
        """What is positive where a wheel lifts, comes down, or the box has tipped, so long after a state."""
        at = expm(system * elapsed) @ state
        return np.append(np.where(presses, -1, 1) * self.loads(at), abs(at[1]) - most_tilt)[event]

    def after(self, rate: float, duration: float, most_tilt: float) -> tuple[float, np.ndarray, int]:
        """The time, the state and the number of events, at the duration or where it has tipped."""
        state, time, events = np.array([0, 0, 0, rate, 1.0]), 0.0, 0
        presses = self.loads(state) > 0
        while time < duration:
            system = self.system(presses)

            step = min(1e-4, duration - time)
            at_ends = [self.beyond(elapsed, system, state, presses, most_tilt) for elapsed in (0.0, step)]
            first = np.flatnonzero((at_ends[1] > 0) & (at_ends[0] < 1e-9))
            for event in first:
                given = (system, state, presses, most_tilt, event)
                step = min(step, brentq(self.beyond, 0.0, step, args=given, xtol=1e-15))
            state, time = expm(system * step) @ state, time + step
            tips = first.size and abs(state[1]) > most_tilt - 1e-12
            if tips:
                return time, state, events
            if first.size:
                presses = np.where(np.abs(self.loads(state)) < 1e-7, ~presses, presses)
                events += 1
        return time, state, events


def box_run(rate: float, duration: float, most_tilt: float = 0.2, law: str = "regularised"):
    vehicle = omniroll.Vehicle.paper(4, 5)
    springs = omniroll.Springs(**BOX, normal_gravity=GRAVITY, tilt_rate=(0, 0, rate), most_tilt=most_tilt)
    ground = omniroll.Contact(law=law, friction=1e-12, speed=1.0 if law == "regularised" else None)
    return vehicle, lambda: omniroll.simulate(
        vehicle, nu=(0, 0, 0), duration=duration, roller_model="massless", effects=[ground, springs], accuracy=1e-11,
    )  # fmt: skip


def test_a_wheel_lifts_and_comes_back_as_the_closed_form_says():
    vehicle, run = box_run(0.8, 0.3)
    found = run()
    _, state, events = Box(vehicle).after(0.8, 0.3, 0.2)
    assert events >= 4
    last = np.array([*found.quantity("tilt")[-1, [0, 2]], *found.quantity("tilt_rate")[-1, [0, 2]]])
    assert np.abs(last - state[:4]).max() < 1e-8
    assert (~found.presses).any() and found.presses[-1].any()
    assert found.ground_load.min() > -1e-9


@pytest.mark.parametrize("law", ["regularised", "coulomb"])
def test_a_box_tips_when_the_closed_form_says(law):
    vehicle, run = box_run(6.0, 1.0, most_tilt=0.15, law=law)
    time, state, _ = Box(vehicle).after(6.0, 1.0, 0.15)
    with pytest.raises(omniroll.SimulationStopped, match="tips") as stopped:
        run()
    assert abs(stopped.value.t - time) < 1e-8
    assert abs(stopped.value.trajectory.quantity("tilt")[-1, 2] - state[1]) < 1e-8


def turning_run(deflection: float):
    """A vehicle that turns as it goes: the ground holds it on its way, and loads move outwards. Nothing jumps."""
    ground = omniroll.Contact(law="regularised", friction=0.5, speed=0.05)
    springs = omniroll.Springs(height=0.06, deflection=deflection, damping_ratio=0.7)
    return omniroll.simulate(
        omniroll.Vehicle.paper(), nu=(3, 1, 6), duration=0.2, roller_model="massless", effects=[ground, springs],
        accuracy=1e-9,
    )  # fmt: skip


def orders_of_loads(run_of, height):
    """With which power of the springs' deflection loads at the end tend to those of rigid bodies."""
    distances = []
    for deflection in (1e-3, 1e-4, 1e-5, 1e-6):
        run = run_of(deflection)
        rigid = omniroll.reactions(run, height=height).load[-1]
        assert np.ptp(rigid) > 0.1
        distances.append(np.abs(run.ground_load[-1] - rigid).max())
    return -np.diff(np.log10(distances))


def test_loads_tend_to_those_of_rigid_bodies_at_first_order():
    orders = orders_of_loads(turning_run, 0.06)
    assert np.abs(orders - 1).max() < 0.05
    assert abs(orders[-1] - 1) < 0.01


BRAKE = omniroll.Motor(0.0, torque_constant=0.05, resistance=0.4, gear_ratio=2.0)


def braking_run(ground, deflection: float, duration: float, roller_model: str = "massless", along=(0.0, 1.0)):
    """A vehicle of four wheels that is braked from 0.8 m/s, sideways unless said."""
    vehicle = omniroll.Vehicle.paper(4, 5)
    springs = omniroll.Springs(height=0.08, deflection=deflection, damping_ratio=0.7)
    nu = 0.8 / vehicle.platform_radius * np.array([*along, 0.0])
    return omniroll.simulate(
        vehicle, nu=tuple(nu), duration=duration, roller_model=roller_model, effects=[ground, springs, BRAKE],
        accuracy=1e-9, control=False,
    )  # fmt: skip


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0)])
def test_loads_of_a_braking_vehicle_whose_contacts_stick_tend_to_those_of_rigid_bodies(along):
    def run_of(deflection):
        run = braking_run(omniroll.Contact(law="coulomb", friction=1.0), deflection, 0.15, along=along)
        assert run.sticks[-1].all()
        return run

    orders = orders_of_loads(run_of, 0.08)
    assert np.abs(orders[1:] - 1).max() < 0.05


def test_the_account_of_contacts_that_stick_on_springs_closes():
    for roller_model in ("massless", "free"):
        run = braking_run(omniroll.Contact(law="coulomb", friction=0.2), 1e-3, 0.12, roller_model)
        assert abs(run.ledger.residual) < 1e-8 * run.ledger.scale
        assert run.ledger.contributions["damper_loss"] < 0 and run.ledger.contributions["ground_loss"] < 0


def test_the_account_closes_with_what_springs_store_and_dampers_take():
    _, run = box_run(0.8, 0.3)
    for found in (run(), turning_run(1e-3)):
        ledger = found.ledger
        assert abs(ledger.residual) < 1e-8 * ledger.scale
        assert ledger.contributions["damper_loss"] < 0
        assert (np.diff(found.contributions()["damper_loss"]) < 1e-12).all()


def test_what_springs_do_not_go_with_is_said():
    vehicle, springs = omniroll.Vehicle.paper(), omniroll.Springs(height=0.06)
    ground = omniroll.Contact(law="regularised", friction=0.5, speed=0.05)

    def run(*effects, **options):
        omniroll.simulate(vehicle, nu=(1, 0, 0), duration=0.01, effects=effects, **options)

    rolling = omniroll.Bearings(roller_viscous=1e-5)
    for effects, options, message in (
        ((springs,), {}, "law that knows loads"),
        ((omniroll.Contact(2.0), springs), {}, "law that knows loads"),
        ((ground, springs, rolling), {}, "wheels' axles"),
        ((ground, springs), {"engine": "python"}, "choose compiled"),
        ((ground, springs), {"sensitivities": ["mass"]}, "leave Springs out"),
        ((ground, replace(springs, tilt_inertia=1e-6)), {}, "must exceed"),
        ((ground, replace(springs, normal_gravity=5.0)), {}, "that of the contacts"),
    ):
        with pytest.raises(omniroll.InvalidValueError, match=message):
            run(*effects, **options)


@pytest.mark.parametrize("law", ["regularised", "coulomb"])
def test_an_accelerometer_feels_the_tilt(law):
    """Of a place that sways: differences of where it is, and the weight along the axes that the platform has there."""
    place, height = np.array([0.03, -0.02]), 0.12
    fading = {"speed": 0.02} if law == "regularised" else {}
    run = omniroll.simulate(
        omniroll.Vehicle.paper(), nu=(0.5, 0.2, 1.0), duration=0.3, accuracy=1e-10,
        effects=[
            omniroll.Torque((0.3, -0.3, 0.05)), omniroll.Springs(height=0.05, deflection=5e-3),
            omniroll.Contact(law=law, friction=0.4, wheel_rates=0, contact_spins=0, **fading),
        ],
    )  # fmt: skip
    vector = run.effects.state_vector(run.effects.kernel(run.vehicle, "free", "python"))

    def along(vectors, heading):
        cosine, sine = np.cos(heading), np.sin(heading)
        x, y = vectors.T
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)

    def there(times):
        """Where the place is in the plane, the heading and the tilt; and the rows before the times."""
        y, rows = run.state_and_row(times)
        pose, tilt = vector.view(y, "pose"), vector.view(y, "tilt")
        aside = place + height * np.stack([tilt[:, 2], -tilt[:, 1]], axis=-1)
        return pose[:, :2] + along(aside, pose[:, 2]), pose[:, 2], tilt, rows

    step, times = 2e-5, np.array([0.011, 0.043, 0.087, 0.135, 0.211, 0.262])
    (before, _, _, first), (now, heading, tilt, _), (after, _, _, last) = (
        there(times + way) for way in (-step, 0.0, step)
    )
    assert np.array_equal(first, last), "no event lies between"
    moving = along((before - 2 * now + after) / step**2, -heading)
    weight = 9.80665 * np.stack([-tilt[:, 2], tilt[:, 1]], axis=-1)
    read = run.measure(times, omniroll.Instruments(place=place, place_height=height))["accelerometer"]
    assert np.abs(read - moving - weight).max() < 1e-4 * np.abs(read).max()
    assert np.abs(weight).max() > 0.02 * np.abs(read).max()
    lower = run.measure(times, omniroll.Instruments(place=place))["accelerometer"]
    assert np.abs(lower - read).max() > 1e-2 * np.abs(read).max()
