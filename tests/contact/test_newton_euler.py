"""Accelerations and forces where wheels slip, against Newton's and Euler's equations of every body, which has the same
friction."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from flint import arb
from oracle.balls import exact, working_precision
from reactions.machines import Case, random_case
from reactions.newton_euler import position, solve
from reactions.test_newton_euler import FADE, acting, call, nu_dot, random_inputs

from omniroll.kernels.kernel import kernel

MODELS = ("massless", "free")
RELATIVE = 1e-11
DAMPING = (3.7, 1.9)  # N s/m, along the axle and along the rolling direction


@dataclass
class Slipping(Case):
    """A state in which wheels slip: rates (N,) of the wheels, turns (N,) the spins of the rollers in contact."""

    rates: np.ndarray = None
    turns: np.ndarray = None

    @working_precision
    def speeds(self):
        dq = super().speeds()
        dq.chi = [exact(rate) for rate in self.rates]
        if self.model == "free":
            for i, turn in enumerate(self.turns):
                dq.phi[i][0] = exact(turn)
        return dq

    def known(self, bound, **inputs):
        """What a kernel's functions take of this state and of further inputs, by name."""
        names = ("nu", "chi", "rates", "spins", "heading")
        values = {name: getattr(self, name) for name in names} | inputs
        if self.model == "free":
            values["contact_omega"] = self.turns + self.nu[2] / self.vehicle.yaw_scale * np.sin(self.chi)
            values["axial"] = call(bound, "axial_speeds", values)
            values["momenta"] = call(bound, "momenta", values)
        if "slip_roller_rates" in bound.signatures:
            _, values["roller_drag"], _ = call(bound, "slip_roller_rates", values)
        return values

    @working_precision
    def solved(self, given):
        """What the oracle finds under these forces; where a guide holds the vehicle, all loads are 0."""
        loads = dict.fromkeys(range(self.machine.wheels), 0) if given.guide else None
        at = position(self.machine, self.heading, self.chi)
        return solve(self.machine, at, self.speeds(), given, model=self.model, loads=loads)

    @working_precision
    def spins_by_bodies(self, given):
        """(N, n) in rad/s^2, accelerations of the rollers' spins under these forces."""
        return np.array([[float(v) for v in row] for row in self.solved(given).second.phi])


def named(bound, function, values):
    """What a function of the kernel gives, by name."""
    outputs = [argument.name for argument in bound.signatures[function].outputs]
    return dict(zip(outputs, call(bound, function, values), strict=True))


@working_precision
def pushed(given, force):
    """The same forces, with the ground's (N, 2) as they are."""
    return replace(given, ground=lambda i, *_: (exact(force[i, 0]), exact(force[i, 1])))


def slipping_case(rng, wheels, rollers, model, **options):
    case = random_case(rng, wheels, rollers, model, **options)
    return Slipping(**vars(case), rates=10 * rng.normal(size=wheels), turns=30 * rng.normal(size=wheels))


def viscous(_, along, across):
    return -exact(DAMPING[0]) * along, -exact(DAMPING[1]) * across


@working_precision
def by_bodies(case, given):
    """(nu', chi'', omega' of the rollers in contact) of the oracle."""
    dq, found = case.speeds(), case.solved(given)
    second = found.second
    axial = []
    for i, chi in enumerate(case.chi):
        sin, cos = arb(float(chi)).sin(), arb(float(chi)).cos()
        axial.append(second.phi[i][0] + second.theta * sin + dq.theta * dq.chi[i] * cos)
    return nu_dot(case, found), np.array([float(v) for v in second.chi]), np.array([float(v) for v in axial])


FRICTION, LOAD, FADE_SPEED = (0.7, 0.3), 8.5, 0.02


def regularised(model):
    """Coulomb's law with an ellipse and a named speed, of that slip which the contact can have."""

    def law(_, along, across):
        axle, rolling = (exact(mu) for mu in FRICTION)
        along = along * 0 if model == "massless" else along
        size = ((axle * along) ** 2 + (rolling * across) ** 2 + axle * rolling * exact(FADE_SPEED) ** 2).sqrt()
        return -exact(LOAD) * axle**2 * along / size, -exact(LOAD) * rolling**2 * across / size

    return law


LAWS = {
    "contact_viscous": {"ground_damping": DAMPING},
    "contact_regularised": {"contact_load": LOAD, "ground_friction": FRICTION, "ground_fade_speed": FADE_SPEED},
}


def by_kernel(case, effects=(), constants=(), law="contact_viscous", **inputs):
    names = ("contact", law, *effects)
    constants = (*LAWS[law].items(), *constants)
    bound = kernel(case.vehicle, case.model, "python", effects=names, constants=constants)
    values = case.known(bound, **inputs)
    nu_rates, chi_dot, rates, *axial = call(bound, "slip_dynamics", values)
    assert (chi_dot == case.rates).all()
    return (nu_rates, rates, *axial), call(bound, "slip_forces", values)


def assert_same(case, given, found):
    for value, wanted in zip(found, by_bodies(case, given), strict=False):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * np.abs(wanted).max())


@pytest.mark.parametrize("model", MODELS)
def test_every_effect_at_once_agrees_with_every_body(model):
    """The vehicle stands on its three wheels, on a slope."""
    rng = np.random.default_rng([7, MODELS.index(model)])
    case = slipping_case(rng, 3, 5, model, has_layout=True)
    constants, inputs = random_inputs(rng, 3)
    assert set(FADE) <= set(constants)
    others = ("drive", "motor", "axle_viscous", "axle_coulomb", "roller_viscous", "roller_coulomb", "slope")
    found, _ = by_kernel(case, others, tuple(constants.items()), **inputs)
    forces = acting(case, constants, inputs)
    assert_same(case, replace(working_precision(forces)(case.speeds()), ground=viscous), found)
