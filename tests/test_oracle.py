"""The oracle checked against itself: other formulations of the same mechanics, and properties it must
have.
"""

from functools import partial

import numpy as np
import pytest
from flint import arb, ctx
from oracle import PRECISION, OracleVehicle, bodies, condition, kinematics, lagrange, switch, taylor
from oracle.balls import exact, working_precision
from oracle.lagrange import MODELS, Speeds
from oracle.states import paper_parts, paper_vehicle, random_state, random_vehicle

SIZES = [(2, 3), (3, 5), (4, 4)]
TINY = 1e-45


@pytest.fixture(autouse=True)
def sixty_digits():
    with ctx.workprec(PRECISION):
        yield


def general_vehicle(rng, wheels, rollers):
    """Wheels anywhere, axles in any direction, centre of mass beside S."""
    places = tuple((float(a), float(b)) for a, b in rng.normal(size=(wheels, 2)))
    axles = tuple(float(a) for a in rng.uniform(0, 6, wheels))
    return random_vehicle(rng, wheels, rollers, places=places, axle_angles=axles, offset=(0.03, -0.05))


def random_forces(rng, vehicle, model):
    force = Speeds.zero(vehicle).map(lambda _: float(rng.normal()))
    return Speeds(force.x, force.y, force.theta, force.chi, Speeds.zero(vehicle).phi) if model == "massless" else force


def gap(found, wanted):
    return max(float(abs(a - b).upper()) for a, b in zip(found, wanted, strict=True))


def size(values):
    return max(float(abs(v)) for v in values)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("wheels, rollers", SIZES)
def test_fast_solver_agrees_with_the_literal_one(wheels, rollers, model):
    rng = np.random.default_rng([1, wheels, rollers])
    for vehicle in (random_vehicle(rng, wheels, rollers), general_vehicle(rng, wheels, rollers)):
        state, forces = random_state(rng, vehicle), random_forces(rng, vehicle, model)
        fast = lagrange.accelerations(vehicle, *state, model=model, theta=0.7, forces=forces)
        dense = lagrange.dense_accelerations(vehicle, *state, model=model, theta=0.7, forces=forces)
        for a, b in ((fast.second.flat(), dense.second.flat()), (fast.nu_dot, dense.nu_dot)):
            assert gap(a, b) <= TINY * size(b)


@pytest.mark.parametrize("model", ["locked", "free"])
def test_solvers_agree_on_a_vehicle_with_many_rollers(model):
    rng = np.random.default_rng(2)
    vehicle = random_vehicle(rng, 3, 20)
    state = random_state(rng, vehicle)
    fast = lagrange.accelerations(vehicle, *state, model=model)
    dense = lagrange.dense_accelerations(vehicle, *state, model=model)
    assert gap(fast.second.flat(), dense.second.flat()) <= TINY * size(dense.second.flat())


@pytest.mark.parametrize("model", MODELS)
def test_balls_are_tight(model):
    """What the oracle gives is good to 40 digits even in its largest case."""
    rng = np.random.default_rng(3)
    vehicle = random_vehicle(rng, 6, 60)
    found = lagrange.accelerations(vehicle, *random_state(rng, vehicle), model=model)
    for value in found.nu_dot:
        assert float(value.rad()) <= 1e-40 * abs(float(value))


@pytest.mark.parametrize("model", MODELS)
def test_the_heading_does_not_matter(model):
    rng = np.random.default_rng(4)
    vehicle = general_vehicle(rng, 3, 5)
    state = random_state(rng, vehicle)
    first = lagrange.accelerations(vehicle, *state, model=model)
    turned = lagrange.accelerations(vehicle, *state, model=model, theta=2.1)
    assert gap(first.nu_dot, turned.nu_dot) <= TINY * size(first.nu_dot)


