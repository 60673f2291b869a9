"""The one reader of logs: files of text, Parquet and bags, as a table of times and named columns.

Other programs write the same numbers in many forms. What is recognised is said, and nothing is guessed in silence:

- lines before the names, and a line of units below them;
- commas, semicolons, tabulators or blanks between cells, and decimal commas where these are no separators;
- the names of times, of ROS's messages (rostopic echo -p, PlotJuggler), and units behind names in brackets;
- clocks in s, ms, us, ns, and times since 1970 (clocks.py);
- rows of one time, of which the last holds: simulated clocks repeat themselves.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import extras, validation
from omniroll.conventions import bags, units
from omniroll.conventions.clocks import DIGITS, read_time, seconds
from omniroll.errors import InvalidValueError, LogError
from omniroll.results.tables import EXTRA

MOST_BYTES = 200_000_000
PARQUET = (".parquet", ".pq")  # ends of the names of such files
TIMES = ("%time", "__time", "t", "time", "timestamp", "stamp")
ENDS_OF_TIMES = (".time", ".timestamp", ".stamp")
WITH_UNIT = re.compile(r"(t|time|timestamp|stamp)_(s|ms|us|ns)", re.IGNORECASE)
WORDS = {"millis": "ms", "micros": "us", "nanos": "ns"}
HEADERS = 20  # lines among which the line of names is sought
SEPARATORS = (",", ";", "\t", None)  # None: blanks
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns over time.

    name     of the file
    times    (K,) in s, increasing
    columns  cells of each column by its name, for the rows of `times`
    units    of columns by name, where the file says them
    lines    (K,) lines of the file that the rows stand in; row numbers of files without lines
    said     what was recognised, in sentences
    """

    name: str
    times: np.ndarray
    columns: dict[str, Sequence[Any]]
    units: dict[str, str] = field(default_factory=dict)
    lines: Sequence[int] = ()
    said: tuple[str, ...] = ()
    line_of_names: int | None = None

    def numbers(self, column: str) -> np.ndarray:
        """(K,) a column. Raises LogError where a cell is no finite number."""
        cells = self.columns[column]
        values = np.empty(len(cells))
        for row, cell in enumerate(cells):
            try:
                values[row] = float(cell)
            except (TypeError, ValueError):
                empty = isinstance(cell, str) and not cell.strip()
                bound = "is empty: each line must have a number in each column" if empty else "must be a number"
                raise LogError(self.name, self.lines[row], column, cell, bound) from None
            if not np.isfinite(values[row]):
                raise LogError(self.name, self.lines[row], column, float(values[row]), "must be finite")
        return values


def read_table(path: str | PathLike, columns: Mapping[str, str] | None = None) -> LogTable:
    """A log's file as a table.

    path     of the file: CSV or other text, Parquet, or a bag of ROS (.bag, .mcap, .db3, or the folder of one)
    columns  names of the file's columns by the names that they shall have: {"time": "clock [ms]", "gyro": "/imu/z"}

    Raises LogError with line and column, OSError, MissingPackageError.
    """
    path = validation.file_path("path", path)
    columns = validation.mapping("columns", {} if columns is None else columns)
    if bags.is_bag(path):
        names, rows, numbers, said = bags.rows_of(path)
        named = _renamed(path.name, names, columns)
        return _table(path.name, named, {}, rows, numbers, said)
    if path.suffix.lower() in PARQUET:
        names, rows = _of_frame(path)
        return _table(path.name, *_with_units(path.name, names, columns), rows, range(len(rows)), [])
    if path.stat().st_size > MOST_BYTES:
        raise LogError(path.name, None, None, None, f"must be of at most {MOST_BYTES} bytes")
    try:
        text = path.read_text(encoding="utf-8-sig")
        lines, separator = _split(text.splitlines())
    except (UnicodeDecodeError, csv.Error) as error:
        raise LogError(path.name, None, None, None, f"must be a CSV file: {error}") from None
    return _of_lines(path.name, lines, separator, columns)


