"""A roboticist's walk with a robot of data sheets alone: from its numbers to slip, sweep, fit, agent and MuJoCo.

Each command ends well, without a traceback, and it is told where every number of the vehicle comes from.
"""

import json

import numpy as np
import pytest

import omniroll
from omniroll import cli

pytestmark = pytest.mark.long

SHEET = """
[vehicle]
wheels = 4
rollers_per_wheel = 15
wheel_angles = ["59 deg", "135 deg", "225 deg", "301 deg"]
platform_radius = 0.08
wheel_radius = 0.03
mass = 2.6
wheel_mass = 0.06
roller_diameter = 0.008
roller_length = 0.009

[start]
twist = [0.0, 0.0, 0.0]

[run]
duration = 1.0
step = 0.01

[rollers]
model = "MODEL"

[drive]
times = [0.0, 0.1, 0.5, 1.0]
voltage = [[0.0, 0.0, 0.0, 0.0], [4.0, 3.0, -3.0, -4.0], [2.0, 4.0, -1.0, -2.0], [5.0, -1.0, 1.0, 3.0]]
torque_constant = 0.0255
resistance = 1.2
gear_ratio = 3.0
rotor_inertia = 92.5e-7

[bearings]
wheel_viscous = 1e-4

[measurements]
wheel_rate_noise = 0.05
"""
GROUND = '\n[contact]\nlaw = "coulomb"\nfriction = 0.3\n'


@pytest.fixture
def walk(tmp_path, monkeypatch, capsys):
    """A function that calls the command in a new folder, where the scenes are, and gives what it printed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.toml").write_text(SHEET.replace("MODEL", "free"), encoding="utf-8")
    (tmp_path / "slips.toml").write_text(SHEET.replace("MODEL", "massless") + GROUND, encoding="utf-8")

    def call(*words, code=0):
        found, shown = cli.main([str(word) for word in words]), capsys.readouterr()
        assert found == code and "Traceback" not in shown.out + shown.err, shown.err
        return shown.out

    return call


def test_the_walk(walk, tmp_path):
    vehicle = omniroll.load_scene("robot.toml").vehicle
    told = {number.name: number.kind for number in vehicle.origins}  # what `explain` shows of them
    named = {name for name, value in vehicle.as_dict().items() if isinstance(value, float)} - {"yaw_scale"}
    assert named <= set(told) and {"assumed", "given"} <= set(told.values())

    assert "error" in walk("run", "robot.toml", "--plot")
    assert (tmp_path / "out/run/robot/forces.png").exists()
    assert "m per m" in walk("run", "slips.toml")
    assert "6 runs" in walk("sweep", "slips.toml", "--vary", "contact.friction=0.2:0.4:3", "--vary", "vehicle.mass=2,3")

    log = "out/run/robot/samples.csv"
    asked = ("--free", "mass,wheel_viscous", "--drive", "motor_voltage", "--readings", "wheel_rate")
    walk("fit", "robot.toml", log, *asked)
    fitted = omniroll.load_scene("out/fit/robot/fitted.toml")
    assert fitted.vehicle.mass == pytest.approx(2.6, rel=0.05)

    gym = pytest.importorskip("omniroll.gym")
    env = gym.TwistEnv(vehicle=vehicle, render_mode="rgb_array")
    env.reset(seed=1)
    assert np.isfinite(env.step(np.ones(4))[0]).all() and env.render().shape == (256, 256, 3)

    pytest.importorskip("mujoco")
    assert "apart" in walk("compare", "robot.toml", "--with", "mujoco", "--duration", "0.1")
    conventions = json.loads(walk("conventions", "robot.toml", "--json"))
    assert [wheel["side"] for wheel in conventions["wheels"]][1:3] == ["back left", "back right"]
