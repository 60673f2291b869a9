"""Logs: what instruments on a robot have read over time, from files, arrays or data frames."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.conventions import units
from omniroll.conventions.bags import is_bag
from omniroll.conventions.log_files import LogTable, read_table
from omniroll.errors import InvalidValueError, LogError
from omniroll.vocabulary import MEASUREMENTS, STATE, TORQUE, by_name

TIME = "t"
WITHOUT = ("odometry", "tracking_odometry", "contact_roller")  # readings that no model is fitted to
ENTRIES = {name: entry for name, entry in by_name(MEASUREMENTS).items() if name not in WITHOUT}
ENTRIES["pose"] = by_name(STATE)["pose"]  # of a tracker outside
HEADER = re.compile(r"\s*([A-Za-z_]+?)(?:_(\d+))?\s*(?:[\[(]\s*(.*?)\s*[\])])?\s*")
DRIVES = ("motor_voltage", "motor_current", "net_torque", "torque")
DRIVE_ONLY = by_name((TORQUE,))  # what drives, and is no reading
NO_SUCH = f"no such reading; there are {TIME}, "
GAP = 10.0  # steps of the usual length that may be missing in a row
ODD_STEPS = {"ms": (1.0, np.inf), "s": (0.0, 2e-5)}  # s, usual steps between rows that look like a clock in that unit
MANY = 50  # rows from which on they do
ALIASES = {  # readings by the ends of names of ROS's messages
    "angular_velocity.z": "gyro",
    "linear_acceleration.x": "accelerometer_1",
    "linear_acceleration.y": "accelerometer_2",
}
POSE = ("pose.position.x", "pose.position.y", "pose.orientation.z", "pose.orientation.w")  # of a tracker or odometry


@dataclass(frozen=True, eq=False)
class Log:
    """What was read at T times.

    data     mapping of columns, for instance a dict of arrays or a data frame: "t" (T,) in s on the clock of the run,
             and readings by the names of omniroll.vocabulary.MEASUREMENTS, or "pose": as arrays (T, ...), or as columns
             "wheel_rate_1", "wheel_rate_2", ... from 1 on. Of each reading all columns must be there. Of a data frame
             "t" may be the index, and its attrs["units"] say the units of columns
    noise    standard deviation of the noise of a reading by its name, in its unit; that of the scene's instruments, or
             what the fit leaves over, where it is not given
    start    arguments of omniroll.simulate that hold for this log alone, such as nu, chi, pose and effects
    drive    reading that drives the model in the place of the scene's drive, and that is not fitted: "motor_voltage" or
             "motor_current" of a scene with a Motor; "torque", at the axles; "net_torque", which stands for drive and
             bearings together; or None
    name     for messages
    gap      times of the usual step that may lie between two rows
    lines    of a file, in which the rows stand; None of arrays
    line_of_names  of a file
    said     what was recognised in a file, in sentences; conversions of units are added
    readings  names of the readings that are taken beside `drive`; other columns are left alone. None: all are readings

    Raises LogError, an InvalidValueError with row and column: for names that are not known, times that do not
    increase, gaps, and numbers that are not finite.
    """

    data: Any
    noise: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)
    drive: str | None = None
    name: str = "log"
    gap: float = GAP
    lines: Sequence[int] | None = None
    readings: Sequence[str] | None = None
    line_of_names: int | None = None
    said: Sequence[str] = ()

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("name", validation.text("name", self.name))
        put("gap", validation.positive("gap", self.gap))
        noise = validation.mapping("noise", self.noise)
        put("noise", {name: self._deviation(name, value) for name, value in noise.items()})
        put("start", validation.mapping("start", self.start))
        if "start_time" in self.start:
            validation.real("start_time", self.start["start_time"])
        if self.lines is not None:
            put("lines", tuple(validation.sequence("lines", self.lines, "must be lines of a file")))
        put("said", validation.sequence("said", self.said, "must be sentences"))
        if self.readings is not None:
            chosen = validation.sequence("readings", self.readings, "must be a sequence of names of readings")
            put("readings", tuple(validation.choice("readings", name, tuple(ENTRIES)) for name in chosen))
        if self.drive is not None:
            validation.choice("drive", self.drive, DRIVES)
        put("data", self._checked(self._chosen(columns_of(self.data))))
        if self.drive is not None:
            validation.choice("drive", self.drive, tuple(name for name in DRIVES if name in self.data))

    @classmethod
    def read(cls, path: str | PathLike, columns: Mapping[str, str] | None = None, **others: Any) -> "Log":
        """A log from a file.

        path     of the file: CSV or other text, whose names may have units in brackets behind them; Parquet, which
                 needs the extra `tables`; or a bag of ROS, which needs the extra `bags`
        columns  names of the file's columns by the names that they shall have: {"time": "clock", "gyro": "imu/z"}
        others   noise, start, drive, gap and readings as of a Log

        Of rows of one time the last holds, and times since 1970 begin at 0; `said` tells what was recognised. Where
        `columns` is given, and of a bag, other columns are left alone.

        Raises LogError with line and column; OSError where the file cannot be read; MissingPackageError.
        """
        table = read_table(path, columns)
        found, said = _readings_of(table), list(table.said)
        leaves = columns or is_bag(Path(path)) or others.get("readings") is not None
        wanted = {title: name for title, name in found.items() if _known(title) or not leaves}
        for title in wanted:
            if not _known(title):
                bound = f"{NO_SUCH}{', '.join(ENTRIES)}; `readings` leaves other columns alone"
                raise LogError(table.name, table.line_of_names, title, None, bound)
        data: dict[str, Any] = {TIME: table.times}
        chosen = others.get("readings")
        for title, name in wanted.items():
            if chosen is None or _name_of(title) in (others.get("drive"), *chosen):
                unit = table.units.get(name)
                data[title if unit is None else f"{title} [{unit}]"] = table.numbers(name)
        if chosen is None and (pose := _pose(table)) is not None:
            data["pose"] = pose
        return cls(
            data, name=table.name, lines=tuple(table.lines), line_of_names=table.line_of_names, said=said, **others
        )

    @property
    def t(self) -> np.ndarray:
        """(T,) the times in s."""
        return self.data[TIME]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the readings, in the order of the columns."""
        return tuple(name for name in self.data if name != TIME)

    @property
    def fitted(self) -> tuple[str, ...]:
        """Names of the readings that a model is fitted to."""
        return tuple(name for name in self.channels if name != self.drive)

    def beginning(self, rows: int) -> "Log":
        """The log's first rows, as a log.

        rows  how many, at least 2; all where there are no more

        Raises InvalidValueError.
        """
        rows = validation.integer("rows", rows, 2)
        lines = None if self.lines is None else self.lines[:rows]
        return replace(self, data={name: values[:rows] for name, values in self.data.items()}, lines=lines)

    def _deviation(self, name: str, value: Any) -> float:
        validation.choice("noise", name, tuple(ENTRIES))
        return validation.positive(f"noise of {name}", value)

    def _chosen(self, given: dict[str, Any]) -> dict[str, Any]:
        """The columns that are taken."""
        if self.readings is None:
            return given
        wanted = (TIME, self.drive, *self.readings)
        return {column: values for column, values in given.items() if _name_of(column) in wanted}

    def _checked(self, given: dict[str, Any]) -> dict[str, np.ndarray]:
        parts: dict[str, dict[int, np.ndarray]] = {}
        for column, values in given.items():
            name, place = self._place(column)
            parts.setdefault(name, {})[place] = self._finite(column, values) * self._factor(column, name)
        if TIME not in parts:
            raise LogError(self.name, self.line(-1), TIME, None, "is missing: times in s")
        data = {name: self._together(name, columns) for name, columns in parts.items()}
        self._check_times(data[TIME])
        for name, values in data.items():
            if len(values) != len(data[TIME]):
                bound = f"must have {len(data[TIME])} rows, as t"
                raise LogError(self.name, None, name, len(values), bound)
        if self.drive == "motor_current" and data.pop("motor_voltage", None) is not None:
            self.said.append("motor_voltage is left alone: the currents drive the model, whatever they take")
        if len(data) < 2:
            bound = (
                f"has no reading; there are {', '.join(ENTRIES)}. "
                "`columns` (--columns gyro=...) names columns that are called otherwise"
            )
            raise LogError(self.name, None, None, None, bound)
        return data

    def _place(self, column: str) -> tuple[str, int]:
        """Name of the reading, and which of its columns, from 1; 0 where it is all of it."""
        match = HEADER.fullmatch(column)
        name = match[1] if match else column
        if name in DRIVE_ONLY and self.drive != name:
            bound = f"drives the model: drive (--drive) must be {name!r}"
            raise LogError(self.name, self.line(-1), column, None, bound)
        if match is None or name not in (TIME, *ENTRIES, *DRIVE_ONLY):
            bound = f"{NO_SUCH}{', '.join(ENTRIES)}; `readings` leaves other columns alone"
            raise LogError(self.name, self.line(-1), column, None, bound)
        return name, int(match[2] or 0)

    def _factor(self, column: str, name: str) -> float:
        """What turns a column into the unit of its reading."""
        unit = "s" if name == TIME else (ENTRIES | DRIVE_ONLY)[name].unit
        given = HEADER.fullmatch(column)[3]
        factor = 1.0 if given is None else units.factor(given, unit)
        if factor is None:
            raise LogError(self.name, self.line(-1), column, None, f"must be in {unit}")
        if factor != 1:
            self.said.append(f"{column}: times {factor:.9g}, in {unit}")
        return factor

    def _finite(self, column: str, values: Any) -> np.ndarray:
        try:
            raw = np.asarray(values)
        except Exception:  # rows of several lengths, or an object whose own code fails
            raw = np.array(None)
        if raw.dtype.kind not in "iuf":
            raise LogError(self.name, None, column, None, "must be numbers")
        array = raw.astype(float)
        if array.ndim == 0 or not array.size:
            raise LogError(self.name, None, column, None, "must have a number for each time")
        wrong = np.argwhere(~np.isfinite(array))
        if len(wrong):
            row = int(wrong[0][0])
            raise LogError(self.name, self.line(row), column, float(array[tuple(wrong[0])]), "must be finite")
        return array

    def _together(self, name: str, columns: dict[int, np.ndarray]) -> np.ndarray:
        if 0 in columns:
            if len(columns) > 1:
                raise LogError(self.name, self.line(-1), name, None, "stands there as a whole and in columns")
            return columns[0]
        missing = sorted(set(range(1, max(columns) + 1)) - set(columns))
        if missing:
            raise LogError(self.name, self.line(-1), f"{name}_{missing[0]}", None, "is missing, others are there")
        return np.stack([columns[place] for place in sorted(columns)], axis=1)

    def _check_times(self, t: np.ndarray) -> None:
        if t.ndim != 1 or len(t) < 2:
            raise LogError(self.name, None, TIME, t.shape, "must be two times or more in one column")
        steps = np.diff(t)
        back = np.flatnonzero(steps <= 0)
        if len(back):
            row = int(back[0]) + 1
            raise LogError(self.name, self.line(row), TIME, float(t[row]), f"must come after {float(t[row - 1])!r}")
        usual = float(np.median(steps))
        for unit, (least, most) in ODD_STEPS.items():
            if len(t) >= MANY and least <= usual <= most:
                said = f"rows are {usual:.3g} s apart; is the clock in {unit}? {TIME} [{unit}] says so"
                self.said.append(f"{TIME}: {said}")
        wide = np.flatnonzero(steps > self.gap * usual)
        if len(wide):
            row = int(wide[0]) + 1
            bound = (
                f"comes {steps[row - 1]:.6g} s after the row before, where {usual:.6g} s are usual: cut the log there"
            )
            raise LogError(self.name, self.line(row), TIME, float(t[row]), f"{bound}, or give a larger gap")

    def line(self, row: int) -> int | None:
        """The line of a file, or the row of arrays; -1 stands for the line of names, which arrays do not have."""
        row = validation.integer("row", row, -1)
        if self.lines is None:
            return row if row >= 0 else None
        return self.lines[row] if row >= 0 else self.line_of_names


