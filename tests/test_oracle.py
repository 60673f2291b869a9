"""The oracle checked against itself: other formulations of the same mechanics, and properties it must
have.
"""

from functools import partial

import numpy as np
import pytest
from flint import arb_mat, ctx
from oracle import PRECISION, bodies, lagrange, switch, taylor
from oracle.balls import exact, working_precision
from oracle.lagrange import MODELS, Speeds
from oracle.states import paper_parts, paper_vehicle, random_state, random_vehicle

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


@working_precision
def inertia_forces(energy, q, dq, second):
    """d/dt dT/dq' - dT/dq of an energy of (q, q'), differentiated numerically."""
    count, step = len(q.flat()), exact("1e-24")
    shape = partial(Speeds.shaped, len(q.chi), len(q.phi[0]))
    place, speed, push = q.flat(), dq.flat(), second.flat()
    at = lambda p, v: energy(shape(p), shape(v))  # noqa: E731
    shifted = lambda p, d, h: [a + b * h for a, b in zip(p, d, strict=True)]  # noqa: E731

    def momentum(unit, h):
        there = [p + v * h + a * h * h / 2 for p, v, a in zip(place, speed, push, strict=True)]
        now = shifted(speed, push, h)
        return (at(there, shifted(now, unit, 1)) - at(there, shifted(now, unit, -1))) / 2  # T is quadratic

    forces = []
    for k in range(count):
        unit = [exact(int(k == m)) for m in range(count)]
        slope = at(shifted(place, unit, step), speed) - at(shifted(place, unit, -step), speed)
        forces.append((momentum(unit, step) - momentum(unit, -step) - slope) / (2 * step))
    return forces


def check_by_dalembert(vehicle, energy, model, forces=None):
    """Forces less those of inertia do no work on any admissible motion; and the motion itself stays admissible."""
    nu, chi, spins = random_state(np.random.default_rng(8), vehicle)
    with ctx.workprec(400):
        at = {"model": model, "theta": exact(0.4)}
        found = lagrange.accelerations(vehicle, nu, chi, spins, **at, forces=forces)
        dq = lagrange.speeds(vehicle, nu, chi, spins, **at)
        q = Speeds(exact(1), exact(2), exact(0.4), [exact(c) for c in chi], dq.map(lambda _: exact(0.3)).phi)
        inertia = inertia_forces(energy, q, dq, found.second)
        acting = [exact(0)] * len(inertia) if forces is None else forces.map(exact).flat()
        basis = switch.nullspace(vehicle, q.theta, q.chi, model=model).transpose()
        for work in (basis * arb_mat([[a - b] for a, b in zip(inertia, acting, strict=True)])).entries():
            assert abs(float(work)) <= 1e-30 * size(inertia)
        step, spun = exact("1e-24"), [[exact(s) for s in wheel] for wheel in spins]
        beside = []
        for h in (step, -step):
            moved = [exact(a) + b * h for a, b in zip(nu, found.nu_dot, strict=True)]
            turned = [exact(a) + b * h for a, b in zip(chi, dq.chi, strict=True)]
            spinning = [[a + b * h for a, b in zip(*pair, strict=True)]
                        for pair in zip(spun, found.spins_dot, strict=True)]  # fmt: skip
            beside.append(lagrange.speeds(
                vehicle, moved, turned, spinning, model=model, theta=at["theta"] + dq.theta * h).flat())  # fmt: skip
        slopes = [(a - b) / (2 * step) for a, b in zip(*beside, strict=True)]
        assert gap(slopes, found.second.flat()) <= 1e-30 * size(slopes)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("wheels, rollers", [(2, 3), (3, 4)])
def test_accelerations_are_those_of_lagranges_equations(wheels, rollers, model):
    """Of (3.2) and random forces, for wheels anywhere and a centre of mass beside S."""
    rng = np.random.default_rng([1, wheels, rollers])
    vehicle = general_vehicle(rng, wheels, rollers)
    energy = lambda q, dq: lagrange.kinetic_energy(vehicle, q.theta, q.chi, dq, model=model)  # noqa: E731
    check_by_dalembert(vehicle, energy, model, random_forces(rng, vehicle, model))


@pytest.mark.parametrize("model", MODELS)
def test_equations_of_motion_from_bodies_in_space(model):
    """Two wheels with four rollers each: the energy is that of all eleven bodies."""
    parts, _ = paper_parts(wheels=2, rollers=4)
    vehicle = paper_vehicle(wheels=2, rollers=4)
    if model == "massless":  # rollers that do not turn about their axes are no rollers: all spins stand
        parts = bodies.Parts(**(vars(parts) | {"roller": bodies.Solid(parts.roller.mass, 0, parts.roller.transverse)}))
        vehicle = vehicle.with_(**bodies.inertias(parts))
    check_by_dalembert(vehicle, partial(bodies.kinetic_energy, parts), model)


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
