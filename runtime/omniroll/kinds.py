"""Kinds of values that a user gives: one of some words, a text, a whole number, truth values, or real numbers in some
shape with bounds.

A kind has
    expected(sizes)            what it accepts, in words
    complaint(value, sizes)    why it refuses a value of a scene file, in words; None where it accepts it
    plain(value)               a value of a scene file that it accepts, as a scene keeps it
    checked(field, value)      a value that is given in Python, as the package keeps it; or InvalidValueError
    shown()                    what it accepts, short, for the tables of docs/scenes.md
    in_python()                the same for docstrings, with shapes as NumPy shows them
`sizes` are the numbers behind the names in shapes, {"N": 3, "n-1": 4}; a name that is missing stands for any
number.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.validation import LARGEST, SMALLEST

Sizes = Mapping[str, int]
Shape = tuple[int | str, ...]
EXACT = 2**53  # integers up to this are floats


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    names: tuple[str, ...]

    def expected(self, sizes: Sizes) -> str:
        return "must be one of " + ", ".join(self.names)

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        return None if isinstance(value, str) and value in self.names else self.expected(sizes)

    def plain(self, value: str) -> str:
        return value

    def checked(self, field: str, value: Any) -> str:
        return validation.choice(field, value, self.names)

    def shown(self) -> str:
        return ", ".join(f"`{name}`" for name in self.names)

    def in_python(self) -> str:
        return " or ".join(f'"{name}"' for name in self.names)


@dataclass(frozen=True)
class Word:
    """A text that is not empty, such as a name."""

    def expected(self, sizes: Sizes) -> str:
        return "must be a text that is not empty"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        return None if isinstance(value, str) and value else self.expected(sizes)

    def plain(self, value: str) -> str:
        return value

    def checked(self, field: str, value: Any) -> str:
        if complaint := self.complaint(value, {}):
            raise InvalidValueError(field, value, complaint)
        return value

    def shown(self) -> str:
        return "text"

    def in_python(self) -> str:
        return "str"


@dataclass(frozen=True)
class Whole:
    """A whole number from `least` to `most`; None: as large as it may be."""

    least: int
    most: int | None = None

    def expected(self, sizes: Sizes) -> str:
        return f"must be a whole number {self._range}"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        good = isinstance(value, int) and not isinstance(value, bool)
        good = good and self.least <= value and (self.most is None or value <= self.most)
        return None if good else self.expected(sizes)

    def plain(self, value: int) -> int:
        return value

    def checked(self, field: str, value: Any) -> int:
        number = validation.integer(field, value, self.least)
        if self.most is not None and number > self.most:
            raise InvalidValueError(field, value, f"must be at most {self.most}")
        return number

    def shown(self) -> str:
        return f"whole, {self._range.removeprefix('from ')}"

    def in_python(self) -> str:
        return f"int {self._range}"

    @property
    def _range(self) -> str:
        return f"of at least {self.least}" if self.most is None else f"from {self.least} to {self.most}"


@dataclass(frozen=True)
class Flags:
    """true or false for all wheels, or for each."""

    def expected(self, sizes: Sizes) -> str:
        return f"must be true or false, or {sizes.get('N', 'N')} of them, one for each wheel"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        if isinstance(value, bool):
            return None
        good = isinstance(value, list | tuple) and len(value) == sizes.get("N", len(value)) > 0
        return None if good and all(isinstance(flag, bool) for flag in value) else self.expected(sizes)

    def plain(self, value: bool | list[bool]) -> bool | tuple[bool, ...]:
        return value if isinstance(value, bool) else tuple(value)

    def checked(self, field: str, value: Any) -> bool | tuple[bool, ...]:
        given = value.tolist() if isinstance(value, np.ndarray | np.bool_) else value
        if complaint := self.complaint(given, {}):
            raise InvalidValueError(field, value, complaint)
        return self.plain(given)

    def shown(self) -> str:
        return "true or false, or N of them"

    def in_python(self) -> str:
        return "bool or (N,) of bool"


@dataclass(frozen=True)
class Flag(Flags):
    """true or false."""

    def expected(self, sizes: Sizes) -> str:
        return "must be true or false"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        return None if isinstance(value, bool) else self.expected(sizes)

    def shown(self) -> str:
        return "true or false"

    def in_python(self) -> str:
        return "bool"


@dataclass(frozen=True)
class Names:
    """A text for each wheel."""

    def expected(self, sizes: Sizes) -> str:
        return f"must be {sizes.get('N', 'N')} texts, one for each wheel"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        good = isinstance(value, list | tuple) and len(value) == sizes.get("N", len(value))
        return None if good and all(isinstance(name, str) and name for name in value) else self.expected(sizes)

    def plain(self, value: list[str]) -> tuple[str, ...]:
        return tuple(value)

    def shown(self) -> str:
        return "texts, (N,)"

    def in_python(self) -> str:
        return "(N,) of str"


@dataclass(frozen=True)
class Tables:
    """Numbers by name, for each of some names."""

    def expected(self, sizes: Sizes) -> str:
        return "must be tables, one for each name"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        good = isinstance(value, dict) and all(isinstance(table, dict) for table in value.values())
        return None if good else self.expected(sizes)

    def plain(self, value: dict[str, dict]) -> dict[str, dict]:
        return value

    def shown(self) -> str:
        return "tables"

    def in_python(self) -> str:
        return "dict of dicts"


@dataclass(frozen=True)
class Numbers:
    """Real numbers in one of some shapes, () for a number by itself; every number within the bounds."""

    shapes: tuple[Shape, ...] = ((),)
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf
    increasing: bool = False

    @property
    def bound(self) -> str:
        """The bound of every number, in words; empty where there is none."""
        bounds = {">": self.above, ">=": self.least, "<=": self.most, "<": self.below}
        parts = [f"{sign} {value:g}" for sign, value in bounds.items() if math.isfinite(value)]
        return ", ".join(parts + (["increasing"] if self.increasing else []))

    def expected(self, sizes: Sizes) -> str:
        shapes = " or ".join(_in_words(shape, sizes) for shape in self.shapes)
        return f"must be {shapes}" + (f", {self.bound}" if self.bound else "")

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        if not any(_fits(value, shape, sizes) for shape in self.shapes):
            return self.expected(sizes)
        numbers = list(_flat(value))
        if not all(math.isfinite(number) for number in numbers):
            return "must be finite"
        if not all(number == 0 or SMALLEST <= abs(number) <= LARGEST for number in numbers):
            return (
                f"must be 0 or between {SMALLEST:.3g} and {LARGEST:.3g} in size, or its square leaves the number range"
            )
        inside = all(self.above < x < self.below and self.least <= x <= self.most for x in numbers)
        ordered = not self.increasing or all(a < b for a, b in zip(numbers, numbers[1:], strict=False))
        return None if inside and ordered else self.expected(sizes)

    def plain(self, value: Any) -> Any:
        """An integer that no float has exactly becomes a float: TOML's have any number of digits, NumPy's 64 bits."""
        if isinstance(value, list):
            return [self.plain(part) for part in value]
        return float(value) if isinstance(value, int) and abs(value) > EXACT else value

    def checked(self, field: str, value: Any) -> Any:
        """A float, or numbers as nested tuples. The size that a name in a shape stands for is not checked."""
        if type(value) in (int, float) and self.shapes == ((),) and self._is_plain(value):
            return float(value)
        array = validation.real_array(field, value, self._only_shape)
        if self._only_shape is None and not any(_matches(array.shape, shape) for shape in self.shapes):
            raise InvalidValueError(field, value, self.expected({}))
        inside = (self.above < array) & (array < self.below) & (self.least <= array) & (array <= self.most)
        if not inside.all():
            raise InvalidValueError(field, value, self._rule)
        if self.above == 0 or self.least == 0:
            for number in array[array != 0].flat:
                validation.positive(field, float(number))
        if self.increasing and (np.diff(array) <= 0).any():
            raise InvalidValueError(field, value, "must increase from each number to the next")
        return _nested(array.tolist())

    def _is_plain(self, number: float) -> bool:
        """Whether a number is within the bounds and far from the ends of the number range."""
        inside = self.above < number < self.below and self.least <= number <= self.most
        return inside and (number == 0 or SMALLEST <= abs(number) <= LARGEST)

    def shown(self) -> str:
        shapes = " or ".join("number" if not shape else " x ".join(map(str, shape)) for shape in self.shapes)
        return shapes + (f", {self.bound}" if self.bound else "")

    def in_python(self) -> str:
        shapes = [
            "number" if not shape else f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})"
            for shape in self.shapes
        ]
        return " or ".join(shapes) + (f", {self.bound}" if self.bound else "")

    @property
    def _only_shape(self) -> tuple[int, ...] | None:
        """The shape, where there is one that holds no names."""
        (shape, *others) = self.shapes
        return shape if not others and all(isinstance(size, int) for size in shape) else None

    @property
    def _rule(self) -> str:
        """The bound as the message for a number that breaks it."""
        low, high = max(self.above, self.least), min(self.most, self.below)
        if math.isfinite(low) and math.isfinite(high):
            return f"must lie between {low:g} and {high:g}"
        words = {"> 0": "must be positive", ">= 0": "must not be negative"}
        return words.get(self.bound, f"must be {self.bound}")


def _nested(value: Any) -> Any:
    return tuple(map(_nested, value)) if isinstance(value, list) else value


def _matches(sizes: tuple[int, ...], shape: Shape) -> bool:
    """Whether an array of these sizes, none of them 0, has a shape whose names stand for any number."""
    alike = len(sizes) == len(shape) and all(isinstance(b, str) or a == b for a, b in zip(sizes, shape, strict=True))
    return alike and 0 not in sizes


def _in_words(shape: Shape, sizes: Sizes) -> str:
    if not shape:
        return "a number"
    counts = [str(sizes.get(size, size)) for size in shape]
    return f"{counts[0]} numbers" if len(shape) == 1 else f"{counts[0]} rows of {counts[1]} numbers"


def _fits(value: Any, shape: Shape, sizes: Sizes) -> bool:
    if not shape:
        return _is_real(value)
    if not isinstance(value, list) or not value:
        return False
    count = sizes.get(shape[0], shape[0])
    return (isinstance(count, str) or len(value) == count) and all(_fits(part, shape[1:], sizes) for part in value)


def _is_real(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        float(value)
    except OverflowError:  # an integer of hundreds of digits
        return False
    return True


def _flat(value: Any) -> Iterator[float]:
    if isinstance(value, list):
        for part in value:
            yield from _flat(part)
    else:
        yield float(value)
