"""Scene files: what is read, and what is said of files that make no sense."""

from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.robots.catalogue import ROBOTS
from omniroll.scenes import SceneError, load_scene

START = "[start]\nnu = [1, 0, 0]\n[run]\nduration = 1\n"
GOOD = "[vehicle]\npreset = 'paper'\n" + START
PARTS = """[vehicle]
wheels = 3
rollers_per_wheel = 20
platform_radius = 0.057
wheel_radius = 0.0345
roller_axis_radius = 0.0285
platform_mass = 0.374
platform_disk_radius = 0.06
hub_mass = 0.0266
hub_radius = 0.0285
hub_width = 0.02
roller_mass = 0.00337
roller_axial_inertia = 6.06e-8
roller_radius = 0.006
roller_length = 0.01
"""


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "scene.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def said_of(folder: Path, content: str | bytes) -> list[str]:
    """The lines of the message that a scene is refused with, without the file's name."""
    path = written(folder, content)
    with pytest.raises(SceneError) as raised:
        load_scene(path)
    lines = str(raised.value).splitlines()
    assert len(lines) == len(raised.value.problems) and all(line.startswith(str(path)) for line in lines)
    return [line.removeprefix(str(path)).lstrip(":") for line in lines]


@pytest.mark.parametrize("text, said", [
    ("[vehicle]\npreset = 'papr'\n", [f"2: [vehicle] preset = 'papr': must be one of paper, {', '.join(ROBOTS)}",
                                      " [start]: is missing; it needs nu", " [run]: is missing; it needs duration"]),
    ("[vehicle]\npreset='paper'\nwheels=true\n[start]\nnu=[1,nan,0]\n[run]\nduration=-1\n[switching]\nlaw=[1]\n",
     ["3: [vehicle] wheels = true: must be a whole number", "5: [start] nu = [1, nan, 0]: must be finite, in 1/s",
      "7: [run] duration = -1: must be a number, >= 0", "9: [switching] law = [1]: must be one of smooth, impact"]),
    ("vehicle = 3\n" + START, ["1: vehicle = 3: must be a table, [vehicle]"]),
    ("duration = 3\n" + GOOD, ["1: duration = 3: stands in no table; did you mean [run] duration?"]),
    (GOOD + "duraton = 1", ["7: [run] duraton = 1: no such key; did you mean duration?"]),
    (GOOD + '"du\\nration" = false\n"" = 2026-01-01\n',
     [r"5: [run] 'du\nration' = false: no such key", "8: [run] '' = 2026-01-01: no such key"]),
    (GOOD + "chi = 1", ["7: [run] chi = 1: no such key; did you mean [start] chi?"]),
    (GOOD + "[roller]", ["7: [roller]: no such table; did you mean [rollers]?"]),
    (GOOD + "[zzz]", ["7: [zzz]: no such table; there are "]),
    ("[vehicle]\npreset='paper'\nwheels=4\nwheel_angles=[0,1]\n[start]\nnu=[1,0]\nchi=9\n[run]\nduration=1",
     ["4: [vehicle] wheel_angles = [0, 1]: must be 4 numbers", "6: [start] nu = [1, 0]: must be 3 numbers",
      "7: [start] chi = [9.0, 9.0, 9.0, 9.0]: must lie within +-pi/n"]),
    (GOOD + "step = 0.1\ntimes = [0.5, 3]", ["7: [run] step = 0.1: cannot stand beside times", "8: [run] times = "]),
    (GOOD + "times = [0.5, 0.2]", ["7: [run] times = [0.5, 0.2]: must be K numbers, increasing"]),
    ("[vehicle]\nwheels=3\nmass=1.0\n" + START,
     [f"1: [vehicle] {name}: is missing" for name in ("rollers_per_wheel", "platform_radius", "wheel_radius",
                                                      "yaw_inertia", "wheel_inertia", "roller_inertia")]),
    (PARTS.replace("hub_width = 0.02\n", "mass = 1.0\n") + START,
     ["1: [vehicle] hub_axial_inertia: is missing", "1: [vehicle] hub_transverse_inertia: is missing",
      "11: [vehicle] mass = 1.0: cannot stand beside parts"]),
    ("[vehicle]\npreset = 'paper'\nhub_mass = 1.0\n" + START, ["3: [vehicle] hub_mass = 1.0: cannot stand beside a"]),
])  # fmt: skip
def test_all_that_is_wrong_is_said_at_once(text, said, tmp_path):
    """Line, key and value of each, and what would be right."""
    found = said_of(tmp_path, text)
    assert len(found) == len(said) and all(map(str.startswith, found, said)), found


def test_numbers_that_do_not_go_together_are_all_named(tmp_path):
    """Both bounds of the derivation, and the start beside them."""
    text = "[vehicle]\npreset = 'paper'\nroller_axis_radius = 0.07\nyaw_inertia = 1e-6\n"
    text += "[start]\nnu = 3\n[run]\nduration = 1"
    lines = said_of(tmp_path, text)
    assert [line.split(" = ")[0] for line in lines] == [
        "3: [vehicle] roller_axis_radius", "4: [vehicle] yaw_inertia", "6: [start] nu",
    ]  # fmt: skip
    assert "roller_axis_radius < wheel_radius cos(pi/n)" in lines[0] and "roller_inertia/2" in lines[1]


