"""`omniroll run SCENE`: files, summary, progress, and exit codes."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.scenes import load_scene

SCENES = sorted(Path("scenes").glob("*.toml"))


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.stem)
def test_every_shipped_scene_runs_and_closes_its_ledger(scene, shortened, tmp_path, capsys):
    path = shortened(scene)
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary == json.loads((tmp_path / "out/summary.json").read_text())
    read = load_scene(path)
    accuracy = read.options.get("accuracy", 1e-9)
    assert summary["stopped"] is None and summary["t"] == [0.0, 0.5]
    # The promise is ten times the request; runs of the compiled engine keep the request itself.
    assert summary["error_estimate"] <= (10 if read.slips else 1) * accuracy
    energy = summary["energy"]
    assert abs(energy["residual"]) <= 10 * accuracy * max(abs(value) for value in energy.values())
    run = omniroll.Trajectory.load(tmp_path / "out/trajectory.npz")
    same = omniroll.Trajectory.load(tmp_path / "out/trajectory.csv")
    assert np.array_equal(run.nu, same.nu) and run.pose[-1].tolist() == summary["pose"]


def test_files_samples_and_text(shortened, tmp_path, capsys):
    path, folder = shortened(Path("scenes/motion-3.toml"), "step = 0.1"), tmp_path / "deep/out"
    assert cli.main(["run", str(path), "--output", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "locked rollers, smooth switches, 0 to 0.5 s" in said and "residual" in said and "samples.csv" in said
    rows = list(csv.DictReader((folder / "samples.csv").open()))
    run = omniroll.Trajectory.load(folder / "trajectory.npz")
    assert [float(row["t"]) for row in rows] == [0.1 * k for k in range(6)]
    assert [float(row["x"]) for row in rows] == run.sample([0.1 * k for k in range(6)]).pose[:, 0].tolist()
    switches = list(csv.DictReader((folder / "switches.csv").open()))
    assert [float(row["energy_jump"]) for row in switches] == run.switches["energy_jump"].tolist() and switches
    assert [int(row["wheel"]) - 1 for row in switches] == run.switches["wheel"].tolist()


def test_impulses_are_kept_under_impact_and_only_there(shortened, tmp_path):
    """A file of every switch, joint ones once, as omniroll.impulses gives them."""
    for name, wanted in (("motion-3-impact", True), ("motion-3", False)):
        folder = tmp_path / name
        assert cli.main(["run", str(shortened(Path(f"scenes/{name}.toml"))), "--output", str(folder)]) == 0
        assert (folder / "impulses.csv").exists() == wanted
    rows = np.genfromtxt(tmp_path / "motion-3-impact/impulses.csv", delimiter=",", names=True)
    found = omniroll.impulses(omniroll.Trajectory.load(tmp_path / "motion-3-impact/trajectory.npz"))
    assert len(found.t) and np.atleast_1d(rows["t"]).tolist() == found.t.tolist()
    assert np.atleast_1d(rows["along_rolling_2"]).tolist() == found.contact[:, 1, 1].tolist()


def test_a_run_that_stops_is_kept_and_is_exit_code_3(tmp_path, capsys, bouncing):
    path = tmp_path / "bouncing.toml"
    path.write_text(Path("scenes/motion-1.toml").read_text().replace("[run]", "[run]\nengine = 'python'"))
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out"), "--json"]) == 3
    captured = capsys.readouterr()
    summary = json.loads(captured.out)
    assert "without progress" in captured.err and "wheel" in captured.err
    assert summary["stopped"]["t"] == summary["t"][1] < 20 and "without progress" in summary["stopped"]["reason"]
    assert omniroll.Trajectory.load(tmp_path / "out/trajectory.npz").t[-1] == summary["t"][1]


def test_a_reader_that_closes_the_output_is_no_error():
    """As `omniroll robots | head -1` does: exit code 141, and no message."""
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "omniroll", "robots"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")
