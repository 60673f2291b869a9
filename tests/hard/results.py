"""The results that `omniroll run` keeps, where a write fails, the disk is full, or a signal comes at any moment.

Each fault is injected from outside: a preloaded library lets one call that changes files fail or ends the process
there, or a signal comes at a random moment of a run. After each one the folder is read as a user reads it.
"""

import contextlib
import os
import random
import re
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from faults.injection import HOW, built_shim, injected

from hard.case import Cases, Measurement, Scale
from omniroll import cli
from omniroll.commands import run as run_command
from omniroll.errors import OmnirollError
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.result_folder import load_results, unfinished

CASES = Cases("Files and signals")
SCENES = Path(__file__).resolve().parents[2] / "scenes"
MEMORY = Path("/dev/shm")  # waiting for the disk costs nothing there
EVERY = {"kill": 8, "error": 9, "full": 10}  # calls of some 74 that are struck in `make test-long`
WHAT = "results lost, mixed or half written, of {} faults"
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
# Scenes with options of `omniroll run`; the first is run in `make test-long` too.
KINDS = [("long",), ("long", "--stream"), *((path.stem,) for path in sorted(SCENES.glob("*.toml"))),
         ("motion-3", "--stream"), ("driven", "--stream")]  # fmt: skip
EXPECTED = {signal.SIGKILL: (-9, 0), signal.SIGTERM: (143, -15, 0), signal.SIGINT: (130, 0)}  # 0: it was done before


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    place = Path(tempfile.mkdtemp(dir=MEMORY if MEMORY.is_dir() else None))
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def scene(path: Path, run: str) -> Path:
    """The paper's motion 3 for a time, by the lines of [run]."""
    path.write_text(re.sub(r"duration = .*", run, (SCENES / "motion-3-impact.toml").read_text()))
    return path


@CASES.case(
    "failing-calls",
    "A call that writes, syncs, renames or removes fails, the disk is full from there on, or kill -9 comes",
    naive="removes the results before, and leaves a truncated file under its final name",
    promise="the results before stand, or all of the new ones; the next run puts the folder in order",
)
def failing_calls(scale: Scale) -> list[Measurement]:
    if shutil.which("cc") is None:
        return []
    found = []
    with folder() as place:
        scenes = scene(place / "before.toml", "duration = 0.3\nstep = 0.1"), scene(place / "new.toml", "duration = 0.4")
        shim = built_shim(place)
        for how in HOW:
            said = injected(shim, place / how, *scenes, how, scale.of(EVERY[how], 1))
            if not said["before"] or not said["new"]:
                raise AssertionError("the faults did not come before and after the new results stand")
            found.append(Measurement(WHAT.format(said["struck"]), "call", how, "", len(said["wrong"]), 0))
        if scale is Scale.FULL:
            in_parts = scenes[0], scene(place / "long.toml", "duration = 20\nstep = 1")
            for how in HOW:
                said = injected(shim, place / f"{how}-in-parts", *in_parts, how, 1, "stream")
                found.append(Measurement(WHAT.format(said["struck"]), "part", how, "", len(said["wrong"]), 0))
    return found


@CASES.case(
    "signals",
    "SIGINT, SIGTERM or kill -9 at 200 moments of 20 kinds of runs: shipped scenes, long ones, streams",
    naive="leaves an empty folder",
    promise="the results before stand, or the new motion up to that moment, which says so; exit code 130 or 143",
)
def signals(scale: Scale) -> list[Measurement]:
    """Runs of each kind, ended by signals at random moments, over complete results of another run."""
    kinds, moments = scale.of(KINDS[:1], KINDS), scale.of(12, 10)
    with folder() as place:
        before = scene(place / "before.toml", "duration = 0.3\nstep = 0.1")
        long = scene(place / "long.toml", "duration = 1500")
        _run(before, place / "out")
        wrong = {number: [0, 0] for number in SIGNALS}
        for k, (name, *options) in enumerate(kinds):
            path = long if name == "long" else SCENES / f"{name}.toml"
            rng = random.Random(f"{name} {options}")
            for number, of_kind in zip(SIGNALS, _ended(path, options, place, moments, k, rng), strict=True):
                wrong[number] = [sum(pair) for pair in zip(wrong[number], of_kind, strict=True)]
    setting = f"{len(kinds)} kinds of runs"
    return [
        Measurement(WHAT.format(count), "signal", number.name, setting, lost, 0)
        for number, (lost, count) in wrong.items()
    ]


def _ended(
    path: Path, options: list[str], place: Path, moments: int, first: int, rng: random.Random
) -> list[tuple[int, int]]:
    """Of each signal how many of its runs left something wrong, and how many there were. The signals take turns."""
    shutil.rmtree(place / "whole", ignore_errors=True)
    took = time.perf_counter()
    _run(path, place / "whole", *options)
    took = time.perf_counter() - took
    whole = load_results(place / "whole").trajectory()
    wrong, counts = [0] * len(SIGNALS), [0] * len(SIGNALS)
    for k in range(moments):
        which = (first + k) % len(SIGNALS)
        shutil.rmtree(place / "work", ignore_errors=True)
        shutil.copytree(place / "out", place / "work")
        ended = _signalled(path, place / "work", SIGNALS[which], rng.uniform(0, 1.2 * took), options)
        wrong[which] += ended not in EXPECTED[SIGNALS[which]] or not _stands(place / "work", whole, path.stem)
        counts[which] += 1
    return list(zip(wrong, counts, strict=True))


def _run(path: Path, output: Path, *options: str) -> int:
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing), contextlib.redirect_stderr(nothing):
        return cli.main(["run", str(path), "--output", str(output), *options])


def _signalled(path: Path, output: Path, number: int, delay: float, options: list[str]) -> int:
    """How a process ends that runs a scene and gets a signal after some s."""
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS[1:])  # the child must not come back here
    child = os.fork()
    if not child:
        code = 128 + number
        try:
            run_command.PARTS = 0.0
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS[1:])
            code = _run(path, output, *options)
        finally:
            os._exit(code)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS[1:])
    time.sleep(delay)
    os.kill(child, number)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _stands(output: Path, whole: Trajectory, name: str) -> bool:
    """Whether the folder holds the results before, or the motion of the new run as far as it came, and says which."""
    try:
        found = load_results(output)
        motion = found.trajectory()
        with contextlib.suppress(FileNotFoundError):
            _check_part(unfinished(output).trajectory(), whole)
        if found.summary["scene"] == "before":
            return True
        is_whole = motion.t[-1] == whole.t[-1]
        _check_part(motion, whole)
        says_so = is_whole or found.summary["interrupted"] is not None
        return says_so and found.summary["scene"] == name and found.summary["t"] == [motion.t[0], motion.t[-1]]
    except (OSError, OmnirollError, AssertionError):
        return False


def _check_part(motion: Trajectory, whole: Trajectory) -> None:
    """A motion is the beginning of the whole one, or of one of the runs with other tolerances that try to reach the
    accuracy first."""
    if motion.stats["tolerance"] != whole.stats["tolerance"]:
        np.testing.assert_allclose(motion.pose, whole.sample(motion.t).pose, atol=1e-3)
        return
    for name in ("t", "nu", "pose", "contact", "energy", "dense"):
        some = getattr(motion, name)
        if some is not None and not np.array_equal(some, getattr(whole, name)[: len(some)]):
            raise AssertionError(name)
