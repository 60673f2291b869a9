"""Vehicles from URDF and MJCF and back, and runs beside MuJoCo."""

import json
import math

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.exchange.importing import import_vehicle
from omniroll.exchange.mjcf import to_mjcf
from omniroll.exchange.run_in_mujoco import run_in_mujoco
from omniroll.robots.catalogue import ROBOTS, robot

from .urdf import NUMBERS, joint, link, urdf


@pytest.fixture(scope="module")
def mujoco():
    return pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extra mujoco")


@pytest.fixture
def read(mujoco, tmp_path):
    def reading(text, name="robot.urdf", **numbers):
        (tmp_path / name).write_text(text)
        return import_vehicle(tmp_path / name, **numbers)

    return reading


def assert_same(one, other, rel=1e-12):
    """The same vehicle but for rounding."""
    for name, value in one.as_dict().items():
        found = getattr(other, name)
        if value is None:
            assert found is None, name
        elif name == "wheel_angles":
            assert np.abs(np.exp(1j * (np.array(found) - value)) - 1).max() < rel
        else:
            np.testing.assert_allclose(found, value, rtol=rel, atol=1e-15, err_msg=name)


def test_a_urdf_file_says_what_its_vehicle_is(read):
    """Each number worked out here by hand from the bodies in the file."""
    found = read(urdf()).vehicle
    (base, _, _, yaw), (hub, axial, across), (roller, along, athwart) = (NUMBERS[k] for k in ("base", "hub", "roller"))
    r, R, n = NUMBERS["r"], NUMBERS["R"], NUMBERS["rollers"]
    assert (found.wheels, found.rollers_per_wheel) == (3, 8)
    assert found.mass == pytest.approx(base + 3 * (hub + n * roller), rel=1e-13)
    assert found.wheel_inertia == pytest.approx(axial + n * (athwart + roller * r**2), rel=1e-12)
    assert found.roller_inertia == pytest.approx(along, rel=1e-12)
    assert found.wheel_radius == pytest.approx(r + NUMBERS["roller_radius"], rel=1e-12)
    assert found.platform_radius == pytest.approx(R, rel=1e-12)
    of_wheel = across + (hub + n * roller) * R**2 + n * (roller * r**2 / 2 + (along + athwart) / 2)
    assert found.yaw_inertia == pytest.approx(yaw + 3 * of_wheel, rel=1e-12)
    angles = np.array(found.wheel_angles) - 0.3 - 2 * np.pi * np.arange(3) / 3
    assert np.abs(np.exp(1j * angles) - 1).max() < 1e-12
    assert found.center_of_mass == (0, 0) and found.wheel_places is None


@pytest.mark.parametrize("changes", [{}, {"wheels": 4, "rollers": 12, "r": 0.05, "R": 0.2}, {"inward": True}])
def test_there_and_back(read, changes):
    first = read(urdf(**changes)).vehicle
    again = read(to_mjcf(first), "robot.xml").vehicle
    assert_same(first, again)


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_there_and_back(read, name):
    vehicle = robot(name).vehicle
    assert_same(vehicle, read(to_mjcf(vehicle, spheres=1), "robot.xml").vehicle)


def test_a_layout_there_and_back(read):
    places = [(0.1, 0.1), (-0.1, 0.12), (-0.13, -0.1), (0.1, -0.1)]
    layout = {"wheel_places": places, "wheel_angles": [0.8, 2.2, -2.3, -0.8], "center_of_mass": (0.01, 0.005)}
    vehicle = omniroll.Vehicle.paper(4, 8).replace(yaw_scale=1.0, **layout)
    again = read(to_mjcf(vehicle, spheres=1), "robot.xml").vehicle
    assert_same(vehicle, again.replace(platform_radius=vehicle.platform_radius))


def test_axles_that_point_inward_are_turned_and_this_is_said(read):
    assert_same(read(urdf()).vehicle, read(urdf(inward=True)).vehicle)
    assert any("point inward" in words for words in read(urdf(inward=True)).assumed)


def test_a_platform_of_several_parts_and_its_tensor_are_turned(read):
    """A box on the platform whose tensor is given in axes turned by 90 degrees: y of the tensor is the vertical."""
    box = link("box", 1.0, (0.01, 0.02, 0.015), at=(0.03, 0, 0.1), rpy=(math.pi / 2, 0, 0))
    arm = link("arm", 0.5, (1e-3, 1e-3, 1e-3))
    more = box + joint("weld", "base_link", "box", (0, 0, 0), kind="fixed")
    more += arm + joint("elbow", "box", "arm", (0, 0, 0.2), axis=(0, 0, 1))
    plain, found = read(urdf()).vehicle, read(urdf(more=more))
    assert found.vehicle.mass == pytest.approx(plain.mass + 1.5, rel=1e-13)
    assert found.vehicle.yaw_inertia == pytest.approx(plain.yaw_inertia + 0.02 + 0.03**2 + 1e-3, rel=1e-12)
    assert found.vehicle.center_of_mass == pytest.approx((0.03 / found.vehicle.mass, 0), abs=1e-12)
    assert any("arm is held" in words for words in found.assumed)


