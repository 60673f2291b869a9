"""The generated Python kernels in ball arithmetic, function by function, against the oracle: 40 digits."""

import importlib
import inspect

import numpy as np
import pytest
from flint import arb, ctx
from oracle import PRECISION, lagrange, switch
from oracle.balls import exact
from oracle.lagrange import Speeds
from oracle.states import random_state, random_vehicle

from omniroll.kernels.kernel import form

SETS = ("massless", "locked", "free", "locked_sharp", "free_sharp")
SIZES = [(2, 3), (3, 5), (6, 7)]
TINY = 1e-40


@pytest.fixture(autouse=True)
def sixty_digits():
    with ctx.workprec(PRECISION):
        yield


def model_of(name):
    return name.removesuffix("_sharp")


class Case:
    """A generated set with a vehicle and a state, all in balls."""

    def __init__(self, name, wheels, rollers, numbers=exact):
        self.name, self.roller_model = name, model_of(name)
        self.module = importlib.import_module(f"omniroll.generated.python.{self.roller_model}")
        self.sharp = name != self.roller_model
        rng = np.random.default_rng([wheels, rollers])
        self.rng, self.vehicle = rng, random_vehicle(rng, wheels, rollers)
        nu, chi, spins = random_state(rng, self.vehicle)
        as_numbers = lambda values: [numbers(float(v)) for v in values]  # noqa: E731
        self.nu, self.chi, self.spins = (as_numbers(nu), as_numbers(chi), [as_numbers(wheel) for wheel in spins])
        fields = self.vehicle.fields()
        angles = as_numbers(fields.pop("wheel_angles"))
        wanted = inspect.signature(self.module.prepare).parameters  # massless rollers have no inertia
        scalars = {k: v if isinstance(v, int) else numbers(v) for k, v in fields.items() if k in wanted}
        self.model = self.module.prepare(**scalars, wheel_angles=angles)
        self.free = self.roller_model == "free"
        self.of_every_roller = "accelerations" if self.free else "forward_dynamics"

    def call(self, name, *arguments):
        return self.function(name)(self.model, *arguments)

    def function(self, name):
        return getattr(self.module, form(name, self.sharp, vars(self.module)))

    def momenta(self):
        return [self.call("momenta", self.call("axial_speeds", self.nu, self.chi, self.spins))] if self.free else []

    def speeds(self):
        return lagrange.speeds(self.vehicle, self.nu, self.chi, self.spins, model=self.roller_model)

    def oracle(self, **more):
        return lagrange.accelerations(self.vehicle, self.nu, self.chi, self.spins, model=self.roller_model, **more)


def flatten(values):
    return [v for part in values for v in flatten(part)] if isinstance(values, (list, tuple)) else [values]


def close(found, wanted, tolerance=TINY):
    found, wanted = flatten(found), flatten(wanted)
    size = max(abs(float(w)) for w in wanted)
    for a, b in zip(found, wanted, strict=True):
        assert float(abs(exact(a) - b).upper()) <= tolerance * size


@pytest.fixture(params=SIZES, ids=lambda size: "N={} n={}".format(*size))
def size(request):
    return request.param


@pytest.mark.parametrize("name", SETS)
def test_accelerations(name, size):
    case = Case(name, *size)
    wanted = case.oracle()
    found = case.call(case.of_every_roller, case.nu, case.chi, *([case.spins] if case.free else []))
    close(found[0] if case.free else found, wanted.nu_dot)
    if case.free:
        close(found[1], wanted.spins_dot)


@pytest.mark.parametrize("name", SETS)
def test_reduced_form(name, size):
    case = Case(name, *size)
    close(case.call("forward_dynamics", case.nu, case.chi, *case.momenta()), case.oracle().nu_dot)


@pytest.mark.parametrize("name", SETS)
def test_mass_matrix_and_bias(name, size):
    """M nu' = forces, M symmetric; with 2T* = nu.M nu where no free roller spins about its own axis."""
    case = Case(name, *size)
    matrix, force = case.call("mass_matrix", case.chi), case.call("forces", case.nu, case.chi, *case.momenta())
    nu_dot = case.oracle().nu_dot
    close([sum(m * a for m, a in zip(row, nu_dot, strict=True)) for row in matrix], force, 1e-36)
    assert all(float(abs(matrix[a][b] - matrix[b][a]).upper()) <= 1e-50 for a in range(3) for b in range(a))
    spins = [[exact(0)] * (case.vehicle.rollers_per_wheel - 1)] * case.vehicle.wheels
    if case.free:  # free rollers that do not turn in space
        spins = case.call("spins_from_axial", case.nu, case.chi, spins)
    dq = lagrange.speeds(case.vehicle, case.nu, case.chi, spins, model=case.roller_model)
    twice = 2 * lagrange.kinetic_energy(case.vehicle, exact(0), case.chi, dq, model=case.roller_model)
    close(sum(case.nu[a] * matrix[a][b] * case.nu[b] for a in range(3) for b in range(3)), twice)


