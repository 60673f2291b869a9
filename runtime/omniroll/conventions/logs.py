"""Logs of commands: CSV files with a line of names, a column of times, and commands."""

import csv
import re
from dataclasses import dataclass
from os import PathLike

import numpy as np

from omniroll import validation
from omniroll.errors import InvalidValueError

MOST_BYTES = 50_000_000
TIMES = ("t", "time", "stamp")
TWISTS = (  # names that logs give to vx, vy and wz
    ("vx", "vy", "wz"),
    ("linear.x", "linear.y", "angular.z"),
    ("twist.linear.x", "twist.linear.y", "twist.angular.z"),
)
WHEELS = {"torque": r"torque_(\d+)", "voltage": r"(?:motor_)?voltage_(\d+)"}


@dataclass(frozen=True, eq=False)
class Log:
    """Commands over time; each holds until the next.

    times     (K,) in s, increasing
    commands  "twist": (K, 3) vx, vy in m/s and wz in rad/s; "torque" in N m and "voltage" in V: (K, N), a column for
              each wheel. A log has one of them or more
    """

    times: np.ndarray
    commands: dict[str, np.ndarray]


def read_log(path: str | PathLike) -> Log:
    """A CSV file whose first line names its columns.

    path  of the file, str or path

    The times are in a column t, time or stamp, in s. Commands are vx, vy, wz, or linear.x, linear.y, angular.z, also
    with twist. before them; torque_1, torque_2 and so on; voltage_1 or motor_voltage_1 and so on, counted from 1. Other
    columns are left alone, and what stands before a name's last slash is no part of it.

    Raises InvalidValueError where the file is none of this, OSError where it cannot be read.
    """
    path = validation.file_path("path", path)
    if path.stat().st_size > MOST_BYTES:
        raise InvalidValueError("path", str(path), f"must be of at most {MOST_BYTES} bytes")
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidValueError("path", str(path), f"must be a CSV file: {error}") from None
    names = [name.strip().rsplit("/", 1)[-1] for name in rows[0]] if rows else []
    found = {kind: [names.index(name) for name in columns] for kind, columns in _columns(names).items()}
    stamps = [name for name in TIMES if name in names]
    if not stamps or not found:
        wanted = f"a column {' or '.join(TIMES)} and commands: {', '.join(TWISTS[0])}; torque_1 ...; or voltage_1 ..."
        raise InvalidValueError("path", str(path), f"must have {wanted}; it has {', '.join(names) or 'nothing'}")
    times = _numbers(path, rows, [names.index(stamps[0])])[:, 0]
    if not len(times) or (np.diff(times) <= 0).any():
        raise InvalidValueError("path", str(path), "must have rows whose times increase")
    return Log(times, {kind: _numbers(path, rows, places) for kind, places in found.items()})


def _columns(names: list[str]) -> dict[str, list[str]]:
    """The names of the columns of each kind of command."""
    found = {}
    for twist in TWISTS:
        if set(twist) <= set(names):
            found["twist"] = list(twist)
            break
    for kind, pattern in WHEELS.items():
        numbered = {int(match[1]): name for name in names if (match := re.fullmatch(pattern, name))}
        if numbered and sorted(numbered) == list(range(1, len(numbered) + 1)):
            found[kind] = [numbered[wheel] for wheel in sorted(numbered)]
    return found


def _numbers(path: object, rows: list[list[str]], places: list[int]) -> np.ndarray:
    """(K, columns) of the rows after the first."""
    found = np.empty((len(rows) - 1, len(places)))
    for number, row in enumerate(rows[1:]):
        try:
            found[number] = [float(row[place]) for place in places]
        except (ValueError, IndexError):
            bound = f"must have finite numbers; row {number + 1} after the names is {', '.join(row)[:80]!r}"
            raise InvalidValueError("path", str(path), bound) from None
    if not np.isfinite(found).all():
        row = int(np.flatnonzero(~np.isfinite(found).all(axis=1))[0]) + 1
        raise InvalidValueError("path", str(path), f"must have finite numbers; row {row} after the names has others")
    return found
