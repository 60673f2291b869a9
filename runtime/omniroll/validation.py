"""Checks of what a user gives. Each raises InvalidValueError with the field, the value and the bound."""

import inspect
import math
import operator
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll.errors import InvalidValueError

# Squares of numbers inside these limits are normal floating-point numbers.
SMALLEST = math.sqrt(np.finfo(float).tiny) * 2
LARGEST = math.sqrt(np.finfo(float).max) / 2
MOST_NUMBERS = 10**8  # of an array that is copied


def integer(field: str, value: Any, least: int) -> int:
    """`value` as an int that is at least `least`. Booleans and floats are refused."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise InvalidValueError(field, value, "must be an integer") from None
    if number < least:
        raise InvalidValueError(field, value, f"must be at least {least}")
    return number


def real(field: str, value: Any) -> float:
    """`value` as a finite float."""
    return float(real_array(field, value, ()))


def positive(field: str, value: Any) -> float:
    """`value` as a positive float whose square is a normal number."""
    number = real(field, value)
    if number <= 0:
        raise InvalidValueError(field, value, "must be positive")
    if not SMALLEST <= number <= LARGEST:
        bound = f"must lie between {SMALLEST:.3g} and {LARGEST:.3g}, or its square leaves the number range"
        raise InvalidValueError(field, value, bound)
    return number


def not_negative(field: str, value: Any) -> float:
    """`value` as a float that is 0, or positive with a square that is a normal number."""
    number = real(field, value)
    if number < 0:
        raise InvalidValueError(field, value, "must not be negative")
    return number if number == 0 else positive(field, number)


def real_array(field: str, value: ArrayLike, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """`value` as a float64 array of finite numbers, of the given shape if there is one."""
    try:
        raw = np.asarray(value)
    except ValueError:
        raise InvalidValueError(field, value, "must be an array of numbers, rows of one length") from None
    except Exception:  # an object whose own code fails
        raise InvalidValueError(field, value, "must be real numbers") from None
    if raw.dtype.kind == "O":
        raw = _of_integers(field, value, raw)
    if raw.dtype.kind not in "iuf":
        raise InvalidValueError(field, value, "must be real numbers")
    if raw.size > MOST_NUMBERS:
        raise InvalidValueError(field, f"shape {raw.shape}", f"must hold at most {MOST_NUMBERS} numbers: go in parts")
    array = raw.astype(float)
    if not np.isfinite(array).all():
        raise InvalidValueError(field, value, "must be finite")
    if shape is not None and array.shape != shape:
        raise InvalidValueError(field, value, f"must have the shape {shape}, not {array.shape}")
    return array


def _of_integers(field: str, value: Any, raw: np.ndarray) -> np.ndarray:
    """Objects as floats where they are real numbers, of which integers may have any number of digits."""
    if not all(isinstance(number, (int, float)) and not isinstance(number, bool) for number in raw.flat):
        raise InvalidValueError(field, value, "must be real numbers")
    try:
        return raw.astype(float)
    except OverflowError:
        raise InvalidValueError(field, value, "must be finite") from None


def trailing(field: str, value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """`value` as a float64 array whose last axes are `shape`; leading axes are free."""
    array = real_array(field, value)
    if array.ndim < len(shape) or array.shape[array.ndim - len(shape) :] != shape:
        want = ", ".join(["..."] + [str(size) for size in shape])
        raise InvalidValueError(field, value, f"must have the shape ({want}), not {array.shape}")
    return array


def magnitude(field: str, array: np.ndarray, axes: int) -> np.ndarray:
    """`array`, whose max-norm over the last `axes` axes must be 0 or have a square in the number range."""
    if array.size:
        norm = np.abs(array).max(axis=tuple(range(-axes, 0)))
        if ((norm != 0) & ((norm < SMALLEST) | (norm > LARGEST))).any():
            bound = (
                f"largest magnitude must be 0 or lie between {SMALLEST:.3g} and {LARGEST:.3g}, "
                "or its square leaves the number range"
            )
            raise InvalidValueError(field, array.tolist(), bound)
    return array


def truth(field: str, value: Any) -> bool:
    """`value`, which must be True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidValueError(field, value, "must be True or False")
    return bool(value)


def file_path(field: str, value: Any) -> Path:
    """`value` as the path of a file. A number is refused: Python would take it for a file that is open."""
    if not isinstance(value, (str, os.PathLike)):
        raise InvalidValueError(field, value, "must be a path, str or path")
    return Path(value)


def text(field: str, value: Any) -> str:
    """`value`, which must be a str."""
    if not isinstance(value, str):
        raise InvalidValueError(field, value, "must be a text")
    return value


def sequence(field: str, value: Any, bound: str) -> list:
    """`value` as a list: a sequence that is no text. `bound` says what its entries must be."""
    if isinstance(value, (str, bytes, bytearray, memoryview)) or not isinstance(value, Sequence):
        raise InvalidValueError(field, value, bound)
    return list(value)


def mapping(field: str, value: Any) -> dict[str, Any]:
    """`value`, which must be a mapping whose keys are texts, as a dict."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InvalidValueError(field, value, "must be a dict by name")
    return dict(value)


def function(field: str, value: Any, *arguments: str) -> Callable:
    """`value`, which must be a function, not a class, that can be called with these arguments."""
    bound = f"must be a function that is called as {field}({', '.join(arguments)})"
    if not callable(value) or isinstance(value, type):
        raise InvalidValueError(field, value, bound)
    try:
        inspect.signature(value).bind(*arguments)
    except TypeError:
        raise InvalidValueError(field, value, bound) from None
    except ValueError:  # a function of C that does not say what it takes
        pass
    return value


def known(given: dict[str, Any], names: Iterable[str], of: str) -> None:
    """Refuse an argument by a name that is none of `names`, the arguments of a function."""
    names = tuple(names)
    for name, value in given.items():
        if name not in names:
            raise InvalidValueError(name, value, f"is no argument of {of}; these are {', '.join(names)}")


def choice(field: str, value: Any, choices: Sequence[str]) -> str:
    """`value`, which must be one of `choices`."""
    if not isinstance(value, str) or value not in choices:
        raise InvalidValueError(field, value, "must be one of " + ", ".join(choices))
    return value