@pytest.mark.parametrize("model", MODELS)
def test_power_of_the_inertia_forces_is_zero(model):
    """dT/dt = 0 by central differences of the energy along q + q' h + q'' h^2/2."""
    rng = np.random.default_rng(5)
    vehicle = general_vehicle(rng, 3, 4)
    nu, chi, spins = random_state(rng, vehicle)
    dq = lagrange.speeds(vehicle, nu, chi, spins, model=model, theta=0.3)
    second = lagrange.accelerations(vehicle, nu, chi, spins, model=model, theta=0.3).second

    def energy(h):
        moved = [v + a * h for v, a in zip(dq.flat(), second.flat(), strict=True)]
        later = [exact(c) + v * h + a * h * h / 2 for c, v, a in zip(chi, dq.chi, second.chi, strict=True)]
        theta = exact(0.3) + dq.theta * h + second.theta * h * h / 2
        return lagrange.kinetic_energy(vehicle, theta, later, Speeds.unflat(vehicle, moved), model=model)

    with ctx.workprec(300):
        h = arb("1e-25")
        slope = (energy(h) - energy(-h)) / (2 * h)
        assert abs(float(slope)) <= 1e-30 * float(energy(arb(0)))


@pytest.mark.parametrize("model", ["locked", "free"])
def test_contact_points_stand(model):
    """The roller's material point at the contact, moved as a point fixed in the roller, has no speed."""
    parts, wheel_radius = paper_parts()
    vehicle = paper_vehicle()
    nu, chi, spins = random_state(np.random.default_rng(6), vehicle)
    dq = lagrange.speeds(vehicle, nu, chi, spins, model=model, theta=0.4)
    place = Speeds(exact(0.1), exact(0.2), exact(0.4), [exact(c) for c in chi], dq.map(lambda _: exact(0.9)).phi)
    for i in range(vehicle.wheels):
        assert size(bodies.contact_point_speed(parts, wheel_radius, place, dq, i)) <= 1e-55


def test_constraints_are_the_papers():
    """(2.1) and (2.2) as printed, for wheels on rays. They are a claim; the kinematics is the ground."""
    rng = np.random.default_rng(7)
    vehicle = random_vehicle(rng, 4, 5)
    nu, chi, _ = random_state(rng, vehicle)
    dq = lagrange.speeds(vehicle, nu, chi, model="free", theta=1.1)
    a, b, c = (exact(v) for v in nu)
    for i, alpha in enumerate(vehicle.wheel_angles):
        sin, cos = exact(alpha).sin_cos()
        radius, wheel_radius = vehicle.number("platform_radius"), vehicle.number("wheel_radius")
        rho = wheel_radius * exact(chi[i]).cos() - vehicle.number("roller_axis_radius")
        assert abs(float(dq.phi[i][0] - radius / rho * (a * cos + b * sin))) <= 1e-50
        turn = c / vehicle.number("yaw_scale")
        assert abs(float(dq.chi[i] - radius / wheel_radius * (a * sin - b * cos - turn))) <= 1e-50


@working_precision
def inertia_forces_from_bodies(parts, q, dq, second):
    """d/dt dT/dq' - dT/dq of the energy of all bodies in space, differentiated numerically."""
    count, step = len(q.flat()), exact("1e-24")
    shape = partial(Speeds.shaped, len(q.chi), len(q.phi[0]))
    place, speed, push = q.flat(), dq.flat(), second.flat()
    energy = lambda p, v: bodies.kinetic_energy(parts, shape(p), shape(v))  # noqa: E731
    shifted = lambda p, d, h: [a + b * h for a, b in zip(p, d, strict=True)]  # noqa: E731

    def momentum(k, h):
        at = [p + v * h + a * h * h / 2 for p, v, a in zip(place, speed, push, strict=True)]
        now = shifted(speed, push, h)
        unit = [exact(int(k == m)) for m in range(count)]
        return (energy(at, shifted(now, unit, 1)) - energy(at, shifted(now, unit, -1))) / 2  # T is quadratic

    forces = []
    for k in range(count):
        unit = [exact(int(k == m)) for m in range(count)]
        slope = energy(shifted(place, unit, step), speed) - energy(shifted(place, unit, -step), speed)
        forces.append((momentum(k, step) - momentum(k, -step) - slope) / (2 * step))
    return forces


