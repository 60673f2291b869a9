"""omniroll accuracy SCENE: what accuracy costs in time."""

import argparse
import importlib.util
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from shtab import DIRECTORY, FILE

from omniroll.commands import STOPPED
from omniroll.errors import InvalidValueError
from omniroll.progress import duration
from omniroll.scenes import load_scene

if TYPE_CHECKING:
    from omniroll.studies.accuracy.study import Study

SUMMARY = "show what accuracy costs in time: every integrator and model of a scene against a reference solution"
EXAMPLES = (
    ("omniroll accuracy scenes/motion-3.toml --duration 5 --error 1e-6", "the cheapest setting with that error"),
)
DURATION = 8.0  # s, where the scene runs longer
WITHIN = 45.0  # s of work after which nothing more is begun
REFERENCE = 6.0  # s of work in which the reference solution goes as far as is then measured, where no duration is asked


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see scenes/").complete = FILE
    parser.add_argument("--error", type=float, metavar="X", help="name the cheapest setting with this error")
    parser.add_argument(
        "--duration",
        type=float,
        metavar="S",
        help=f"seconds to simulate; default: the scene's, at most {DURATION:g}, "
        f"and what a reference solution reaches in {REFERENCE:g} s",
    )
    parser.add_argument(
        "--within", type=float, default=WITHIN, metavar="S",
        help="seconds of work after which nothing more is measured; what is left out is named; default: %(default)g",
    )  # fmt: skip
    parser.add_argument(
        "--folder", type=Path, help="for page, figure, CSV and JSON; default: out/accuracy/ and the scene's name"
    ).complete = DIRECTORY
    parser.add_argument("--json", action="store_true", help="print JSON in place of the tables")


def run(arguments: argparse.Namespace) -> int:
    """0 where all was measured and written; 3 where a run stopped, and the others were written.

    Raises SceneError, InvalidValueError, and SimulationStopped where the reference solution stops.
    """
    from omniroll.studies.accuracy.study import affordable, study
    from omniroll.studies.accuracy.tables import text

    scene = load_scene(arguments.scene)
    if scene.slips:
        raise InvalidValueError("SCENE", arguments.scene.name, "must not have [contact]: the integrators compared roll")
    if scene.vehicle.has_kinds or not scene.vehicle.has_wheels_of_the_paper:
        bound = "must have omni-wheels of one kind, round and with one row of rollers: the reference knows no others"
        raise InvalidValueError("SCENE", arguments.scene.name, bound)
    seconds = _duration(arguments.duration, scene.options["duration"])
    if arguments.error is not None and not 0 < arguments.error < math.inf:
        raise InvalidValueError("--error", arguments.error, "must be positive")
    if not arguments.within >= 0:
        raise InvalidValueError("--within", arguments.within, "must not be negative")
    whole = seconds
    if arguments.duration is None:
        seconds = affordable(scene, whole, REFERENCE)
    folder = arguments.folder or Path("out/accuracy") / scene.name
    result = study(
        scene, seconds, wanted=arguments.error, report=_reporter(arguments.within), progress=None,
        within=arguments.within,
    )  # fmt: skip
    if seconds < whole:
        result.failed.append(f"beyond {seconds:g} s: --duration {whole:g} takes all, and its reference longer")
    files = _write(result, folder)
    print(result.as_json() if arguments.json else f"{text(result)}\n\n{folder}: {', '.join(files)}")
    if result.stopped is not None:
        print(f"omniroll: {result.stopped}", file=sys.stderr)
        return STOPPED
    return 0


def _write(result: "Study", folder: Path) -> list[str]:
    """Write page, data and, where matplotlib is installed, pictures; what there is now."""
    from omniroll.studies.accuracy.tables import markdown

    drawn = importlib.util.find_spec("matplotlib") is not None
    folder.mkdir(parents=True, exist_ok=True)
    page = markdown(result, "accuracy.png" if drawn else None)
    (folder / "accuracy.md").write_text(page, encoding="utf-8")
    (folder / "accuracy.json").write_text(result.as_json() + "\n", encoding="utf-8")
    (folder / "accuracy.csv").write_text(result.as_csv(), encoding="utf-8")
    if not drawn:
        return ["accuracy.md", ".csv", ".json (pictures: 'omniroll[plots]')"]
    from omniroll.studies.accuracy.figure import draw

    draw(result, folder)
    return ["accuracy.md", ".png", ".svg", ".csv", ".json"]


def _duration(given: float | None, scenes: float) -> float:
    seconds = min(scenes, DURATION) if given is None else given
    if not 0 < seconds < math.inf:
        raise InvalidValueError("--duration", seconds, "must be positive")
    return seconds


def _reporter(within: float, clock: Callable[[], float] = time.monotonic) -> Callable[[str], None]:
    """Says on a terminal what comes next, how long all before it took, and what is left of the time."""
    if not sys.stderr.isatty():
        return lambda line: None
    start = clock()

    def report(line: str) -> None:
        took = clock() - start
        left = f", {duration(max(within - took, 0.0))} left at most" if within < math.inf else ""
        print(f"  {line} ... ({duration(took)} so far{left})", file=sys.stderr)

    return report