def columns_of(data: Any) -> dict[str, Any]:
    """The columns of a mapping by name; of a data frame with its index and its units. Raises InvalidValueError."""
    try:
        found = {str(name): data[name] for name in data.keys()}
        frame_index, units = getattr(data, "index", None), getattr(data, "attrs", {}).get("units", {})
    except Exception:  # whatever an object that is none raises
        raise InvalidValueError("data", data, "must be a dict of arrays, or another mapping of columns") from None
    if len(found) < len(data.keys()):
        raise InvalidValueError("data", list(data.keys()), "must have each column once")
    if TIME not in found and getattr(frame_index, "name", None) == TIME:
        found = {TIME: frame_index} | found
    return {f"{name} [{units[name]}]" if name in units else name: values for name, values in found.items()}


def _readings_of(table: LogTable) -> dict[str, str]:
    """Columns of a file by the names of readings; those of ROS's messages by their ends."""
    found = {}
    for name in table.columns:
        plain = name.replace("/", ".")
        end = next((end for end in ALIASES if plain == end or plain.endswith("." + end)), None)
        title = ALIASES[end] if end else plain.rsplit(".", 1)[-1]
        found[name if title in found or not _known(title) else title] = name
    return found


def _pose(table: LogTable) -> np.ndarray | None:
    """(T, 3) of the first topic that has positions and quaternions; None where there is none."""
    for name in table.columns:
        if name.replace("/", ".").endswith(POSE[0]):
            before = name[: -len(POSE[0])]
            around = {column.replace("/", "."): column for column in table.columns}
            ends = [around.get(before.replace("/", ".") + end) for end in POSE]
            if None not in ends:
                x, y, z, w = (table.numbers(column) for column in ends)
                return np.stack([x, y, np.unwrap(2 * np.arctan2(z, w))], axis=1)
    return None


def _known(column: str) -> bool:
    return _name_of(column) in ENTRIES or _name_of(column) in DRIVE_ONLY


def _name_of(column: str) -> str:
    match = HEADER.fullmatch(column)
    return match[1] if match else column