@pytest.mark.parametrize("model", MODELS)
def test_equations_of_motion_from_bodies_in_space(model):
    """Two wheels with three rollers each: forces of inertia of all nine bodies against the oracle's
    multipliers.
    """
    parts, wheel_radius = paper_parts(wheels=2, rollers=4)
    vehicle = paper_vehicle(wheels=2, rollers=4)
    if model == "massless":  # rollers that do not turn about their axes are no rollers: all spins stand
        parts = bodies.Parts(**(vars(parts) | {"roller": bodies.Solid(parts.roller.mass, 0, parts.roller.transverse)}))
        vehicle = vehicle.with_(**bodies.inertias(parts))
    nu, chi, spins = random_state(np.random.default_rng(8), vehicle)
    with ctx.workprec(400):
        found = lagrange.accelerations(vehicle, nu, chi, spins, model=model, theta=0.4)
        dq = lagrange.speeds(vehicle, nu, chi, spins, model=model, theta=0.4)
        q = Speeds(exact(1), exact(2), exact(0.4), [exact(c) for c in chi], dq.map(lambda _: exact(0.3)).phi)
        inertia = inertia_forces_from_bodies(parts, q, dq, found.second)
        reactions = lagrange.dense_accelerations(vehicle, nu, chi, spins, model=model, theta=0.4).multipliers
        rows = lagrange.constraint_matrix(vehicle, q.theta, q.chi, model=model)
        for a, force in enumerate(inertia):
            carried = sum(row[a] * m for row, m in zip(rows, reactions, strict=True))
            assert abs(float(force - carried)) <= 1e-30 * size(inertia)


def test_energy_of_bodies_in_space_is_the_papers():
    """(3.2) with M, I_S, J, B taken from unit speeds, for any speeds at any place; motors' rotors
    included.
    """
    rng = np.random.default_rng(9)
    parts, _ = paper_parts(wheels=3, rollers=5)
    rotor = bodies.Solid("0.07", "0.00002", "0.00003")
    geared = bodies.Parts(**(vars(parts) | {"rotor": rotor, "gear": -20, "rotor_distance": "0.1"}))
    for these in (parts, geared):
        vehicle = paper_vehicle().with_(**bodies.inertias(these))
        shape = Speeds.zero(vehicle)
        for _ in range(3):
            q, dq = (shape.map(lambda _: exact(float(rng.normal()))) for _ in range(2))
            space = bodies.kinetic_energy(these, q, dq)
            plane = lagrange.kinetic_energy(vehicle, q.theta, q.chi, dq, model="free")
            assert abs(float(space - plane)) <= TINY * float(plane)


def test_the_papers_numbers():
    """The closed forms of M, I_S, J, B that the design gives for the paper's vehicle."""
    vehicle = paper_vehicle()
    n_wheels, n, radius, r, m = 3, 5, arb("0.15"), arb("0.05"), arb("0.05")
    hub = arb("0.15")
    with ctx.workprec(200):
        pi = arb.pi()
        wheel_radius = r / (pi / (n - 1)).cos()
        a, h = (wheel_radius - r) / 2, 2 * wheel_radius * (pi / n).sin()
        axial, transverse = m * a**2 / 2, m * (3 * a**2 + h**2) / 12
        hub_yaw = hub * radius**2 + hub * (3 * r**2 + arb("0.01") ** 2) / 12
        rollers_yaw = n * ((transverse + axial) / 2 + m * radius**2 + m * r**2 / 2)
        wanted = {
            "mass": 1 + hub * n_wheels + n_wheels * n * m,
            "wheel_inertia": hub * r**2 / 2 + n * (transverse + m * r**2),
            "yaw_inertia": radius**2 / 2 + n_wheels * (hub_yaw + rollers_yaw),
            "roller_inertia": axial,
        }
        for name, value in wanted.items():
            assert abs(float(vehicle.number(name) - value)) <= 1e-30, name


