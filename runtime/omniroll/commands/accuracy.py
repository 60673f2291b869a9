"""omniroll accuracy SCENE: what accuracy costs in time."""

import argparse
import importlib.util
import math
import sys
from pathlib import Path

from omniroll.errors import InvalidValueError
from omniroll.scene import load_scene

SUMMARY = "show what accuracy costs in time: every integrator and model of a scene against a reference solution"
DURATION = 8.0  # s, where the scene runs longer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see scenes/")
    parser.add_argument("--error", type=float, metavar="X", help="name the cheapest setting with this error")
    parser.add_argument(
        "--duration", type=float, metavar="S", help=f"seconds to simulate; default: the scene's, at most {DURATION:g}"
    )
    parser.add_argument(
        "--folder", type=Path, help="for figure, CSV and JSON; default: out/accuracy/ and the scene's name"
    )
    parser.add_argument("--json", action="store_true", help="print JSON in place of the tables")


def run(arguments: argparse.Namespace) -> int:
    """0 where all was measured and written. Raises SceneError, InvalidValueError, SimulationStopped."""
    from omniroll.accuracy.study import study

    scene = load_scene(arguments.scene)
    duration = _duration(arguments.duration, scene.options["duration"])
    if arguments.error is not None and not 0 < arguments.error < math.inf:
        raise InvalidValueError("--error", arguments.error, "must be positive")
    folder = arguments.folder or Path("out/accuracy") / scene.name
    result = study(scene, duration, wanted=arguments.error, report=_report())
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "accuracy.json").write_text(result.as_json() + "\n", encoding="utf-8")
    (folder / "accuracy.csv").write_text(result.as_csv(), encoding="utf-8")
    drawn = importlib.util.find_spec("matplotlib") is not None
    if drawn:
        from omniroll.accuracy.figure import draw

        draw(result, folder)
    if arguments.json:
        print(result.as_json())
        return 0
    from omniroll.accuracy.tables import text

    print(text(result))
    kinds = "accuracy.png, .svg, .csv, .json" if drawn else "accuracy.csv, .json (pictures: 'omniroll[plots]')"
    print(f"\n{folder}: {kinds}")
    return 0


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
