"""What is wrong in a scene file, and the error that says it."""

import datetime
import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from omniroll.errors import OmnirollError

LONGEST = 60  # characters of a value that are shown


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong.

    table, key  where; None for the file as a whole, or a table as a whole
    value       what stands there, as text; None where nothing does
    expected    what should
    line        its number in the file, or None
    """

    table: str | None
    key: str | None
    value: str | None
    expected: str
    line: int | None = None

    def __str__(self) -> str:
        place = "" if self.table is None else f"[{_name(self.table)}]"
        if self.key is not None:
            place = f"{place} {_name(self.key)}".lstrip()
        if self.value is not None:
            place += f" = {self.value}"
        return f"{place}: {self.expected}" if place else self.expected


class SceneError(OmnirollError):
    """A scene that makes no sense; `problems` has a Problem for each thing that is wrong, by line."""

    def __init__(self, path: Any, problems: Iterable[Problem]):
        problems = tuple(sorted(problems, key=lambda problem: problem.line or math.inf))
        super().__init__(
            "\n".join(
                f"{path}:{problem.line}: {problem}" if problem.line else f"{path}: {problem}" for problem in problems
            )
        )
        self.path, self.problems = str(path), problems

    def __reduce__(self):
        return type(self), (self.path, self.problems)


def _name(name: str) -> str:
    """A name of a key or table on one line; in quotes where a file needs them."""
    return name if name.isprintable() and name.strip() else repr(name)


def shown(value: Any) -> str | None:
    """A value as text of at most LONGEST characters, as a TOML file has it; None for what is not there."""
    if value is None:
        return None
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, a list in a list in a list ...
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= LONGEST else text[: LONGEST - 4] + " ..."


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that looks most like `name`, or None."""
    alike = difflib.get_close_matches(name[:LONGEST], known, n=1, cutoff=0.5)
    return alike[0] if alike else None
