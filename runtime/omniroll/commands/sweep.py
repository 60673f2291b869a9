"""omniroll sweep SCENE: run a scene over numbers of its file, in threads, into a table and a picture."""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from shtab import DIRECTORY, FILE

from omniroll import durable, extras
from omniroll.commands import INTERRUPTED, STOPPED
from omniroll.errors import SweepInterrupted
from omniroll.progress import reporting
from omniroll.scenes.result_folder import as_json

SUMMARY = "run a scene over numbers of its file; keep where the runs end as Parquet and as a picture"
EXAMPLES = (
    ("omniroll sweep scenes/motion-3.toml --vary vehicle.mass=0.5:2:16", "16 runs, into out/sweep/motion-3/"),
    (
        "omniroll sweep scenes/wheel-spin.toml --vary vehicle.mass=2:3:21 --vary contact.friction=0.2,0.3",
        "42 runs: every mass with every friction",
    ),
    ("omniroll sweep scenes/motion-3.toml --vary start.nu.1=0.5:2:16", "over the first entry of a list"),
)
TABLE, PICTURE, SUMMARY_FILE = "sweep.parquet", "sweep.png", "summary.json"
DELAY = 1.0  # s of work before a bar is shown


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument(
        "--vary", action="append", required=True, metavar="TABLE.KEY=FROM:TO:COUNT",
        help="a number of the scene and its values; also TABLE.KEY=VALUE,VALUE,... and TABLE.KEY.NUMBER of a list; "
        "repeated: every value of one with every value of the others",
    )  # fmt: skip
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="default: out/sweep/ and the scene's name"
    ).complete = DIRECTORY
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")


def run(arguments: argparse.Namespace) -> int:
    """0; STOPPED where each run stopped; INTERRUPTED by Ctrl-C, with what was done until then in the files."""
    from omniroll.scenes.sweeping import Axis, SceneSweep

    extras.needed("pyarrow", "tables", "omniroll sweep")
    extras.needed("matplotlib", "plots", "omniroll sweep")
    sweep = SceneSweep.of(arguments.scene, [Axis.read(text) for text in arguments.vary])
    folder = arguments.output or Path("out/sweep") / sweep.name
    began, interrupted = time.perf_counter(), False
    folder.mkdir(parents=True, exist_ok=True)
    with reporting(None, len(sweep.scenes), "runs", delay=DELAY) as report:
        try:
            many = sweep.run(report)
        except SweepInterrupted as error:
            many, interrupted = error.many, True
    summary = _summary(sweep, many, time.perf_counter() - began, interrupted)
    files = _write(sweep, many, summary, folder)
    print(as_json(summary) if arguments.json else text(summary) + f"\n\n{folder}: {', '.join(files)}")
    if interrupted:
        return INTERRUPTED
    return STOPPED if many.stopped.all() else 0


def _write(sweep: Any, many: Any, summary: dict[str, Any], folder: Path) -> list[str]:
    """Write the files, each as a whole; their names."""
    import matplotlib

    from omniroll.results import pictures
    from omniroll.scenes import sweep_picture

    with durable.whole_file(folder / TABLE, "wb") as file:
        many.to_pandas(sweep.along).to_parquet(file)
    with matplotlib.rc_context(pictures.STYLE):
        figure = sweep_picture.sheet(sweep, many)
        (folder / PICTURE).unlink(missing_ok=True)
        if figure is not None:
            pictures.save(figure, folder / PICTURE)
    with durable.whole_file(folder / SUMMARY_FILE) as file:
        file.write(as_json(summary) + "\n")
    return [name for name in (TABLE, PICTURE, SUMMARY_FILE) if (folder / name).exists()]


def _summary(sweep: Any, many: Any, seconds: float, interrupted: bool) -> dict[str, Any]:
    """What there is to know in short, in plain Python types; units SI."""
    from omniroll.scenes.sweep_picture import panels

    reasons = dict.fromkeys(many.reasons.values())
    return {
        "scene": sweep.name,
        "axes": [{"name": axis.name, "unit": axis.unit, "values": axis.values.tolist()} for axis in sweep.axes],
        "runs": int(many.stopped.size),
        "stopped": int(many.stopped.sum()),
        "reasons": list(reasons),
        "interrupted": interrupted,
        "seconds": seconds,
        "ends": {panel.title: _range(panel.values) | {"unit": panel.unit} for panel in panels(sweep, many)},
        "error_estimate": None if np.isnan(many.error_estimate).all() else float(np.nanmax(many.error_estimate)),
    }


def _range(values: np.ndarray) -> dict[str, float | None]:
    known = values[np.isfinite(values)]
    return {"least": float(known.min()), "most": float(known.max())} if known.size else {"least": None, "most": None}


def text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    over = " x ".join(f"{axis['name']} ({len(axis['values'])})" for axis in summary["axes"])
    lines = [f"{summary['scene']}: {summary['runs']} runs over {over}", "", f"{'took':<22}{summary['seconds']:.3g} s"]
    if summary["stopped"]:
        lines.append(f"{'stopped':<22}{summary['stopped']} of them: {summary['reasons'][0]}")
    worst = summary["error_estimate"]
    lines += [f"{'error':<22}{'not estimated' if worst is None else f'{worst:.2g} estimated at most'}", ""]
    for title, found in summary["ends"].items():
        if found["least"] is not None:
            unit = "" if found["unit"] == "1" else f" {found['unit']}"
            lines.append(f"{title:<22}{found['least']:.6g} to {found['most']:.6g}{unit}")
    if len(summary["axes"]) > 2:
        lines += ["", "no picture: one or two numbers are drawn, and more are varied here"]
    return "\n".join(lines)
