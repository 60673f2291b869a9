"""Vehicles with rollers at an angle or in two rows, from URDF and MJCF and back, beside MuJoCo's own mass matrix."""

import math

import numpy as np
import pytest

import omniroll
from omniroll import InvalidValueError
from omniroll.exchange.importing import import_vehicle
from omniroll.exchange.mjcf import to_mjcf
from omniroll.exchange.urdf import to_urdf
from omniroll.robots.catalogue import robot

from .test_exchange import assert_same
from .urdf import plain_urdf, urdf

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extra mujoco")
PAPER = omniroll.Vehicle.paper(4, 10).replace(yaw_scale=1.0)
HANDS = (1, -1, -1, 1)
VEHICLES = {
    "mecanum": PAPER.replace(roller_angle=[hand * math.pi / 4 for hand in HANDS]),
    "steep": PAPER.replace(roller_angle=[-1.2, 1.2, 1.2, 1.2], center_of_mass=(0.01, -0.005)),
    "rows": PAPER.replace(rows=2, row_offset=0.006),
    "rows, roller 0 inward": PAPER.replace(rows=2, row_offset=-0.006),
    "youbot": robot("youbot").vehicle,
}
FORMATS = {"robot.xml": to_mjcf, "robot.urdf": to_urdf}


@pytest.fixture
def read(tmp_path):
    def reading(text, name="robot.urdf", **numbers):
        (tmp_path / name).write_text(text)
        return import_vehicle(tmp_path / name, **numbers)

    return reading


@pytest.mark.parametrize("file", FORMATS)
@pytest.mark.parametrize("name", VEHICLES)
def test_there_and_back(read, name, file):
    vehicle = VEHICLES[name]
    again = read(FORMATS[file](vehicle, spheres=1), file).vehicle
    assert_same(vehicle, again.replace(platform_radius=vehicle.platform_radius))
    assert (again.rows, again.rollers_per_wheel) == (vehicle.rows, vehicle.rollers_per_wheel)


def whole(model, data, row):
    """Twice the energy of motions that these speeds (nv) are."""
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return row @ matrix @ row


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("file", FORMATS)
def test_inertias_are_those_of_mujocos_mass_matrix(tmp_path, name, file):
    vehicle = VEHICLES[name]
    text = FORMATS[file](vehicle, spheres=1)
    if file == "robot.urdf":  # MuJoCo holds a URDF's first link unless there is a joint to the world
        compiler = '<mujoco><compiler fusestatic="false" inertiafromgeom="false"/></mujoco>'
        text = text.replace("<link", f'{compiler}<link name="world"/><link', 1)
        free = '<joint name="free" type="floating"><parent link="world"/><child link="platform"/></joint>'
        text = text.replace("</robot>", f"{free}</robot>")
    (tmp_path / file).write_text(text)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / file))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    unit = np.eye(model.nv)
    wheel, roller = (int(model.joint(joint).dofadr[0]) for joint in ("wheel1", "roller1_2"))
    assert whole(model, data, unit[wheel]) == pytest.approx(vehicle.wheel_inertia, rel=1e-9)
    assert whole(model, data, unit[roller]) == pytest.approx(vehicle.roller_inertia, rel=1e-9)
    assert whole(model, data, unit[0]) == pytest.approx(vehicle.mass, rel=1e-9)
    assert whole(model, data, unit[5]) == pytest.approx(vehicle.yaw_inertia, rel=1e-9)
    # The roller's axial speed has the sine of its angle times the wheel's rate: that is what couples them.
    both = whole(model, data, unit[wheel] + unit[roller]) - vehicle.wheel_inertia - vehicle.roller_inertia
    wanted = 2 * vehicle.roller_inertia * math.sin(vehicle.roller_angle[0])
    assert both == pytest.approx(wanted, rel=1e-8, abs=1e-12 * vehicle.wheel_inertia)


@pytest.mark.parametrize("name", VEHICLES)
def test_spheres_lie_in_the_envelope_and_touch_it(name):
    """However a wheel stands, its lowest sphere is at most the wheel's radius below the axle; one touches by turns."""
    vehicle, spheres = VEHICLES[name], 9
    model = mujoco.MjModel.from_xml_string(to_mjcf(vehicle, spheres=spheres))
    data = mujoco.MjData(model)
    joint = math.pi / vehicle.rollers_per_wheel
    place = int(model.joint("wheel1").qposadr[0])
    of_wheel = [k for k in range(1, model.ngeom) if model.body(model.geom_bodyid[k]).name.startswith("roller1_")]
    for chi in np.linspace(-joint, joint, 2 * spheres - 1):
        data.qpos[:] = model.qpos0
        data.qpos[2], data.qpos[place] = vehicle.wheel_radius, chi
        mujoco.mj_kinematics(model, data)
        lowest = min(data.geom_xpos[k][2] - model.geom_size[k][0] for k in of_wheel)
        assert lowest > -1e-15
        if round((chi + joint) / (joint / (spheres - 1))) % 2 == 0:
            assert lowest == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("inward, sign", [(False, 1), (True, 1)])
def test_the_hand_does_not_depend_on_the_axles_sign(read, inward, sign):
    found = read(urdf(slant=0.7, inward=inward)).vehicle
    assert found.roller_angle == pytest.approx([sign * 0.7] * 3, rel=1e-12)


def test_two_rows_of_a_file_are_two_or_one_on_request(read):
    found = read(urdf(offset=0.006, rollers=10))
    assert (found.vehicle.rows, found.vehicle.platform_radius) == (2, pytest.approx(0.12))
    assert abs(found.vehicle.row_offset) == pytest.approx(0.006)
    one = read(urdf(offset=0.006, rollers=10), rows=1)
    assert one.vehicle.has_wheels_of_the_paper and any("count as one in the middle" in words for words in one.assumed)


def test_an_x_is_assumed_of_wheels_of_one_body(read):
    sizes = {"rollers_per_wheel": 12, "roller_radius": 0.008, "roller_angle": math.pi / 4}
    corners = plain_urdf(wheels=4)
    found = read(corners, **sizes)
    signs = np.sign(found.vehicle.places().prod(axis=1) if found.vehicle.wheel_places is None else [0])
    assert np.sign(found.vehicle.roller_angle).tolist() == signs.tolist()
    assert any("make an X" in words for words in found.assumed)
    own = read(corners, **sizes | {"roller_angle": [0.7, 0.7, -0.7, -0.7]})
    assert own.vehicle.roller_angle == (0.7, 0.7, -0.7, -0.7)


@pytest.mark.parametrize("text, words", [
    (urdf(offset=0.006, rollers=9), "stand neither in one row nor in two, by turns"),
    (
        urdf(slant=0.7).replace('<axis xyz="0.644', '<axis xyz="-0.644', 1),
        "make -40.11 to 40.11 degrees with its plane",
    ),
])  # fmt: skip
def test_what_is_refused(read, text, words):
    with pytest.raises(InvalidValueError, match=words):
        read(text)
