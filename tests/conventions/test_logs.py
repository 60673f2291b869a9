"""Logs of commands: what is read, what is refused, and that a scene replays them."""

from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll.conventions.logs import read_log
from omniroll.scenes.lints import lints

SCENE = """[vehicle]
preset = "paper"
[start]
nu = [0, 0, 0]
[run]
duration = 0.5
step = 0.01
[drive]
log = "log.csv"
"""
TORQUES = "t,torque_1,torque_2,torque_3\n0,0.01,0,-0.01\n0.2,0.02,0.01,0\n"
TRACKED = SCENE.split("[drive]")[0] + '[controller]\nlog = "log.csv"\nproportional = 0.2\nsample_time = 0.01\n'


def scene(tmp_path, log, text=SCENE):
    (tmp_path / "log.csv").write_text(log)
    (tmp_path / "scene.toml").write_text(text)
    return omniroll.load_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize("text, words", [
    ("", "must have a line of names"),
    ("t,torque_1,torque_3\n0,1,2\n", "must have commands.*log_columns, names"),
    ("torque_1\n0\n", "must have a column t, time"),
    ("t,vx,vy,wz\n", "must have a line of names and lines of numbers"),
    ("t,vx,vy,wz\n1,1,2,3\n0,1,2,3\n", "3: t = 0.0: must come after 1.0"),
    ("t,vx,vy,wz\n0,1,2\n", "2: 3: numbers; the line of names has 4"),
    ("t,vx,vy,wz\n0,1,2,3\n1,1,2,x\n", "3: wz = 'x': must be a number"),
    ("t,vx,vy,wz\n0,1,2,nan\n", "2: wz = nan: must be finite"),
])  # fmt: skip
def test_what_is_no_log(tmp_path, text, words):
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(omniroll.InvalidValueError, match=words):
        read_log(tmp_path / "log.csv")


def test_a_scene_replays_torques_that_hold_and_voltages_with_a_motor(tmp_path):
    found = scene(tmp_path, TORQUES)
    (torque,) = found.options["effects"]
    assert torque == omniroll.TorqueTable([0.0, 0.2], [[0.01, 0, -0.01], [0.02, 0.01, 0]], "hold")
    linear = scene(tmp_path, TORQUES, SCENE + 'interpolation = "linear"\n')
    assert linear.options["effects"][0].interpolation == "linear"

    log = f"{TORQUES.split()[0]},motor_voltage_1,motor_voltage_2,motor_voltage_3\n0,9,9,9,1,2,3\n0.1,9,9,9,4,5,6\n"
    motor = "torque_constant = 0.02\nresistance = 1.0\n"
    (found,) = scene(tmp_path, log, SCENE + motor).options["effects"]
    assert found.voltage == ((1, 2, 3), (4, 5, 6)) and found.interpolation == "hold"


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_a_command_holds_until_the_next(tmp_path, engine):
    """The vehicle follows each twist until the next row; a linear target would be half way between them."""
    log = "t,vx,vy,wz\n0,0.1,0,0\n0.4,0,0.2,0\n"
    found = scene(tmp_path, log, TRACKED)
    run = omniroll.run(found, engine=engine)
    seen = run.sample(np.array([0.38, 0.5])).nu * found.vehicle.platform_radius
    assert seen[0, 0] == pytest.approx(0.1, rel=0.1) and abs(seen[0, 1]) < 0.01
    assert seen[1, 1] > 0.1
    linear = omniroll.run(scene(tmp_path, log, TRACKED + 'interpolation = "linear"\n'), engine=engine)
    assert linear.sample(0.38).nu[1] * found.vehicle.platform_radius > 0.1


@pytest.mark.parametrize("log, text, words", [
    (TORQUES, SCENE + "torque = 1.0\n", "torque = 1.0: cannot stand beside log"),
    (TORQUES, SCENE + "torque_constant = 0.02\nresistance = 1.0\n", "must have columns voltage_1"),
    ("t,vx,vy,wz\n0,1,2,3\n", SCENE, "belongs to \\[controller\\]"),
    (TORQUES, TRACKED, "must have columns vx, vy, wz, or wheel_rate_1"),
    (TORQUES, SCENE.replace("log.csv", "other.csv"), "No such file"),
    (TORQUES, SCENE.replace("log.csv", "../log.csv"), "own folder"),
    (TORQUES, SCENE.replace("log.csv", "/etc/passwd"), "own folder"),
    (TORQUES, SCENE.replace("log.csv", "."), "own folder"),
    (TORQUES.replace("torque_3", "x"), SCENE, "3 columns, one for each wheel"),
    ("nothing", SCENE, "must have a line of names"),
])  # fmt: skip
def test_what_a_scene_cannot_replay(tmp_path, log, text, words):
    with pytest.raises(omniroll.SceneError, match=words):
        scene(tmp_path, log, text)


def test_a_scene_names_no_folder_and_no_large_file(tmp_path, monkeypatch):
    (tmp_path / "bag").mkdir()
    with pytest.raises(omniroll.SceneError, match="of a bag in a folder name its .mcap"):
        scene(tmp_path, TORQUES, SCENE.replace("log.csv", "bag"))
    monkeypatch.setattr("omniroll.scenes.logs.MOST_BYTES", 10)
    with pytest.raises(omniroll.SceneError, match="at most 10 bytes"):
        scene(tmp_path, TORQUES)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "outside.csv").write_text(TORQUES)
    (inner / "log.csv").symlink_to(tmp_path / "outside.csv")
    Path(inner, "scene.toml").write_text(SCENE)
    with pytest.raises(omniroll.SceneError, match="own folder"):
        omniroll.load_scene(inner / "scene.toml")


def test_a_scene_says_what_was_recognised_in_its_log(tmp_path):
    """A log in ms since 1970, under other names; and one that begins when the run is over."""
    text = TRACKED.replace('log = "log.csv"', 'log = "log.csv"\nlog_columns = "time=clock [ms], vx=ahead"')
    rows = "".join(f"{1732809600000 + 20 * k},0.1,0,0\n" for k in range(3))
    found = scene(tmp_path, "clock,ahead,vy,wz\n" + rows, text)
    assert found.tables["controller"]["times"] == [0.0, 0.02, 0.04]
    assert [place for *place, _ in found.said] == [["controller", "log"]]
    assert any("since 1970" in str(lint) for lint in lints(found))
    late = scene(tmp_path, "t,vx,vy,wz\n100,1,0,0\n101,0,0,0\n", TRACKED)
    assert any("when the run is over" in str(lint) for lint in lints(late))
    with pytest.raises(omniroll.SceneError, match="needs log, whose columns it names"):
        scene(tmp_path, "", TRACKED.replace('log = "log.csv"', 'target = 0\nlog_columns = "time=clock"'))
