"""Every reader, with bytes that were changed: trajectories, folders of results, and scenes."""

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from fuzz.calls import run

import omniroll
from hard.case import Cases, Measurement, Scale
from hard.inputs import measured
from omniroll.errors import OmnirollError
from omniroll.results.trajectory_content import ARRAYS
from omniroll.scenes.outcome import result_folder, run_scene, write

CASES = Cases("Input")
SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
FRAGMENTS = (
    b"", b"\x00", b"\xff", b"nan", b"inf", b"-1", b"1e999", b"[", b"]", b'"', b"{}", b",", b"\n", b"PK\x03\x04", b"=",
)  # fmt: skip


def edited(content: bytes, random: np.random.Generator) -> bytes:
    """The bytes with another digit for one, or with some cut and others put in their place, one to four times."""
    digits = [place for place, byte in enumerate(content) if byte in b"0123456789"]
    if digits and random.random() < 0.5:
        place = random.choice(digits)
        return content[:place] + b"%d" % random.integers(10) + content[place + 1 :]
    for _ in range(random.integers(1, 5)):
        start = int(random.choice((0.0, 1.0, *random.random(6))) * len(content))
        new = FRAGMENTS[random.integers(len(FRAGMENTS))] if random.random() < 0.5 else random.bytes(random.integers(9))
        cut = int(random.choice((0, len(new), random.integers(65))))
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


def try_trajectory(seed: int, ending: str) -> str:
    """A changed file of a trajectory is refused, or holds the same motion."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"run{ending}")
        path.write_bytes(edited(kept(ending), np.random.default_rng(seed)))
        with typed():
            found = omniroll.Trajectory.load(path)
            for name in ARRAYS:
                assert np.array_equal(getattr(found, name), getattr(run(), name)), name
            return "done"
    return "refused"


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


def try_results(seed: int) -> str:
    """A folder with one changed file is refused, or read: summary.json is the only file without a checksum."""
    random = np.random.default_rng(seed)
    name = random.choice(sorted(path.name for path in results().iterdir() if path.name != ".lock"))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(shutil.copytree(results(), Path(folder, "out")))
        (place / name).write_bytes(edited((place / name).read_bytes(), random))
        with typed(FileNotFoundError):
            omniroll.load_results(place).trajectory()
    return "done"


def try_scene_bytes(seed: int) -> str:
    """A scene of which bytes were changed is read, or refused; nothing is run."""
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.toml")
        path.write_bytes(edited(SCENES[random.integers(len(SCENES))].read_bytes(), random))
        with typed():
            omniroll.load_scene(path)
    return "done"


@CASES.case(
    "changed-files",
    "Files of trajectories, results and scenes with changed bytes",
    naive="reads numbers that nobody wrote, or ends in a traceback",
    promise="refused by a typed error, or the same motion",
)
def readers(scale: Scale) -> Iterator[Measurement]:
    count = scale.of(15, 5000)
    kept(".npz"), kept(".csv"), results()  # made before processes are forked
    yield from measured(lambda seed: try_trajectory(seed, ".npz"), count, "Trajectory.load, NPZ")
    yield from measured(lambda seed: try_trajectory(seed, ".csv"), count, "Trajectory.load, CSV")
    yield from measured(try_results, count, "load_results")
    yield from measured(try_scene_bytes, count, "load_scene")