@pytest.mark.parametrize("name", SETS)
def test_energy(name, size):
    case = Case(name, *size)
    wanted = lagrange.kinetic_energy(case.vehicle, exact(0), case.chi, case.speeds(), model=case.roller_model)
    close(case.call("energy", case.nu, case.chi, *([case.spins] if case.free else [])), wanted)


@pytest.mark.parametrize("name", SETS)
def test_kinematics(name, size):
    case = Case(name, *size)
    chi_dot, contact_spin = case.call("wheel_rates", case.nu, case.chi)
    dq = lagrange.speeds(case.vehicle, case.nu, case.chi, model="free", theta=0.8)
    close(chi_dot, dq.chi)
    close(case.call("wheel_speeds", case.nu), dq.chi)
    close(contact_spin, [wheel[0] for wheel in dq.phi])
    close(case.call("pose_rates", case.nu, exact(0.8)), [dq.x, dq.y, dq.theta])
    if case.vehicle.wheels >= 3:
        close(case.call("nu_from_wheels", chi_dot), case.nu, 1e-35)


def test_free_rollers_keep_their_axial_speeds(size):
    """axial = phi' + theta' sin(psi) is constant: its rate along the oracle's accelerations is zero."""
    case = Case("free", *size)
    vehicle, turn = case.vehicle, case.nu[2] / case.vehicle.number("yaw_scale")
    axial = case.call("axial_speeds", case.nu, case.chi, case.spins)
    close(case.call("spins_from_axial", case.nu, case.chi, axial), case.spins)
    wanted, rates, found = [], [], case.oracle()
    for i, wheel in enumerate(case.spins):
        for j, spin in enumerate(wheel, start=1):
            psi = case.chi[i] + vehicle.kappa(j)
            wanted.append(spin + turn * psi.sin())
            yaw = found.second.theta
            rates.append(found.spins_dot[i][j - 1] + yaw * psi.sin() + turn * psi.cos() * case.speeds().chi[i])
    close(axial, wanted)
    contact = [wheel[0] + turn * chi.sin() for wheel, chi in zip(case.speeds().phi, case.chi, strict=True)]
    close(case.call("contact_axial", case.nu, case.chi), contact)
    assert max(float(abs(r).upper()) for r in rates) <= 1e-45
    inertia = vehicle.number("roller_inertia")
    for i, pair in enumerate(case.call("momenta", axial)):
        angles = [vehicle.kappa(j) for j in range(1, vehicle.rollers_per_wheel)]
        sums = [sum(inertia * w * f(k) for w, k in zip(axial[i], angles, strict=True)) for f in (arb.cos, arb.sin)]
        assert max(float(abs(a - b).upper()) for a, b in zip(pair, sums, strict=True)) <= 1e-50


@pytest.mark.parametrize("name", SETS)
def test_torques_give_the_accelerations_asked_for(name):
    """Inverse dynamics and its wheel torques, put on the oracle's wheels as generalised forces."""
    for size in ((3, 5), (6, 7)):
        case = Case(name, *size)
        wanted = [exact(float(v)) for v in case.rng.normal(size=3)]
        force = case.call("inverse_dynamics", case.nu, case.chi, *case.momenta(), wanted)
        torques = case.call("wheel_torques", force)
        push = Speeds.zero(case.vehicle)
        push.chi = torques
        close(case.oracle(forces=push).nu_dot, wanted, 1e-34)


@pytest.mark.parametrize("moves", [{0: 1}, {1: -1}, {0: -1, 1: 1}])
@pytest.mark.parametrize("name", ["locked", "free", "locked_sharp", "free_sharp"])
def test_impact(name, size, moves):
    """Wheels at their joints; the kernel's arguments, made as their meaning says, against the literal
    projection.
    """
    case = Case(name, *size)
    model, theta = case.roller_model, exact(0.3)
    for i, direction in moves.items():
        case.chi[i] = direction * arb.pi() / case.vehicle.rollers_per_wheel
    dq = lagrange.speeds(case.vehicle, case.nu, case.chi, case.spins, model=model, theta=theta)
    chi, moved = switch.relabel(case.vehicle, case.chi, dq, moves)
    wanted = switch.impact_literal(case.vehicle, theta, chi, moved, model=model)
    demanded = switch.smooth(case.vehicle, theta, chi, moved, model=model)
    entering, leaving = ([exact(0)] * case.vehicle.wheels for _ in range(2))
    for i in moves:
        entering[i] = moved.phi[i][0] - demanded.phi[i][0]
        leaving[i] = dq.phi[i][0] if model == "locked" else exact(0)
    close(case.call("impact", case.nu, chi, entering, leaving), switch.nu_of(case.vehicle, theta, wanted), 1e-36)