def difference(vehicle, a, b):
    return Speeds.unflat(vehicle, [x - y for x, y in zip(a.flat(), b.flat(), strict=True)])


@pytest.mark.parametrize("model", ["locked", "free"])
@pytest.mark.parametrize("moves", [{0: 1}, {1: -1}, {0: -1, 2: 1}])
def test_impact_from_momentum_is_the_literal_projection(model, moves):
    rng = np.random.default_rng(10)
    for vehicle in (random_vehicle(rng, 3, 5), general_vehicle(rng, 3, 4)):
        nu, chi, spins = random_state(rng, vehicle)
        dq = lagrange.speeds(vehicle, nu, chi, spins, model=model, theta=0.2)
        chi, dq = switch.relabel(vehicle, chi, dq, moves)
        fast = switch.impact(vehicle, 0.2, chi, dq, model=model)
        literal = switch.impact_literal(vehicle, 0.2, chi, dq, model=model)
        assert gap(fast.flat(), literal.flat()) <= TINY * size(literal.flat())
        energies = [
            lagrange.kinetic_energy(vehicle, exact(0.2), chi, speeds, model=model)
            for speeds in (dq, literal, difference(vehicle, dq, literal))
        ]
        assert abs(float(energies[0] - energies[1] - energies[2])) <= TINY * float(energies[0])  # Carnot
        again = switch.impact(vehicle, 0.2, chi, literal, model=model)
        assert gap(again.flat(), literal.flat()) <= TINY * size(literal.flat())  # a projection


@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_massless_rollers_switch_without_a_trace(law):
    rng = np.random.default_rng(11)
    vehicle = random_vehicle(rng, 3, 5)
    nu, chi, _ = random_state(rng, vehicle)
    dq = lagrange.speeds(vehicle, nu, chi, model="massless", theta=0.2)
    _, after = switch.after_switch(vehicle, exact(0.2), chi, dq, {0: 1, 2: -1}, model="massless", law=law)
    assert gap(after.flat(), dq.flat()) <= TINY * size(dq.flat())


def test_relabelling_keeps_every_roller_where_it_is():
    """psi = chi + kappa of each physical roller is the same on both sides of a switch, up to a turn."""
    vehicle = paper_vehicle()
    n = vehicle.rollers_per_wheel
    dq = Speeds.zero(vehicle)
    dq.phi = [[exact(10 * i + j) for j in range(n)] for i in range(vehicle.wheels)]
    for direction in (1, -1):
        chi, after = switch.relabel(vehicle, [exact(0.1)] * 3, dq, {1: direction})
        for j in range(n):
            name = int(float(after.phi[1][j])) - 10
            turned = exact(0.1) + vehicle.kappa(name) - chi[1] - vehicle.kappa(j)
            assert abs(float((turned / 2).sin())) <= 1e-50


