"""Kinds of values of a scene's keys: what each accepts, and what it says of a value that it does not.

A kind has
    expected(sizes)            what it accepts, in words
    complaint(value, sizes)    why it refuses, in words; None where it accepts
`sizes` are the numbers behind the names in shapes, {"N": 3, "n-1": 4}; a name that is missing stands for any
number.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from omniroll.validation import LARGEST, SMALLEST

Sizes = Mapping[str, int]
Shape = tuple[int | str, ...]


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    names: tuple[str, ...]

    def expected(self, sizes: Sizes) -> str:
        return "must be one of " + ", ".join(self.names)

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        return None if isinstance(value, str) and value in self.names else self.expected(sizes)


@dataclass(frozen=True)
class Whole:
    """A whole number from `least` to `most`."""

    least: int
    most: int

    def expected(self, sizes: Sizes) -> str:
        return f"must be a whole number from {self.least} to {self.most}"

    def complaint(self, value: Any, sizes: Sizes) -> str | None:
        good = isinstance(value, int) and not isinstance(value, bool) and self.least <= value <= self.most
        return None if good else self.expected(sizes)


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
        said = [f"{sign} {value:g}" for sign, value in bounds.items() if math.isfinite(value)]
        return ", ".join(said + (["increasing"] if self.increasing else []))

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
