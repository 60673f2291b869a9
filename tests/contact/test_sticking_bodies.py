"""Accelerations, forces and rates of the slip where some contacts stick and others slip, against every body.

The oracle knows no modes. It is given the forces that were found, and must find the same accelerations and the same
rates of the slip; those of contacts that stick must be zero.
"""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb
from oracle.balls import coefficient, exact, working_precision
from oracle.kinematics import cross, dot
from reactions.newton_euler import along, bodies, contact_velocity, position
from reactions.test_newton_euler import FADE, acting, call, random_inputs

from contact.test_newton_euler import MODELS, Slipping, nu_dot, pushed, slipping_case
from omniroll.kernels.kernel import kernel

RELATIVE = 1e-10
OTHERS = ("drive", "motor", "axle_viscous", "axle_coulomb", "roller_viscous", "roller_coulomb", "slope")


def sticking_case(rng, model, sticks, wheels=3, **options) -> Slipping:
    """Of the wheels, those of `sticks` (N,) bool roll."""
    case = slipping_case(rng, wheels, 5, model, has_layout=True, **options)
    rolling = kernel(case.vehicle, model, "python").wheel_rates(case.nu, case.chi)
    return replace(case, rates=np.where(sticks, rolling[0], case.rates), turns=np.where(sticks, rolling[1], case.turns))


def by_kernel(case, sticks, push, others=(), constants=(), **inputs):
    bound = kernel(
        case.vehicle, case.model, "python", effects=("contact", "contact_coulomb", *others), constants=constants
    )
    modes = {"sticks": sticks.astype(float), "ground_push": np.where(sticks[:, None], 0.0, push)}
    return call(bound, "ground_dynamics", case.known(bound, **inputs, **modes))


@working_precision
def by_bodies(case, given, force):
    """(nu', chi'', rates of the slip (N, 2)) under the forces (N, 2) of the ground."""
    machine, dq = case.machine, case.speeds()
    at, found = position(machine, case.heading, case.chi), case.solved(pushed(given, force))
    moving = bodies(machine, along(machine, at, dq, found.second))
    slips = []
    for i, angle in enumerate(machine.axle_angles):
        turned = exact(case.heading) + exact(angle)
        axle = (turned.cos(), turned.sin(), arb(0))
        velocity = contact_velocity(machine, moving, i)
        now, later = ([coefficient(v, k) for v in velocity] for k in (0, 1))
        row = []
        for direction in (axle, cross((arb(0), arb(0), arb(1)), axle)):
            turning = cross((arb(0), arb(0), dq.theta), direction)
            row.append(float(dot(later, direction) + dot(now, turning)))
        slips.append(row)
    return nu_dot(case, found), np.array([float(v) for v in found.second.chi]), np.array(slips)


def assert_same(case, sticks, given, found):
    nu_rates, _, rates, *_, force, slip_dot = found
    wanted_nu, wanted_rates, slips = by_bodies(case, given, force)
    for value, wanted in ((nu_rates, wanted_nu), (rates, wanted_rates)):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * np.abs(wanted).max())
    components = slice(0, 2) if case.model == "free" else slice(1, 2)
    size = np.abs(slips).max() + np.abs(case.vehicle.wheel_radius * wanted_rates).max()
    assert slip_dot[:, components] == pytest.approx(slips[:, components], abs=RELATIVE * size)
    assert np.abs(slips[sticks][:, components]).max(initial=0.0) <= RELATIVE * size


@pytest.mark.parametrize("model", MODELS)
def test_every_effect_at_once_agrees_with_every_body(model):
    """Motors, bearings, rollers' bearings and a slope; one of the three contacts slips."""
    sticks = np.array([True, False, True])
    rng = np.random.default_rng([12, MODELS.index(model)])
    case = sticking_case(rng, model, sticks)
    constants, inputs = random_inputs(rng, 3)
    assert set(FADE) <= set(constants)
    found = by_kernel(case, sticks, rng.normal(size=(3, 2)), OTHERS, tuple(constants.items()), **inputs)
    forces = acting(case, constants, inputs)
    assert_same(case, sticks, working_precision(forces)(case.speeds()), found)