@pytest.mark.parametrize("model", MODELS)
def test_series_of_motion_satisfy_the_equations(model):
    """The accelerations read from the series at the end of a step are those of the state there."""
    rng = np.random.default_rng(12)
    vehicle = random_vehicle(rng, 3, 4)
    nu, chi, spins = random_state(rng, vehicle, filled=0.5)
    state = taylor.start(vehicle, nu=nu, chi=chi, spins=spins, pose=(0, 0, 0.3), model=model)

    @working_precision
    def check():
        series = taylor.Series(vehicle, state, model, 30)
        h = series.step(exact("1e-28"))
        later = series.state(state.t, h, state.contact)
        pushed = [taylor.horner([k * c for k, c in enumerate(rate)][1:], h) for rate in series.rate]
        nu_later = taylor.nu(vehicle, later)
        spins_later = [w[1:] for w in later.dq.phi]
        at = {"model": model, "theta": later.theta}
        wanted = lagrange.accelerations(vehicle, nu_later, later.chi, spins_later, **at).second.flat()
        assert gap(pushed, wanted) <= 1e-24 * size(wanted)
        demanded = lagrange.speeds(vehicle, nu_later, later.chi, spins_later, **at)
        assert gap(later.dq.flat(), demanded.flat()) <= 1e-26 * size(demanded.flat())
        energies = [taylor.energy(vehicle, s, model=model) for s in (state, later)]
        assert abs(float(energies[1] - energies[0])) <= 1e-26 * float(energies[0])

    check()


@pytest.mark.long
def test_references_do_not_depend_on_the_order():
    """The same motion with two orders and tolerances, switches included, to 17 digits."""
    vehicle = paper_vehicle()
    state = taylor.start(vehicle, nu=(1, 0.2, 1), chi=(0.1, 0, -0.2), model="locked")
    ends = []
    for digits, order in ((17, 20), (21, 26)):
        motion = taylor.simulate(vehicle, state, 0.3, model="locked", law="impact", digits=digits, order=order)
        assert len(motion.switches) >= 1
        ends.append([*motion.end.pose, *taylor.nu(vehicle, motion.end), *motion.end.chi])
    assert gap(*ends) <= 1e-15


def test_condition_of_a_difference():
    """x - y at 1 and 1 - 1e-6 has the condition (1 + 1 - 1e-6)/1e-6; x^2 has 2."""
    found = condition.cond(lambda x: [x[0] - x[1], x[0] ** 2], [1.0, 1.0 - 1e-6])
    assert found == pytest.approx([(2 - 1e-6) / 1e-6, 2.0], rel=1e-9)


def test_random_vehicles_are_admissible():
    rng = np.random.default_rng(13)
    for _ in range(200):
        vehicle = random_vehicle(rng, int(rng.integers(2, 7)), int(rng.integers(3, 61)))
        n = vehicle.rollers_per_wheel
        assert vehicle.roller_axis_radius < vehicle.wheel_radius * np.cos(np.pi / n)
        assert vehicle.yaw_inertia > vehicle.wheels * n * vehicle.roller_inertia / 2


def test_wheels_placed_anywhere_roll():
    """A wheel at p with axle n: the part of v_C along n is n.(v_S + theta' Z x p) - rho phi', along h it
    holds l chi'.
    """
    rng = np.random.default_rng(14)
    vehicle = general_vehicle(rng, 3, 5)
    nu, chi, _ = random_state(rng, vehicle)
    dq = lagrange.speeds(vehicle, nu, chi, model="free", theta=0.0)
    for i in range(3):
        (px, py), beta = vehicle.place(i), vehicle.axle_angle(i)
        hub = (dq.x - dq.theta * py, dq.y + dq.theta * px)
        rho = vehicle.number("wheel_radius") * exact(chi[i]).cos() - vehicle.number("roller_axis_radius")
        assert abs(float(beta.cos() * hub[0] + beta.sin() * hub[1] - rho * dq.phi[i][0])) <= 1e-50
        forward = beta.cos() * hub[1] - beta.sin() * hub[0]
        assert abs(float(forward + vehicle.number("wheel_radius") * dq.chi[i])) <= 1e-50


def test_vehicle_type_keeps_floats():
    vehicle = random_vehicle(np.random.default_rng(15), 3, 5)
    assert isinstance(vehicle, OracleVehicle)
    assert vehicle.permuted((2, 0, 1)).wheel_angles[0] == vehicle.wheel_angles[2]
    assert kinematics.cross((1, 0, 0), (0, 1, 0)) == (0, 0, 1)
