"""Vehicles and motors from data sheets: what is derived, what is assumed, and that each number says which."""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import kernel
from omniroll.scenes.explanation import origins_of

SHEET = {
    "wheels": 4, "rollers_per_wheel": 9, "platform_radius": 0.15, "mass": 12.0, "wheel_diameter": 0.1,
    "roller_diameter": 0.022, "roller_length": 0.025,
}  # fmt: skip
MOTOR = {"rated_voltage": 24.0, "stall_torque": 0.9, "free_speed": 650.0}
PARTS = {
    "wheels": 3, "rollers_per_wheel": 5, "platform_radius": 0.15, "wheel_radius": 0.07, "platform_mass": 1.0,
    "platform_inertia": 0.01, "hub_mass": 0.15, "hub_axial_inertia": 2e-4, "hub_transverse_inertia": 1e-4,
    "roller_mass": 0.05, "roller_axial_inertia": 2e-6, "roller_transverse_inertia": 2e-5,
}  # fmt: skip


def origins(vehicle):
    return {origin.name: origin for origin in vehicle.origins}


def test_a_data_sheet_is_enough():
    """Each derived number worked out here by hand: solid cylinders of 1200 kg/m^3, a platform that is a disk."""
    vehicle = omniroll.Vehicle.from_parts(**SHEET)
    roller = 1200 * np.pi * 0.011**2 * 0.025
    hub = 1200 * np.pi * 0.039**2 * 0.022
    platform = 12 - 4 * (hub + 9 * roller)
    assert vehicle.mass == 12.0 and vehicle.wheel_radius == 0.05
    assert vehicle.roller_axis_radius == pytest.approx(0.039, rel=1e-15)
    assert vehicle.roller_inertia == pytest.approx(roller * 0.011**2 / 2, rel=1e-14)
    across = roller * (3 * 0.011**2 + 0.025**2) / 12
    wanted = hub * 0.039**2 / 2 + 9 * (across + roller * 0.039**2)
    assert vehicle.wheel_inertia == pytest.approx(wanted, rel=1e-14)
    of_hub = hub * (0.15**2 + (3 * 0.039**2 + 0.022**2) / 12)
    of_rollers = 9 * (roller * (0.15**2 + 0.039**2 / 2) + (roller * 0.011**2 / 2 + across) / 2)
    assert vehicle.yaw_inertia == pytest.approx(platform * 0.15**2 / 2 + 4 * (of_hub + of_rollers), rel=1e-14)


def test_every_number_says_where_it_comes_from():
    found = origins(omniroll.Vehicle.from_parts(**SHEET))
    assert {name for name, origin in found.items() if origin.kind == "given"} == set(SHEET) - {
        "wheels", "rollers_per_wheel"
    }  # fmt: skip
    assert {name for name, origin in found.items() if origin.kind == "assumed"} == {
        "roller_mass", "hub_mass", "hub_radius", "hub_width", "platform_disk_radius",
    }  # fmt: skip
    assert all(bool(origin.reason) == (origin.kind != "given") for origin in found.values())
    known = origins(omniroll.Vehicle.from_parts(**SHEET, wheel_mass=0.5, roller_mass=0.012, platform_inertia=0.1))
    assert known["hub_mass"].value == pytest.approx(0.5 - 9 * 0.012) and known["hub_mass"].kind == "derived"
    assert "platform_disk_radius" not in known and known["platform_inertia"].kind == "given"


def test_parts_assume_no_mass():
    found = origins(omniroll.Vehicle.from_parts(**PARTS))
    assert {name for name, origin in found.items() if origin.kind == "assumed"} == {"roller_axis_radius"}
    assert found["mass"].value == 1 + 3 * (0.15 + 5 * 0.05)


def test_origins_are_no_part_of_what_a_vehicle_is():
    vehicle = omniroll.Vehicle.from_parts(**SHEET)
    plain = omniroll.Vehicle(**vehicle.as_dict())
    assert plain == vehicle and hash(plain) == hash(vehicle) and repr(plain) == repr(vehicle) and plain.origins == ()
    assert pickle.loads(pickle.dumps(vehicle)).origins == vehicle.origins
    heavier = vehicle.replace(mass=13.0)
    assert set(origins(vehicle)) - set(origins(heavier)) == {"mass"}


