"""Vehicles: fields and defaults, what is refused, and how it is said."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

import omniroll
from omniroll import Vehicle


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


POSITIVE = "platform_radius wheel_radius roller_axis_radius mass yaw_inertia wheel_inertia roller_inertia yaw_scale"
NOT_POSITIVE = [(0.0, "positive"), (math.inf, "finite"), (1e-200, "number range")]


@pytest.mark.parametrize("field, value, bound", [
    *((field, *wrong) for field in POSITIVE.split() for wrong in NOT_POSITIVE),
    ("wheels", 0, "at least 1"),
    ("rollers_per_wheel", 2, "at least 3"),
    ("wheel_angles", (0.0, 1.0), r"shape \(3,\)"),
])  # fmt: skip
def test_bad_numbers_are_named(field, value, bound):
    with pytest.raises(ValueError, match=bound) as raised:
        Vehicle.paper().replace(**{field: value})
    assert str(raised.value).startswith(f"{field} = ")
    assert raised.value.field == field
    pickle.loads(pickle.dumps(raised.value))


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


def test_cylinder():
    assert omniroll.cylinder(2, 3, 4) == (9.0, pytest.approx(2 * (27 + 16) / 12))
