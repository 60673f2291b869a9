"""Numbers that cannot be, or are not meant: each is caught by name, and robots as they are raise no alarm.

Numbers of robots are published ones: the Robot Soccer Kit's model for MuJoCo, OpenBase, RoboMaster's standard robot,
TIGERs Mannheim's, the youBot's and others' robot descriptions. What a source leaves out is estimated for these tests.

Some published slips are no number of a vehicle here, or one that may be: two files that disagree by some per cent
(Robot Soccer Kit, RoboJackets) each hold a possible robot, wheels of 35 degrees (ER-Force) as well, and so does a
description with the density of its drawings (LeKiwi, 17 kg). The mass of a ball and a map of forces are not in a scene.
"""

import math
from pathlib import Path

import pytest
from fuzz.keys import written

import omniroll
from omniroll import cli
from omniroll.scenes import load_scene
from omniroll.scenes.lints import lints

NUMBERS = {
    "wheels": 3, "rollers_per_wheel": 8, "platform_radius": 0.15, "wheel_radius": 0.05, "roller_axis_radius": 0.039,
    "mass": 12.0, "yaw_inertia": 0.14, "wheel_inertia": 4e-4, "roller_inertia": 7e-7,
}  # fmt: skip
PARTS = {
    "wheels": 3, "rollers_per_wheel": 8, "platform_radius": 0.15, "wheel_radius": 0.05, "platform_mass": 11.0,
    "platform_inertia": 0.12, "hub_mass": 0.13, "hub_radius": 0.039, "hub_width": 0.022, "roller_mass": 0.012,
    "roller_radius": 0.011, "roller_length": 0.025,
}  # fmt: skip
SHEET = {
    "wheels": 3, "rollers_per_wheel": 8, "platform_radius": 0.15, "mass": 12.0, "wheel_diameter": 0.1,
    "roller_diameter": 0.022, "roller_length": 0.025,
}  # fmt: skip
MOTOR = {"torque_constant": 0.036, "resistance": 1.0, "gear_ratio": 19.0}
SHEET_MOTOR = {
    "voltage": 0, "rated_voltage": 24.0, "stall_torque": 0.78, "free_speed": 703.0, "gear_ratio": 3.5,
}  # fmt: skip
LOOP = {"target": [1, 0, 0], "proportional": 0.1, "sample_time": 0.01}
TIGERS = NUMBERS | {"wheels": 4, "platform_radius": 0.079, "wheel_radius": 0.032, "roller_axis_radius": 0.027,
                   "rollers_per_wheel": 16, "mass": 2.78, "yaw_inertia": 0.012145, "wheel_inertia": 3.6e-5,
                   "roller_inertia": 1e-8,
                   "wheel_angles": [math.radians(a) for a in (59, 135, 225, 301)]}  # fmt: skip
LAYOUT = [[0.15, 0.0], [-0.075, 0.13], [-0.075, -0.13]]


def text_of(vehicle: dict, tables: dict) -> str:
    given = {key: value for key, value in vehicle.items() if value is not None}
    return written({"vehicle": given, "start": {"nu": [0.5, 0, 0]}, "run": {"duration": 0.1}} | tables)


def wrong_in(folder: Path, vehicle: dict, tables: dict) -> list[str]:
    """What is refused, or else what looks wrong: table and key of each."""
    path = folder / "scene.toml"
    path.write_text(text_of(vehicle, tables))
    try:
        return [f"{lint.table} {lint.key}" for lint in lints(load_scene(path))]
    except omniroll.SceneError as error:
        return [f"{problem.table} {problem.key}" for problem in error.problems]


def even(count: int, first: float = 0.0, digits: int = 3) -> list[float]:
    return [round(first + 2 * math.pi * k / count, digits) for k in range(count)]


