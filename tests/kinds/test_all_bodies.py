"""Wheels of several kinds against a model of all bodies in all coordinates, which shares nothing with the formulas."""

import numpy as np
import pytest

from omniroll.kernels.kernel import kernel
from omniroll.vehicles.checks import rollers_there
from tests.kinds.vehicles import random_bodies, vehicle_of
from tests.mecanum.all_bodies import accelerations, after_impact, mass_matrix
from tests.mecanum.vehicles import coordinates, free_places, own, rolling_rates

MODELS = ("massless", "locked", "free")
COUNTS = [(5, 4, 5), (6, 6, 4, 4), (3, 8, 5, 8, 3), (7, 9, 7, 9, 5, 5)]


def drawn(counts, model, slanted):
    """Bodies, vehicle, nu, chi and spins of the free rollers; those that are held in the bodies."""
    draw = np.random.default_rng(len(counts))
    bodies = random_bodies(len(counts), counts, model, slanted)
    vehicle = vehicle_of(bodies)
    nu, chi = draw.normal(size=3), draw.uniform(-1, 1, len(counts)) * np.pi / np.array(counts)
    inertia = np.array([kind.roller[1] for kind in bodies.kinds])
    spins = 20 * draw.normal(size=(len(counts), max(counts) - 1)) * rollers_there(vehicle) * (inertia[:, None] > 0)
    held = free_places(bodies)
    if model == "free":
        own_places = [
            [bodies.place(i, j) for j in range(1, bodies.kinds[i].rollers)] for i in np.flatnonzero(inertia == 0)
        ]
        held = [place for places in own_places for place in places]
    return bodies, vehicle, nu, chi, spins * (model == "free"), held


@pytest.mark.parametrize("slanted", [False, True], ids=["omni", "mecanum too"])
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("counts", COUNTS)
def test_rates_energy_and_accelerations_are_those_of_the_bodies(counts, model, slanted):
    bodies, vehicle, nu, chi, spins, held = drawn(counts, model, slanted)
    q, rates = coordinates(bodies, chi), rolling_rates(bodies, vehicle, nu, chi, spins)
    torque, force = np.linspace(-1, 2, len(counts)), np.zeros(bodies.size)
    force[own(bodies)[: len(counts)]] = torque
    expected = accelerations(bodies, q, rates, force, held)
    turned = np.array([-rates[1] * rates[2], rates[0] * rates[2], 0])  # of the axes, which turn with the platform
    near = {"rtol": 1e-10, "atol": 1e-10 * np.abs(expected[:3]).max()}
    energy, there = rates @ mass_matrix(bodies, q).real @ rates / 2, rollers_there(vehicle)
    for backend in ("compiled", "python"):
        bound = kernel(vehicle, model, backend, effects=("drive",))
        found = np.concatenate(bound.wheel_rates(nu, chi))
        np.testing.assert_allclose(found, rates[own(bodies)], rtol=1e-12, atol=1e-12 * np.abs(rates).max())
        assert bound.energy(nu, chi, *bound.spins_or_nothing(spins)) == pytest.approx(energy, rel=1e-12)
        inputs = ()
        if model == "free":
            axial = bound.axial_speeds(nu, chi, spins)
            nu_dot, spins_dot = bound.accelerations(nu, chi, spins, torque)
            with_inertia = there & (np.array(vehicle.by_wheel["roller_inertia"]) > 0)[:, None]
            whole = np.zeros(there.shape)
            whole[there] = expected[free_places(bodies)]
            np.testing.assert_allclose(spins_dot[with_inertia], whole[with_inertia], rtol=1e-10,
                                       atol=1e-10 * np.abs(expected).max())  # fmt: skip
            assert not axial[~there].any() and not spins_dot[~there].any()
            inputs = (bound.momenta(axial),)
        nu_dot = bound.forward_dynamics(nu, chi, *inputs, torque)
        scale = np.array([0.3, 0.3, 1 / 1.7])
        np.testing.assert_allclose(scale * nu_dot + turned, expected[:3], **near)


@pytest.mark.parametrize("slanted", [False, True], ids=["omni", "mecanum too"])
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("counts", COUNTS)
def test_an_impact_is_that_of_the_bodies_and_loses_what_carnot_says(counts, model, slanted):
    """Every second wheel passes on to its next roller."""
    bodies, vehicle, nu, chi, spins, held = drawn(counts, model, slanted)
    passing, joint = np.arange(len(counts)) % 2 == 0, np.pi / np.array(counts)
    chi = np.where(passing, joint, chi)
    after = np.where(passing, -joint, chi)
    q, rates = coordinates(bodies, after), rolling_rates(bodies, vehicle, nu, chi, spins)
    for wheel in np.flatnonzero(passing):
        places = [bodies.place(wheel, j) for j in range(counts[wheel])]
        rates[places] = np.roll(rates[places], 1)
    expected = after_impact(bodies, q, rates, held)
    bound = kernel(vehicle, model, "compiled")
    excess = bound.wheel_speeds(nu, chi) - bound.wheel_speeds(nu, after)
    turning = (excess,) if slanted else ()
    if model == "massless":
        nu_after = bound.call("impact", nu, after, *turning) if slanted else nu
    elif model == "locked":
        spin, next_spin = bound.wheel_rates(nu, chi)[1], bound.wheel_rates(nu, after)[1]
        came, left = np.where(passing, -next_spin, 0), np.where(passing, spin, 0)
        nu_after = bound.call("impact", nu, after, came, left, *turning)
    else:
        axial, places = bound.axial_speeds(nu, chi, spins), np.array(counts) - 2
        came_with = np.where(passing, axial[np.arange(len(counts)), places], bound.contact_axial(nu, chi))
        entering = np.where(passing, came_with - bound.contact_axial(nu, after), 0)
        nu_after = bound.call("impact", nu, after, entering, np.zeros(len(counts)), *turning)
    found = np.array([0.3, 0.3, 1 / 1.7]) * nu_after
    np.testing.assert_allclose(found, expected[:3], rtol=1e-10, atol=1e-10)
    mass = mass_matrix(bodies, q).real
    energies = [rates @ mass @ rates, expected @ mass @ expected, (rates - expected) @ mass @ (rates - expected)]
    assert energies[0] - energies[1] == pytest.approx(energies[2], rel=1e-9, abs=1e-13 * energies[0])
