"""The results of `omniroll run`: nothing that was complete is lost, nothing half written stands under a final name."""

import errno
import json
import os
import re
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.commands import run as run_command
from omniroll.scenes import load_scene
from omniroll.scenes.outcome import result_folder, run_scene, write
from omniroll.scenes.result_folder import DamagedResultsError, Parts, load_results, unfinished


@pytest.fixture
def long_scene(tmp_path):
    """A scene whose run takes several calls of the engine."""
    path = tmp_path / "long.toml"
    path.write_text(re.sub(r"duration = .*", "duration = 1500", Path("scenes/motion-3.toml").read_text()))
    return path


def looks(monkeypatch, at, action):
    """Does something at the look number `at` of the part keeper at the run."""
    look, seen = Parts.look, []

    def looked(parts, run):
        look(parts, run)
        seen.append(run.row_count)
        if len(seen) == at:
            action()

    monkeypatch.setattr(Parts, "look", looked)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_with_the_files_of_the_motion_so_far(number, long_scene, tmp_path, monkeypatch, capsys):
    looks(monkeypatch, 6, lambda: signal.raise_signal(number))
    before = signal.getsignal(number)
    assert cli.main(["run", str(long_scene), "--output", str(tmp_path / "out"), "--json"]) == 128 + number
    assert signal.getsignal(number) is before
    printed = capsys.readouterr()
    summary = json.loads(printed.out)
    assert number.name in printed.err and summary["interrupted"] == f"interrupted by {number.name}"
    assert summary["stopped"]["t"] == summary["t"][1] < 1500
    kept = load_results(tmp_path / "out")
    assert kept.summary == summary and kept.trajectory().t[-1] == summary["t"][1] > 100
    whole = omniroll.run(load_scene(long_scene), control=False)
    assert np.array_equal(kept.trajectory().pose, whole.pose[: len(kept.trajectory())])


def test_a_signal_in_the_coarser_run_leaves_the_whole_motion(two_scenes, tmp_path, monkeypatch, capsys):
    from omniroll.engine import control

    def making(task, tolerance, made=control.making):
        if tolerance > 1e-9:
            signal.raise_signal(signal.SIGTERM)
        return made(task, tolerance)

    scene = re.sub(r"accuracy = .*", "accuracy = 1e-9", two_scenes[0].read_text())
    two_scenes[0].write_text(scene if "accuracy" in scene else scene.replace("[run]", "[run]\naccuracy = 1e-9"))
    whole = omniroll.run(load_scene(two_scenes[0]), control=False)
    monkeypatch.setattr(control, "making", making)
    assert cli.main(["run", str(two_scenes[0]), "--output", str(tmp_path / "out")]) == 128 + signal.SIGTERM
    assert "hold the whole motion" in capsys.readouterr().err
    kept = load_results(tmp_path / "out")
    assert np.array_equal(kept.trajectory().pose, whole.pose)
    assert kept.summary["tolerance"] == 1e-9 and kept.summary["stopped"] is None


@pytest.mark.parametrize("drawn", ["--plot", "--view"])
def test_results_stand_before_pictures_are_drawn(drawn, two_scenes, tmp_path, monkeypatch, capsys):
    from omniroll.scenes import outcome

    def draw(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(outcome, "draw", draw)
    monkeypatch.setattr(outcome, "page_of", draw)
    assert cli.main(["run", str(two_scenes[0]), drawn, "--output", str(tmp_path / "out")]) == 1
    assert "the results are whole in" in capsys.readouterr().err
    assert load_results(tmp_path / "out").trajectory().t[-1] == 0.3


@pytest.mark.long
def test_a_run_that_is_killed_leaves_its_parts(long_scene, tmp_path, monkeypatch):
    monkeypatch.setattr(run_command, "PARTS", 0.0)
    out = tmp_path / "out"
    arguments = ["run", str(long_scene), "--output", str(out)]

    def killed(at):
        child = os.fork()
        if not child:
            looks(monkeypatch, at, lambda: os.kill(os.getpid(), signal.SIGKILL))
            cli.main(arguments)
            os._exit(0)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL

    killed(at=7)
    whole = omniroll.run(load_scene(long_scene), control=False)
    found = load_results(out)
    assert found.summary is None and len(found.places) == 7
    kept = found.trajectory()
    assert kept.t[-1] > 300
    for name in ("t", "nu", "contact", "energy", "switches", "dense", "step_rows"):
        assert np.array_equal(getattr(kept, name), getattr(whole, name)[: len(getattr(kept, name))]), name
    assert cli.main(["run", str(long_scene), "--output", str(out)]) == 0
    assert load_results(out).summary["t"] == [0, 1500] and not (out / "unfinished").exists()
    killed(at=2)  # the results before stand, and the parts beside them
    assert load_results(out).summary["t"] == [0, 1500] and len(unfinished(out).places) == 2


def test_a_part_that_cannot_be_written_does_not_end_the_run(tmp_path):
    class Run:
        row_count = 5

        def part(self, first):
            return omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=0)

    (tmp_path / "file").write_text("no folder")
    parts = Parts(tmp_path / "file/unfinished", 0.0, lambda: 0.0)
    with pytest.warns(RuntimeWarning, match="the run so far is not kept") as said:
        parts.look(Run())
        parts.look(Run())
    assert len(said) == 1


