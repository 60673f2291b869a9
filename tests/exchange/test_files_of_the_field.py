"""Files of the kinds that people have: each gives the right vehicle, or a sentence that says what to do."""

import math
import re

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.exchange.importing import import_vehicle
from omniroll.exchange.mjcf import to_mjcf

from .urdf import CYLINDER, joint, link, plain_urdf, urdf

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extra mujoco")
VISUAL = CYLINDER.format(rpy="0 0 0", radius=0.0405 - 0.03, length=0.01).replace("collision", "visual")
SHOWN = '<robot name="test"><mujoco><compiler discardvisual="false"/></mujoco>'


def two_robots():
    """Two vehicles and a ball in one MJCF file."""
    first, second = (to_mjcf(omniroll.Vehicle.paper().replace(mass=m), spheres=1) for m in (3.0, 4.0))
    body = second[second.index("<body") : second.index("</worldbody>")]
    for name in ("platform", "wheel", "roller"):
        body = body.replace(f'name="{name}', f'name="other_{name}')
    inertial = '<inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/>'
    ball = f'<body name="ball" pos="1 0 0"><freejoint/>{inertial}</body>'
    return first.replace("</worldbody>", f"{body}{ball}</worldbody>")


def turret():
    """A part on a vertical hinge without limits that carries two hinges more: it is no wheel."""
    parts = link("turret", 0.2, (1e-4, 1e-4, 1e-4)) + joint("pan", "base_link", "turret", (0, 0, 0.1), axis=(0, 0, 1))
    for k in range(3):
        angle = 2 * math.pi * k / 3
        parts += link(f"fin{k}", 0.01, (1e-5, 1e-5, 1e-5))
        parts += joint(f"f{k}", "turret", f"fin{k}", (math.cos(angle), math.sin(angle), 0), (0, 0, angle), (1, 0, 0))
    return parts


def without_a_roller():
    return re.sub(r'<(link|joint) name="(roller|spin)0_7".*?</\1>', "", urdf(), flags=re.DOTALL)


FILES = {
    "plain": (urdf(), {}),
    "struts": (urdf(strut=0.03), {}),
    "struts, four wheels": (urdf(strut=0.03, wheels=4, rollers=10), {}),
    "turret": (urdf(more=turret()), {}),
    "CAD": (urdf(spread=0.004), {}),
    "visual": (urdf().replace("</link>", VISUAL + "</link>").replace('<robot name="test">', SHOWN), {}),
    "frictions": (urdf(frictions=(0.1, 0.0, 0.3)), {}),
    "one of two": (two_robots(), {"robot": "other_platform"}),
    "one body": (plain_urdf(), {"rollers_per_wheel": 10, "roller_radius": 0.006}),
}


@pytest.fixture
def read(tmp_path):
    def reading(text, **numbers):
        path = tmp_path / ("robot.xml" if text.startswith("<mujoco") else "robot.urdf")
        path.write_text(text)
        return import_vehicle(path, **numbers)

    return reading


def mass_matrix(text, root):
    """MuJoCo's model and mass matrix (nv, nv) of a file, with a first body that is free."""
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.fusestatic = False
    body = spec.body(root)
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints):
        body.add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return model, full, int(model.jnt_dofadr[model.body_jntadr[model.body(root).id]])


@pytest.mark.parametrize("name", FILES)
def test_masses_and_inertias_are_those_of_mujocos_mass_matrix(read, name):
    text, options = FILES[name]
    found = read(text, **options).vehicle
    root = options.get("robot", "platform" if text.startswith("<mujoco") else "base_link")
    model, full, free = mass_matrix(text, root)
    forward, turn = np.zeros(model.nv), np.zeros(model.nv)
    forward[free], turn[free + 5] = 1, 1
    prefix = root.removesuffix("platform") if "platform" in root else ""
    numbers = ("1", "roller1_1") if "platform" in root else ("0", "roller0_0")
    wheel = int(model.body_dofadr[model.body(f"{prefix}wheel{numbers[0]}").id])
    for value, true in (
        (found.mass, forward @ full @ forward),
        (found.yaw_inertia, turn @ full @ turn),
        (found.mass * found.center_of_mass[0], turn @ full @ np.eye(model.nv)[free + 1]),
        (found.wheel_inertia, full[wheel, wheel]),
    ):
        assert value == pytest.approx(true, rel=1e-9, abs=1e-12)
    if name not in ("one body", "CAD"):  # of these the file has no rollers, or unequal ones
        roller = int(model.body_dofadr[model.body(f"{prefix}{numbers[1]}").id])
        assert found.roller_inertia == pytest.approx(full[roller, roller], rel=1e-9)