def test_a_platform_that_is_turned_and_moved_in_its_world(read):
    text = to_mjcf(omniroll.Vehicle.paper().replace(yaw_scale=1.0))
    moved = text.replace('name="platform" pos="0 0 ', 'name="platform" quat="0.6 0 0 0.8" pos="3 -2 ')
    assert moved != text
    assert_same(read(text, "a.xml").vehicle, read(moved, "b.xml").vehicle)


HEAVY_ROLLER = urdf().replace(f'<mass value="{NUMBERS["roller"][0]}"', '<mass value="0.1"', 1)


@pytest.mark.parametrize(
    "text, words",
    [
        (urdf(rollers=2), "must have wheels"),
        (urdf().replace('<axis xyz="1.0 0.0 0.0"', '<axis xyz="0.0 0.0 1.0"', 1), "not horizontal .*: wheel0"),
        (urdf(base=(2.0, 0.001, 0.001, 0.011)), "MuJoCo reads; it says: .*inertia"),
        ("<robot>", "MuJoCo reads"),
        ("not a file of the kind", "MuJoCo reads"),
        (HEAVY_ROLLER, "wheels whose wheel_inertia is from .* or give wheel_inertia"),
    ],
)  # fmt: skip
def test_what_is_no_such_vehicle(read, text, words):
    with pytest.raises(omniroll.InvalidValueError, match=words):
        read(text)


def test_a_file_that_is_not_there(mujoco, tmp_path):
    with pytest.raises(omniroll.InvalidValueError, match="is no file: give a URDF or MJCF file"):
        import_vehicle(tmp_path / "nothing.urdf")


def test_what_is_printed_of_a_file_is_a_scene(read, tmp_path, capsys, mujoco):
    (tmp_path / "robot.urdf").write_text(urdf())
    assert cli.main(["vehicle", str(tmp_path / "robot.urdf")]) == 0
    path = tmp_path / "robot.toml"
    path.write_text(capsys.readouterr().out + "\n[start]\nnu = [1, 0, 0]\n[run]\nduration = 1\n")
    assert omniroll.load_scene(path).vehicle == import_vehicle(tmp_path / "robot.urdf").vehicle


def test_a_body_for_each_roller_moves_as_the_equations_do(mujoco, tmp_path, capsys):
    """Smaller steps make stiffer contacts, and MuJoCo's motion comes nearer."""
    path = tmp_path / "scene.toml"
    path.write_text("[vehicle]\npreset = 'paper'\n[start]\nnu = [1, 0.3, 1]\n[run]\nduration = 1.0\n")
    output = tmp_path / "out"
    call = ["compare", str(path), "--with", "mujoco", "--duration", "0.3", "--step", "5e-4", "--output", str(output)]
    assert cli.main([*call, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    coarse, fine = found["runs"]
    assert fine["step"] == coarse["step"] / 2 and fine["t"][-1] == pytest.approx(0.3, abs=1e-3)
    assert 0 < fine["place"][-1] < coarse["place"][-1] < 0.02 * found["way"]
    assert {file.name for file in output.iterdir()} == {"model.xml", "compare.json", "compare.png"}
    assert_same(omniroll.Vehicle.paper().replace(yaw_scale=1.0), import_vehicle(output / "model.xml").vehicle)


def test_motors_drive_the_bodies_as_they_drive_the_vehicle(mujoco):
    """From rest: without the torques the bodies would stay, and without what motors lose by their rate be too fast."""
    motor = omniroll.Motor([4, -2, -2], torque_constant=0.012, resistance=2.5, gear_ratio=20, rotor_inertia=4e-7)
    run = omniroll.simulate(omniroll.Vehicle.paper(), nu=(0, 0, 0), duration=0.35, effects=[motor])
    other = run_in_mujoco(run, np.linspace(0, 0.35, 8), 1e-3, 1.0)
    own = run.sample(other.t)
    way = np.linalg.norm(own.pose[-1, :2])
    assert way > 0.1 and np.linalg.norm(other.pose[-1, :2] - own.pose[-1, :2]) < 0.01 * way


SKID = """[vehicle]
preset = 'robot-soccer-kit'
[start]
nu = [6, 0, 0]
[run]
duration = 0.02
[contact]
law = 'coulomb'
friction = 0.3
wheel_rates = 0
[reactions]
height = 0.05
"""


def test_a_comparison_takes_friction_and_height_from_the_contact(mujoco, tmp_path, capsys):
    path, output = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(SKID)
    call = ["compare", str(path), "--with", "mujoco", "--spheres", "1", "--output", str(output), "--json"]
    assert cli.main(call) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["friction"] == 0.3 and summary["height"] == 0.05 and not summary["left_out"]
    model = mujoco.MjModel.from_xml_path(str(output / "model.xml"))
    assert (model.geom_friction[1:, 0] == 0.3).all()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.subtree_com[1, 2] == pytest.approx(0.05, rel=1e-12)
    run = omniroll.run(omniroll.load_scene(path))
    other = run_in_mujoco(run, run.t[[0]] + [0.0, 0.01], 2e-4, spheres=1)
    assert np.abs(other.wheel_rates[0]).max() == 0  # the wheels stand at the start
    assert other.nu[1, 0] < other.nu[0, 0]