def columns_of_text(text: str) -> dict[str, str]:
    """Names of columns from a text such as "time=clock [ms], gyro=/imu/z"; {} of an empty one.

    Raises InvalidValueError.
    """
    found = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, equals, source = (piece.strip() for piece in part.partition("="))
        if not (name and equals and source):
            raise InvalidValueError("columns", part, "must be NAME=COLUMN, as in time=stamp, with commas between them")
        found[name] = source
    return found


def time_unit(name: str) -> tuple[bool, str | None]:
    """Whether a column's name is one of times, and the unit that it says."""
    plain, unit = units.split(name)
    low = plain.replace("/", ".").lower()
    if found := WITH_UNIT.fullmatch(low):
        return True, unit or found[2].lower()
    if low == "%time" or low.endswith("header.stamp"):
        return True, unit or "ns"
    if low in WORDS:
        return True, unit or WORDS[low]
    return low in TIMES or low.endswith(ENDS_OF_TIMES), unit


def _of_lines(
    name: str, lines: list[tuple[int, list[str]]], separator: str | None, wanted: Mapping[str, str]
) -> LogTable:
    start = _line_of_names(lines, wanted)
    if len(lines) <= start + 1:
        raise LogError(name, None, None, None, "must have a line of names and lines of numbers")
    (number, names), rest = lines[start], lines[start + 1 :]
    said = [f"{start} lines before the names, on line {number}, were not read"] if start else []
    titles, below = [cell.strip().lstrip("#").strip() for cell in names], {}
    if rest and not any(_is_number(cell) for cell in rest[0][1]) and _are_units(rest[0][1]):
        below = {k: cell.strip().strip("[]()") for k, cell in enumerate(rest[0][1]) if cell.strip()}
        rest = rest[1:]
    rest = [(line, row) for line, row in rest if not row[0].lstrip().startswith("#")]
    for line, row in rest:
        if len(row) != len(titles):
            raise LogError(name, line, None, len(row), f"numbers; the line of names has {len(titles)}")
    if separator != "," and any(COMMA.fullmatch(cell.strip()) for _, row in rest for cell in row):
        rest = [(line, [_with_point(cell) for cell in row]) for line, row in rest]
        said.append("decimal commas were read as points")
    titles = [f"{title} [{below[k]}]" if k in below else title for k, title in enumerate(titles)]
    named, found = _with_units(name, titles, wanted, number)
    table = _table(name, named, found, [row for _, row in rest], [line for line, _ in rest], said)
    return replace(table, line_of_names=number)


def _table(
    name: str, names: list[str], found: dict[str, str], rows: Sequence[Sequence[Any]], lines: Sequence[int], said: list
) -> LogTable:
    """The table of rows; of rows of one time the last holds."""
    place = _place_of_times(name, names, lines)
    times: list[Decimal] = []
    for row, line in zip(rows, lines, strict=True):
        time = row[place] if isinstance(row[place], Decimal) else read_time(str(row[place]))
        if time is None:
            raise LogError(name, line, names[place], row[place], "must be a finite time")
        if times and time < times[-1]:
            raise LogError(name, line, names[place], float(time), f"must come after {float(times[-1])!r}")
        times.append(time)
    unit = found.pop(names[place], None) or time_unit(names[place])[1]
    if unit is not None and units.plain(unit) not in DIGITS:
        raise LogError(name, None, names[place], None, f"must be in {', '.join(DIGITS)}; it is in {unit}")
    last = [row for row in range(len(times)) if row + 1 == len(times) or times[row + 1] > times[row]]
    if len(last) < len(times):
        said.append(f"{len(times) - len(last)} rows have the time of the next row, which holds")
    moments = seconds([times[row] for row in last], unit, said)
    kept = {title: [rows[row][k] for row in last] for k, title in enumerate(names) if k != place}
    return LogTable(name, np.array(moments), kept, found, [lines[row] for row in last], tuple(said))


def _place_of_times(name: str, names: list[str], lines: Sequence[int]) -> int:
    plain = [title.replace("/", ".").lower() for title in names]
    for wanted in TIMES:
        if wanted in plain:
            return plain.index(wanted)
    places = [k for k, title in enumerate(names) if time_unit(title)[0]]
    if not places:
        shown = ", ".join(names[:12]) + (" and others" if len(names) > 12 else "")
        bound = f"must have a column t, time, stamp or timestamp; it has {shown or 'nothing'}"
        raise LogError(name, None, None, None, f"{bound}. `columns` (--columns time=...) names another")
    return places[0]


