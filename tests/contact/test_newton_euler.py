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


def slipping_case(rng, wheels, rollers, model, **options):
    case = random_case(rng, wheels, rollers, model, **options)
    return Slipping(**vars(case), rates=10 * rng.normal(size=wheels), turns=30 * rng.normal(size=wheels))


def viscous(_, along, across):
    return -exact(DAMPING[0]) * along, -exact(DAMPING[1]) * across


@working_precision
def by_bodies(case, given):
    """(nu', chi'', omega' of the rollers in contact) of the oracle."""
    dq = case.speeds()
    at = position(case.machine, case.heading, case.chi)
    loads = None if not given.guide else dict.fromkeys(range(case.machine.wheels), 0)
    found = solve(case.machine, at, dq, given, model=case.model, loads=loads)
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
    values = {
        "nu": case.nu,
        "chi": case.chi,
        "rates": case.rates,
        "spins": case.spins,
        "heading": case.heading,
    } | inputs
    if case.model == "free":
        yaw_rate = case.nu[2] / case.vehicle.yaw_scale
        values["contact_omega"] = case.turns + yaw_rate * np.sin(case.chi)
        values["axial"] = call(bound, "axial_speeds", values)
        values["momenta"] = call(bound, "momenta", values)
    if "slip_roller_rates" in bound.signatures:
        _, values["roller_drag"], _ = call(bound, "slip_roller_rates", values)
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

