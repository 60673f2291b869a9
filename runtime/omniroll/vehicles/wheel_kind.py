"""Wheels of other kinds than the paper's: rollers at an angle to their wheel's plane (mecanum), in two rows, or with a
meridian of their own."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from omniroll import validation, vocabulary
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts as generated_parts
from omniroll.vehicles import parts

SAME = 1e-9  # rad that sizes of angles may differ by rounding
ENTRIES = vocabulary.by_name(vocabulary.WHEEL_KIND)


def of_the_paper(wheels: int) -> dict[str, Any]:
    """The numbers of the paper's wheels."""
    return {"roller_angle": (0.0,) * wheels, "rows": 1, "row_offset": 0.0, "meridian_radius": None,
            "roller_profile": None}  # fmt: skip


def checked(wheels: int, rollers_per_wheel: int, **given: Any) -> dict[str, Any]:
    """The numbers that say of what kind the wheels are, roller_angle by wheel. Raises InvalidValueError."""
    found = {name: entry.checked(given[name]) for name, entry in ENTRIES.items()}
    angles, rows, offset = (found[name] for name in ("roller_angle", "rows", "row_offset"))
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


def middle_rows(
    wheel_radius: float,
    places: Sequence[Sequence[float]],
    wheel_angles: Sequence[float],
    roller_angle: Sequence[float],
) -> np.ndarray:
    """(N, 3) rates of wheels in rad/s for a twist (vx, vy in m/s, wz in rad/s), with every contact in the middle of its
    wheel: what programs know that count no rollers."""
    numbers = {"wheel_radius": wheel_radius, "centres": places, "wheel_angles": wheel_angles}
    return np.array(generated_parts.middle_rows(len(wheel_angles), 3, axis_angles=roller_angle, **numbers), float)


def size_of(roller_angle: tuple[float, ...]) -> float:
    """The size in rad that all angles have. Raises InvalidValueError where they have not one."""
    sizes = np.abs(roller_angle)
    if np.ptp(sizes) > SAME:
        bound = "must have one size, whatever the signs: the vehicle has one wheel_inertia and one roller_axis_radius"
        raise InvalidValueError("roller_angle", roller_angle, bound)
    return float(sizes.max())


def inertias_beyond(
    wheels: int, rollers_per_wheel: int, numbers: Mapping[str, float], axis_angle: float, row_side: float
) -> dict[str, float]:
    """What yaw_inertia and wheel_inertia have beyond those of rollers that lie in the middle planes of their wheels.

    numbers  roller_mass, roller_axial_inertia and roller_transverse_inertia by name
    """
    rollers = {name: numbers[name] for name in ("roller_mass", "roller_axial_inertia", "roller_transverse_inertia")}
    kind = {"axis_angle": axis_angle, "row_side": row_side}
    more = parts.evaluate("inertias_of_kind", wheels, rollers_per_wheel, **rollers, **kind)
    return dict(zip(("yaw_inertia", "wheel_inertia"), more, strict=True))


def assumed_axis_radius(wheel_radius: float, rollers_per_wheel: int, axis_angle: float) -> tuple[float, str]:
    """roller_axis_radius in m where nobody gives it, and why it is that."""
    found = []
    if axis_angle:
        by_neighbours = axis_by_neighbours(wheel_radius, rollers_per_wheel, axis_angle)
        found.append((by_neighbours, "rollers touch their neighbours: makers fill the room"))
    if not axis_angle or rollers_per_wheel > 3:  # rollers at a small angle touch their neighbours' ends first
        truncated = parts.truncated_axis_radius(wheel_radius, rollers_per_wheel)
        found.append((truncated, "truncated rollers, section 4"))
    return min(found)


def axis_by_neighbours(wheel_radius: float, rollers_per_wheel: int, axis_angle: float) -> float:
    """roller_axis_radius in m of a wheel whose rollers touch their neighbours in their middles."""
    lengths = {"wheel_radius": wheel_radius, "axis_angle": axis_angle}
    return parts.evaluate("axis_by_neighbours", 1, rollers_per_wheel, **lengths)[0]


def half_length(wheel_radius: float, axis_radius: float, rollers_per_wheel: float, axis_angle: float) -> float:
    """Half of the least length of a roller, in m, by which a wheel has no gap."""
    lengths = {"wheel_radius": wheel_radius, "roller_axis_radius": axis_radius, "axis_angle": axis_angle}
    return parts.evaluate("half_length", 1, rollers_per_wheel, **lengths)[0]


def room_for_rollers(
    wheel_radius: float, axis_radius: float, rollers_per_wheel: int, axis_angle: float
) -> tuple[float, float]:
    """Half of the distance in m of neighbours' axes, and the radius of a roller there."""
    lengths = {"wheel_radius": wheel_radius, "roller_axis_radius": axis_radius, "axis_angle": axis_angle}
    room, thickness = parts.evaluate("room_for_rollers", 1, rollers_per_wheel, **lengths)
    return room, thickness


def rolling_of_kind(
    wheel_radius: float, axis_radius: float, rollers_per_wheel: int, axis_angle: float
) -> dict[str, float]:
    """Closed forms of how a wheel rolls sideways: strafe_factor, rate_ripple, spin_ratio, and contact_shift in m."""
    lengths = {"wheel_radius": wheel_radius, "roller_axis_radius": axis_radius, "axis_angle": axis_angle}
    names = ("strafe_factor", "rate_ripple", "spin_ratio", "contact_shift")
    return dict(zip(names, parts.evaluate("rolling_of_kind", 1, rollers_per_wheel, **lengths), strict=True))
