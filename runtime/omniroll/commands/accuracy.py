"""omniroll accuracy SCENE: what accuracy costs in time."""

import argparse
import importlib.util
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from shtab import DIRECTORY, FILE

from omniroll.commands import STOPPED
from omniroll.errors import InvalidValueError
from omniroll.scenes import load_scene

if TYPE_CHECKING:
    from omniroll.studies.accuracy.study import Study

SUMMARY = "show what accuracy costs in time: every integrator and model of a scene against a reference solution"
EXAMPLES = (
    ("omniroll accuracy scenes/motion-3.toml --duration 5 --error 1e-6", "the cheapest setting with that error"),
)
DURATION = 8.0  # s, where the scene runs longer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see scenes/").complete = FILE
    parser.add_argument("--error", type=float, metavar="X", help="name the cheapest setting with this error")
    parser.add_argument(
        "--duration", type=float, metavar="S", help=f"seconds to simulate; default: the scene's, at most {DURATION:g}"
    )
    parser.add_argument(
        "--folder", type=Path, help="for page, figure, CSV and JSON; default: out/accuracy/ and the scene's name"
    ).complete = DIRECTORY
    parser.add_argument("--json", action="store_true", help="print JSON in place of the tables")


def run(arguments: argparse.Namespace) -> int:
    """0 where all was measured and written; 3 where a run stopped, and the others were written.

    Raises SceneError, InvalidValueError, and SimulationStopped where the reference solution stops.
    """
    from omniroll.studies.accuracy.study import study
    from omniroll.studies.accuracy.tables import text

    scene = load_scene(arguments.scene)
    if scene.slips:
        raise InvalidValueError("SCENE", arguments.scene.name, "must not have [contact]: the integrators compared roll")
    duration = _duration(arguments.duration, scene.options["duration"])
    if arguments.error is not None and not 0 < arguments.error < math.inf:
        raise InvalidValueError("--error", arguments.error, "must be positive")
    folder = arguments.folder or Path("out/accuracy") / scene.name
    result = study(scene, duration, wanted=arguments.error, report=_report())
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
    duration = min(scenes, DURATION) if given is None else given
    if not 0 < duration < math.inf:
        raise InvalidValueError("--duration", duration, "must be positive")
    return duration


def _report():
    """Lines of progress for a terminal, nothing for a file."""
    if not sys.stderr.isatty():
        return lambda line: None
    return lambda line: print(f"  {line} ...", file=sys.stderr)
