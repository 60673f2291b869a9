"""Reads generated/data: what the derivation says about symbols, bounds and kernels, as numbers.

Expressions are nested lists in the paper's symbols: an integer, a symbol, or [operation, operands...] with
the operations + * / (an exact ratio of integers) ^ (an integer power) sin cos sqrt.
"""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

Expression = int | str | list


@cache
def load(name: str) -> Any:
    """The content of generated/data/<name>.json; what it describes stands under the key `name`.

    "kernels" is the folder of that name, which has a file for each set, read as one: the sets, and each function once
    with the names of its sets.
    """
    data = resources.files("omniroll.generated").joinpath("data")
    if name == "kernels":
        files = sorted((data / name).iterdir(), key=lambda file: file.name)
        return _joined(json.loads(file.read_text(encoding="utf-8")) for file in files)
    return json.loads((data / f"{name}.json").read_text(encoding="utf-8"))


def _joined(files: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """The files of all sets as one."""
    of_sets = {file["set"]["name"]: file for file in files}
    users: dict[tuple[str, str], list[str]] = {}
    for name, file in of_sets.items():
        for home, functions in file["elsewhere"].items():
            for function in functions:
                users.setdefault((home, function), []).append(name)
    return {
        "sets": [file["set"] for file in of_sets.values()],
        "functions": [
            {"sets": [name, *users.get((name, function["name"]), [])]} | function
            for name, file in of_sets.items()
            for function in file["functions"]
        ],
    }


@cache
def code_names() -> dict[str, str]:
    """Name in the code of each of the paper's symbols: {"B": "roller_inertia", ...}."""
    return {symbol: entry["code"] for symbol, entry in load("symbols")["symbols"].items()}


@dataclass(frozen=True)
class Described:
    """What the derivation says of a number: the paper's symbol for it, empty where it has none; unit and meaning."""

    symbol: str
    unit: str
    meaning: str

    @property
    def text(self) -> str:
        """The symbol and the meaning."""
        return f"{self.symbol}, {self.meaning}" if self.symbol else self.meaning


@cache
def described(name: str) -> Described:
    """What the derivation says of an argument of its functions, or of a number that a symbol of the paper stands for.

    Raises KeyError for a name that it does not know.
    """
    symbols = {entry["code"]: (symbol, entry) for symbol, entry in load("symbols")["symbols"].items()}
    symbol, entry = symbols.get(name, ("", None))
    about = load("arguments")["arguments"].get(name) or entry
    if about is None:
        raise KeyError(name)
    return Described(symbol, about["unit"], about["meaning"])


def _power(base: float, exponent: int) -> float:
    try:
        return base**exponent
    except (OverflowError, ZeroDivisionError):  # Python's floats raise where the number type has inf
        return math.inf


OPERATIONS = {
    "+": lambda *terms: math.fsum(terms),
    "*": lambda *factors: math.prod(factors),
    "/": lambda p, q: p / q,
    "^": _power,
    "sin": math.sin,
    "cos": math.cos,
    "sqrt": math.sqrt,
}


def evaluate(expression: Expression, values: Mapping[str, float]) -> float:
    """The number that `expression` has; `values` are by the paper's symbols (pi is known)."""
    if isinstance(expression, int):
        return expression
    if isinstance(expression, str):
        return math.pi if expression == "pi" else values[expression]
    operation, *operands = expression
    return OPERATIONS[operation](*(evaluate(operand, values) for operand in operands))
