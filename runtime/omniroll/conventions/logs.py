"""Logs of commands: times, and twists, wheel rates, torques or voltages."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike

import numpy as np

from omniroll.conventions import units
from omniroll.conventions.log_files import LogTable, read_table
from omniroll.errors import InvalidValueError, LogError

TWISTS = (  # names that logs give to vx, vy and wz, or the ends of such names
    ("vx", "vy", "wz"),
    ("linear.x", "linear.y", "angular.z"),
    ("linear_x", "linear_y", "angular_z"),
)
TWIST_UNITS = ("m/s", "m/s", "rad/s")
WHEELS = {  # kind, pattern of its names, unit
    "torque": (r"torque_(\d+)", "N m"),
    "voltage": (r"(?:motor_)?voltage_(\d+)", "V"),
    "wheel_rate": (r"wheel_rate_(\d+)", "rad/s"),
}
COMMANDED = "cmd"  # what names of topics of commands have in them
OTHERS = "; `columns`, in a scene log_columns, names columns that are called otherwise"


@dataclass(frozen=True, eq=False)
class Log:
    """Commands over time; each holds until the next.

    times     (K,) in s, increasing
    commands  "twist": (K, 3) vx, vy in m/s and wz in rad/s; "torque" in N m, "voltage" in V and "wheel_rate" in rad/s:
              (K, N), a column for each wheel. A log has one of them or more
    said      what was recognised in the file, in sentences
    """

    times: np.ndarray
    commands: dict[str, np.ndarray]
    said: tuple[str, ...] = ()


def read_log(path: str | PathLike, columns: Mapping[str, str] | None = None) -> Log:
    """A log of commands, as log_files.py reads it.

    path     of the file
    columns  names of the file's columns by the names that they shall have: {"time": "clock", "vx": "forward"}

    Commands are vx, vy, wz, or linear.x, linear.y, angular.z of a topic; torque_1, torque_2 and so on; voltage_1 or
    motor_voltage_1; wheel_rate_1; counted from 1. Other columns are left alone. Of several topics with twists that of
    commands is taken, whose name has cmd in it.

    Raises InvalidValueError where the file is none of this, OSError where it cannot be read, MissingPackageError.
    """
    try:
        table = read_table(path, columns)
        said = list(table.said)
        places = _columns(table)
        if not places:
            wanted = f"commands: {', '.join(TWISTS[0])}; torque_1 ...; voltage_1 ...; or wheel_rate_1 ..."
            shown = ", ".join(list(table.columns)[:12]) or "nothing"
            raise InvalidValueError("path", str(path), f"must have {wanted}; it has {shown}{OTHERS}")
        commands = {kind: _numbers(table, found, said) for kind, found in places.items()}
    except LogError as error:
        raise InvalidValueError("path", str(path), _bound(error)) from None
    return Log(table.times, commands, tuple(said))


def _bound(error: LogError) -> str:
    """What a LogError says behind the name of its file."""
    return str(error).removeprefix(error.source).lstrip(":").strip()


def _columns(table: LogTable) -> dict[str, list[tuple[str, str]]]:
    """The names of the columns of each kind of command, and the units that they shall have."""
    found = {}
    plain = {name: name.replace("/", ".").lower() for name in table.columns}
    if twist := _twist(plain):
        found["twist"] = list(zip(twist, TWIST_UNITS, strict=True))
    for kind, (pattern, unit) in WHEELS.items():
        named = {name: re.fullmatch(pattern, text.rsplit(".", 1)[-1]) for name, text in plain.items()}
        numbered = {int(match[1]): name for name, match in named.items() if match}
        if numbered and sorted(numbered) == list(range(1, len(numbered) + 1)):
            found[kind] = [(numbered[wheel], unit) for wheel in sorted(numbered)]
    return found


def _twist(plain: Mapping[str, str]) -> list[str] | None:
    """The columns of vx, vy and wz. Raises InvalidValueError where several topics have them."""
    topics = {}
    for ends in TWISTS:
        for text in plain.values():
            if text == ends[0] or text.endswith("." + ends[0]):
                topic = text.removesuffix(ends[0])
                columns = [next((n for n, t in plain.items() if t == topic + end), None) for end in ends]
                if None not in columns:
                    topics[topic] = columns
    chosen = {topic: names for topic, names in topics.items() if COMMANDED in topic} or topics
    if len(chosen) > 1:
        shown = ", ".join(topic.strip(".") or "no topic" for topic in chosen)
        bound = f"has twists of {shown}: choose by `columns`, such as columns.vx = {next(iter(chosen.values()))[0]!r}"
        raise InvalidValueError("path", None, bound)
    return next(iter(chosen.values()), None)


def _numbers(table: LogTable, columns: list[tuple[str, str]], said: list[str]) -> np.ndarray:
    """(K, columns) in the units of this project."""
    found = []
    for name, unit in columns:
        given = table.units.get(name, unit)
        factor = units.factor(given, unit)
        if factor is None:
            raise LogError(table.name, table.line_of_names, name, None, f"must be in {unit}; it is in {given}")
        if factor != 1:
            said.append(f"{name} is in {given}: times {factor:.9g}, in {unit}")
        found.append(table.numbers(name) * factor)
    return np.stack(found, axis=1)
