"""Every reader, with bytes that were changed: trajectories, folders of results, scenes, and the command line."""

import contextlib
import io
import shutil
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
from fuzz.calls import run
from hypothesis import strategies as st
from hypothesis import target

import omniroll
from hard.case import Case, Measurement, Scale
from hard.inputs import SCENES, SECTION, measured
from omniroll import cli
from omniroll.errors import OmnirollError
from omniroll.results.trajectory_content import ARRAYS
from omniroll.scenes.outcome import result_folder, run_scene, write

Edit = tuple[float, int, bytes]  # where, as a part of the file; how many bytes are cut there; what comes in their place
FRAGMENTS = st.sampled_from(
    [b"", b"\x00", b"\xff", b"nan", b"inf", b"-1", b"1e999", b"[", b"]", b'"', b"{}", b",", b"\n", b"PK\x03\x04", b"="]
)
EDITS = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 64), st.one_of(FRAGMENTS, st.binary(max_size=8))), min_size=1, max_size=4
)
WORDS = ("run", "explain", "accuracy", "kernel", "where", "view", "new", "formulas", "motions", "completion")
OPTIONS = ("--json", "--plot", "--view", "--title", "--stream", "--output", "--import", "--error", "-x", "--", "--help")
NO_SUCH = "--no-such-option"  # of commands that need no file, so that nothing long is done


def edited(content: bytes, edits: list[Edit]) -> bytes:
    """The bytes with some of them cut and others put in their place."""
    for where, cut, new in edits:
        start = int(where * len(content))
        content = content[:start] + new + content[start + cut :]
    return content


@contextlib.contextmanager
def typed(*others: type[Exception]) -> Iterator[None]:
    """What a reader may raise. Whatever is refused says why."""
    try:
        yield
    except (OmnirollError, *others) as error:
        assert str(error)


@cache
def kept(ending: str) -> bytes:
    """A trajectory's file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"run{ending}")
        run().save(path)
        return path.read_bytes()


def check_trajectory(ending: str) -> Callable[[list[Edit]], None]:
    """A changed file of a trajectory is refused, or holds the same motion."""

    def check(edits: list[Edit]) -> None:
        content = edited(kept(ending), edits)
        target(-abs(len(content) - len(kept(ending))), label="nearly whole files")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"run{ending}")
            path.write_bytes(content)
            with typed():
                found = omniroll.Trajectory.load(path)
                for name in ARRAYS:
                    assert np.array_equal(getattr(found, name), getattr(run(), name)), name

    return check


@cache
def results() -> Path:
    """A folder of results, which stays while the process lasts."""
    folder = Path(tempfile.mkdtemp())
    scene = next(path for path in SCENES if path.stem == "motion-3-impact")
    short = folder / "short.toml"
    short.write_text(scene.read_text(encoding="utf-8").replace("duration = 20.0", "duration = 0.2"), encoding="utf-8")
    with result_folder(folder / "out") as place:
        write(run_scene(omniroll.load_scene(short)), place)
    return folder / "out"


def check_results(changed: tuple[str, list[Edit]]) -> None:
    """A folder with one changed file is refused, or read: summary.json is the only file without a checksum."""
    name, edits = changed
    with tempfile.TemporaryDirectory() as folder:
        place = Path(shutil.copytree(results(), Path(folder, "out")))
        path = place / name
        path.write_bytes(edited(path.read_bytes(), edits))
        with typed(FileNotFoundError):
            omniroll.load_results(place).trajectory()


def check_scene_bytes(changed: tuple[int, list[Edit]]) -> None:
    """A scene of which bytes were changed is read, or refused; nothing is run."""
    number, edits = changed
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.toml")
        path.write_bytes(edited(SCENES[number % len(SCENES)].read_bytes(), edits))
        with typed():
            omniroll.load_scene(path)


def check_command_line(arguments: list[str]) -> None:
    """Any arguments end in an exit code, without a traceback."""
    if arguments[0] in ("formulas", "motions", "new"):
        arguments = [arguments[0], NO_SUCH, *arguments[1:]]
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                code = cli.main(arguments)
            except SystemExit as end:
                code = end.code
    assert code in (0, 1, 2, 3) and "Traceback" not in said.getvalue()


TEXTS = st.text(max_size=12).filter(lambda text: "\0" not in text)
LINES = st.builds(lambda first, others: [first, *others],
                  st.one_of(st.sampled_from(WORDS), TEXTS),
                  st.lists(st.one_of(st.sampled_from(OPTIONS), TEXTS), max_size=4))  # fmt: skip


def readers(scale: Scale) -> list[Measurement]:
    examples = scale.of(15, 5000)
    names = st.sampled_from(sorted(path.name for path in results().iterdir() if path.name != ".lock"))
    return [
        *measured(check_trajectory(".npz"), EDITS, examples, "Trajectory.load, NPZ"),
        *measured(check_trajectory(".csv"), EDITS, examples, "Trajectory.load, CSV"),
        *measured(check_results, st.tuples(names, EDITS), examples, "load_results"),
        *measured(check_scene_bytes, st.tuples(st.integers(0, 99), EDITS), examples, "load_scene"),
        *measured(check_command_line, LINES, examples, "command line"),
    ]


CASES = [
    Case(
        "changed-files", SECTION, "Files of trajectories, results and scenes with changed bytes; any command line",
        "reads numbers that nobody wrote, or ends in a traceback",
        "refused by a typed error, or the same motion; an exit code", readers,
    )
]  # fmt: skip