NUMBERS = """[vehicle]
wheels = 3
rollers_per_wheel = 6
mass = 1
yaw_inertia = 1
wheel_inertia = 0.1
roller_inertia = 3
platform_radius = 0.1
wheel_radius = 0.05
roller_axis_radius = 0.06
"""


@pytest.mark.parametrize("change, to, wrong", [
    ("", "", ["yaw_inertia", "roller_axis_radius"]),
    ("wheel_inertia = 0.1", "wheel_inertia = -1", ["yaw_inertia", "wheel_inertia", "roller_axis_radius"]),
    ("wheels = 3", "colour = 3", ["wheels", "colour", "yaw_inertia", "roller_axis_radius"]),
    ("rollers_per_wheel = 6\n", "", ["rollers_per_wheel", "roller_axis_radius"]),
    ("wheel_radius = 0.05", "wheel_radius = 'x'", ["yaw_inertia", "wheel_radius"]),
    ("roller_inertia = 3", "roller_inertia = nan", ["roller_inertia", "roller_axis_radius"]),
    ("mass = 1", "hub_mass = 1", None),
    ("wheels = 3", "preset = 'paper'\ncolour = 1", ["colour", "yaw_inertia", "roller_axis_radius"]),
    ("wheel_radius = 0.05", "preset = 'paper'\ncolour = 1", ["yaw_inertia", "colour", "roller_axis_radius"]),
])  # fmt: skip
def test_numbers_are_judged_beside_those_that_are_wrong_or_missing(change, to, wrong, tmp_path):
    """Only bounds that are broken whatever the wrong numbers are meant to be are said."""
    lines = said_of(tmp_path, NUMBERS.replace(change, to) + START)
    found = [line.split("[vehicle] ")[1].split(":")[0].split(" =")[0] for line in lines]
    assert "roller_axis_radius" in found if wrong is None else found == wrong


def test_files_that_are_no_scenes(tmp_path):
    assert said_of(tmp_path, bytes(range(256))) == [" byte 128 is not UTF-8 text"]
    assert said_of(tmp_path, b"x" * 10_000_000) == [" longer than 1000000 bytes, which no scene is"]
    assert said_of(tmp_path, "[[")[0].startswith(" not TOML: ")
    assert said_of(tmp_path, "[a]\nb = " + "9" * 5000) == [" a whole number has too many digits (at line 2)"]
    assert said_of(tmp_path, "a = " + "[" * 100_000) == [" lists or tables stand too deep inside each other"]
    for path in (tmp_path, tmp_path / "absent.toml", "null\0byte"):
        with pytest.raises(SceneError):
            load_scene(path)


def test_a_bad_scene_is_exit_code_2_of_every_command_that_takes_one(tmp_path, capsys):
    path = written(tmp_path, "[vehicle]")
    for command in ("accuracy", "run", "explain"):
        assert cli.main([command, str(path)]) == 2
        assert f"{path}:1: [vehicle]" in capsys.readouterr().err


def test_parts_give_the_vehicle_that_they_give_in_python(tmp_path):
    vehicle = load_scene(written(tmp_path, PARTS + START)).vehicle
    hub, roller = omniroll.cylinder(0.0266, 0.0285, 0.02), omniroll.cylinder(0.00337, 0.006, 0.01)
    assert vehicle == omniroll.Vehicle.from_parts(
        wheels=3, rollers_per_wheel=20, platform_radius=0.057, wheel_radius=0.0345, roller_axis_radius=0.0285,
        platform_mass=0.374, platform_inertia=omniroll.cylinder(0.374, 0.06, 1.0)[0],
        hub_mass=0.0266, hub_axial_inertia=hub[0], hub_transverse_inertia=hub[1],
        roller_mass=0.00337, roller_axial_inertia=6.06e-8, roller_transverse_inertia=roller[1],
    )  # fmt: skip


def test_a_preset_with_other_numbers(tmp_path):
    scene = load_scene(written(tmp_path, GOOD.replace("'paper'", "'paper'\nwheels = 4\nmass = 7.0")))
    assert scene.vehicle == omniroll.Vehicle.paper(4).replace(mass=7.0)


def test_times_of_samples(tmp_path):
    scene = load_scene(written(tmp_path, GOOD + "start_time = 2\nstep = 0.1"))
    assert np.allclose(scene.sample_times(3.0), 2 + np.arange(11) / 10, rtol=0, atol=1e-15)
    assert scene.sample_times(2.55)[-1] == 2.5
    assert load_scene(written(tmp_path, GOOD)).sample_times(1.0) is None
    assert load_scene(written(tmp_path, GOOD + "times = [0.25, 1]")).sample_times(1.0).tolist() == [0.25, 1.0]
