"""Mecanum wheels, wheels with two rows of rollers and profiles against a model of all bodies in all coordinates."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.accelerations import call_named
from omniroll.vehicles import profiles
from tests.mecanum.all_bodies import accelerations, after_impact, height_of_contact, inertial_force, mass_matrix, pushes
from tests.mecanum.vehicles import contacts, coordinates, drawn, free_places, own, platform_rates, rolling_rates

MODELS = ("massless", "locked", "free")
SIZES = [(1, 3, 5), (2, 4, 6), (3, 5, 4), (4, 6, 3), (5, 4, 9)]
each_kind = pytest.mark.parametrize("kind", ["mecanum", "rows", "profile", "arcs"])


def in_phase(bound, bodies, stands=()):
    """The kernel while these wheels stand on their joints."""
    pivots = np.isin(np.arange(bound.wheels), stands).astype(int)
    return kernel_in_phase(bound, Carry(contacts(bodies), pivots))


def speeds_of_wheels(bound, nu, chi):
    return call_named(bound, "wheel_speeds", {"nu": nu, "chi": chi})


def found_accelerations(bound, nu, chi, spins, torque):
    """nu' by the reduced system, and the accelerations of the free rollers."""
    if bound.roller_model != "free":
        return bound.forward_dynamics(nu, chi, torque), None
    axial = bound.axial_speeds(nu, chi, spins)
    nu_dot, spins_dot = bound.accelerations(nu, chi, spins, torque)
    reduced = bound.forward_dynamics(nu, chi, bound.momenta(axial), torque)
    np.testing.assert_allclose(reduced, nu_dot, rtol=1e-10, atol=1e-10 * np.abs(nu_dot).max())
    return nu_dot, spins_dot


def assert_moves_as_the_bodies(bodies, vehicle, bound, state, stands, relative):
    """Energy and accelerations under torques of the wheels. Returns these, rates and accelerations of all coordinates,
    the forces on them, and nu'."""
    nu, chi, spins = state
    q, rates = coordinates(bodies, chi), rolling_rates(bodies, vehicle, nu, chi, spins, stands)
    energy = rates @ mass_matrix(bodies, q).real @ rates / 2
    assert bound.energy(nu, chi, *bound.spins_or_nothing(spins)) == pytest.approx(energy, rel=1e-12)
    torque, force = np.linspace(-1, 2, bodies.wheels), np.zeros(bodies.size)
    force[own(bodies)[: bodies.wheels]] = torque
    held = [] if bound.roller_model == "free" else free_places(bodies)
    expected = accelerations(bodies, q, rates, force, held, stands)
    turned = np.array([-rates[1] * rates[2], rates[0] * rates[2], 0])  # of the axes, which turn with the platform
    nu_dot, spins_dot = found_accelerations(bound, nu, chi, spins, torque)
    np.testing.assert_allclose(platform_rates(vehicle, nu_dot) + turned, expected[:3], rtol=relative,
                               atol=relative * np.abs(expected[:3]).max())  # fmt: skip
    if spins_dot is not None:
        np.testing.assert_allclose(spins_dot.ravel(), expected[free_places(bodies)], rtol=relative,
                                   atol=relative * np.abs(expected).max())  # fmt: skip
    return torque, rates, expected, force, nu_dot


@each_kind
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("seed", "wheels", "rollers", "backend"), [(*sizes, ("python", "compiled")[sizes[0] % 2]) for sizes in SIZES]
)
def test_rates_energy_and_accelerations_are_those_of_the_bodies(kind, seed, wheels, rollers, model, backend):
    bodies, vehicle, nu, chi, spins = drawn(kind, seed, wheels, rollers, model)
    bound = in_phase(kernel(vehicle, model, backend, effects=("drive",)), bodies)
    moved = assert_moves_as_the_bodies(bodies, vehicle, bound, (nu, chi, spins), (), 1e-10)
    _, rates, expected, _, nu_dot = moved
    chi_dot, spin = bound.wheel_rates(nu, chi)
    np.testing.assert_allclose([*chi_dot, *spin], rates[own(bodies)], rtol=1e-12, atol=1e-12 * np.abs(rates).max())
    np.testing.assert_array_equal(speeds_of_wheels(bound, nu, chi), chi_dot)
    if kind != "rows":  # where rates go by the wheels' angles
        chi_ddot = bound.call("wheel_accelerations", nu, chi, nu_dot)
        np.testing.assert_allclose(
            chi_ddot, expected[own(bodies)[:wheels]], rtol=1e-10, atol=1e-10 * np.abs(expected).max()
        )


@each_kind
def test_rollers_touch_the_ground_where_the_bodies_do(kind):
    bodies, vehicle, _, chi, _ = drawn(kind, 2, 4, 6, "free")
    for wheel, (turn, angle) in enumerate(zip(chi.tolist(), vehicle.roller_angle, strict=True)):
        pieces = profiles.pieces(vehicle, angle) if vehicle.has_profile else ()
        on = [piece.arc for piece in pieces if piece.first < turn < piece.last]
        height = profiles.ride(on[0], vehicle, turn, angle)["height"] if on else 0
        assert abs(height_of_contact(bodies, coordinates(bodies, chi), wheel) + height) < 1e-10


