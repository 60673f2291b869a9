"""Robots with numbers: sums of their parts, marks of every number, presets in scenes, no false alarm."""

import json
import math
from pathlib import Path

import pytest

import omniroll
from omniroll import cli
from omniroll.robots.catalogue import ROBOTS, robot
from omniroll.robots.page import page
from omniroll.robots.wheels import WHEEL_NAMES, wheel_numbers
from omniroll.scenes.explanation import origins_of
from omniroll.scenes.lints import lints
from omniroll.scenes.lints_of_wheels import of_wheels

REST = "[start]\nnu = [0, 0, 0]\n[run]\nduration = 0.01\n"


def scene(tmp_path, vehicle, more=""):
    path = tmp_path / "scene.toml"
    path.write_text(f"[vehicle]\n{vehicle}\n{REST}{more}")
    return omniroll.load_scene(path)


def test_the_parts_of_the_soccer_kit_add_up():
    """Worked out here by hand from the published parts."""
    vehicle = robot("robot-soccer-kit").vehicle
    rollers = 20 * 0.00337198
    assert vehicle.mass == pytest.approx(0.374118 + 0.00935 + 3 * (0.0266331 + rollers), rel=1e-14)
    assert vehicle.wheel_inertia == pytest.approx(7.07069e-6 + 20 * 3.55777e-8 + rollers * 0.0285**2, rel=1e-14)
    hub = 0.0266331 * (3 * 0.0285**2 + 0.012**2) / 12  # a solid cylinder, across its axis
    wheel = (0.0266331 + rollers) * 0.0572**2 + hub + rollers * 0.0285**2 / 2 + 20 * (6.05554e-8 + 3.55777e-8) / 2
    assert vehicle.yaw_inertia == pytest.approx(8.4026e-4 + 3 * wheel, rel=1e-12)


def test_the_wheels_of_the_robomaster_hold_their_rollers():
    vehicle = robot("robomaster-standard").vehicle
    assert vehicle.mass == pytest.approx(12.326 + 4 * 0.59, rel=1e-15)
    assert vehicle.yaw_inertia == pytest.approx(0.3187 + 4 * (0.59 * 0.196**2 + 1.416e-3), rel=1e-14)
    motor = robot("robomaster-standard").motor(24.0)
    assert 24.0 / (motor.back_emf * motor.gear_ratio) == pytest.approx(50.0)
    assert motor.current_limit * motor.torque_constant * motor.gear_ratio == pytest.approx(5.0)


def test_the_power_of_the_tigers_motors_balances():
    """The firmware's constants hold a factor 1.5; without it the torque per current is the voltage per rate."""
    motor = robot("tigers-2020").motor(0.0)
    assert motor.torque_constant == pytest.approx(motor.back_emf, rel=1e-15)
    assert motor.current_limit * motor.torque_constant == pytest.approx(9 * 0.03375)


def test_double_rows_alternate_their_lever():
    changes = {name: found.lever_change for name, found in ROBOTS.items() if found.row_offset}
    assert changes == {"open-base": pytest.approx(0.275), "robomaster-standard": pytest.approx(0.0976, abs=5e-5)}