# Folders

T = '"t": [0, 1]'
ODD_SUMMARIES = (
    "", "[]", "null", "3", '"files"', "[" * 100_000, '{"a":' * 100_000, '{"files": 3', "{}", "9" * 5000, "\x00",
    '{"files": []}', '{"files": {}}', f'{{{T}, "files": []}}', f'{{{T}, "files": null}}',
    f'{{{T}, "files": {{"..": "a"}}}}', f'{{{T}, "files": {{"a/b": "a"}}}}', f'{{{T}, "files": {{"a": 3}}}}',
    f'{{{T}, "files": {{"\\u0000": "a"}}}}', f'{{{T}, "files": {{}}, "parts": 3}}',
    f'{{{T}, "files": {{}}, "parts": [3]}}', f'{{{T}, "files": {{}}, "parts": [{{}}]}}',
    f'{{{T}, "files": {{}}, "parts": [{{{T}, "file": [], "checksum": ""}}]}}',
    '{"files": {}, "t": [1, 0]}', '{"files": {}, "t": [0, NaN]}', '{"files": {}, "t": [[], []]}',
)  # fmt: skip


def test_a_mix_of_two_runs_is_refused(two_scenes, tmp_path):
    for scene, name in zip(two_scenes, ("a", "b"), strict=True):
        with result_folder(tmp_path / name) as folder:
            write(run_scene(load_scene(scene)), folder)
    assert load_results(tmp_path / "a").trajectory().t[-1] == 0.3
    shutil.copy(tmp_path / "b/trajectory.csv", tmp_path / "a/trajectory.csv")
    with pytest.raises(DamagedResultsError, match="trajectory.csv is not the file that"):
        load_results(tmp_path / "a")
    (tmp_path / "b/switches.csv").unlink()
    with pytest.raises(DamagedResultsError, match="switches.csv is missing"):
        load_results(tmp_path / "b")
    for text in ODD_SUMMARIES:
        (tmp_path / "b/summary.json").write_text(text)
        with pytest.raises(DamagedResultsError, match="not a whole summary"):
            load_results(tmp_path / "b")
    with pytest.raises(FileNotFoundError, match="holds no results"):
        load_results(tmp_path / "c")


def test_two_runs_into_one_folder_are_refused(two_scenes, tmp_path, capsys):
    with result_folder(tmp_path / "out"):
        assert cli.main(["run", str(two_scenes[0]), "--output", str(tmp_path / "out")]) == 1
    assert "another run is writing" in capsys.readouterr().err
    assert cli.main(["run", str(two_scenes[0]), "--output", str(tmp_path / "out")]) == 0


def test_a_folder_that_takes_no_files_is_known_before_the_run(two_scenes, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run_command, "run_scene", lambda *_, **__: pytest.fail("it was run"))
    (tmp_path / "out/summary.json").mkdir(parents=True)
    assert cli.main(["run", str(two_scenes[0]), "--output", str(tmp_path / "out")]) == 1
    assert "summary.json is a folder" in capsys.readouterr().err
    monkeypatch.setattr(Path, "mkdir", read_only)
    assert cli.main(["run", str(two_scenes[0]), "--output", str(tmp_path / "other")]) == 1
    assert "Read-only file system" in capsys.readouterr().err


def read_only(path, *_, **__):
    raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
