"""omniroll run SCENE: simulate a scene, keep the results, say what happened."""

import argparse
import sys
import time
import webbrowser
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from shtab import DIRECTORY, FILE

from omniroll import extras
from omniroll.engine.runs import MEMORY
from omniroll.interruption import Interruption
from omniroll.progress import reporting
from omniroll.results.ledger import WORDS
from omniroll.scenes import load_scene
from omniroll.scenes.lints import lints
from omniroll.scenes.outcome import VIEW, Outcome, complete, result_folder, run_scene, write
from omniroll.scenes.result_folder import Parts, as_json
from omniroll.scenes.streaming import Stream, refuse_unless_streamable

SUMMARY = "simulate a scene; keep its results as NPZ and CSV, with pictures where they are wanted"
EXAMPLES = (
    ("omniroll run scenes/motion-3.toml --plot", "results and a picture into out/run/motion-3/"),
    ("omniroll run scenes/robot-soccer-kit.toml --view", "and the run moving in the browser"),
    ("omniroll --import my_controllers run scene.toml", "with controllers that a module registers"),
)
WIDTH = 1 + max(map(len, WORDS.values()))  # of the words for a ledger's entries
DELAY = 1.0  # s of work before a bar is shown
PARTS = 10.0  # s of work after which what has been done is kept


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="default: out/run/ and the scene's name"
    ).complete = DIRECTORY
    parser.add_argument(
        "--plot", action="store_true", help="draw path, heading, energy and speeds into picture.png, torques, "
        "currents, loads and errors of a path into forces.png",
    )  # fmt: skip
    parser.add_argument("--view", action="store_true", help="write view.html, on which the run moves, and open it")
    parser.add_argument(
        "--stream", action="store_true",
        help="write the motion to the disk part by part, so that memory holds one part; without an error estimate",
    )  # fmt: skip
    parser.add_argument(
        "--memory", type=float, metavar="BYTES", help=f"what the run may take; default: the scene's, or {MEMORY:.3g}"
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")


def run(arguments: argparse.Namespace) -> int:
    """0 where the simulation came to its end; 128 and the number of a signal that has ended it. Raises
    SimulationStopped. What was done has been kept then."""
    scene = load_scene(arguments.scene)
    if arguments.memory is not None:
        scene = replace(scene, options=scene.options | {"memory": arguments.memory})
    if arguments.plot:
        extras.needed("matplotlib", "plots", "--plot")
    if arguments.stream:
        refuse_unless_streamable(scene, plot=arguments.plot, view=arguments.view)
    folder = arguments.output or Path("out/run") / scene.name
    wrong = lints(scene)
    _warn(map(str, wrong))
    with result_folder(folder) as results, Interruption() as interruption:
        memory = scene.options.get("memory", MEMORY)
        stream = Stream(results.unfinished, memory) if arguments.stream else None
        parts = Parts(results.unfinished, PARTS, time.monotonic)
        with reporting(None, scene.options["duration"], "s", delay=DELAY) as report:
            outcome = run_scene(scene, report, keep=parts.look, interrupted=interruption, stream=stream)
        summary = write(outcome, results)
        try:
            summary = complete(outcome, results, summary, picture=arguments.plot, view=arguments.view)
        except BaseException:
            print(f"omniroll: the results are whole in {folder}; what is drawn of them is not", file=sys.stderr)
            raise
    files = ", ".join([*summary["files"], "summary.json", *_parts(summary)])
    print(as_json(summary) if arguments.json else text(outcome) + f"\n\n{folder}: {files}")
    if arguments.view:
        webbrowser.open((folder / VIEW).resolve().as_uri())
    early = {lint.text for lint in wrong}
    _warn(warning for warning in outcome.warnings if warning not in early)
    if interruption():
        print(f"omniroll: {interruption()}; {_kept(outcome)}", file=sys.stderr)
        return interruption.exit_code
    if outcome.stopped is not None:
        raise outcome.stopped
    return 0


def _parts(summary: dict[str, Any]) -> list[str]:
    """The parts of a run that went to the disk, in short."""
    parts = summary.get("parts", [])
    return [f"parts/ ({len(parts)} of them, {sum(part['rows'] for part in parts)} rows)"] if parts else []


def _kept(outcome: Outcome) -> str:
    """What the files of a run hold that a signal has ended."""
    if outcome.stopped is not None:
        return "the files hold the motion so far"
    estimate = outcome.trajectory.stats["error_estimate"]
    return "the files hold the whole motion" + (", without an estimate of its error" if estimate is None else "")


def _warn(texts: Iterable[str]) -> None:
    for text in texts:
        print(f"warning: {text}", file=sys.stderr, flush=True)


def text(outcome: Outcome) -> str:
    """The summary for people."""
    summary = outcome.summary()
    start, end = summary["t"]
    (x, y, theta), (ahead, left, turns) = summary["pose"], summary["twist"]
    lines = [
        f"{summary['scene']}: {summary['roller_model']} rollers, "
        + ("wheels that may slip, " if summary["switching"] == "slip" else f"{summary['switching']} switches, ")
        + f"{start:g} to {end:g} s"
        + (", stopped there" if summary["stopped"] else ""),
        "",
        f"{'took':<12}{summary['seconds']:.3g} s, {summary['steps']} steps, {summary['evaluations']} evaluations"
        + (", on the Python engine" if summary["engine"] == "python" else ""),
        f"{'switches':<12}{summary['switches']}" + _stood(summary.get("times_on_joints")),
        *_off_ground(summary.get("off_ground")),
        f"{'error':<12}{_number(summary['error_estimate'])} estimated, sensitivity {_number(summary['sensitivity'])}",
        f"{'end':<12}x {x:.6g} m, y {y:.6g} m, heading {theta:.6g} rad",
        f"{'':<12}{ahead:.6g} m/s ahead, {left:.6g} m/s to the left, {turns:.6g} rad/s counterclockwise",
        f"{'':<12}nu " + ", ".join(f"{value:.6g}" for value in summary["nu"]) + " 1/s",
        "",
        f"{'energy':<12}J",
        *(f"  {WORDS.get(name, name):<{WIDTH}}{value: .6e}" for name, value in summary["energy"].items()),
        *_slip(summary["slip"]),
        *_reactions(summary["reactions"]),
    ]
    return "\n".join(lines)


def _stood(times: list[float] | None) -> str:
    """What there is to say of mecanum wheels and wheels with two rows of rollers that have stood on their joints."""
    return f"; wheels stood on their joints for {sum(times):.3g} s in all" if times and any(times) else ""


def _off_ground(found: dict[str, float] | None) -> list[str]:
    if found is None:
        return []
    fastest, limit = found["fastest"], found["rate_on_ground"]
    return [
        f"{'':<12}wheels turn with up to {fastest:.4g} rad/s; beyond {limit:.4g} rad/s they leave the ground on their "
        "rollers, which the model leaves out"
    ]


def _slip(summary: dict[str, Any] | None) -> list[str]:
    if summary is None:
        return []
    mean, most = sum(summary["slip_path"]) / len(summary["slip_path"]), max(summary["slip_path"])
    per = summary["slip_per_distance"]
    (ahead, aside), of_loads = summary["force"], summary["friction"]
    shares = "" if of_loads is None else f": {of_loads[0]:.3g} and {of_loads[1]:.3g} of the loads"
    return [
        "",
        f"{'slip':<12}{mean:.4g} m of a contact in the mean, {most:.4g} m at most, over {summary['distance']:.4g} m"
        + ("" if per is None else f": {per:.3g} m per m"),
        f"{'':<12}the ground gives at most {ahead:.4g} N along x and {aside:.4g} N along y of the body{shares}",
    ]


def _reactions(summary: dict[str, Any] | None) -> list[str]:
    if summary is None:
        return []
    slip = (
        "" if summary["least_slip_margin"] is None else f", {summary['least_slip_margin']:.4g} N from slipping at least"
    )
    return [
        "",
        f"{'reactions':<12}loads {summary['load_rule']}, {summary['least_load']:.4g} N at least",
        f"{'':<12}friction {summary['needed_friction']:.4g} needed at most{slip}",
        f"{'':<12}{1e3 * summary['least_tip_margin']:.4g} mm from tipping at least",
    ]


def _number(value: float | None) -> str:
    return "not" if value is None else f"{value:.2g}"
