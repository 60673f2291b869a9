"""Scene files read, checked and run."""

from dataclasses import dataclass, field, replace
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.runs import MEMORY
from omniroll.engine.simulate import checked_task, one_run, simulate
from omniroll.errors import InvalidValueError
from omniroll.results.measurements import Instruments
from omniroll.results.reactions import Reactions, judged_reactions
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.acting import check_together, effects_of, with_layout
from omniroll.scenes.checking import Findings, checked_tables, sizes
from omniroll.scenes.lints_of_angles import of_degrees
from omniroll.scenes.logs import replay_logs
from omniroll.scenes.problems import SceneError, shown
from omniroll.scenes.reading import Lines, read
from omniroll.scenes.schema import keys
from omniroll.scenes.speeds import speeds_as_nu
from omniroll.scenes.vehicles import vehicle_of
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INSTRUMENTS, KINDS_OF_ERROR, WITH_ERRORS

ONE_ROW = {"rows": 1, "row_offset": 0.0}  # of a vehicle
OPTIONS = {  # argument of simulate: the table and key that it comes from
    "nu": ("start", "nu"),
    "chi": ("start", "chi"),
    "spins": ("start", "spins"),
    "pose": ("start", "pose"),
    "duration": ("run", "duration"),
    "accuracy": ("run", "accuracy"),
    "engine": ("run", "engine"),
    "memory": ("run", "memory"),
    "start_time": ("run", "start_time"),
    "roller_model": ("rollers", "model"),
    "switching": ("switching", "law"),
}
CHANGES = tuple(name for name in signature(simulate).parameters if name != "vehicle")
MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Scene:
    """A scene that has been read.

    name     the file's name without its ending, or with it where nothing but dots stand before it
    vehicle  the vehicle
    options  the other arguments of omniroll.simulate
    tables   the file's tables, checked, as plain data
    said     what is worth saying of logs and speeds: table, key and a sentence
    """

    name: str
    vehicle: Vehicle
    options: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, dict[str, Any]] = field(default_factory=dict)
    said: tuple[tuple[str, str, str], ...] = ()

    @property
    def title(self) -> str:
        """The name as every page and picture can show it: bytes of a file's name that are no text are escaped."""
        return self.name.encode("utf-8", "backslashreplace").decode("utf-8")

    @property
    def slips(self) -> bool:
        """Whether its wheels may slip."""
        return "contact" in self.tables

    def doubts(self) -> tuple[UserWarning, ...]:
        """What is allowed in its effects and yet looks wrong, as simulate warns of it."""
        return EffectSet.checked(self.options.get("effects", ()), self.vehicle).doubts(self.vehicle)

    def instruments(self) -> Instruments | None:
        """The instruments that the scene asks for, or None."""
        if "measurements" not in self.tables:
            return None
        return _instruments(self.tables["measurements"])

    def sample_times(self, end: float) -> np.ndarray | None:
        """The times (K,) in s up to `end`, in s, at which the scene asks for samples; None where it asks for none."""
        run_table = self.tables.get("run", {})
        if "times" in run_table:
            times = np.array(run_table["times"], float)
        elif "step" in run_table:
            start = run_table.get("start_time", 0)
            times = start + run_table["step"] * np.arange(_sample_intervals(run_table) + 1)
        else:
            return None
        return times[times <= end]


def _instruments(given: dict[str, Any]) -> Instruments:
    plain = {entry.name: given[entry.name] for entry in INSTRUMENTS if entry.name in given}
    errors = {
        error: {name: given[f"{name}_{error}"] for name in WITH_ERRORS if f"{name}_{error}" in given}
        for error in KINDS_OF_ERROR
    }
    return Instruments(**plain, **errors)


def load_scene(path: str | PathLike) -> Scene:
    """Read a scene file; docs/scenes.md says what it holds.

    path  of the TOML file, str or path

    Raises SceneError, which names all that is wrong in the file, each with its line; InvalidValueError for what is no
    path.
    """
    path = validation.file_path("path", path)
    return scene_of(path, *read(path))


def scene_of(path: Path, tables: dict[str, Any], lines: Lines) -> Scene:
    """The scene that a file's tables describe. Raises SceneError as load_scene does.

    path   of the file, which messages name; logs are beside it
    lines  those of the tables' keys
    """
    findings = Findings(lines)
    tables = checked_tables(tables, findings)
    vehicle = vehicle_of(tables["vehicle"], findings) if "vehicle" in tables else None
    _check_samples(tables.get("run", {}), findings)
    _check_memory(tables.get("run", {}), findings)
    if "measurements" in tables:
        _check_instruments(tables, findings)
    said = replay_logs(tables, path.parent, findings)
    whole = vehicle
    if vehicle is not None and vehicle.rows > 1 and any(vehicle.roller_angle):  # no motion: what else the scene says is
        vehicle = vehicle.replace(**ONE_ROW)  # checked all the same
    said += speeds_as_nu(tables, vehicle, findings)
    options = {
        argument: tables[table][key] for argument, (table, key) in OPTIONS.items() if key in tables.get(table, {})
    }
    effects = effects_of(tables, findings)
    if whole is not None:
        placed = with_layout(whole, tables, findings)
        whole, vehicle = placed, placed if vehicle is whole else placed.replace(**ONE_ROW)
    stand_in = vehicle or _stand_in(tables.get("vehicle", {}), findings.keys_in("vehicle"))
    if stand_in is not None:
        check_together(effects, stand_in, findings)
        _check_options(stand_in, options, findings)
    if effects:
        options["effects"] = tuple(effects.values())
    if not findings.problems:
        _check_whole(vehicle, options, tables, findings)
    if findings.problems:
        for lint in of_degrees(vehicle, tables) if vehicle is not None else ():  # what else is wrong may follow from it
            findings.add(lint.table, lint.key, lint.text)
            findings.problems.insert(0, findings.problems.pop())
        raise SceneError(path, findings.problems)
    return Scene(_name(path), whole, options, tables, tuple(said))


