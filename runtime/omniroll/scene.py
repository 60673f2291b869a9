"""Scenes: TOML files that say what there is. load_scene() reads one and names everything that is wrong in it.

[vehicle]    preset = "paper" (with wheels, rollers_per_wheel), or the fields of omniroll.Vehicle
[start]      nu in 1/s; chi in rad, spins in rad/s, pose in m, m, rad
[run]        duration in s; accuracy, engine, start_time in s
[rollers]    model = "massless", "locked" or "free"
[switching]  law = "smooth" or "impact"
"""

import difflib
import tomllib
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

from omniroll.errors import InvalidValueError, OmnirollError
from omniroll.simulate import checked_task, simulate
from omniroll.trajectory import Trajectory
from omniroll.vehicle import Vehicle

MOST_BYTES = 1_000_000
KEYS = {
    "vehicle": ("preset", *(entry.name for entry in fields(Vehicle) if entry.name != "_")),
    "start": ("nu", "chi", "spins", "pose"),
    "run": ("duration", "accuracy", "engine", "start_time"),
    "rollers": ("model",),
    "switching": ("law",),
}
NEEDED = {"vehicle": (), "start": ("nu",), "run": ("duration",)}
RENAMED = {("rollers", "model"): "roller_model", ("switching", "law"): "switching"}
PRESETS = ("paper",)


class SceneError(OmnirollError):
    """A scene that makes no sense; `problems` has one line for each thing that is wrong."""

    def __init__(self, path: Any, problems: list[str]):
        super().__init__("\n".join(f"{path}: {problem}" for problem in problems))
        self.path, self.problems = str(path), problems

    def __reduce__(self):
        return type(self), (self.path, self.problems)


@dataclass(frozen=True)
class Scene:
    """A scene that has been read: a vehicle, and the other arguments of omniroll.simulate."""

    name: str
    vehicle: Vehicle
    options: dict[str, Any] = field(default_factory=dict)


def load_scene(path: str | PathLike) -> Scene:
    """Read a scene file. Raises SceneError, which names all that is wrong."""
    tables = _read(path)
    problems = _unknown(tables) + _missing(tables)
    if problems:
        raise SceneError(path, problems)
    vehicle, problems = _vehicle(tables["vehicle"])
    options = {
        RENAMED.get((table, key), key): value
        for table in KEYS
        if table != "vehicle"
        for key, value in tables.get(table, {}).items()
    }
    if vehicle is not None:
        problems += _refused(vehicle, options)
    if problems:
        raise SceneError(path, problems)
    return Scene(Path(path).stem, vehicle, options)


def run(scene: Scene, **changes: Any) -> Trajectory:
    """Simulate a scene; `changes` are arguments of omniroll.simulate that replace the scene's."""
    return simulate(scene.vehicle, **scene.options | changes)


def _read(path: str | PathLike) -> dict[str, Any]:
    try:
        with open(path, "rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise SceneError(path, [error.strerror or str(error)]) from None
    if len(raw) > MOST_BYTES:
        raise SceneError(path, [f"longer than {MOST_BYTES} bytes, which no scene is"])
    try:
        return tomllib.loads(raw.decode())
    except UnicodeDecodeError as error:
        raise SceneError(path, [f"byte {error.start} is not UTF-8 text"]) from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SceneError(path, [f"not TOML: {error}"]) from None


def _unknown(tables: dict[str, Any]) -> list[str]:
    problems = []
    for table, content in tables.items():
        if table not in KEYS:
            problems.append(f"[{table}]: no such table{_nearest(table, KEYS)}")
        elif not isinstance(content, dict):
            problems.append(f"{table} = {content!r}: must be a table, [{table}]")
        else:
            problems += [
                f"[{table}] {key} = {value!r}: no such key{_nearest(key, KEYS[table])}"
                for key, value in content.items()
                if key not in KEYS[table]
            ]
    return problems


def _nearest(name: str, known: Any) -> str:
    found = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"; did you mean {found[0]}?" if found else f"; there are {', '.join(known)}"


def _missing(tables: dict[str, Any]) -> list[str]:
    problems = []
    for table, keys in NEEDED.items():
        content = tables.get(table)
        if content is None:
            problems.append(f"[{table}]: is missing")
        elif isinstance(content, dict):
            problems += [f"[{table}] {key}: is missing" for key in keys if key not in content]
    return problems


def _vehicle(content: dict[str, Any]) -> tuple[Vehicle | None, list[str]]:
    numbers = dict(content)
    preset = numbers.pop("preset", None)
    try:
        if preset is None:
            return Vehicle(**numbers), []
        if preset not in PRESETS:
            return None, [f"[vehicle] preset = {preset!r}: must be one of {', '.join(PRESETS)}"]
        sizes = {key: numbers.pop(key) for key in ("wheels", "rollers_per_wheel") if key in numbers}
        vehicle = Vehicle.paper(**sizes)
        return (vehicle.replace(**numbers) if numbers else vehicle), []
    except InvalidValueError as error:
        return None, [f"[vehicle] {error}"]
    except TypeError as error:  # a field that is not there
        return None, [f"[vehicle]: {str(error).partition(') ')[2] or error}"]


def _refused(vehicle: Vehicle, options: dict[str, Any]) -> list[str]:
    """What simulate would refuse, each argument by itself so that all are named at once."""
    harmless = {"nu": (0, 0, 0), "duration": 0}
    options = dict(options)
    engine = options.pop("engine", None)
    problems = [] if engine is None else _complaint(vehicle, harmless | {"engine": engine})
    for name, value in options.items():
        alone = harmless | {name: value}
        if name == "spins":
            alone |= {"roller_model": "free"}
        problems += _complaint(vehicle, alone)
    return problems or _complaint(vehicle, options)


def _complaint(vehicle: Vehicle, arguments: dict[str, Any]) -> list[str]:
    try:
        checked_task(vehicle, **arguments)
    except InvalidValueError as error:
        back = {code: f"[{table}] {key}" for (table, key), code in RENAMED.items()}
        place = back.get(error.field) or next(
            (f"[{table}] {error.field}" for table, keys in KEYS.items() if error.field in keys), error.field
        )
        return [f"{place} = {error.value!r}: {error.bound}"]
    return []
