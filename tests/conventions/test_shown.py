"""Which wheel is which: what the command prints, and LeKiwi's formulas, which are written here once more."""

import json
import math

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.conventions import lekiwi
from omniroll.conventions.shown import facts

ANGLES = [math.radians(angle) for angle in (180, 60, -60)]  # back, left, right


def lerobot(x, y, theta, wheel_radius, base_radius):
    """_body_to_wheel_raw of lekiwi.py, up to degrees a second: left, back, right."""
    angles = np.radians(np.array([240, 0, 120]) - 90)
    matrix = np.array([[np.cos(a), np.sin(a), base_radius] for a in angles])
    return matrix.dot(np.array([x, y, theta * np.pi / 180])) / wheel_radius * (180 / np.pi)


def test_the_matrix_is_that_of_lerobot():
    vehicle = omniroll.Vehicle.paper().replace(wheel_angles=ANGLES, platform_radius=0.125, center_of_mass=(0.01, 0))
    drive = lekiwi.LeKiwiDrive.of(vehicle)
    assert drive.order == (1, 0, 2)
    wanted = np.stack([lerobot(*row, vehicle.wheel_radius, 0.125) for row in np.diag([1, 1, 180 / np.pi])], axis=1)
    assert np.abs(drive.matrix - wanted).max() <= 1e-15 * np.abs(wanted).max()
    assert drive.rates(drive.speeds_of_rates([1.0, 2.0, 3.0])) == pytest.approx([1, 2, 3], rel=1e-15)
    twist = [0.2, -0.1, 0.5]
    assert lekiwi.fields_of_twist(twist)["theta.vel"] == math.degrees(0.5)
    assert lekiwi.twist_of_fields(lekiwi.fields_of_twist(twist)) == pytest.approx(twist, rel=1e-15)
    with pytest.raises(omniroll.InvalidValueError, match="60, 180 and -60 degrees"):
        lekiwi.LeKiwiDrive.of(omniroll.Vehicle.paper())


def test_wheels_turn_as_a_run_says():
    """The left wheel of a robot that goes ahead turns forwards: by the right-hand rule about its axle, outward."""
    vehicle = omniroll.Vehicle.paper().replace(wheel_angles=[math.pi / 2, math.pi, -math.pi / 2], yaw_scale=1.7)
    found = facts(vehicle)
    left, back, right = found["wheels"]
    assert [wheel["side"] for wheel in found["wheels"]] == ["left", "back", "right"] and left["wheel"] == 1
    assert left["for_x"] == pytest.approx(1 / vehicle.wheel_radius) == -right["for_x"] and back["for_x"] == 0
    for k, (name, speed) in enumerate({"for_x": 0.1, "for_y": 0.1, "for_yaw": 0.5}.items()):
        nu = np.zeros(3)
        nu[k] = speed * (vehicle.yaw_scale if name == "for_yaw" else 1 / vehicle.platform_radius)
        run = omniroll.simulate(vehicle, nu=nu, duration=1e-3, roller_model="massless", engine="python")
        rates = run.measure([0.0], names=("wheel_rate",))["wheel_rate"][0]
        assert [speed * wheel[name] for wheel in found["wheels"]] == pytest.approx(rates.tolist(), abs=1e-12)


def test_the_command(tmp_path, capsys):
    assert cli.main(["conventions", "robot-soccer-kit"]) == 0
    said = capsys.readouterr().out
    assert "1      front right" in said and "wheel_names: [wheel1, wheel2, wheel3]" in said
    assert "does not drive this vehicle: wheels must be 4" in said
    (tmp_path / "x.toml").write_text(
        '[vehicle]\npreset = "paper"\nwheels = 4\nwheel_angles = ["45 deg", "135 deg", "225 deg", "315 deg"]\n'
        "[start]\nnu = [0, 0, 0]\n[run]\nduration = 1\n"
    )
    assert cli.main(["conventions", str(tmp_path / "x.toml"), "--json"]) == 0
    programs = json.loads(capsys.readouterr().out)["programs"]
    assert [(w["name"], w["wheel"], round(w["for_x"], 12)) for w in programs["wpilib"]["wheels"]] == [
        ("FL", 1, 1), ("FR", 4, 1), ("RL", 2, 1), ("RR", 3, 1),
    ]  # fmt: skip
    assert [w["wheel"] for w in programs["ros"]["wheels"]] == [1, 2, 3, 4]
    assert cli.main(["conventions", "nobody"]) == 2