CASES = {
    # Rollers that do not fit
    "rollers thinner than wheel and axis make them": (
        PARTS | {"roller_axis_radius": 0.049, "roller_radius": 0.011}, {}, "vehicle roller_axis_radius"),
    "rollers thicker than wheel and axis make them": (
        PARTS | {"roller_axis_radius": 0.042}, {}, "vehicle roller_radius"),
    "rollers too thin to reach the ground at the joint": (
        PARTS | {"roller_radius": 0.003}, {}, "vehicle roller_radius"),
    "a roller's length in mm": (PARTS | {"roller_length": 25.0}, {}, "vehicle roller_length"),
    # A rotor in two tables, gears that contradict
    "a rotor in two tables": (
        PARTS | {"rotor_axial_inertia": 1e-6, "gear_ratio": 19.0},
        {"drive": MOTOR | {"voltage": 5, "rotor_inertia": 1e-6}}, "drive rotor_inertia"),
    "a rotor behind two gears": (
        PARTS | {"rotor_axial_inertia": 1e-6, "gear_ratio": 20.0}, {"drive": MOTOR | {"voltage": 5}},
        "drive gear_ratio"),
    "two gears without a rotor": (PARTS | {"gear_ratio": 20.0}, {"drive": MOTOR | {"voltage": 5}}, "drive gear_ratio"),
    "a rotor's inertia in g cm^2": (
        NUMBERS, {"drive": MOTOR | {"voltage": 5, "rotor_inertia": 92.5}}, "drive rotor_inertia"),
    # Angles
    "directions in degrees": (NUMBERS | {"wheel_angles": [0, 120, 240]}, {}, "vehicle wheel_angles"),
    "directions of a layout in degrees": (
        NUMBERS, {"layout": {"wheel_places": LAYOUT, "wheel_angles": [30.5, 150.5, 270.5]}}, "layout wheel_angles"),
    "a heading in degrees": (NUMBERS, {"start": {"nu": [1, 0, 0], "pose": [0, 0, 90]}}, "start pose"),
    "an inclination of 1 degree": (NUMBERS, {"slope": {"angle": 1.0}}, "slope angle"),
    "an inclination of 5 degrees": (NUMBERS, {"slope": {"angle": 5.0}}, "slope angle"),
    "a direction of descent in degrees": (NUMBERS, {"slope": {"angle": 0.05, "direction": 90}}, "slope direction"),
    "all axles parallel": (
        NUMBERS | {"wheel_angles": [0, math.pi, 0]}, {"layout": {"wheel_places": LAYOUT}}, "vehicle wheel_angles"),
    "thirds rounded": (NUMBERS | {"wheel_angles": even(3)}, {}, "vehicle wheel_angles"),
    "quarters from 45 degrees rounded": (
        NUMBERS | {"wheels": 4, "wheel_angles": even(4, math.pi / 4, 2)}, {}, "vehicle wheel_angles"),
    # Sizes a thousand times off
    "lengths in mm": (
        NUMBERS | {"platform_radius": 150.0, "wheel_radius": 50.0, "roller_axis_radius": 39.0}, {}, "vehicle mass"),
    "the wheel in mm": (
        NUMBERS | {"wheel_radius": 50.0, "roller_axis_radius": 39.0}, {}, "vehicle wheel_radius"),
    "the platform's radius in mm": (NUMBERS | {"platform_radius": 150.0}, {}, "vehicle mass"),
    "places in mm": (
        NUMBERS, {"layout": {"wheel_places": [[1000 * x, 1000 * y] for x, y in LAYOUT]}}, "vehicle mass"),
    "a mass in g": (NUMBERS | {"mass": 12e3, "yaw_inertia": 140.0, "wheel_inertia": 0.4}, {}, "vehicle mass"),
    "a yaw inertia in kg cm^2": (NUMBERS | {"yaw_inertia": 1400.0}, {}, "vehicle yaw_inertia"),
    "a yaw inertia in tonnes": (NUMBERS | {"yaw_inertia": 1.4e-4}, {}, "vehicle yaw_inertia"),
    "a wheel's inertia in g m^2": (NUMBERS | {"wheel_inertia": 0.4}, {}, "vehicle wheel_inertia"),
    "a roller's mass in g": (PARTS | {"roller_mass": 12.0}, {}, "vehicle roller_mass"),
    "a hub's radius in mm": (PARTS | {"hub_radius": 39.0}, {}, "vehicle hub_radius"),
    "a platform's radius in mm": (
        PARTS | {"platform_disk_radius": 150.0, "platform_inertia": None}, {}, "vehicle platform_disk_radius"),
    "a centre of mass in mm": (NUMBERS, {"layout": {"center_of_mass": [5.0, 0.0]}}, "vehicle yaw_inertia"),
    "a height in mm": (NUMBERS, {"reactions": {"height": 80.0}}, "reactions height"),
    "a torque in mN m": (NUMBERS, {"drive": {"torque": 500.0}}, "drive torque"),
    "a torque constant in mN m/A": (
        NUMBERS, {"drive": MOTOR | {"voltage": 12, "torque_constant": 36.0}}, "drive gear_ratio"),
    "a voltage per rpm": (
        NUMBERS, {"drive": MOTOR | {"voltage": 12, "back_emf": 0.036 * 2 * math.pi / 60}}, "drive back_emf"),
    "a speed in mm/s": (NUMBERS, {"start": {"nu": [300 / 0.15, 0, 0]}}, "start nu"),
    # Controllers that a linear test finds unstable
    "gains in torque": (NUMBERS, {"controller": LOOP | {"proportional": 5.0}}, "controller sample_time"),
    "an integral in torque": (
        NUMBERS, {"controller": LOOP | {"proportional": 0.01, "integral": 1000.0}}, "controller sample_time"),
    "gains in voltage": (
        NUMBERS, {"drive": MOTOR | {"voltage": 0}, "controller": LOOP | {"proportional": 20.0, "output": "voltage"}},
        "controller sample_time"),
    # Published numbers, and those of data sheets
    "Robot Soccer Kit in MuJoCo: dry friction on the rollers": (
        NUMBERS | {"rollers_per_wheel": 20, "platform_radius": 0.057, "wheel_radius": 0.0345,
                   "roller_axis_radius": 0.0285, "mass": 0.666, "yaw_inertia": 1.86e-3, "wheel_inertia": 6.256e-5,
                   "roller_inertia": 6.056e-8},
        {"bearings": {"roller_coulomb": 0.1, "roller_speed": 1.0}}, "bearings roller_coulomb"),
    "a test base: damping of 1 N m s": (
        NUMBERS | {"wheels": 4, "mass": 4.2, "platform_radius": 0.7071, "yaw_inertia": 1.6, "wheel_radius": 0.076,
                   "roller_axis_radius": 0.062, "wheel_inertia": 2.9404e-3},
        {"bearings": {"wheel_viscous": 1.0}}, "bearings wheel_viscous"),
    "a free speed in rpm": (
        NUMBERS, {"drive": SHEET_MOTOR | {"free_speed": 6710.0, "stall_torque": 0.08}}, "drive free_speed"),
    "a stall torque in mN m": (NUMBERS, {"drive": SHEET_MOTOR | {"stall_torque": 780.0}}, "drive stall_torque"),
    "hangar_sim: rollers that brake with 367 N": (
        NUMBERS | {"mass": 60.0, "yaw_inertia": 1.2, "wheel_radius": 0.1, "roller_axis_radius": 0.0835,
                   "wheel_inertia": 7.2e-3, "roller_inertia": 1e-5},
        {"bearings": {"roller_viscous": 0.1}}, "bearings roller_viscous"),
    "a raspbot's wheel that breaks the triangle": (
        PARTS | {"hub_mass": 0.167, "hub_axial_inertia": 0.04411, "hub_transverse_inertia": 0.01629}, {},
        "vehicle hub_axial_inertia"),
    "youBot: placeholders": (
        PARTS | {"platform_mass": 0.1, "platform_inertia": 1.0}, {}, "vehicle platform_inertia"),
    "RoboJackets: placeholders": (
        NUMBERS | {"wheels": 4, "mass": 1.0, "yaw_inertia": 1.0, "platform_radius": 0.1}, {}, "vehicle yaw_inertia"),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_what_is_not_meant_is_caught_by_name(name, tmp_path):
    vehicle, tables, caught = CASES[name]
    assert caught in wrong_in(tmp_path, vehicle, tables)


ROBOTS = {
    "numbers": (NUMBERS, {}),
    "parts": (PARTS, {}),
    "a data sheet": (SHEET, {}),
    "exact directions": (NUMBERS | {"wheel_angles": [2 * math.pi * k / 3 for k in range(3)]}, {}),
    "TIGERs": (
        TIGERS,
        {"drive": {"voltage": 24, "torque_constant": 0.03375, "back_emf": 0.0225, "resistance": 0.4875,
                   "gear_ratio": 25 / 7, "current_limit": 9},
         "start": {"nu": [3 / 0.079, 0, 0]}}),
    "TIGERs' motors without gear": (
        TIGERS, {"drive": {"voltage": 24, "torque_constant": 0.03375, "back_emf": 0.0225, "resistance": 0.4875}}),
    "RoboTeam's angles": (
        NUMBERS | {"wheels": 4, "wheel_angles": [math.radians(a) for a in (60, 135, 225, 300)]}, {}),
    "Thunderbots: axles that miss the centre": (
        NUMBERS | {"wheels": 4, "platform_radius": 0.0749, "wheel_radius": 0.03, "roller_axis_radius": 0.025,
                   "rollers_per_wheel": 16, "mass": 2.5, "yaw_inertia": 0.01, "wheel_inertia": 3e-5,
                   "roller_inertia": 1e-8},
        {"layout": {"wheel_places": [[0.03485, 0.06632], [-0.04985, 0.05592], [-0.04985, -0.05592],
                                     [0.03485, -0.06632]],
                    "wheel_angles": [math.radians(a) for a in (58, 134, 226, 302)]}}),
    "RoboMaster": (
        PARTS | {"wheels": 4, "rollers_per_wheel": 26, "platform_radius": 0.196, "wheel_radius": 0.0762,
                 "roller_axis_radius": 0.0672, "platform_mass": 12.326, "platform_inertia": 0.3187,
                 "hub_mass": 0.59 - 26 * 0.0058, "hub_radius": 0.0672, "hub_width": 0.02, "roller_mass": 0.0058,
                 "roller_radius": 0.009, "roller_length": 0.019, "roller_axial_inertia": 2.70867e-7,
                 "roller_transverse_inertia": 2.91412e-7}, {}),
    "OpenBase": (
        PARTS | {"rollers_per_wheel": 8, "platform_radius": 0.04, "wheel_radius": 0.01905,
                 "roller_axis_radius": 0.01355, "platform_mass": 0.0786294, "platform_inertia": 3.94596e-5,
                 "hub_mass": 0.00835758, "hub_axial_inertia": 9.40333e-7, "hub_transverse_inertia": 6e-7,
                 "hub_radius": None, "hub_width": None, "roller_mass": 0.00113845, "roller_axial_inertia": 1.47666e-8,
                 "roller_transverse_inertia": 2.53776e-8, "roller_radius": 0.0055, "roller_length": 0.012}, {}),
    "Ridgeback: a dense core": (
        PARTS | {"wheels": 4, "rollers_per_wheel": 9, "platform_radius": 0.4215, "wheel_radius": 0.0759,
                 "platform_mass": 165.304, "platform_inertia": 7.1624, "hub_mass": 2.3,
                 "hub_axial_inertia": 6.6424e-3, "hub_transverse_inertia": 3.4e-3, "hub_radius": None,
                 "hub_width": None, "roller_mass": 0.03, "roller_radius": None, "roller_length": None,
                 "roller_axial_inertia": 6e-7, "roller_transverse_inertia": 4e-6}, {}),
    "ER-Force": (
        NUMBERS | {"wheels": 4, "platform_radius": 0.07, "wheel_radius": 0.0225, "roller_axis_radius": 0.018,
                   "rollers_per_wheel": 16, "mass": 1.5, "yaw_inertia": 0.007884, "wheel_inertia": 1e-5,
                   "roller_inertia": 5e-9, "wheel_angles": [math.radians(a) for a in (55, 135, 225, 305)]},
        {"start": {"nu": [3 / 0.07, 0, 6]}}),
    "a motor of 50 W behind 60/17": (
        NUMBERS | {"mass": 2.5, "platform_radius": 0.08, "wheel_radius": 0.03, "roller_axis_radius": 0.025,
                   "rollers_per_wheel": 16, "yaw_inertia": 0.01, "wheel_inertia": 3e-5, "roller_inertia": 1e-8},
        {"drive": {"voltage": 12, "torque_constant": 0.0360, "resistance": 0.942, "gear_ratio": 60 / 17,
                   "rotor_inertia": 135e-7}}),
    "gains that settle": (
        NUMBERS, {"drive": MOTOR | {"voltage": 0}, "controller": LOOP | {"output": "voltage", "integral": 0.5}}),
    "a motor of a data sheet": (NUMBERS, {"drive": SHEET_MOTOR}),
    "a heading after some turns": (NUMBERS, {"start": {"nu": [1, 0, 0], "pose": [0, 0, 20.3]}}),
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_as_they_are_raise_no_alarm(name, tmp_path):
    assert wrong_in(tmp_path, *ROBOTS[name]) == []


@pytest.mark.parametrize("scene", sorted(Path("scenes").glob("*.toml")), ids=lambda scene: scene.stem)
def test_shipped_scenes_raise_no_alarm(scene):
    assert lints(load_scene(scene)) == []


def test_run_says_it_at_the_start(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(text_of(NUMBERS | {"wheel_angles": even(3)}, {}))
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert said.startswith("warning: [vehicle] wheel_angles: are a regular polygon but for rounding")
    exact = ", ".join(repr(2 * math.pi * k / 3) for k in range(3))
    assert f"[{exact}]" in said
    assert load_scene(path).vehicle.wheel_angles == tuple(even(3))  # a word, and no change
