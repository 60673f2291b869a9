"""Where a contact goes that lets go under loads that follow the motion.

A contact that has used its friction up begins to slip against the force that has held it, with no rate yet. Loads
follow the direction of a slip, and turn it. Where that turns slips back that leave the direction, it is steady, and the
slip grows along it as friction is used up more. Else two solutions meet there (Painleve): behind this instant the
contact neither sticks nor slips in a direction nearby. It slips at once along the next steady direction, under other
loads.
"""

from collections.abc import Callable

import numpy as np

TURNED = 1e-6  # rad, by which a direction is turned: what is found there is rounded far less
FARTHEST = np.pi / 2  # rad: the force of a direction beyond is none that has held
FOUND = 1e-15  # rad

Turned = Callable[[float], tuple[float, float]]  # from a turn in rad the rates in m/s^2 along the direction and across


def turned_by(way: np.ndarray, angle: float) -> np.ndarray:
    """(2,) a direction, turned."""
    x, y = way
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * x - sin * y, cos * y + sin * x])


def is_steady(turned: Turned) -> bool:
    """Whether slips that leave a direction are turned back."""
    return turned(TURNED)[1] < turned(-TURNED)[1]


def next_steady(turned: Turned, side: int) -> float | None:
    """The turn in rad to the next steady direction on a side, 1 or -1, of one that is not; None where there is none."""
    near, far = 0.0, TURNED
    while side * turned(side * far)[1] > 0:
        near, far = far, 2 * far
        if near > FARTHEST:
            return None
    while far - near > FOUND:
        middle = (near + far) / 2
        if middle in (near, far):
            break
        if side * turned(side * middle)[1] > 0:
            near = middle
        else:
            far = middle
    return side * (near + far) / 2
