"""omniroll sweep: every combination is the scene that a file with these numbers is; the files hold all runs."""

import json

import numpy as np
import pandas
import pytest

import omniroll
from omniroll import cli
from omniroll.scenes.sweeping import Axis, SceneSweep

SCENE = """
[vehicle]
preset = "paper"
mass = 1.0
[start]
nu = [1.0, 0.0, 1.0]
[run]
duration = 0.5
[reactions]
friction = 0.5
height = 0.05
gravity = 9.81
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "some.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def test_a_run_is_that_of_a_file_with_its_numbers(scene, tmp_path, capsys):
    call = ["sweep", str(scene), "--vary", "vehicle.mass=1:2:3", "--vary", "start.nu.1=0.5,1"]
    assert cli.main([*call, "--output", str(tmp_path / "out")]) == 0
    assert "6 runs over vehicle.mass (3) x start.nu.1 (2)" in capsys.readouterr().out
    frame = pandas.read_parquet(tmp_path / "out/sweep.parquet")
    assert frame["vehicle.mass"].tolist() == [1, 1, 1.5, 1.5, 2, 2] and frame.attrs["units"]["x"] == "m"
    text = SCENE.replace("mass = 1.0", "mass = 1.5").replace("[1.0, 0.0", "[0.5, 0.0")
    scene.write_text(text, encoding="utf-8")
    run = omniroll.run(omniroll.load_scene(scene))
    assert frame.loc[2, ["x", "y", "theta"]].tolist() == run.pose[-1].tolist()
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert summary["runs"] == 6 and summary["ends"]["x at the end"]["least"] == frame["x"].min()
    assert (tmp_path / "out/sweep.png").stat().st_size > 10_000


def test_an_entry_that_is_varied_has_its_own_unit():
    units = [Axis.read(f"controller.twist{entry}=1").unit for entry in ("", ".1", ".3")]
    assert units == ["m/s, m/s, rad/s", "m/s", "rad/s"]


@pytest.mark.parametrize("vary, sentence", [
    ("mass=1:2:3", "must be TABLE.KEY=FROM:TO:COUNT"),
    ("vehicle.mass=1:2", "must be TABLE.KEY=FROM:TO:COUNT"),
    ("vehicle.mass=1,nan", "finite"),
    ("vehicle.mass=1:2:0", "at least one value"),
    ("vehicle.mas=1,2", "did you mean mass?"),
    ("vehicel.mass=1,2", "did you mean vehicle?"),
    ("vehicle.mass=-1,2", "[vehicle] mass = -1.0: must be a number, > 0"),
    ("start.nu.4=1,2", "no list there with so many entries"),
    ("start.nu.0=1,2", "count from 1"),
    ("run.accuracy=1e-6,1e-7", "the same for all runs"),
    ("start.nu.1=0:1:2000000", "at most 1000000"),
    ("start.nu.1=0:1:99999999999", "at most 1000000"),
])  # fmt: skip
def test_what_cannot_be_varied_is_refused_in_a_sentence(scene, capsys, vary, sentence):
    assert cli.main(["sweep", str(scene), "--vary", vary]) == 2
    assert sentence in capsys.readouterr().err


def test_counts_stay_whole_and_what_is_missing_may_be_varied(scene):
    sweep = SceneSweep.of(scene, [Axis.read("vehicle.rollers_per_wheel=5,6")])
    assert [each.vehicle.rollers_per_wheel for each in sweep.scenes] == [5, 6]
    sweep = SceneSweep.of(scene, [Axis.read("bearings.wheel_viscous=0.0001,0.001")])
    assert np.ptp(sweep.run().end.pose[:, 0]) > 1e-3