def _name(path: Path) -> str:
    """The name of a scene, which may be that of a folder: not "." or ".."."""
    return path.stem if path.stem.strip(".") else path.name


def run(scene: Scene, **changes: Any) -> Trajectory:
    """Simulate a scene.

    scene    Scene, as load_scene gives it
    changes  arguments of omniroll.simulate that replace the scene's, all but the vehicle

    Raises InvalidValueError for what is no scene and for other arguments; raises and warns as omniroll.simulate does.
    """
    if not isinstance(scene, Scene):
        raise InvalidValueError("scene", scene, "must be a Scene, as omniroll.load_scene gives it")
    validation.known(changes, CHANGES, "run")
    return simulate(scene.vehicle, **scene.options | changes)


def reactions_of(trajectory: Trajectory, arguments: dict[str, Any]) -> tuple[Reactions, list[str]]:
    """The reactions that [reactions] asks for, and the warnings that come with them."""
    reactions = judged_reactions(trajectory, **arguments)
    return reactions, [str(warning) for warning in reactions.warnings()]


def _sample_intervals(run_table: dict[str, Any]) -> int:
    return int(np.floor(run_table["duration"] / run_table["step"] * (1 + 1e-12)))


def _check_samples(run_table: dict[str, Any], findings: Findings) -> None:
    if "step" in run_table and "times" in run_table:
        findings.add("run", "step", "cannot stand beside times", shown(run_table["step"]))
    if "duration" not in run_table:
        return
    start = run_table.get("start_time", 0)
    end = start + run_table["duration"]
    if "times" in run_table and not start <= run_table["times"][0] <= run_table["times"][-1] <= end:
        findings.add("run", "times", f"must lie within the run, {start!r} to {end!r} s", shown(run_table["times"]))
    if "step" in run_table and run_table["duration"] / run_table["step"] > MOST_SAMPLES:
        findings.add("run", "step", f"must leave at most {MOST_SAMPLES} samples of the run", shown(run_table["step"]))


def _check_memory(run_table: dict[str, Any], findings: Findings) -> None:
    """A scene may come from somebody else: it lowers the bound, and its caller alone raises it."""
    if run_table.get("memory", 0) > MEMORY:
        bound = f"must be at most {MEMORY:.0f} in a scene; who runs it may give more: omniroll run --memory"
        findings.add("run", "memory", bound, shown(run_table["memory"]))


def _stand_in(vehicle_table: dict[str, Any], wrong: set[str | None]) -> Vehicle | None:
    """A vehicle of as many wheels and rollers as the one that could not be made, to check the start with.

    wrong  keys of the table that are not good
    """
    known = sizes(vehicle_table)
    if "N" not in known or known.get("n-1", 0) < 3:
        return None
    found = Vehicle.paper(known["N"], known["n-1"] + 1)
    if {"meridian_radius", "roller_profile"} & (wrong | set(vehicle_table)):
        return found.replace(meridian_radius=found.wheel_radius - found.roller_axis_radius)
    return found


def _check_instruments(tables: dict[str, Any], findings: Findings) -> None:
    if not {"step", "times"} & set(tables.get("run", {})):
        findings.add("measurements", None, "needs [run] step or times, at which instruments are read")
    if not findings.keys_in("measurements"):
        try:
            _instruments(tables["measurements"])
        except InvalidValueError as error:
            findings.add("measurements", error.field, error.bound, shown(error.value))


def _check_options(vehicle: Vehicle, options: dict[str, Any], findings: Findings) -> None:
    """What simulate would refuse of each argument by itself, so that all are named at once."""
    harmless = {"nu": (0, 0, 0), "duration": 0}
    for name, value in options.items():
        alone = harmless | {name: value}
        if name == "spins":
            alone |= {"roller_model": "free"}
        try:
            checked_task(vehicle, **alone)
        except InvalidValueError as error:
            findings.add(*OPTIONS[name], error.bound, shown(error.value))


def _check_whole(vehicle: Vehicle, options: dict[str, Any], tables: dict[str, Any], findings: Findings) -> None:
    """What the vehicle, the start and the effects refuse only together; the reactions by those at the start."""
    asked = ""  # the table that asks for what is refused
    try:
        task = checked_task(vehicle, **options)
        asked = "reactions"
        if asked in tables:
            reactions_of(one_run(replace(task, duration=0.0), task.accuracy), tables[asked])
    except InvalidValueError as error:
        table, key = _place(error, tables, asked)
        findings.add(table, key, error.bound, None if key is None else shown(error.value))


def _place(error: InvalidValueError, tables: dict[str, Any], asked: str) -> tuple[str, str | None]:
    """The table and key that an argument comes from; `asked` where that table has such a key. Without a key where it is
    the table as a whole that is refused."""
    name = error.field
    if name in OPTIONS:
        return OPTIONS[name]
    if name == "trajectory" and asked:
        return asked, None
    if name == "effects":
        refused = [table for table in tables if str(error.value).lower().startswith(table)]
        return next(iter(refused), "vehicle"), None if refused else name
    written = [table for table, content in tables.items() if name in content]
    known = [table.name for table, key in keys() if key.name == name and table.name in tables]
    return next(iter([asked] * (asked in known) + written + known), "vehicle"), name
