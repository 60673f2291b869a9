"""Vehicles from their parts: M, I_S, J, B against the kinetic energy of all bodies in space."""

import numpy as np
import pytest
from oracle import bodies
from oracle.balls import exact
from oracle.bridge import oracle_vehicle
from oracle.states import paper_vehicle
from oracle.vehicle import SCALARS

INERTIAS = ("mass", "yaw_inertia", "wheel_inertia", "roller_inertia")


def random_parts(rng):
    """Arguments of from_parts for a robot with motors, as floats."""
    vary = lambda value: value * float(rng.uniform(0.6, 1.5))  # noqa: E731
    sizes = {
        "platform_mass": 2.0, "platform_inertia": 0.04, "hub_mass": 0.2, "hub_axial_inertia": 3e-4,
        "hub_transverse_inertia": 2e-4, "roller_mass": 0.02, "roller_axial_inertia": 1e-6,
        "roller_transverse_inertia": 3e-6, "rotor_mass": 0.1, "rotor_axial_inertia": 2e-6,
        "rotor_transverse_inertia": 5e-6, "rotor_distance": 0.1, "gear_ratio": -30.0, "platform_radius": 0.2,
    }  # fmt: skip
    return {name: vary(value) for name, value in sizes.items()}


def as_bodies(sizes, axis_radius, rollers, wheels):
    solid = lambda name: bodies.Solid(  # noqa: E731
        sizes[f"{name}_mass"], sizes[f"{name}_axial_inertia"], sizes[f"{name}_transverse_inertia"]
    )
    return bodies.Parts(
        platform=bodies.Solid(sizes["platform_mass"], sizes["platform_inertia"], 0.0),
        hub=solid("hub"),
        roller=solid("roller"),
        rotor=solid("rotor"),
        gear=sizes["gear_ratio"],
        rotor_distance=sizes["rotor_distance"],
        platform_radius=sizes["platform_radius"],
        roller_axis_radius=axis_radius,
        rollers_per_wheel=rollers,
        wheel_angles=tuple(2 * np.pi * k / wheels for k in range(wheels)),
    )


@pytest.mark.parametrize("wheels, rollers", [(2, 3), (3, 5), (5, 12)])
def test_inertias_are_those_of_the_bodies(wheels, rollers):
    import omniroll

    rng = np.random.default_rng([wheels, rollers])
    sizes = random_parts(rng)
    vehicle = omniroll.Vehicle.from_parts(
        wheels=wheels, rollers_per_wheel=rollers, wheel_radius=0.06, roller_axis_radius=0.025, **sizes
    )
    wanted = bodies.inertias(as_bodies(sizes, 0.025, rollers, wheels))
    for name in INERTIAS:
        assert abs(float(exact(getattr(vehicle, name)) - wanted[name])) <= 4e-16 * float(wanted[name]), name


@pytest.mark.parametrize("wheels, rollers", [(3, 5), (4, 8)])
def test_the_papers_vehicle(wheels, rollers):
    import omniroll

    found = omniroll.Vehicle.paper(wheels=wheels, rollers_per_wheel=rollers)
    wanted = paper_vehicle(wheels, rollers)
    # Its roller's radius (l - r)/2 is a difference of rounded lengths: B, and what holds B, lose some digits
    # there.
    for name in SCALARS:
        assert getattr(found, name) == pytest.approx(float(wanted.number(name)), rel=2e-14), name
    assert oracle_vehicle(found).wheel_angles == pytest.approx([float(a) for a in wanted.wheel_angles], rel=4e-16)
