"""Mecanum wheels against a model of all bodies in all coordinates."""

import numpy as np
import pytest

from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from tests.mecanum.all_bodies import (
    accelerations,
    after_impact,
    height_of_contact,
    inertial_force,
    mass_matrix,
    pushes,
)
from tests.mecanum.vehicles import (
    coordinates,
    free_places,
    own,
    platform_rates,
    random_bodies,
    rolling_rates,
    vehicle_of,
)

MODELS = ("massless", "locked", "free")
SIZES = [(1, 3, 5), (2, 4, 6), (3, 5, 4), (4, 6, 3), (5, 4, 9)]


def drawn(seed: int, wheels: int, rollers: int, model: str):
    """Bodies, vehicle, nu, chi and spins of the free rollers."""
    draw = np.random.default_rng(1000 + seed)
    bodies = random_bodies(seed, wheels, rollers, model == "massless")
    vehicle = vehicle_of(bodies, 1e-6 if model == "massless" else None)
    nu, chi = draw.normal(size=3), draw.uniform(-1, 1, wheels) * np.pi / rollers
    spins = draw.normal(size=(wheels, rollers - 1)) * (20 if model == "free" else 0)
    return bodies, vehicle, nu, chi, spins


def in_phase(bound, stands):
    """The kernel while these wheels stand on their joints."""
    pivots = np.isin(np.arange(bound.wheels), stands).astype(int)
    return kernel_in_phase(bound, Carry(np.zeros(bound.wheels, int), pivots))


def found_accelerations(bound, nu, chi, spins, torque):
    """nu' by the reduced system, and the accelerations of the free rollers."""
    if bound.roller_model != "free":
        return bound.forward_dynamics(nu, chi, torque), None
    axial = bound.axial_speeds(nu, chi, spins)
    nu_dot, spins_dot = bound.accelerations(nu, chi, spins, torque)
    reduced = bound.forward_dynamics(nu, chi, bound.momenta(axial), torque)
    np.testing.assert_allclose(reduced, nu_dot, rtol=1e-10, atol=1e-10 * np.abs(nu_dot).max())
    return nu_dot, spins_dot


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("seed", "wheels", "rollers", "backend"),
                         [(*sizes, ("python", "compiled")[sizes[0] % 2]) for sizes in SIZES])
def test_rates_energy_and_accelerations_are_those_of_the_bodies(seed, wheels, rollers, model, backend):
    bodies, vehicle, nu, chi, spins = drawn(seed, wheels, rollers, model)
    bound, q = kernel(vehicle, model, backend, effects=("drive",)), coordinates(bodies, chi)
    rates = rolling_rates(bodies, vehicle, nu, chi, spins)
    chi_dot, spin = bound.wheel_rates(nu, chi)
    np.testing.assert_allclose([*chi_dot, *spin], rates[own(bodies)], rtol=1e-12, atol=1e-12 * np.abs(rates).max())
    np.testing.assert_array_equal(bound.wheel_speeds(nu, chi), chi_dot)
    energy = rates @ mass_matrix(bodies, q).real @ rates / 2
    assert bound.energy(nu, chi, *bound.spins_or_nothing(spins)) == pytest.approx(energy, rel=1e-12)

    torque, force = np.linspace(-1, 2, wheels), np.zeros(bodies.size)
    force[own(bodies)[:wheels]] = torque
    held = [] if model == "free" else free_places(bodies)
    expected = accelerations(bodies, q, rates, force, held)
    turned = np.array([-rates[1] * rates[2], rates[0] * rates[2], 0])  # of the axes, which turn with the platform
    nu_dot, spins_dot = found_accelerations(bound, nu, chi, spins, torque)
    np.testing.assert_allclose(platform_rates(vehicle, nu_dot) + turned, expected[:3], rtol=1e-10,
                               atol=1e-10 * np.abs(expected[:3]).max())  # fmt: skip
    if spins_dot is not None:
        np.testing.assert_allclose(spins_dot.ravel(), expected[free_places(bodies)], rtol=1e-10,
                                   atol=1e-10 * np.abs(expected).max())  # fmt: skip
    chi_ddot = bound.call("wheel_accelerations", nu, chi, nu_dot)
    np.testing.assert_allclose(
        chi_ddot, expected[own(bodies)[:wheels]], rtol=1e-10, atol=1e-10 * np.abs(expected).max()
    )


