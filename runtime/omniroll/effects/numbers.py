"""Numbers that a user gives to an effect, one for all wheels, one for each wheel, or a table over time; and views that
a user gets."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INTERPOLATION

PerWheel = float | tuple[float, ...]


def per_wheel(field: str, value: ArrayLike) -> PerWheel:
    """A finite number, or a tuple of them."""
    array = validation.real_array(field, value)
    if array.ndim > 1 or array.size == 0:
        raise InvalidValueError(field, value, "must be one number, or one for each wheel")
    return tuple(array.tolist()) if array.ndim else float(array)


def spread(field: str, value: PerWheel, wheels: int) -> np.ndarray:
    """(N,) numbers."""
    if np.ndim(value) and len(value) != wheels:
        raise InvalidValueError(field, value, f"must have {wheels} numbers, one for each wheel")
    return np.broadcast_to(np.asarray(value, float), (wheels,)).copy()


def driven_alone(field: str, value: PerWheel, vehicle: Vehicle) -> np.ndarray:
    """(N,) numbers for drives, one number for all wheels that have one. Raises InvalidValueError for a number by wheel
    where a wheel has none."""
    found = spread(field, value, vehicle.wheels)
    if np.ndim(value):
        refuse_undriven(field, found, vehicle)
    return np.where(vehicle.driven, found, 0.0)


def refuse_undriven(field: str, values: np.ndarray, vehicle: Vehicle) -> None:
    """Raise InvalidValueError where values (..., N) ask something of a wheel without a drive."""
    if values[..., ~vehicle.driven].any():
        wheel = int(np.flatnonzero(~vehicle.driven)[0]) + 1
        bound = f"must be 0 for wheel {wheel}, which has no drive: its kind has driven = false"
        raise InvalidValueError(field, values.tolist(), bound)


def plain_numbers(given: ArrayLike, count: int) -> list[float] | None:
    """What is given as a list, where it is one finite float or a row of `count`; None where it needs a closer look.

    On few numbers lists are faster than arrays.
    """
    if type(given) is float:
        numbers = [given] * count
    elif type(given) is np.ndarray and given.dtype == float and given.shape == (count,):
        numbers = given.tolist()
    elif type(given) in (list, tuple) and len(given) == count and set(map(type, given)) == {float}:
        numbers = list(given)
    else:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None


def plain(array: np.ndarray) -> Any:
    """An array as nested tuples."""
    return tuple(plain(row) for row in array) if array.ndim else float(array)


def read_only(array: np.ndarray) -> np.ndarray:
    """A view of the array that cannot be written."""
    view = array.view()
    view.flags.writeable = False
    return view


def table(
    field: str, times: ArrayLike, values: ArrayLike, interpolation: str, width: int | None = None
) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Checked times (K,), increasing, and values (K, width). Raises InvalidValueError."""
    INTERPOLATION.checked(interpolation)
    knots = validation.real_array("times", times)
    if knots.ndim != 1 or knots.size == 0 or (np.diff(knots) <= 0).any():
        raise InvalidValueError("times", times, "must be a row of increasing times")
    rows = validation.real_array(field, values)
    if rows.ndim != 2 or len(rows) != len(knots) or (width is not None and rows.shape[1] != width):
        columns = "one column for each wheel" if width is None else f"{width} columns"
        raise InvalidValueError(field, values, f"must have {len(knots)} rows, one for each time, and {columns}")
    return plain(knots), plain(rows)


@dataclass(frozen=True)
class Curve:
    """A table over time: linear or held between its knots (K,), constant before the first and after the last.

    knots   (K,) counted from the start of the run
    values  (K, ...)
    """

    knots: np.ndarray
    values: np.ndarray
    interpolation: str = "linear"

    @classmethod
    def constant(cls, values: np.ndarray) -> "Curve":
        return cls(np.array([-math.inf]), np.array(values, float)[None], "hold")

    @property
    def is_constant(self) -> bool:
        return len(self.knots) == 1

    def after(self, elapsed: float) -> tuple[np.ndarray, np.ndarray]:
        """Value and slope from `elapsed` to the next knot."""
        segment = int(np.searchsorted(self.knots, elapsed, side="right")) - 1
        held = self.values[max(segment, 0)]
        if segment < 0 or segment == len(self.knots) - 1 or self.interpolation == "hold":
            return held, np.zeros_like(held)
        start, end = self.knots[segment : segment + 2]
        slope = (self.values[segment + 1] - held) / (end - start)
        return held + slope * (elapsed - start), slope

    def next_knot(self, elapsed: float) -> float:
        """The first knot after `elapsed`, or inf."""
        later = self.knots[self.knots > elapsed]
        return float(later[0]) if later.size else math.inf
