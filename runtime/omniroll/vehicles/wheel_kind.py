"""Wheels of other kinds than the paper's: rollers at an angle to their wheel's plane (mecanum), or in two rows."""

from typing import Any

import numpy as np

from omniroll import validation, vocabulary
from omniroll.errors import InvalidValueError

ENTRIES = vocabulary.by_name(vocabulary.WHEEL_KIND)


def of_the_paper(wheels: int) -> dict[str, Any]:
    """The numbers of the paper's wheels."""
    return {"roller_angle": (0.0,) * wheels, "rows": 1, "row_offset": 0.0}


def checked(wheels: int, rollers_per_wheel: int, **given: Any) -> dict[str, Any]:
    """The numbers that say of what kind the wheels are, roller_angle by wheel. Raises InvalidValueError."""
    found = {name: entry.checked(given[name]) for name, entry in ENTRIES.items()}
    angles, rows, offset = found.values()
    if isinstance(angles, tuple):
        validation.real_array("roller_angle", angles, (wheels,))
    if rows == 1 and offset:
        bound = "must be 0 with one row: a wheel stands where its row is; give wheel_places, or rows = 2"
        raise InvalidValueError("row_offset", offset, bound)
    if rows == 2 and not validation.SMALLEST <= abs(offset) <= validation.LARGEST:
        bound = "must be given with rows = 2, not 0, and its square in the number range"
        raise InvalidValueError("row_offset", offset, bound)
    if rollers_per_wheel % rows:
        bound = "must be even with rows = 2: it counts the rollers of both rows together"
        raise InvalidValueError("rollers_per_wheel", rollers_per_wheel, bound)
    return found | {"roller_angle": tuple(np.broadcast_to(angles, wheels).tolist())}