def _line_of_names(lines: Sequence[tuple[int, list[str]]], wanted: Mapping[str, str]) -> int:
    """The line among the first that names times, or a column that is wanted; the first where none does."""
    for k, (_, row) in enumerate(lines[:HEADERS]):
        titles = [cell.strip().lstrip("#").strip() for cell in row]
        if any(time_unit(title)[0] for title in titles) or set(wanted.values()) & set(titles):
            return k
    return 0


def _with_units(
    name: str, titles: Sequence[str], wanted: Mapping[str, str], line: int | None = None
) -> tuple[list[str], dict[str, str]]:
    """Names without their units, and the units by name."""
    split = [units.split(title) for title in titles]
    named = _renamed(name, [plain for plain, _ in split], wanted, line)
    found = {plain: unit for plain, (_, unit) in zip(named, split, strict=True) if unit is not None}
    for title, source in wanted.items():
        if (unit := units.split(source)[1]) is not None:
            found[title] = unit
    return named, found


def _renamed(name: str, names: Sequence[str], wanted: Mapping[str, str], line: int | None = None) -> list[str]:
    found = list(names)
    for title, source in wanted.items():
        source = source if source in names else units.split(source)[0]
        if source not in names:
            raise LogError(name, line, source, None, f"is no column; there are {', '.join(names)[:300]}")
        found[names.index(source)] = title
    twice = next((title for title in found if found.count(title) > 1), None)
    if twice is not None:
        raise LogError(name, 1 if line is None else line, twice, None, "stands there twice")
    return found


def _split(lines: Sequence[str]) -> tuple[list[tuple[int, list[str]]], str | None]:
    """The cells of each line that is not empty, with its number; and what separates them."""
    filled = [line for line in lines[:200] if line.strip()]
    separator = max(SEPARATORS, key=lambda one: _fit(filled[-1:], one)) if filled else ","
    if filled and _fit(filled[-1:], separator) == (0, 0):
        separator = max(SEPARATORS[:3], key=lambda one: len(filled[0].split(one)))
    return list(_cells(lines, separator)), separator


def _cells(lines: Sequence[str], separator: str | None) -> Iterator[tuple[int, list[str]]]:
    if separator is None:
        rows = ((number, line.split()) for number, line in enumerate(lines, 1))
    else:
        reader = csv.reader(lines, delimiter=separator)
        rows = ((reader.line_num, row) for row in reader)
    return ((number, row) for number, row in rows if any(cell.strip() for cell in row))


def _fit(sample: Sequence[str], separator: str | None) -> tuple[float, int]:
    """How well a separator splits a line into numbers: their share among the cells, and how many cells there are."""
    cells = [cell for line in sample for cell in line.split(separator)]
    numbers = sum(_is_number(cell, separator != ",") for cell in cells)
    return (numbers / len(cells), len(cells)) if len(cells) > 1 and numbers else (0, 0)


def _is_number(cell: str, with_commas: bool = True) -> bool:
    cell = cell.strip()
    return bool(NUMBER.fullmatch(cell) or (with_commas and COMMA.fullmatch(cell)))


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell.strip().strip("[]()") for cell in cells if cell.strip()]
    return bool(filled) and all(cell in units.KNOWN or cell in ("1", "-") for cell in filled)


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if COMMA.fullmatch(cell.strip()) else cell


def _of_frame(path: Path) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Names, with the units that the frame has, and rows of a Parquet file."""
    extras.needed("pyarrow", EXTRA, f"a log in a file {path.suffix}")
    pandas = extras.needed("pandas", EXTRA, f"a log in a file {path.suffix}")
    try:
        frame = pandas.read_parquet(path)
    except OSError:
        raise
    except ValueError as error:  # pyarrow's error of files of other kinds
        raise LogError(path.name, None, None, None, f"must be a Parquet file: {error}") from None
    if frame.index.name is not None:
        frame = frame.reset_index()
    known = frame.attrs.get("units", {})
    names = [f"{name} [{known[name]}]" if name in known else str(name) for name in frame.columns]
    return names, list(frame.itertuples(index=False, name=None))
