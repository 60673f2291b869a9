"""Runs that go to the disk part by part: the same motion to the bit, in bounded memory, whatever ends it."""

import os
import re
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.engine.control import made
from omniroll.engine.simulate import checked_task
from omniroll.results.trajectory_content import ARRAYS
from omniroll.scenes import load_scene
from omniroll.scenes.outcome import result_folder, run_scene
from omniroll.scenes.result_folder import load_results
from omniroll.scenes.streaming import SHARE, Stream

PAPER = omniroll.Vehicle.paper()
ROLLING = [omniroll.Bearings(roller_viscous=1e-6)]
DRIVEN = [omniroll.Torque(1e-3), omniroll.Bearings(roller_viscous=1e-6, wheel_viscous=1e-5)]
SLIPPING = [omniroll.Contact(law="coulomb", friction=0.3), omniroll.Torque(1e-3)]
MEMORY = 2e7  # bytes


def task(**options):
    return checked_task(PAPER, **{"nu": (1, 0.2, 1), "duration": 6, "accuracy": 1e-8} | options)


@pytest.mark.parametrize("options", [
    {"duration": 60},
    {"duration": 60, "roller_model": "locked"},
    {"duration": 60, "effects": ROLLING},
    {"engine": "python"},
    {"engine": "python", "effects": DRIVEN},
    {"engine": "python", "effects": SLIPPING, "accuracy": 1e-2},
])  # fmt: skip
def test_parts_that_memory_forgets_join_to_the_motion(options):
    asked, parts = task(**options), []
    whole = made(asked, asked.accuracy)

    def keep(run):
        parts.append(run.part(0))
        for name in (*ARRAYS, "switches"):
            getattr(parts[-1], name)  # is made now: the run writes over what it forgets
        run.forget()

    last = made(replace(asked, keep=keep), asked.accuracy)
    joined = omniroll.Trajectory.joined([*parts, last.part()])
    assert len(parts) > 1 and len(joined.switches) > 10
    for name in (*ARRAYS, "switches"):
        assert np.array_equal(getattr(joined, name), getattr(whole.part(), name)), name
    assert last.stats()["switches"] == len(joined.switches) and last.stats()["steps"] == whole.stats()["steps"]


# The command, and reading


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A scene whose rows would take five times the memory that a part may take."""
    path = tmp_path_factory.mktemp("scene") / "long.toml"
    new = f"duration = 1500\nmemory = {MEMORY}\nstep = 100"
    path.write_text(re.sub(r"duration = .*", new, Path("scenes/motion-3-impact.toml").read_text()))
    return path


@pytest.fixture(scope="module")
def kept(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("kept") / "out"
    assert cli.main(["run", str(scene), "--output", str(out), "--stream"]) == 0
    return out


@pytest.fixture
def copied(kept, tmp_path):
    return Path(shutil.copytree(kept, tmp_path / "out"))


def test_a_streamed_run_is_the_run(scene, kept):
    whole, results = omniroll.run(load_scene(scene), control=False), load_results(kept)
    parts = list(results.parts())
    assert len(parts) >= 3
    joined = results.trajectory()
    for name in (*ARRAYS, "switches"):
        assert np.array_equal(getattr(joined, name), getattr(whole, name)), name
    ledger, summary = whole.ledger, results.summary
    found = [summary["energy"][name] for name in ("start", "end", "switches")]
    assert found == pytest.approx([ledger.start, ledger.end, ledger.contributions["switches"]], rel=1e-12)
    assert summary["t"] == [0, 1500] and summary["switches"] == len(whole.switches)
    assert [(part["rows"], part["t"]) for part in summary["parts"]] == [
        (len(part), [part.t[0], part.t[-1]]) for part in parts
    ]
    samples = (kept / "samples.csv").read_text().splitlines()[1:]
    times, x = np.array([[float(text) for text in row.split(",")[:2]] for row in samples]).T
    assert np.array_equal(times, 100.0 * np.arange(16)) and np.array_equal(x, whole.sample(times).pose[:, 0])


def test_memory_holds_one_part(scene, tmp_path, monkeypatch):
    held, look = [], Stream.look
    monkeypatch.setattr(Stream, "look", lambda stream, run: (held.append(run.bytes_held), look(stream, run)))
    with result_folder(tmp_path / "out") as folder:
        stream = Stream(folder.unfinished, MEMORY)
        outcome = run_scene(load_scene(scene), stream=stream)
    assert len(stream.parts) >= 3 and outcome.stopped is None and len(held) > 5
    assert max(held) < 2.1 * SHARE * MEMORY  # what one call adds comes on top


def test_a_streamed_run_that_is_killed_leaves_its_parts(scene, tmp_path, monkeypatch):
    out, look = tmp_path / "out", Stream.look
    child = os.fork()
    if not child:

        def struck(stream, run):
            look(stream, run)
            if len(stream.parts) == 2:
                os.kill(os.getpid(), signal.SIGKILL)

        monkeypatch.setattr(Stream, "look", struck)
        cli.main(["run", str(scene), "--output", str(out), "--stream"])
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    found = load_results(out)
    whole = omniroll.run(load_scene(scene), control=False)
    assert found.summary is None and len(found.places) == 2
    motion = found.trajectory()
    assert motion.t[-1] > 300 and np.array_equal(motion.nu, whole.nu[: len(motion)])


def test_runs_of_both_kinds_take_each_others_place(scene, copied, tmp_path):
    short = tmp_path / "short.toml"
    short.write_text(re.sub(r"duration = .*", "duration = 0.2", Path("scenes/motion-3-impact.toml").read_text()))
    assert cli.main(["run", str(short), "--output", str(copied)]) == 0
    assert not (copied / "parts").exists() and load_results(copied).trajectory().t[-1] == 0.2
    assert cli.main(["run", str(short), "--output", str(copied), "--stream"]) == 0
    assert {path.name for path in copied.iterdir()} == {"parts", "summary.json", ".lock"}
    assert load_results(copied).trajectory().t[-1] == 0.2
    assert cli.main(["run", str(short), "--output", str(copied), "--stream"]) == 0
    assert len(list((copied / "parts").iterdir())) == 1


def test_a_disk_that_fails_ends_the_run_and_leaves_the_results_before(scene, copied, tmp_path, monkeypatch, capsys):
    before, add = (copied / "summary.json").read_bytes(), Stream.add

    def failing(stream, part):
        if len(stream.parts) == 2:
            raise OSError(28, "No space left on device")
        add(stream, part)

    monkeypatch.setattr(Stream, "add", failing)
    assert cli.main(["run", str(scene), "--output", str(copied), "--stream"]) == 1
    assert "No space left" in capsys.readouterr().err
    assert (copied / "summary.json").read_bytes() == before and load_results(copied).trajectory().t[-1] == 1500
    assert len(omniroll.unfinished(copied).places) == 2


def test_a_run_that_the_disk_does_not_hold_is_stopped(scene, tmp_path):
    with result_folder(tmp_path / "out") as folder:
        stream = Stream(folder.unfinished, MEMORY)
        stream.room = 1e4
        outcome = run_scene(load_scene(scene), stream=stream)
    assert "the disk allows 10 kB" in outcome.stopped.reason


@pytest.mark.parametrize("table, options", [("\n[reactions]\nheight = 0.1\n", []), ("", ["--plot"]), ("", ["--view"])])
def test_what_needs_the_whole_run_is_refused(table, options, tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(Path("scenes/motion-3.toml").read_text() + table)
    assert cli.main(["run", str(path), "--output", str(tmp_path), "--stream", *options]) == 2
    assert "which needs the whole run at once" in capsys.readouterr().err
