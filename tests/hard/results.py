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
from collections import Counter
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
EXPECTED = {signal.SIGKILL: (-9, 0), signal.SIGTERM: (143, -15, 0), signal.SIGINT: (130, 0)}  # 0: it was done before


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
def failing_calls(scale: Scale) -> Iterator[Measurement]:
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        place = Path(folder)
        scenes = scene(place / "before.toml", "duration = 0.3\nstep = 0.1"), scene(place / "new.toml", "duration = 0.4")
        shim = built_shim(place)
        for how in HOW:
            said = injected(shim, place / how, *scenes, how, scale.of(EVERY[how], 1))
            if not said["before"] or not said["new"]:
                raise AssertionError("the faults did not come before and after the new results stand")
            yield Measurement(WHAT.format(said["struck"]), "call", how, "", len(said["wrong"]), 0)
        if scale is Scale.FULL:
            in_parts = scenes[0], scene(place / "long.toml", "duration = 20\nstep = 1")
            for how in HOW:
                said = injected(shim, place / f"{how}-in-parts", *in_parts, how, 1, "stream")
                yield Measurement(WHAT.format(said["struck"]), "part", how, "", len(said["wrong"]), 0)


@CASES.case(
    "signals",
    "SIGINT, SIGTERM or kill -9 at 60 moments of a long run and of a stream",
    naive="leaves an empty folder",
    promise="the results before stand, or the new motion up to that moment, which says so; exit code 130 or 143",
)
def signals(scale: Scale) -> Iterator[Measurement]:
    """Runs that are ended by signals at random moments, over complete results of another run."""
    wrong, counts, rng = Counter(), Counter(), random.Random("signals")
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        place = Path(folder)
        long = scene(place / "long.toml", "duration = 1500")
        _run(scene(place / "before.toml", "duration = 0.3\nstep = 0.1"), place / "out")
        for options in ((), ("--stream",))[: scale.of(1, 2)]:
            took = -time.perf_counter()
            _run(long, place / "whole", *options)
            took += time.perf_counter()
            whole = load_results(place / "whole").trajectory()
            for number in SIGNALS * scale.of(4, 10):
                shutil.copytree(place / "out", place / "work")
                ended = _signalled(long, place / "work", number, rng.uniform(0, 1.2 * took), options)
                counts[number] += 1
                wrong[number] += ended not in EXPECTED[number] or not _stands(place / "work", whole)
                shutil.rmtree(place / "work")
    for number in SIGNALS:
        yield Measurement(WHAT.format(counts[number]), "signal", number.name, "a long run", wrong[number], 0)


def _run(path: Path, output: Path, *options: str) -> int:
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing), contextlib.redirect_stderr(nothing):
        return cli.main(["run", str(path), "--output", str(output), *options])


def _signalled(path: Path, output: Path, number: int, delay: float, options: tuple[str, ...]) -> int:
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


def _stands(output: Path, whole: Trajectory) -> bool:
    """Whether the folder holds the results before, or the motion of the new run as far as it came, and says which."""
    try:
        found = load_results(output)
        motion = found.trajectory()
        with contextlib.suppress(FileNotFoundError):
            if not _begins(unfinished(output).trajectory(), whole):
                return False
        if found.summary["scene"] == "before":
            return True
        says_so = motion.t[-1] == whole.t[-1] or found.summary["interrupted"] is not None
        is_told = found.summary["scene"] == "long" and found.summary["t"] == [motion.t[0], motion.t[-1]]
        return says_so and is_told and _begins(motion, whole)
    except (OSError, OmnirollError):
        return False


def _begins(motion: Trajectory, whole: Trajectory) -> bool:
    """Whether a motion is the beginning of the whole one, or of one of the runs with other tolerances that try to reach
    the accuracy first."""
    if motion.stats["tolerance"] != whole.stats["tolerance"]:
        return np.allclose(motion.pose, whole.sample(motion.t).pose, rtol=0, atol=1e-3)
    names = ("t", "nu", "pose", "contact", "energy", "dense")
    pairs = ((getattr(motion, name), getattr(whole, name)) for name in names)
    return all(some is None or np.array_equal(some, every[: len(some)]) for some, every in pairs)