@pytest.mark.parametrize("name", [name for name in FILES if "two" not in name])
def test_masses_add_up_to_those_of_the_file_and_this_is_said(read, name):
    text, options = FILES[name]
    found = read(text, **options)
    (said,) = [words for words in found.assumed if words.startswith("masses:")]
    assert f"{found.vehicle.mass:.6g} kg, all that the file has" in said


def test_two_robots_are_named(read):
    with pytest.raises(omniroll.InvalidValueError, match="2 robots: platform, other_platform; name one"):
        read(two_robots())
    found = read(two_robots(), robot="other_platform")
    assert found.vehicle.mass == pytest.approx(4.0, rel=1e-12)
    assert any("3.05 kg of platform, ball belong to others" in words for words in found.assumed)
    with pytest.raises(omniroll.InvalidValueError, match="must be one of platform, other_platform, ball"):
        read(two_robots(), robot="nobody")


def test_wheels_of_one_body(read):
    found = read(plain_urdf(), rollers_per_wheel=10, roller_radius=0.006)
    vehicle, kinds = found.vehicle, {origin.name: origin.kind for origin in found.vehicle.origins}
    assert (vehicle.wheels, vehicle.rollers_per_wheel) == (3, 10)
    assert vehicle.wheel_radius == pytest.approx(0.038, rel=1e-12)
    assert vehicle.roller_axis_radius == pytest.approx(0.032, rel=1e-12)
    length = 2 * 0.032 * math.tan(math.pi / 10)
    mass = 1200 * math.pi * 0.006**2 * length
    assert vehicle.roller_inertia == pytest.approx(mass * 0.006**2 / 2, rel=1e-12)
    assert kinds["roller_inertia"] == "assumed" and kinds["mass"] == "derived"
    assert any("wheel0, wheel1, wheel2" in words for words in found.assumed)
    assert [words for words in found.assumed if "is held" in words] == [
        f"{name} is held where the file has it" for name in ("fork", "ball", "arm")
    ]
    named = read(plain_urdf(), rollers_per_wheel=10, roller_radius=0.006, wheel_names=["wheel0", "wheel1", "wheel2"])
    assert named.vehicle == vehicle


def test_wheels_of_one_body_with_those_of_a_known_robot(read):
    kit = omniroll.robot("robot-soccer-kit").vehicle
    vehicle = read(plain_urdf(wheel_radius=kit.wheel_radius), wheel="robot-soccer-kit").vehicle
    for name in ("rollers_per_wheel", "roller_axis_radius", "roller_inertia"):
        assert getattr(vehicle, name) == getattr(kit, name)
    with pytest.raises(omniroll.InvalidValueError, match="has a radius of 0.0345 m"):
        read(plain_urdf(), wheel="robot-soccer-kit")


@pytest.mark.parametrize(
    "text, options, words",
    [
        (plain_urdf(), {}, "rollers_per_wheel = None: must be given with roller_radius: .* wheels of one body"),
        (plain_urdf(), {"rollers_per_wheel": 10}, "roller_radius = None: must be given"),
        (plain_urdf(collision=False), {"rollers_per_wheel": 10, "roller_radius": 0.006}, "--wheel-radius"),
        (urdf(), {"roller_radius": 0.006}, "the file has bodies for the rollers"),
        (plain_urdf(wheels=2, caster=False), {}, "has hinges of wheel0, wheel1, arm"),
        (without_a_roller(), {}, "not evenly spaced: neighbours are 45 to 90 degrees apart"),
    ],
)  # fmt: skip
def test_sentences(read, text, options, words):
    with pytest.raises(omniroll.InvalidValueError, match=words):
        read(text, **options)


def test_options_of_the_command(tmp_path, capsys):
    path = tmp_path / "robot.urdf"
    path.write_text(plain_urdf())
    assert cli.main(["vehicle", str(path), "--rollers", "10", "--roller-radius", "0.006"]) == 0
    assert "rollers_per_wheel = 10" in capsys.readouterr().out
    assert cli.main(["vehicle", str(path)]) == 2
    assert "--rollers = None" in capsys.readouterr().err
    angled = ["vehicle", str(path), "--rollers", "10", "--roller-radius", "0.006", "--roller-angle", "45deg"]
    assert cli.main(angled) == 0
    assert f"roller_angle = {[math.pi / 4] * 3}" in capsys.readouterr().out
