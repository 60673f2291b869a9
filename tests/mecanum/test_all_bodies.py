"""Mecanum wheels, two rows of rollers, profiles and several kinds of wheels against all bodies in all coordinates."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.accelerations import call_named
from omniroll.vehicles import profiles
from tests.mecanum.all_bodies import accelerations, after_impact, height_of_contact, inertial_force, mass_matrix, pushes
from tests.mecanum.vehicles import (
    contacts,
    coordinates,
    drawn,
    free_places,
    held_places,
    joints,
    own,
    platform_rates,
    rolling_rates,
    turning_freely,
)

MODELS = ("massless", "locked", "free")
SIZES = [(1, 3, 5), (2, 4, 6), (3, 5, 4), (4, 6, 3), (5, 4, 9)]
OF_ONE = ["mecanum", "rows", "profile", "arcs"]
each_kind = pytest.mark.parametrize("kind", OF_ONE)
each_and_several = pytest.mark.parametrize("kind", [*OF_ONE, "kinds", "mecanum kinds"])


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
    held = held_places(bodies, bound.roller_model)
    expected = accelerations(bodies, q, rates, force, held, stands)
    turned = np.array([-rates[1] * rates[2], rates[0] * rates[2], 0])  # of the axes, which turn with the platform
    nu_dot, spins_dot = found_accelerations(bound, nu, chi, spins, torque)
    np.testing.assert_allclose(platform_rates(vehicle, nu_dot) + turned, expected[:3], rtol=relative,
                               atol=relative * np.abs(expected[:3]).max())  # fmt: skip
    if spins_dot is not None:
        there = turning_freely(bodies)
        places = np.setdiff1d(free_places(bodies), held)
        np.testing.assert_allclose(spins_dot[there], expected[places], rtol=relative,
                                   atol=relative * np.abs(expected).max())  # fmt: skip
    return torque, rates, expected, force, nu_dot


@each_and_several
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
    if kind in ("mecanum", "profile", "arcs"):  # where rates go by the wheels' angles
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


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("kind", "seed", "wheels", "rollers", "what"), [
    (kind, *SIZES[1 + k % 2], what) for kind in [*OF_ONE, "kinds", "mecanum kinds"]
    for k, what in enumerate(("passes", "stops", "goes", "goes to the next")) if kind in OF_ONE or what == "passes"
])  # fmt: skip
def test_an_impact_is_that_of_the_bodies_and_loses_what_carnot_says(kind, seed, wheels, rollers, what, model):
    """Some wheels pass on, and others stop at their joints or go on from there."""
    bodies, vehicle, nu, chi, spins = drawn(kind, seed, wheels, rollers, model)
    counts = [bodies.of(i).rollers for i in range(wheels)]
    joint, passing, some = joints(bodies), np.arange(wheels) % 2 == 0, np.arange(wheels) == 1
    passing = passing | (some if what == "goes to the next" else False)
    was, stands = some & what.startswith("goes"), some & (what == "stops")
    chi = np.where(passing | some, joint, chi)
    before = rolling_rates(bodies, vehicle, nu, chi, spins, np.flatnonzero(was))
    plain = kernel(vehicle, model, "compiled")
    first = in_phase(plain, bodies, np.flatnonzero(was))
    after = np.where(passing, -joint, chi)
    if kind == "rows":
        bodies = replace(bodies, contact=(contacts(bodies) - passing) % bodies.rollers)
    q = coordinates(bodies, after)
    # The rollers take each other's numbers where a wheel passes on: that which comes is roller 0 now.
    rates = before.copy()
    for wheel in np.flatnonzero(passing):
        places = [bodies.place(wheel, j) for j in range(counts[wheel])]
        rates[places] = np.roll(before[places], 1)
    held = held_places(bodies, model)
    expected = after_impact(bodies, q, rates, held, np.flatnonzero(stands))
    bound = in_phase(plain, bodies, np.flatnonzero(stands))
    speeds = speeds_of_wheels(first, nu, chi) - speeds_of_wheels(bound, nu, after)
    excess = np.where(passing | some, speeds, 0)
    given = {"nu": nu, "chi": after, "turn_excess": excess, "rate_excess": excess}
    if model == "locked":
        spin, next_spin = first.wheel_rates(nu, chi)[1], bound.wheel_rates(nu, after)[1]
        given |= {"entering": np.where(passing, -next_spin, 0), "leaving": np.where(passing, spin, 0)}
    elif model == "free":
        coming = first.axial_speeds(nu, chi, spins)[np.arange(wheels), np.array(counts) - 2]
        came_with = np.where(passing, coming, first.contact_axial(nu, chi))
        entering = np.where(passing | some, came_with - bound.contact_axial(nu, after), 0)
        given |= {"entering": entering, "leaving": np.zeros(wheels)}
    nu_after = call_named(bound, "impact", given) if "impact" in bound.signatures else nu  # none of massless rollers
    np.testing.assert_allclose(platform_rates(vehicle, nu_after), expected[:3], rtol=1e-10, atol=1e-10)

    mass = mass_matrix(bodies, q).real
    energies = [rates @ mass @ rates, expected @ mass @ expected, (rates - expected) @ mass @ (rates - expected)]
    assert energies[0] - energies[1] == pytest.approx(energies[2], rel=1e-9, abs=1e-13 * energies[0])