@each_kind
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("seed", "wheels", "rollers"), SIZES)
def test_a_wheel_that_stands_on_its_joint_is_that_of_the_bodies(kind, seed, wheels, rollers, model):
    bodies, vehicle, nu, chi, spins = drawn(kind, seed, wheels, rollers, model)
    stands = [(seed + 1) % wheels, (seed + 2) % wheels][: 1 + seed % 2]
    chi[stands] = np.pi / bodies.rollers * np.array([1, -1])[: len(stands)]
    bound = in_phase(kernel(vehicle, model, "compiled", effects=("drive",)), bodies, stands)
    assert not speeds_of_wheels(bound, nu, chi)[stands].any()
    moved = assert_moves_as_the_bodies(bodies, vehicle, bound, (nu, chi, spins), stands, 1e-9)
    (torque, rates, expected, force, nu_dot), q = moved, coordinates(bodies, chi)
    assert abs(pushes(bodies, q, rates, stands) @ rates).max() < 1e-12 * np.abs(rates).max()
    inputs = () if model != "free" else (bound.momenta(bound.axial_speeds(nu, chi, spins)),)
    asked = bound.call("inverse_dynamics", nu, chi, *inputs, torque, nu_dot)
    assert np.abs(asked).max() < 1e-11 * np.abs(bound.mass_matrix(chi) @ nu_dot).max()
    power = rates @ (mass_matrix(bodies, q).real @ expected + inertial_force(bodies, q, rates))
    assert power == pytest.approx(force @ rates, rel=1e-9, abs=1e-9 * np.abs(force).max() * np.abs(rates).max())


@each_kind
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("seed", "wheels", "rollers", "what"), [
    (*SIZES[1], "passes"), (*SIZES[2], "stops"), (*SIZES[1], "goes"), (*SIZES[2], "goes to the next"),
])  # fmt: skip
def test_an_impact_is_that_of_the_bodies_and_loses_what_carnot_says(kind, seed, wheels, rollers, what, model):
    """Some wheels pass on, and others stop at their joints or go on from there."""
    bodies, vehicle, nu, chi, spins = drawn(kind, seed, wheels, rollers, model)
    rollers = bodies.rollers
    joint, passing, some = np.pi / rollers, np.arange(wheels) % 2 == 0, np.arange(wheels) == 1
    passing = passing | (some if what == "goes to the next" else False)
    was, stands = some & what.startswith("goes"), some & (what == "stops")
    chi[passing | some] = joint
    before = rolling_rates(bodies, vehicle, nu, chi, spins, np.flatnonzero(was))
    plain = kernel(vehicle, model, "compiled")
    first = in_phase(plain, bodies, np.flatnonzero(was))
    after = np.where(passing, -joint, chi)
    bodies = replace(bodies, contact=(contacts(bodies) - passing) % rollers)
    q = coordinates(bodies, after)
    # The rollers take each other's numbers where a wheel passes on: that which comes is roller 0 now.
    rates = before.copy()
    for wheel in np.flatnonzero(passing):
        places = [bodies.place(wheel, j) for j in range(rollers)]
        rates[places] = np.roll(before[places], 1)
    held = [] if model == "free" else free_places(bodies)
    expected = after_impact(bodies, q, rates, held, np.flatnonzero(stands))
    bound = in_phase(plain, bodies, np.flatnonzero(stands))
    speeds = speeds_of_wheels(first, nu, chi) - speeds_of_wheels(bound, nu, after)
    excess = np.where(passing | some, speeds, 0)
    given = {"nu": nu, "chi": after, "turn_excess": excess, "rate_excess": excess}
    if model == "locked":
        spin, next_spin = first.wheel_rates(nu, chi)[1], bound.wheel_rates(nu, after)[1]
        given |= {"entering": np.where(passing, -next_spin, 0), "leaving": np.where(passing, spin, 0)}
    elif model == "free":
        came_with = np.where(passing, first.axial_speeds(nu, chi, spins)[:, -1], first.contact_axial(nu, chi))
        entering = np.where(passing | some, came_with - bound.contact_axial(nu, after), 0)
        given |= {"entering": entering, "leaving": np.zeros(wheels)}
    nu_after = call_named(bound, "impact", given)
    np.testing.assert_allclose(platform_rates(vehicle, nu_after), expected[:3], rtol=1e-10, atol=1e-10)

    mass = mass_matrix(bodies, q).real
    energies = [rates @ mass @ rates, expected @ mass @ expected, (rates - expected) @ mass @ (rates - expected)]
    assert energies[0] - energies[1] == pytest.approx(energies[2], rel=1e-9, abs=1e-13 * energies[0])
