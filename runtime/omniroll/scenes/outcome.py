"""What a run of a scene leaves: a summary, and files."""

import csv
import json
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from omniroll.engine.simulate import accuracy_doubts, checked_task, controlled_run, one_run
from omniroll.errors import SimulationStopped
from omniroll.progress import Report
from omniroll.results.impulses import Impulses, impulses
from omniroll.results.measurements import Instruments
from omniroll.results.reactions import Reactions
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.loading import Scene, reactions_of
from omniroll.scenes.picture import draw

STATS = ("steps", "evaluations", "switches", "tolerance", "error_estimate", "sensitivity")
FILES = (
    "trajectory.npz",
    "trajectory.csv",
    "switches.csv",
    "impulses.csv",
    "samples.csv",
    "reactions.csv",
    "summary.json",
    "picture.png",
)


@dataclass(frozen=True)
class Outcome:
    """A scene that was run.

    trajectory  the motion, up to the stop where there was one
    seconds     that it took
    warnings    what simulate and reactions would warn of
    stopped     the error that stopped it, or None
    reactions   where the scene asks for them
    """

    scene: Scene
    trajectory: Trajectory
    seconds: float
    warnings: tuple[str, ...]
    stopped: SimulationStopped | None
    reactions: Reactions | None

    def summary(self) -> dict[str, Any]:
        """What there is to know in short, in plain Python types; units SI."""
        trajectory, stopped = self.trajectory, self.stopped
        return {
            "scene": self.scene.name,
            "stopped": stopped and {"reason": stopped.reason, "t": stopped.t, "wheel": stopped.wheel},
            "warnings": list(self.warnings),
            "roller_model": trajectory.roller_model,
            "switching": trajectory.switching,
            "engine": trajectory.engine,
            "t": [float(trajectory.t[0]), float(trajectory.t[-1])],
            "seconds": self.seconds,
            **{name: trajectory.stats.get(name) for name in STATS},
            "nu": trajectory.nu[-1].tolist(),
            "pose": trajectory.pose[-1].tolist(),
            "energy": ledger(trajectory),
            "reactions": self.reactions and _reactions_in_short(self.reactions),
        }


def ledger(trajectory: Trajectory) -> dict[str, float]:
    """Where the kinetic energy went, in J. `residual` is what the rest does not explain."""
    account = trajectory.ledger
    return {"start": account.start, "end": account.end} | account.contributions | {"residual": account.residual}


def _reactions_in_short(reactions: Reactions) -> dict[str, Any]:
    needed = reactions.needed_friction[np.isfinite(reactions.needed_friction)]
    return {
        "load_rule": reactions.load_rule,
        "least_load": float(reactions.load.min()),
        "needed_friction": float(needed.max(initial=0.0)),
        "least_slip_margin": None if reactions.slip_margin is None else float(reactions.slip_margin.min()),
        "least_tip_margin": float(reactions.tip_margin.min()),
        "doubts": [asdict(doubt) for doubt in reactions.doubts],
    }


def run_scene(scene: Scene, report: Report | None = None) -> Outcome:
    """Run a scene, also one that stops before its end."""
    stopped, reactions = None, None
    began = time.perf_counter()
    task = checked_task(scene.vehicle, **scene.options, progress=report)
    doubts = scene.doubts()
    try:
        trajectory = controlled_run(task) if task.duration > 0 else one_run(task, task.accuracy)
        doubts += accuracy_doubts(task, trajectory) if task.duration > 0 else ()
    except SimulationStopped as error:
        stopped, trajectory = error, error.trajectory
    seconds = time.perf_counter() - began
    texts = [str(doubt) for doubt in doubts]
    if "reactions" in scene.tables:
        reactions, rolling = reactions_of(trajectory, scene.tables["reactions"])
        texts += rolling
    return Outcome(scene, trajectory, seconds, tuple(texts), stopped, reactions)


