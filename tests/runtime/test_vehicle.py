"""Vehicles: what is refused, and how it is said; the vehicle of parts and the paper's."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

import omniroll
from omniroll import Vehicle

PARTS = {
    "wheels": 3,
    "rollers_per_wheel": 6,
    "platform_radius": 0.2,
    "wheel_radius": 0.06,
    "platform_mass": 2.0,
    "platform_inertia": 0.05,
    "hub_mass": 0.2,
    "hub_axial_inertia": 2e-4,
    "hub_transverse_inertia": 1e-4,
    "roller_mass": 0.03,
    "roller_axial_inertia": 1e-6,
    "roller_transverse_inertia": 3e-6,
}


def test_fields_and_defaults():
    vehicle = Vehicle(
        wheels=4,
        rollers_per_wheel=8,
        platform_radius=0.2,
        wheel_radius=0.05,
        mass=3,
        yaw_inertia=0.1,
        wheel_inertia=1e-3,
        roller_inertia=1e-6,
    )
    np.testing.assert_allclose(vehicle.wheel_angles, np.arange(4) * np.pi / 2)
    assert vehicle.roller_axis_radius == pytest.approx(0.05 * math.cos(math.pi / 7), rel=1e-15)
    assert vehicle.yaw_scale == 1
    assert isinstance(vehicle.mass, float)


def test_vehicle_is_immutable_hashable_and_copies():
    vehicle = Vehicle.paper()
    with pytest.raises(dataclasses.FrozenInstanceError):
        vehicle.mass = 2.0
    assert hash(vehicle) == hash(Vehicle.paper()) and vehicle == Vehicle.paper()
    assert vehicle.replace(mass=5).mass == 5 and vehicle.replace(mass=5) != vehicle
    assert eval(repr(vehicle), {"Vehicle": Vehicle}) == vehicle
    assert pickle.loads(pickle.dumps(vehicle)) == vehicle
    assert Vehicle(**vehicle.as_dict()) == vehicle


@pytest.mark.parametrize("field", [
    "platform_radius",
    "wheel_radius",
    "roller_axis_radius",
    "mass",
    "yaw_inertia",
    "wheel_inertia",
    "roller_inertia",
    "yaw_scale",
])  # fmt: skip
@pytest.mark.parametrize("value, bound", [
    (0.0, "positive"),
    (-1.0, "positive"),
    (math.nan, "finite"),
    (math.inf, "finite"),
    (1e200, "number range"),
    (1e-200, "number range"),
    ("1", "real numbers"),
    (None, "real numbers"),
    (1j, "real numbers"),
    ([1.0, 2.0], "shape"),
])  # fmt: skip
def test_bad_numbers_are_named(field, value, bound):
    if field == "roller_axis_radius" and value is None:
        return  # None asks for the default
    with pytest.raises(ValueError, match=bound) as raised:
        Vehicle.paper().replace(**{field: value})
    assert str(raised.value).startswith(f"{field} = ")
    assert raised.value.field == field
    pickle.loads(pickle.dumps(raised.value))


@pytest.mark.parametrize("field, value, bound", [
    ("wheels", 0, "at least 1"),
    ("wheels", 2.0, "integer"),
    ("wheels", True, "integer"),
    ("rollers_per_wheel", 2, "at least 3"),
    ("rollers_per_wheel", "5", "integer"),
    ("wheel_angles", (0.0, 1.0), r"shape \(3,\)"),
    ("wheel_angles", (0.0, 1.0, math.nan), "finite"),
    ("wheel_angles", (0.0, (1.0, 2.0), 3.0), "array of numbers"),
])  # fmt: skip
def test_bad_shapes_and_counts_are_named(field, value, bound):
    with pytest.raises(ValueError, match=bound) as raised:
        Vehicle.paper().replace(**{field: value})
    assert raised.value.field == field


def test_roller_axis_must_stay_above_the_ground_at_the_joint():
    vehicle = Vehicle.paper()
    limit = vehicle.wheel_radius * math.cos(math.pi / 5)
    vehicle.replace(roller_axis_radius=limit * (1 - 1e-12))
    for value in (limit * (1 + 1e-12), 2 * limit):
        with pytest.raises(ValueError, match="must be below") as raised:
            vehicle.replace(roller_axis_radius=value)
        assert raised.value.field == "roller_axis_radius"
    assert f"{limit:.10}"[:10] in str(raised.value)


def test_yaw_inertia_must_exceed_that_of_the_rollers():
    vehicle = Vehicle.paper()
    limit = 3 * 5 * vehicle.roller_inertia / 2
    vehicle.replace(yaw_inertia=limit * (1 + 1e-12))
    with pytest.raises(ValueError, match="must be above") as raised:
        vehicle.replace(yaw_inertia=limit * (1 - 1e-12))
    assert raised.value.field == "yaw_inertia"


def test_three_rollers_need_an_axis_radius():
    with pytest.raises(ValueError, match="roller_axis_radius"):
        Vehicle.paper().replace(rollers_per_wheel=3, roller_axis_radius=None)
    assert Vehicle.paper().replace(rollers_per_wheel=3, roller_axis_radius=0.02).rollers_per_wheel == 3


@pytest.mark.parametrize("wheels, rollers", [(3, 5), (4, 8), (2, 4), (1, 12)])
def test_paper_vehicle_has_the_numbers_of_the_scripts(wheels, rollers):
    """The formulas of the design, written out here once more."""
    vehicle = Vehicle.paper(wheels, rollers)
    R, r, m, hub = 0.15, 0.05, 0.05, 0.15
    wheel_radius = r / math.cos(math.pi / (rollers - 1))
    radius, length = (wheel_radius - r) / 2, 2 * wheel_radius * math.sin(math.pi / rollers)
    B, A = m * radius**2 / 2, m * (3 * radius**2 + length**2) / 12
    mass = 1 + hub * wheels + wheels * rollers * m
    yaw = (
        R**2 / 2
        + wheels * (hub * R**2 + hub * (3 * r**2 + 0.01**2) / 12)
        + wheels * rollers * ((A + B) / 2 + m * R**2 + m * r**2 / 2)
    )
    expected = {
        "platform_radius": R,
        "wheel_radius": wheel_radius,
        "roller_axis_radius": r,
        "mass": mass,
        "yaw_inertia": yaw,
        "wheel_inertia": hub * r**2 / 2 + rollers * (A + m * r**2),
        "roller_inertia": B,
        "yaw_scale": yaw / (mass * wheel_radius**2),
    }
    for field, value in expected.items():
        assert getattr(vehicle, field) == pytest.approx(value, rel=1e-14), field


def test_paper_vehicle_needs_four_rollers():
    with pytest.raises(ValueError, match="rollers_per_wheel = 3: must be at least 4"):
        Vehicle.paper(3, 3)


def test_rotors_count_through_their_gears():
    plain = Vehicle.from_parts(**PARTS)
    geared = Vehicle.from_parts(
        **PARTS,
        rotor_mass=0.1,
        rotor_axial_inertia=1e-6,
        rotor_transverse_inertia=2e-6,
        rotor_distance=0.1,
        gear_ratio=-20,
    )
    assert geared.wheel_inertia - plain.wheel_inertia == pytest.approx(400 * 1e-6)
    assert geared.mass - plain.mass == pytest.approx(0.3)
    assert geared.yaw_inertia - plain.yaw_inertia == pytest.approx(3 * (0.1 * 0.01 + 2e-6))
    assert geared.roller_inertia == plain.roller_inertia == 1e-6


@pytest.mark.parametrize("field, value", [
    ("platform_mass", -1.0),
    ("roller_mass", 0.0),
    ("hub_axial_inertia", math.nan),
    ("gear_ratio", math.inf),
    ("rotor_distance", -0.1),
    ("wheels", 0),
])  # fmt: skip
def test_bad_parts_are_named(field, value):
    with pytest.raises(ValueError) as raised:
        Vehicle.from_parts(**(PARTS | {field: value}))
    assert raised.value.field == field


def test_cylinder():
    assert omniroll.cylinder(2, 3, 4) == (9.0, pytest.approx(2 * (27 + 16) / 12))