def test_rollers_touch_the_ground_where_the_bodies_do():
    bodies, _, _, chi, _ = drawn(2, 4, 6, "free")
    for wheel in range(4):
        assert abs(height_of_contact(bodies, coordinates(bodies, chi), wheel)) < 1e-10


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("seed", "wheels", "rollers"), SIZES)
def test_a_wheel_that_stands_on_its_joint_is_that_of_the_bodies(seed, wheels, rollers, model):
    bodies, vehicle, nu, chi, spins = drawn(seed, wheels, rollers, model)
    stands = [(seed + 1) % wheels, (seed + 2) % wheels][: 1 + seed % 2]
    chi[stands] = np.pi / rollers * np.array([1, -1])[: len(stands)]
    bound = in_phase(kernel(vehicle, model, "compiled", effects=("drive",)), stands)
    q, rates = coordinates(bodies, chi), rolling_rates(bodies, vehicle, nu, chi, spins, stands)
    assert not bound.wheel_speeds(nu, chi)[stands].any()
    energy = rates @ mass_matrix(bodies, q).real @ rates / 2
    assert bound.energy(nu, chi, *bound.spins_or_nothing(spins)) == pytest.approx(energy, rel=1e-12)
    assert abs(pushes(bodies, q, rates, stands) @ rates).max() < 1e-12 * np.abs(rates).max()
    torque, force = np.linspace(-1, 2, wheels), np.zeros(bodies.size)
    force[own(bodies)[:wheels]] = torque
    held = [] if model == "free" else free_places(bodies)
    expected = accelerations(bodies, q, rates, force, held, stands)
    nu_dot, spins_dot = found_accelerations(bound, nu, chi, spins, torque)
    turned = np.array([-rates[1] * rates[2], rates[0] * rates[2], 0])
    np.testing.assert_allclose(platform_rates(vehicle, nu_dot) + turned, expected[:3], rtol=1e-9,
                               atol=1e-9 * np.abs(expected[:3]).max())  # fmt: skip
    if spins_dot is not None:
        np.testing.assert_allclose(spins_dot.ravel(), expected[free_places(bodies)], rtol=1e-9,
                                   atol=1e-9 * np.abs(expected).max())  # fmt: skip
    inputs = () if model != "free" else (bound.momenta(bound.axial_speeds(nu, chi, spins)),)
    asked = bound.call("inverse_dynamics", nu, chi, *inputs, torque, nu_dot)
    assert np.abs(asked).max() < 1e-11 * np.abs(bound.mass_matrix(chi) @ nu_dot).max()
    power = rates @ (mass_matrix(bodies, q).real @ expected + inertial_force(bodies, q, rates))
    assert power == pytest.approx(force @ rates, rel=1e-9, abs=1e-9 * np.abs(force).max() * np.abs(rates).max())


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("seed", "wheels", "rollers", "what"), [
    (*SIZES[1], "passes"), (*SIZES[2], "stops"), (*SIZES[1], "goes"), (*SIZES[2], "goes to the next"),
])  # fmt: skip
def test_an_impact_is_that_of_the_bodies_and_loses_what_carnot_says(seed, wheels, rollers, what, model):
    """Some wheels pass on, and others stop at their joints or go on from there."""
    bodies, vehicle, nu, chi, spins = drawn(seed, wheels, rollers, model)
    joint, passing, some = np.pi / rollers, np.arange(wheels) % 2 == 0, np.arange(wheels) == 1
    passing = passing | (some if what == "goes to the next" else False)
    was, stands = some & what.startswith("goes"), some & (what == "stops")
    chi[passing | some] = joint
    before = rolling_rates(bodies, vehicle, nu, chi, spins, np.flatnonzero(was))
    after = np.where(passing, -joint, chi)
    q = coordinates(bodies, after)
    # The rollers take each other's numbers where a wheel passes on: that which comes is roller 0 now.
    rates = before.copy()
    for wheel in np.flatnonzero(passing):
        places = [bodies.place(wheel, j) for j in range(rollers)]
        rates[places] = np.roll(before[places], 1)
    held = [] if model == "free" else free_places(bodies)
    expected = after_impact(bodies, q, rates, held, np.flatnonzero(stands))
    plain = kernel(vehicle, model, "compiled")
    first, bound = in_phase(plain, np.flatnonzero(was)), in_phase(plain, np.flatnonzero(stands))
    excess = np.where(passing | some, first.wheel_speeds(nu, chi) - bound.wheel_speeds(nu, after), 0)
    if model == "massless":
        nu_after = bound.call("impact", nu, after, excess)
    elif model == "locked":
        spin, next_spin = first.wheel_rates(nu, chi)[1], bound.wheel_rates(nu, after)[1]
        nu_after = bound.call("impact", nu, after, np.where(passing, -next_spin, 0), np.where(passing, spin, 0), excess)
    else:
        axial = first.axial_speeds(nu, chi, spins)
        came_with = np.where(passing, axial[:, -1], first.contact_axial(nu, chi))
        entering = np.where(passing | some, came_with - bound.contact_axial(nu, after), 0)
        nu_after = bound.call("impact", nu, after, entering, np.zeros(wheels), excess)
    np.testing.assert_allclose(platform_rates(vehicle, nu_after), expected[:3], rtol=1e-10, atol=1e-10)

    mass = mass_matrix(bodies, q).real
    energies = [rates @ mass @ rates, expected @ mass @ expected, (rates - expected) @ mass @ (rates - expected)]
    assert energies[0] - energies[1] == pytest.approx(energies[2], rel=1e-9, abs=1e-13 * energies[0])
