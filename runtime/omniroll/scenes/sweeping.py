"""Scenes over numbers of their file: the runs of `omniroll sweep`.

An axis is a key of the scene and the values it has one after the other. Each combination is a scene as if the file said
so: it is read and checked like any other, so that what follows from the number (a layout, loads, a controller's gains)
follows here too.
"""

import copy
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.progress import Report
from omniroll.scenes.loading import Scene, scene_of
from omniroll.scenes.problems import nearest
from omniroll.scenes.reading import read
from omniroll.scenes.schema import TABLES
from omniroll.sweeps.ends import Many
from omniroll.sweeps.many import simulate_many

FIELD = "--vary"
FORM = "must be TABLE.KEY=FROM:TO:COUNT or TABLE.KEY=VALUE,VALUE,...; of a list TABLE.KEY.NUMBER, from 1"
PLACE = re.compile(r"([A-Za-z_]\w*)\.(\w+)(?:\.(\d+))?")
OF_RUNS = ("vehicle", "nu", "chi", "spins", "pose", "duration", "effects")  # what each run may have for itself
MOST_RUNS = 1_000_000


@dataclass(frozen=True)
class Axis:
    """A number of a scene's file that is varied.

    table, key  where it stands; entry is its number from 1 where the key has a list, else None
    values      (K,) in the key's unit
    """

    table: str
    key: str
    entry: int | None
    values: np.ndarray

    @property
    def name(self) -> str:
        """As it was named: vehicle.mass, start.nu.1."""
        return ".".join(filter(None, (self.table, self.key, self.entry and str(self.entry))))

    @property
    def unit(self) -> str:
        """Of the key, or of the entry where a list has units of its own for each; "" where it has none."""
        whole = TABLES[self.table].key(self.key).unit
        units = whole.split(", ")
        return units[self.entry - 1] if self.entry and len(units) > 1 else whole

    @classmethod
    def read(cls, text: str) -> "Axis":
        """The axis that `text` names, as in vehicle.mass=2:3:21. Raises InvalidValueError."""
        name, equals, given = text.partition("=")
        place = PLACE.fullmatch(name.strip())
        if not equals or place is None:
            raise InvalidValueError(FIELD, text, FORM)
        table, key, entry = place[1], place[2], place[3] and int(place[3])
        _check_known(text, table, key)
        if entry == 0:
            raise InvalidValueError(FIELD, text, "entries of a list count from 1")
        return cls(table, key, entry, _values(text, given))

    def put(self, tables: dict[str, Any], value: float) -> None:
        """Let the tables of a file say this value. Raises InvalidValueError where no list has such an entry."""
        content = tables.setdefault(self.table, {})
        whole = _whole(content.get(self.key), value)
        if self.entry is None:
            content[self.key] = whole
            return
        there = content.get(self.key)
        if not isinstance(there, list) or not self.entry <= len(there):
            raise InvalidValueError(FIELD, self.name, "the scene has no list there with so many entries")
        there[self.entry - 1] = whole


def _check_known(text: str, table: str, key: str) -> None:
    if table not in TABLES:
        close = nearest(table, TABLES)
        raise InvalidValueError(FIELD, text, f"no such table{f'; did you mean {close}?' if close else ''}")
    known = [entry.name for entry in TABLES[table].keys]
    if key not in known:
        close = nearest(key, known)
        raise InvalidValueError(FIELD, text, f"[{table}] has no such key{f'; did you mean {close}?' if close else ''}")


def _values(text: str, given: str) -> np.ndarray:
    try:
        if ":" in given:
            first, last, count = given.split(":")
            ends, count = [float(first), float(last)], int(count)
        else:
            ends = [float(value) for value in given.split(",")]
            count = len(ends)
    except ValueError:
        raise InvalidValueError(FIELD, text, FORM) from None
    if count < 1 or not np.isfinite(ends).all():
        raise InvalidValueError(FIELD, text, "must give at least one value, and finite ones")
    if count > MOST_RUNS:
        raise InvalidValueError(FIELD, text, f"must give at most {MOST_RUNS} values")
    return np.linspace(*ends, count) if ":" in given else np.array(ends)


def _whole(before: Any, value: float) -> float | int:
    """A whole number where the file has one, or nothing: a count stays a count."""
    return int(value) if float(value).is_integer() and (before is None or isinstance(before, int)) else float(value)


@dataclass(frozen=True)
class SceneSweep:
    """The scenes over all combinations of the axes, in C order.

    name    of the scene
    axes    Axes, each a leading axis of the results
    scenes  one for each combination
    """

    name: str
    axes: tuple[Axis, ...]
    scenes: tuple[Scene, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def along(self) -> dict[str, np.ndarray]:
        """The values of each axis by its name, as Many.to_pandas and to_xarray take them."""
        return {axis.name: axis.values for axis in self.axes}

    @classmethod
    def of(cls, path: str | PathLike, axes: Sequence[Axis]) -> "SceneSweep":
        """The scenes of a file over axes. Raises SceneError for a combination that is none, InvalidValueError."""
        path = validation.file_path("path", path)
        names, count = [axis.name for axis in axes], int(np.prod([len(axis.values) for axis in axes]))
        if not axes or len(set(names)) < len(names):
            raise InvalidValueError(FIELD, names, "must name at least one number, and each of them once")
        if count > MOST_RUNS:
            raise InvalidValueError(FIELD, names, f"makes {count} runs; must make at most {MOST_RUNS}")
        tables, lines = read(path)
        scenes = []
        for values in itertools.product(*(axis.values for axis in axes)):
            changed = copy.deepcopy(tables)
            for axis, value in zip(axes, values, strict=True):
                if isinstance(changed.get(axis.table, {}), dict):  # else the scene is refused for it
                    axis.put(changed, float(value))
            scenes.append(scene_of(path, changed, lines))
        return cls(scenes[0].name, tuple(axes), tuple(scenes))

    def run(self, progress: Report | None = None) -> Many:
        """All runs. Raises InvalidValueError for an axis that must be the same for all; else as simulate_many does."""
        options = [scene.options for scene in self.scenes]
        common = {name: value for name, value in options[0].items() if name not in OF_RUNS}
        for scene in options[1:]:
            differing = next((name for name in common if not scene.get(name) == common[name]), None)
            if differing:
                raise InvalidValueError(FIELD, differing, "must be the same for all runs of a sweep")
        own = {
            name: self._nested([scene.get(name, ()) for scene in options])
            for name in OF_RUNS[1:]
            if any(name in scene for scene in options)
        }
        vehicles = self._nested([scene.vehicle for scene in self.scenes])
        return simulate_many(vehicles, **own, **common, progress=progress)

    def _nested(self, values: list[Any]) -> list[Any]:
        """Lists in lists of the sweep's shape, as simulate_many takes them."""
        for size in reversed(self.shape[1:]):
            values = [values[k : k + size] for k in range(0, len(values), size)]
        return values