@pytest.mark.parametrize(
    "changes, field, words",
    [
        ({"wheel_radius": 0.05}, "wheel_diameter", "beside wheel_radius"),
        ({"roller_radius": 0.011}, "roller_diameter", "beside roller_radius"),
        ({"platform_mass": 10.0}, "mass", "beside platform_mass"),
        ({"wheel_mass": 0.5, "hub_mass": 0.4}, "wheel_mass", "beside hub_mass"),
        ({"mass": 0.9}, "mass", "what wheels and rotors weigh"),
        ({"wheel_mass": 0.1}, "wheel_mass", "below the mass of its rollers"),
        ({"roller_length": None}, "roller_length", "must be given"),
        ({"roller_diameter": 0.12}, "roller_radius", "below wheel_radius"),
        ({"roller_diameter": 0.0055}, "roller_radius", "give roller_axis_radius too"),
        ({"mass": None}, "platform_mass", "or mass"),
        ({"mass": None, "platform_mass": 9.0}, "platform_inertia", "or platform_disk_radius"),
        ({"mass": None, "platform_mass": 9.0, "platform_inertia": 0.1}, "hub_mass", "must be given"),
    ],
)  # fmt: skip
def test_what_a_data_sheet_cannot_say(changes, field, words):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        omniroll.Vehicle.from_parts(**(SHEET | changes))
    assert refused.value.field == field and words in refused.value.bound


def test_a_motor_goes_through_both_ends_of_its_line():
    """At the rated voltage the kernel's torque is the stall torque at rest, and zero at the free speed."""
    motor = omniroll.Motor.from_data_sheet(24.0, **MOTOR, gear_ratio=19.0)
    vehicle = omniroll.Vehicle.paper()
    constants = tuple(motor.constants(vehicle).items())
    bound = kernel(vehicle, "free", "python", effects=motor.kernel_effects(), constants=constants)
    torque, damping = bound.motor_torques(np.full(3, 24.0), np.zeros(3))
    assert torque == pytest.approx(19 * 0.9, rel=1e-14)
    assert torque - damping * 650 / 19 == pytest.approx(0, abs=1e-13)


def test_a_rotor_is_given_once():
    vehicle = omniroll.Vehicle.from_parts(**SHEET, rotor_axial_inertia=1e-6, gear_ratio=19.0)
    assert vehicle.rotor == (1e-6, 19.0)
    run = {"nu": (1, 0, 0), "duration": 0.01}
    for changes, field in (({"rotor_inertia": 1e-6}, "rotor_inertia"), ({"gear_ratio": 20.0}, "gear_ratio")):
        motor = omniroll.Motor.from_data_sheet(1.0, **MOTOR, **({"gear_ratio": 19.0} | changes))
        with pytest.raises(omniroll.InvalidValueError) as refused:
            omniroll.simulate(vehicle, **run, effects=[motor])
        assert refused.value.field == field
        omniroll.simulate(vehicle.replace(wheel_inertia=3e-4), **run, effects=[motor])


SCENE = """[vehicle]
wheels = 4
rollers_per_wheel = 9
platform_radius = 0.15
mass = 12.0
wheel_diameter = 0.1
roller_diameter = 0.022
roller_length = 0.025
[start]
nu = [0, 0, 0]
[run]
duration = 0.1
[drive]
voltage = 12
rated_voltage = 24
stall_torque = 0.9
free_speed = 650
gear_ratio = 19
"""


def test_a_scene_takes_data_sheets_and_marks_them(tmp_path):
    path = tmp_path / "sheet.toml"
    path.write_text(SCENE)
    scene = omniroll.load_scene(path)
    assert scene.vehicle == omniroll.Vehicle.from_parts(**SHEET)
    assert scene.options["effects"] == (omniroll.Motor.from_data_sheet(12, **MOTOR, gear_ratio=19),)
    marks = {origin.name: origin for origin in origins_of(scene)}
    assert marks["mass"].kind == "given" and marks["roller_axis_radius"].reason == "wheel_radius less roller_radius"
    assert marks["hub_mass"].reason == "a solid cylinder of 1200 kg/m^3"
    assert marks["resistance"].value == pytest.approx(24 / (0.9 / (24 / 650)), rel=1e-15)


@pytest.mark.parametrize("key, wrong", [("mass", -12.0), ("wheel_diameter", 0), ("roller_length", -1)])
def test_a_wrong_number_of_a_data_sheet_is_not_missing(key, wrong, tmp_path):
    """One message, of the number: nothing else follows from it."""
    path = Path(tmp_path, "sheet.toml")
    path.write_text(re.sub(rf"^{key} = .*$", f"{key} = {wrong}", SCENE, flags=re.MULTILINE))
    with pytest.raises(omniroll.SceneError) as refused:
        omniroll.load_scene(path)
    assert [(problem.table, problem.key) for problem in refused.value.problems] == [("vehicle", key)]