def write(outcome: Outcome, folder: Path, *, picture: bool) -> list[str]:
    """Write the files of a run into `folder`; their names. Files of an earlier run go away."""
    for name in FILES:
        (folder / name).unlink(missing_ok=True)
    trajectory = outcome.trajectory
    trajectory.save(folder / "trajectory.npz")
    trajectory.save(folder / "trajectory.csv", dense=False)
    _write_switches(trajectory, folder / "switches.csv")
    if trajectory.switching == "impact":
        _write_impulses(impulses(trajectory), folder / "impulses.csv")
    times = outcome.scene.sample_times(float(trajectory.t[-1]))
    if times is not None:
        _write_samples(trajectory, times, folder / "samples.csv", outcome.scene.instruments())
    if outcome.reactions is not None:
        _write_reactions(outcome.reactions, folder / "reactions.csv")
    (folder / "summary.json").write_text(as_json(outcome.summary()) + "\n", encoding="utf-8")
    if picture:
        draw(trajectory, outcome.scene.name, folder / "picture.png", stopped=outcome.stopped is not None)
    return [name for name in FILES if (folder / name).exists()]


def as_json(summary: dict[str, Any]) -> str:
    """The summary as JSON, which has no infinity: what is not finite becomes null."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: plain(part) for name, part in value.items()}
        if isinstance(value, list):
            return [plain(part) for part in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(plain(summary), indent=1, allow_nan=False)


def _write_switches(trajectory: Trajectory, path: Path) -> None:
    _write_table(path, trajectory.switches.dtype.names, trajectory.switches.tolist())


def _write_impulses(at_switches: Impulses, path: Path) -> None:
    wheels = range(1, at_switches.contact.shape[1] + 1)
    names = ["t", *(f"{name}_{i}" for name in ("along_axle", "along_rolling") for i in wheels)]
    _write_table(path, names, _rows((at_switches.t, at_switches.contact[..., 0], at_switches.contact[..., 1])))


def _write_samples(trajectory: Trajectory, times: np.ndarray, path: Path, instruments: Instruments | None) -> None:
    """The motion at the times, and what instruments read there."""
    samples, wheels = trajectory.sample(times), range(1, trajectory.vehicle.wheels + 1)
    names = ["t", "x", "y", "theta", "nu_1", "nu_2", "nu_3"]
    names += [f"{name}_{i}" for name in ("chi", "contact", "contact_spin") for i in wheels] + ["energy"]
    columns = (samples.t, samples.pose, samples.nu, samples.chi, samples.contact, samples.contact_spin, samples.energy)
    if instruments is not None and len(times):
        for name, values in trajectory.measure(times, instruments).items():
            axes = values.shape[1:]
            names += [f"{name}_{k + 1}" for k in range(axes[0])] if axes else [name]
            columns += (values,)
    _write_table(path, names, _rows(columns))


def _write_reactions(reactions: Reactions, path: Path) -> None:
    wheels = range(1, reactions.load.shape[1] + 1)
    names = [
        "t",
        *(f"{name}_{i}" for name in ("along_axle", "along_rolling", "load", "needed_friction") for i in wheels),
    ]
    names += ["pressure_x", "pressure_y", "tip_margin"]
    along, across = reactions.contact_force[..., 0], reactions.contact_force[..., 1]
    columns = (
        reactions.t,
        along,
        across,
        reactions.load,
        reactions.needed_friction,
        reactions.pressure_point,
        reactions.tip_margin,
    )
    _write_table(path, names, _rows(columns))


def _rows(columns: Iterable[np.ndarray]) -> Iterator[list]:
    """The rows of columns (T,) or (T, m) side by side, as Python's numbers: contacts stay integers."""
    for row in zip(
        *(column.reshape(len(column), math.prod(column.shape[1:])).tolist() for column in columns), strict=True
    ):
        yield [value for part in row for value in part]


def _write_table(path: Path, names: Sequence[str], rows: Iterable[Sequence]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)
