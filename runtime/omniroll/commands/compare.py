"""omniroll compare SCENE --with mujoco: a scene beside a simulator of bodies and contacts."""

import argparse
import importlib.util
import json
import math
from pathlib import Path
from typing import Any

from shtab import DIRECTORY, FILE

from omniroll import extras
from omniroll.durable import whole_file
from omniroll.errors import InvalidValueError
from omniroll.exchange.run_in_mujoco import FINE_SPHERES, FRICTION, PURPOSE, STEP
from omniroll.scenes import load_scene

SUMMARY = "run a scene beside MuJoCo, with a body for each roller: distances and a picture"
EXAMPLES = (
    (
        "omniroll compare scenes/robot-soccer-kit.toml --with mujoco --duration 2",
        "needs pip install 'omniroll[mujoco]'",
    ),
)
HOPPING = 0.5  # part of the time off the ground from which wheels are said to hop
HOPS = ": they hop, and distances need not fall with the step"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument("--with", dest="peer", choices=("mujoco",), required=True, help="the other simulator")
    parser.add_argument("--duration", type=float, metavar="S", help="seconds to simulate; default: the scene's")
    parser.add_argument(
        "--step", type=float, metavar="S", default=STEP, help=f"the peer's time step, and half of it; default: {STEP}"
    )
    parser.add_argument(
        "--friction",
        type=float,
        metavar="X",
        help=f"friction between rollers and ground; default: that of the scene's [contact], or {FRICTION}",
    )
    parser.add_argument(
        "--spheres", type=int, metavar="N", default=FINE_SPHERES, help=f"spheres for a roller; default: {FINE_SPHERES}"
    )
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help="for the files; default: out/compare/ and the scene's name",
    ).complete = DIRECTORY
    parser.add_argument("--json", action="store_true", help="print JSON in place of the tables")


def run(arguments: argparse.Namespace) -> int:
    """0 where both ran. Raises SceneError, InvalidValueError, SimulationStopped, MissingPackageError."""
    extras.needed("mujoco", "mujoco", PURPOSE)
    from omniroll.studies.beside_mujoco import beside_mujoco

    scene = load_scene(arguments.scene)
    for name in ("duration", "step", "friction"):
        value = getattr(arguments, name)
        if value is not None and not 0 < value < math.inf:
            raise InvalidValueError(f"--{name}", value, "must be positive")
    options = {name: getattr(arguments, name) for name in ("step", "friction", "spheres", "duration")}
    found = beside_mujoco(scene, **options)
    folder = arguments.output or Path("out/compare") / scene.name
    folder.mkdir(parents=True, exist_ok=True)
    summary = found.summary()
    files = {"model.xml": found.others[-1].model, "compare.json": json.dumps(summary, indent=1, allow_nan=False) + "\n"}
    for name, content in files.items():
        with whole_file(folder / name) as file:
            file.write(content)
    drawn = importlib.util.find_spec("matplotlib") is not None
    if drawn:
        found.draw(folder / "compare.png")
    kept = [*files, "compare.png" if drawn else "(a picture: pip install 'omniroll[plots]')"]
    print(json.dumps(summary, allow_nan=False) if arguments.json else f"{text(summary)}\n\n{folder}: {', '.join(kept)}")
    return 0


def text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    lines = [
        f"{summary['scene']}: {summary['roller_model']} rollers, {summary['switches']} switches, a way of "
        f"{summary['way']:.4g} m; MuJoCo has a body for each roller, contacts that give way and a friction of "
        f"{summary['friction']:g}",
        *(f"besides, {words}" for words in summary["left_out"]),
    ]
    for other in summary["runs"]:
        lines += [
            "",
            f"step {1e3 * other['step']:g} ms, {other['seconds']:.3g} s; wheels off the ground "
            f"{other['off_ground']:.1%} of the time" + (HOPS if other["off_ground"] > HOPPING else ""),
            f"{'t, s':>10}{'place, mm':>12}{'heading, mrad':>15}{'speed, mm/s':>13}   apart",
        ]
        rows = zip(*(other[name] for name in ("t", "place", "heading", "speed")), strict=True)
        lines += [
            f"{t:>10.4g}{1e3 * place:>12.4g}{1e3 * turn:>15.4g}{1e3 * speed:>13.4g}" for t, place, turn, speed in rows
        ]
    return "\n".join(lines)
