"""What a run of a scene leaves: a summary, and files."""

import csv
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from omniroll.conventions.twists import twist_of_nu
from omniroll.engine.runs import Interrupted, Keep
from omniroll.engine.simulate import accuracy_doubts, checked_task, controlled_run, one_run
from omniroll.errors import SimulationStopped
from omniroll.progress import Report
from omniroll.results import slip_map, tables
from omniroll.results.impulses import Impulses, impulses
from omniroll.results.measurements import Instruments
from omniroll.results.reactions import Reactions
from omniroll.results.slip_in_short import slip_in_short
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.loading import Scene, reactions_of
from omniroll.scenes.picture import draw
from omniroll.scenes.result_folder import ResultFolder
from omniroll.scenes.streaming import Stream
from omniroll.vehicles import profiles
from omniroll.viewer import page
from omniroll.viewer.page import View

STATS = ("steps", "evaluations", "switches", "tolerance", "error_estimate", "sensitivity")
VIEW = "view.html"
FILES = (
    "trajectory.npz",
    "trajectory.csv",
    "switches.csv",
    "impulses.csv",
    "slip.csv",
    "samples.csv",
    "reactions.csv",
    "summary.json",
    "picture.png",
    "forces.png",
    "slip.png",
    VIEW,
)


@dataclass(frozen=True)
class Outcome:
    """A scene that was run.

    trajectory  the motion, up to the stop where there was one
    seconds     that it took
    warnings    what simulate and reactions would warn of
    stopped     the error that stopped it, or None
    reactions   where the scene asks for them
    interrupted what has interrupted it, or ""
    stream      where the motion was written part by part, the last of them being the trajectory; or None
    """

    scene: Scene
    trajectory: Trajectory
    seconds: float
    warnings: tuple[str, ...]
    stopped: SimulationStopped | None
    reactions: Reactions | None
    interrupted: str = ""
    stream: Stream | None = None

    def parts(self) -> Iterable[Trajectory]:
        """The motion: one part, or those that were written, each read when its turn comes."""
        return [self.trajectory] if self.stream is None else self.stream.written()

    def summary(self, *, measured: bool = True) -> dict[str, Any]:
        """What there is to know in short, in plain Python types; units SI.

        measured  also the sensitivity, for which runs may have to be made; it is None else
        """
        trajectory, stopped = self.trajectory, self.stopped
        figures = trajectory.stats if measured else trajectory.stats.known()
        return {
            "scene": self.scene.name,
            "stopped": stopped and {"reason": stopped.reason, "t": stopped.t, "wheel": _from_one(stopped.wheel)},
            "interrupted": self.interrupted or None,
            "warnings": list(self.warnings),
            "roller_model": trajectory.roller_model,
            "switching": trajectory.switching,
            "engine": trajectory.stats["engine"],
            "kernel": trajectory.stats["kernel"],
            "t": [self.stream.parts[0]["t"][0] if self.stream else float(trajectory.t[0]), float(trajectory.t[-1])],
            "seconds": self.seconds,
            **{name: figures.get(name) for name in STATS},
            "nu": trajectory.nu[-1].tolist(),
            "twist": twist_of_nu(trajectory.vehicle, trajectory.nu[-1]).tolist(),
            "pose": trajectory.pose[-1].tolist(),
            "energy": self.stream.ledger() if self.stream else ledger(trajectory),
            "slip": None if self.stream else slip_in_short(trajectory),
            "reactions": self.reactions and _reactions_in_short(self.reactions),
            **self._stood(),
            **self._off_ground(),
        } | ({"parts": self.stream.parts} if self.stream else {})

    def _stood(self) -> dict[str, Any]:
        """For how long each mecanum wheel or wheel with two rows of rollers has stood on its joint, in s."""
        stood = None if self.stream else self.trajectory.times_on_joints()
        return {} if stood is None else {"times_on_joints": stood.tolist()}

    def _off_ground(self) -> dict[str, Any]:
        """Of wheels that turn so fast that they leave the ground on their rollers, which the model leaves out: the
        fastest rate, and the one up to which they stay, in rad/s."""
        vehicle = self.scene.vehicle
        if self.stream or not vehicle.has_profile:
            return {}
        run, limit = self.trajectory, profiles.rate_on_ground(vehicle)
        fastest = float(np.abs(run.kernel.wheel_speeds(run.nu, run.chi)).max())
        return {"off_ground": {"fastest": fastest, "rate_on_ground": limit}} if fastest > limit else {}


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


def run_scene(
    scene: Scene,
    report: Report | None = None,
    *,
    keep: Keep | None = None,
    interrupted: Interrupted | None = None,
    stream: Stream | None = None,
) -> Outcome:
    """Run a scene, also one that stops before its end.

    report       is told of the progress, then of that of the coarser run that the error estimate needs
    keep         sees the run now and then
    interrupted  ends the run where it gives a text
    stream       takes the parts of the run, in place of `keep`
    """
    stopped, reactions = None, None
    began = time.perf_counter()
    task = checked_task(scene.vehicle, **scene.options, progress=report)
    task = replace(task, keep=keep, interrupted=interrupted, coarse=report)
    if stream is not None:
        task = replace(task, keep=stream.look, room=stream.room)
    doubts = scene.doubts()
    try:
        estimated = task.duration > 0 and stream is None
        trajectory = controlled_run(task) if estimated else one_run(task, task.accuracy)
        doubts += accuracy_doubts(task, trajectory) if task.duration > 0 else ()
    except SimulationStopped as error:
        stopped, trajectory = error, error.trajectory
    if stream is not None:
        stream.add(trajectory)
    seconds = time.perf_counter() - began
    texts = [str(doubt) for doubt in doubts]
    if "reactions" in scene.tables:
        reactions, rolling = reactions_of(trajectory, scene.tables["reactions"])
        texts += rolling
    reason = interrupted() if interrupted else ""
    return Outcome(scene, trajectory, seconds, tuple(texts), stopped, reactions, reason, stream)


