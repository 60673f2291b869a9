"""Logs: what instruments on a robot have read over time, from CSV and Parquet files, arrays or data frames."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import extras, validation
from omniroll.errors import InvalidValueError, LogError
from omniroll.results.tables import EXTRA
from omniroll.vocabulary import MEASUREMENTS, STATE, by_name

TIME = "t"
WITHOUT = ("odometry", "contact_roller")  # readings that no model is fitted to
ENTRIES = {name: entry for name, entry in by_name(MEASUREMENTS).items() if name not in WITHOUT}
ENTRIES["pose"] = by_name(STATE)["pose"]  # of a tracker outside
HEADER = re.compile(r"\s*([A-Za-z_]+?)(?:_(\d+))?\s*(?:[\[(]\s*(.*?)\s*[\])])?\s*")
DRIVES = ("motor_voltage", "net_torque")
GAP = 10.0  # steps of the usual length that may be missing in a row
PARQUET = (".parquet", ".pq")  # ends of the names of such files
OTHER_UNITS = {  # a reading in the unit of the first column, times the number, is one in that of the second
    ("deg/s", "rad/s"): np.pi / 180,
    ("rpm", "rad/s"): np.pi / 30,
    ("turns/s", "rad/s"): 2 * np.pi,
    ("deg", "rad"): np.pi / 180,
    ("ms", "s"): 1e-3,
    ("us", "s"): 1e-6,
    ("mA", "A"): 1e-3,
    ("mV", "V"): 1e-3,
    ("g", "m/s^2"): 9.80665,
    ("mm/s^2", "m/s^2"): 1e-3,
    ("mN m", "N m"): 1e-3,
}


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
    drive    reading that drives the model in the place of the scene's drive, and that is not fitted: "motor_voltage" of
             a scene with a Motor, or "net_torque", which stands for drive and bearings together; or None
    name     for messages
    gap      times of the usual step that may lie between two rows
    first_line  of a file, in which the first row stands; None of arrays
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
    first_line: int | None = None  # of the rows in a file
    readings: Sequence[str] | None = None

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
        if self.first_line is not None:
            put("first_line", validation.integer("first_line", self.first_line, 1))
        if self.readings is not None:
            chosen = validation.sequence("readings", self.readings, "must be a sequence of names of readings")
            put("readings", tuple(validation.choice("readings", name, tuple(ENTRIES)) for name in chosen))
        put("data", self._checked(self._chosen(columns_of(self.data))))
        if self.drive is not None:
            validation.choice("drive", self.drive, tuple(name for name in DRIVES if name in self.data))

    @classmethod
    def read(cls, path: str | PathLike, **others: Any) -> "Log":
        """A log from a CSV file: a line of names, behind which units may stand in brackets, then a line for each time.

        path    of the file; one whose name ends with .parquet holds a data frame, and needs the extra `tables`
        others  noise, start, drive, gap and readings as of a Log

        Raises LogError with line and column; OSError where the file cannot be read; MissingPackageError.
        """
        path = validation.file_path("path", path)
        if path.suffix.lower() in PARQUET:
            return cls(_frame(path), name=path.name, **others)
        try:
            with open(path, newline="", encoding="utf-8-sig") as file:
                lines = [(reader.line_num, row) for reader in [csv.reader(file)] for row in reader if row]
        except (UnicodeDecodeError, csv.Error) as error:
            raise LogError(path.name, None, None, None, f"must be a CSV file: {error}") from None
        if len(lines) < 2:
            raise LogError(path.name, None, None, None, "must have a line of names and lines of numbers")
        (_, names), *rows = lines
        columns: dict[str, list[float]] = {name.strip(): [] for name in names}
        if len(columns) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise LogError(path.name, 1, twice, None, "stands there twice")
        for line, row in rows:
            if len(row) != len(names):
                raise LogError(path.name, line, None, len(row), f"numbers; the line of names has {len(names)}")
            for name, text in zip(columns, row, strict=True):
                columns[name].append(_number(path.name, line, name, text))
        return cls(columns, name=path.name, first_line=rows[0][0], **others)

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
        return replace(self, data={name: values[:rows] for name, values in self.data.items()})

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
            parts.setdefault(name, {})[place] = self._finite(column, values)
        if TIME not in parts:
            raise LogError(self.name, self.line(-1), TIME, None, "is missing: times in s")
        data = {name: self._together(name, columns) for name, columns in parts.items()}
        self._check_times(data[TIME])
        for name, values in data.items():
            if len(values) != len(data[TIME]):
                bound = f"must have {len(data[TIME])} rows, as t"
                raise LogError(self.name, None, name, len(values), bound)
        if len(data) < 2:
            raise LogError(self.name, None, None, None, f"has no reading; there are {', '.join(ENTRIES)}")
        return data

    def _place(self, column: str) -> tuple[str, int]:
        """Name of the reading, and which of its columns, from 1; 0 where it is all of it. Checks the unit."""
        match = HEADER.fullmatch(column)
        name = match[1] if match else column
        if match is None or name not in (TIME, *ENTRIES):
            bound = f"no such reading; there are {TIME}, {', '.join(ENTRIES)}; `readings` leaves other columns alone"
            raise LogError(self.name, self.line(-1), column, None, bound)
        unit = "s" if name == TIME else ENTRIES[name].unit
        if match[3] not in (None, unit):
            factor = OTHER_UNITS.get((match[3], unit))
            bound = f"must be in {unit}" + (f": multiply by {factor:.9g}" if factor else "")
            raise LogError(self.name, self.line(-1), column, None, bound)
        return name, int(match[2] or 0)

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
        if self.first_line is None:
            return row if row >= 0 else None
        return self.first_line + row if row >= 0 else 1


def suspected_unit(unit: str, ratio: float) -> str | None:
    """The unit that readings seem to have which are `ratio` times what they should be; None where none is near."""
    for (other, wanted), factor in OTHER_UNITS.items():
        if wanted == unit and ratio > 0 and abs(np.log(ratio * factor)) < 0.2:
            return other
    return None


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


def _frame(path: Path) -> Any:
    """The data frame that a Parquet file holds. Raises LogError, MissingPackageError, OSError."""
    extras.needed("pyarrow", EXTRA, f"a log in a file {path.suffix}")
    pandas = extras.needed("pandas", EXTRA, f"a log in a file {path.suffix}")
    try:
        return pandas.read_parquet(path)
    except OSError:
        raise
    except ValueError as error:  # pyarrow's error of files of other kinds
        raise LogError(path.name, None, None, None, f"must be a Parquet file: {error}") from None


def _name_of(column: str) -> str:
    match = HEADER.fullmatch(column)
    return match[1] if match else column


def _number(path: str, line: int, column: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        bound = "must be a number" if text.strip() else "is empty: each line must have a number in each column"
        raise LogError(path, line, column, text, bound) from None
