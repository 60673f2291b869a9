"""Checks of a scene's tables against the schema: every key by itself, so that one message names all that is wrong."""

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from omniroll.conventions.units import in_unit
from omniroll.kinds import Sizes
from omniroll.robots.catalogue import ROBOTS
from omniroll.scenes.problems import Problem, nearest, shown
from omniroll.scenes.reading import Lines
from omniroll.scenes.schema import INSTEAD, KIND_OF_WHEEL, KINDS, OF_LOG, SCENE, TABLES, Table, keys

ELSEWHERE = {  # what tables, keys and words for other kinds of wheels have in them
    "mecanum|roller_angle|slant": "asks for mecanum wheels: they are roller_angle and handedness in [vehicle]",
    "double|rows|row_offset": "asks for two rows of rollers: they are rows = 2 and row_offset in [vehicle]",
}
TURN = 6.3  # rad
PAPER_SIZES = {"wheels": 3, "rollers_per_wheel": 5}


class Findings:
    """The problems that were found so far, each with its line."""

    def __init__(self, lines: Lines):
        self._lines = lines
        self.problems: list[Problem] = []

    def add(self, table: str, key: str | None, expected: str, value: str | None = None) -> None:
        line = self._lines.get((table, key), self._lines.get((table, None)))
        self.problems.append(Problem(table, key, value, expected, line))

    def add_stray(self, name: str, value: Any, expected: str) -> None:
        """Something that stands where only tables do."""
        self.problems.append(Problem(None, name, shown(value), expected, self._lines.get((name, None))))

    def keys_in(self, table: str) -> set[str | None]:
        """The keys of this table that have problems; None stands for the table as a whole."""
        return {problem.key for problem in self.problems if problem.table == table}


def checked_tables(tables: dict[str, Any], findings: Findings) -> dict[str, dict[str, Any]]:
    """The tables with the keys that are known and good; what is not goes into `findings`."""
    contents = {}
    for name, content in tables.items():
        if name not in TABLES:
            _unknown_table(name, content, findings)
        elif not isinstance(content, dict):
            findings.add_stray(name, content, f"must be a table, [{name}]")
        else:
            contents[name] = content
    for table in SCENE:
        if table.needed and table.name not in tables:
            findings.add(table.name, None, "is missing" + _that_needs(table))
    known = sizes(contents.get("vehicle", {}))
    kinds = {}
    if KINDS in contents.get("vehicle", {}):
        contents["vehicle"] = dict(contents["vehicle"])
        kinds = {KINDS: _kinds(contents["vehicle"].pop(KINDS), known, findings)}
    found = {name: _good_keys(TABLES[name], content, known, findings) for name, content in contents.items()}
    return found | ({"vehicle": found["vehicle"] | kinds} if kinds else {})


def _kinds(tables: Any, known: Sizes, findings: Findings) -> dict[str, dict[str, Any]]:
    """The tables of the kinds of wheels, with the keys that are known and good."""
    if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
        findings.add("vehicle", KINDS, "must be tables, [vehicle.kinds.NAME]", shown(tables))
        return {}
    return {
        name: _good_keys(replace(KIND_OF_WHEEL, name=f"vehicle.kinds.{name}"), table, known, findings)
        for name, table in tables.items()
    }


def sizes(vehicle: dict[str, Any]) -> Sizes:
    """N and n - 1 as far as [vehicle] says them."""
    preset = vehicle.get("preset")
    usual: dict[str, int | None] = dict.fromkeys(PAPER_SIZES)
    if isinstance(preset, str) and preset in ROBOTS:
        usual = {key: getattr(ROBOTS[preset], key) for key in PAPER_SIZES}
    elif preset is not None:
        usual = dict(PAPER_SIZES)
    given = {key: vehicle.get(key, default) for key, default in usual.items()}
    good = {key: value for key, value in given.items() if TABLES["vehicle"].key(key).kind.complaint(value, {}) is None}
    result = {"N": good["wheels"]} if "wheels" in good else {}
    return result | ({"n-1": good["rollers_per_wheel"] - 1} if "rollers_per_wheel" in good else {})


def _good_keys(table: Table, content: dict[str, Any], known: Sizes, findings: Findings) -> dict[str, Any]:
    names = [key.name for key in table.keys]
    for name, value in content.items():
        if name not in names:
            what = _of_wheels(name, value) or f"no such key{_hint(name, names)}"
            findings.add(table.name, name, what, shown(value))
    good = {}
    for key in table.keys:
        if key.name not in content:
            if key.needed and not _stands_for(table.name, key.name, content):
                findings.add(table.name, key.name, f"is missing; {key.kind.expected(known)}{_unit(key.unit)}")
            continue
        try:
            value = in_unit(content[key.name], key.unit)
        except ValueError as error:
            findings.add(table.name, key.name, str(error), shown(content[key.name]))
            continue
        complaint = key.kind.complaint(value, known)
        if complaint is None:
            good[key.name] = key.kind.plain(value)
        else:
            said = _of_wheels(value) or complaint + _unit(key.unit) + _in_degrees(value, key.unit)
            findings.add(table.name, key.name, said, shown(content[key.name]))
    return good


def _of_wheels(*parts: Any) -> str | None:
    """A sentence on names and words that ask for another kind of wheel."""
    text = " ".join(part.lower() for part in parts if isinstance(part, str))
    return next((words for pattern, words in ELSEWHERE.items() if re.search(pattern, text)), None)


def _stands_for(table: str, key: str, content: dict[str, Any]) -> bool:
    """Whether a table has another key that gives what a needed one would."""
    if "log" in content and key in OF_LOG.get(table, ()):
        return True
    return any(name in content for name in INSTEAD.get((table, key), ()))


def _in_degrees(value: Any, unit: str) -> str:
    """What to write in place of a number that is an angle in degrees by its size."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f'; degrees are written "{value:g} deg"' if unit == "rad" and is_number and abs(value) > TURN else ""


def _unit(unit: str) -> str:
    return f", in {unit}" if unit not in ("", "1") else ""


def _that_needs(table: Table) -> str:
    needed = [key.name for key in table.keys if key.needed]
    return f"; it needs {', '.join(needed)}" if needed else ""


def _unknown_table(name: str, content: Any, findings: Findings) -> None:
    if not isinstance(content, dict):
        elsewhere = _elsewhere(name)
        findings.add_stray(name, content, "stands in no table" + (f"; did you mean {elsewhere}?" if elsewhere else ""))
        return
    if other := _of_wheels(name, *content, *content.values()):
        findings.add(name, None, other)
        return
    close = nearest(name, TABLES)
    findings.add(name, None, "no such table" + (f"; did you mean [{close}]?" if close else _all(TABLES)))


def _hint(name: str, known: Iterable[str]) -> str:
    """What may have been meant: a key of this table, or one of another."""
    close, elsewhere = nearest(name, known), _elsewhere(name)
    if elsewhere:
        return f"; did you mean {elsewhere}?"
    return f"; did you mean {close}?" if close else _all(known)


def _elsewhere(name: str) -> str | None:
    return next((f"[{table.name}] {name}" for table, key in keys() if key.name == name), None)


def _all(names: Iterable[str]) -> str:
    return f"; there are {', '.join(names)}"