def result_folder(path: Path) -> ResultFolder:
    """The folder for the files of runs."""
    return ResultFolder(path, FILES)


def write(outcome: Outcome, folder: ResultFolder) -> dict[str, Any]:
    """Keep the files of a run in place of those of an earlier one; the summary, with the files' checksums.

    The sensitivity is in it where it has been measured: nothing is computed before the results are on the disk.
    """

    def write_files(place: Path) -> None:
        trajectory = outcome.trajectory
        times = outcome.scene.sample_times(float(trajectory.t[-1]))
        if times is not None:
            _write_samples(outcome.parts(), times, place / "samples.csv", outcome.scene.instruments())
        if outcome.stream is not None:
            return
        trajectory.save(place / "trajectory.npz", measured=False)
        trajectory.save(place / "trajectory.csv", dense=False, measured=False)
        _write_switches(trajectory, place / "switches.csv")
        vehicle = trajectory.vehicle
        if not vehicle.rows_move and not vehicle.has_kinds and trajectory.switching == "impact":
            _write_impulses(impulses(trajectory), place / "impulses.csv")
        if trajectory.contacts is not None:
            _write_slip(trajectory, place / "slip.csv")
        if outcome.reactions is not None:
            _write_reactions(outcome.reactions, place / "reactions.csv")

    return folder.keep(write_files, outcome.summary(measured=False))


def complete(
    outcome: Outcome, folder: ResultFolder, summary: dict[str, Any], *, picture: bool, view: bool
) -> dict[str, Any]:
    """Add what is made of results that `write` has kept: the sensitivity, and pictures. Gives the summary then.

    summary  as `write` has given it
    """
    trajectory, name = outcome.trajectory, outcome.scene.title

    def write_files(place: Path) -> None:
        if picture:
            drawn = name.replace("$", r"\$")  # which matplotlib would take for the start of a formula
            draw(trajectory, drawn, place, stopped=outcome.stopped is not None)
            if trajectory.effects.slips:
                slip_map.draw(trajectory, f"{drawn}: where and when wheels slip", place / "slip.png")
        if view:
            page_of(outcome).save(place / VIEW)

    whole = outcome.summary() | {"files": summary["files"]}
    return folder.add(write_files, whole) if picture or view or whole != summary else summary


def page_of(outcome: Outcome) -> View:
    """The page that shows a run of a scene moving."""
    name = outcome.scene.title
    return page.view(outcome.trajectory, labels=[name], reactions=outcome.reactions, title=name)


def _from_one(wheel: int | None) -> int | None:
    """A wheel's number for people."""
    return None if wheel is None else wheel + 1


def _write_switches(trajectory: Trajectory, path: Path) -> None:
    """Wheels count from 1, as in all tables for people; arrays count from 0."""
    names, switches = trajectory.switches.dtype.names, trajectory.switches.copy()
    switches["wheel"] += 1
    _write_table(path, names, switches.tolist())


def _write_impulses(at_switches: Impulses, path: Path) -> None:
    wheels = range(1, at_switches.contact.shape[1] + 1)
    names = ["t", *(f"{name}_{i}" for name in ("along_axle", "along_rolling") for i in wheels)]
    _write_table(path, names, _rows((at_switches.t, at_switches.contact[..., 0], at_switches.contact[..., 1])))


def _write_slip(trajectory: Trajectory, path: Path) -> None:
    wheels = range(1, trajectory.vehicle.wheels + 1)
    slip, force, sticks = trajectory.slip, trajectory.ground_force, trajectory.sticks
    columns = {
        "slip_axle": slip[..., 0], "slip_rolling": slip[..., 1], "force_axle": force[..., 0],
        "force_rolling": force[..., 1], "loss": trajectory.quantity("ground_loss"), "load": trajectory.ground_load,
        "sticks": None if sticks is None else sticks.astype(int),
    }  # fmt: skip
    columns = {name: column for name, column in columns.items() if column is not None}
    names = ["t", *(f"{name}_{i}" for name in columns for i in wheels)]
    _write_table(path, names, _rows([trajectory.t, *columns.values()]))


def _write_samples(parts: Iterable[Trajectory], times: np.ndarray, path: Path, instruments: Instruments | None) -> None:
    """The motion at the times, and what instruments read there. A time at which a part ends is that of the next one."""

    def of_parts() -> Iterator[dict[str, np.ndarray]]:
        before = None
        for part in parts:
            if before is not None:
                yield _samples(before, times[(before.t[0] <= times) & (times < part.t[0])], instruments)
            before = part
        yield _samples(before, times[before.t[0] <= times], instruments)

    found = of_parts()
    first = next(found)
    _write_table(path, tuple(first), (row for columns in chain([first], found) for row in _rows(columns.values())))


def _samples(trajectory: Trajectory, times: np.ndarray, instruments: Instruments | None) -> dict[str, np.ndarray]:
    """Columns by name."""
    samples = trajectory.sample(times)
    arrays = {"t": samples.t} | dict(zip(tables.POSE, samples.pose.T, strict=True))
    arrays |= {name: getattr(samples, name) for name in ("nu", "chi", "contact", "contact_spin", "energy")}
    if instruments is not None and len(times):
        arrays |= trajectory.measure(times, instruments)
    return tables.columns(arrays)


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
