"""Units that logs have, and what turns them into those of this project."""

import math
import re
from typing import Any

FACTORS = {  # a number in the unit of the first column, times the factor, is one in that of the second
    ("deg/s", "rad/s"): math.pi / 180,
    ("rpm", "rad/s"): math.pi / 30,
    ("turns/s", "rad/s"): 2 * math.pi,
    ("deg", "rad"): math.pi / 180,
    ("ms", "s"): 1e-3,
    ("us", "s"): 1e-6,
    ("ns", "s"): 1e-9,
    ("mA", "A"): 1e-3,
    ("mV", "V"): 1e-3,
    ("g", "m/s^2"): 9.80665,
    ("mm/s^2", "m/s^2"): 1e-3,
    ("mN m", "N m"): 1e-3,
    ("mm/s", "m/s"): 1e-3,
    ("cm/s", "m/s"): 1e-2,
    ("km/h", "m/s"): 1 / 3.6,
    ("mm", "m"): 1e-3,
    ("cm", "m"): 1e-2,
}
NAMES = {  # other ways to write a unit
    "seconds": "s", "sec": "s", "msec": "ms", "milliseconds": "ms", "µs": "us", "usec": "us", "nsec": "ns",
    "°": "deg", "°/s": "deg/s", "dps": "deg/s", "degrees": "deg", "degrees/s": "deg/s", "radians": "rad",
    "radians/s": "rad/s", "1/min": "rpm", "U/min": "rpm", "rev/s": "turns/s", "rps": "turns/s", "m/s2": "m/s^2",
    "m/s²": "m/s^2", "Nm": "N m", "N*m": "N m", "mNm": "mN m", "volts": "V", "amps": "A",
}  # fmt: skip
KNOWN = {unit for pair in FACTORS for unit in pair} | set(NAMES)
WITH_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*)")
IN_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]\s*")


def plain(unit: str) -> str:
    """A unit as FACTORS names it."""
    return NAMES.get(unit, unit)


def split(name: str) -> tuple[str, str | None]:
    """A column's name and the unit in brackets behind it, None where there is none."""
    found = IN_BRACKETS.fullmatch(name)
    return (found[1].strip(), plain(found[2])) if found and found[1] else (name.strip(), None)


def factor(unit: str, wanted: str) -> float | None:
    """What turns numbers in `unit` into those in `wanted`; None where that is not known."""
    return 1.0 if plain(unit) == wanted else FACTORS.get((plain(unit), wanted))


def in_unit(value: Any, wanted: str) -> Any:
    """Texts such as "45 deg" or "300 rpm" within a value as numbers in the unit that is wanted; the rest as it is.

    wanted  one unit, or one for each entry of a list: "m, m, rad"

    Raises ValueError for a unit that is not known.
    """
    if isinstance(value, list):
        each = wanted.split(", ")
        each = each * len(value) if len(each) == 1 else each
        if len(each) != len(value) or any(isinstance(part, list) for part in value):
            return [in_unit(part, wanted) for part in value]
        return [in_unit(part, unit) for part, unit in zip(value, each, strict=True)]
    found = WITH_UNIT.fullmatch(value.strip()) if isinstance(value, str) else None
    if found is None:
        return value
    number = factor(found[2], wanted)
    if number is None:
        raise ValueError(f"must be in {wanted or 'no unit'}, or in a unit of {', '.join(_others(wanted)) or 'none'}")
    return float(found[1]) * number


def _others(wanted: str) -> list[str]:
    return [unit for unit, into in FACTORS if into == wanted]


def suspected(unit: str, ratio: float) -> str | None:
    """The unit that readings seem to have which are `ratio` times what they should be; None where none is near."""
    for (other, wanted), number in FACTORS.items():
        if wanted == unit and ratio > 0 and abs(math.log(ratio * number)) < 0.2:
            return other
    return None