@pytest.mark.parametrize("name", ROBOTS)
def test_every_number_has_a_source_or_a_reason(name):
    numbers = robot(name).origins()
    assert numbers and all(number.reason for number in numbers)
    assert {number.kind for number in numbers} <= {"published", "derived", "assumed"}
    fields = {number.name: number.value for number in robot(name).vehicle.origins}
    for field in ("mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "wheel_radius", "roller_axis_radius"):
        assert fields[field] == getattr(robot(name).vehicle, field)


@pytest.mark.parametrize("name", ROBOTS)
def test_nothing_of_a_robot_looks_wrong(tmp_path, name):
    of_the_paper = robot(name).vehicle.has_wheels_of_the_paper  # limits of currents do not go with others
    motor = f"[drive]\npreset = '{name}'\nvoltage = 10\n" if robot(name).motor_numbers and of_the_paper else ""
    found = scene(tmp_path, f"preset = '{name}'", motor)
    assert found.vehicle == robot(name).vehicle
    assert lints(found) == []
    if of_the_paper:
        omniroll.run(found)


def test_a_scene_takes_the_motors_of_a_robot(tmp_path):
    drive = "[drive]\npreset = 'tigers-2020'\nvoltage = [1, 2, 3, 4]\ncurrent_limit = 5\n"
    found = scene(tmp_path, "preset = 'tigers-2020'", drive)
    assert found.options["effects"] == (robot("tigers-2020").motor([1, 2, 3, 4], current_limit=5),)
    marks = {origin.name: origin for origin in origins_of(found)}
    assert marks["wheel_radius"].kind == "published" and marks["roller_inertia"].kind == "assumed"
    assert marks["back_emf"].kind == "published" and marks["current_limit"].kind == "given"


@pytest.mark.parametrize(
    "vehicle, more, said",
    [
        ("preset = 'tigers'", "", "must be one of paper, robot-soccer-kit"),
        ("preset = 'tigers-2020'\nwheels = 3", "", "wheels = 3: cannot stand beside the preset of a robot"),
        ("preset = 'tigers-2020'\nwheel_angles = [0, 1, 2]", "", "must be 4 numbers"),
        ("preset = 'paper'", "[drive]\npreset = 'open-base'\nvoltage = 1\n", "must be one of robomaster-standard"),
        ("preset = 'paper'", "[drive]\npreset = 'tigers-2020'\n", "needs torque or voltage"),
        ("preset = 'paper'", "[drive]\npreset = 'tigers-2020'\ntorque = 1\n", "cannot stand beside torque"),
        ("preset = 'paper'", "[drive]\npreset = 'tigers-2020'\nvoltage = 1\nstall_torque = 1\nfree_speed = 1\n"
         "rated_voltage = 1\n", "cannot stand beside"),
    ],
)  # fmt: skip
def test_what_a_preset_does_not_allow(tmp_path, vehicle, more, said):
    with pytest.raises(omniroll.SceneError, match=said):
        scene(tmp_path, vehicle, more)


def test_the_command(capsys):
    assert cli.main(["robots"]) == 0
    assert [row.split()[0] for row in capsys.readouterr().out.splitlines()[1:]] == list(ROBOTS)
    assert cli.main(["robots", "tigers-2020", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["wheel_angles_in_degrees"] == [59, 135, 225, 301]
    assert cli.main(["robots", "robomaster-standard"]) == 0
    assert "alternates by 9.8 %" in capsys.readouterr().out
    assert cli.main(["robots", "robocop"]) == 2


def test_the_page_is_written_from_the_catalogue():
    """Where this fails: python -m omniroll.robots.page docs/robots.md"""
    text = Path("docs/robots.md").read_text(encoding="utf-8")
    assert page(text) == text


@pytest.mark.parametrize("name", WHEEL_NAMES)
def test_a_scene_with_a_wheel_of_the_catalogue(tmp_path, name):
    path = tmp_path / "new.toml"
    assert cli.main(["new", str(path), "--wheel", name]) == 0
    found, numbers = omniroll.load_scene(path).vehicle, wheel_numbers(name)
    assert found.wheel_radius == numbers["wheel_radius"] and found.rollers_per_wheel == numbers["rollers_per_wheel"]
    assert found.roller_angle == (numbers.get("roller_angle", 0.0),) * found.wheels


def test_wheels_on_sale_have_sources_and_are_no_alarm(capsys):
    assert cli.main(["robots", "--wheels", "--json"]) == 0
    for wheel in json.loads(capsys.readouterr().out):
        kinds = {number["name"]: number["kind"] for number in wheel["numbers"]}
        assert kinds["wheel_radius"] == "published" and all(number["reason"] for number in wheel["numbers"])
        numbers = wheel_numbers(wheel["name"]) | {"roller_angle": [s * math.pi / 4 for s in (1, -1, -1, 1)]}
        layout = {"wheel_angles": [s * math.pi / 2 for s in (1, -1, 1, -1)], "platform_radius": 0.3}
        places = [(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)]
        base = omniroll.Vehicle.paper(4).replace(mass=20.0, yaw_inertia=0.8, **layout, wheel_places=places)
        assert list(of_wheels({}, base.replace(**numbers))) == []
