"""Angles that look like degrees, axles that are all parallel, and directions that are nearly evenly spaced."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

from omniroll.scenes.lint import Lint
from omniroll.vehicles.vehicle import Vehicle

TURN = 2 * math.pi
PARALLEL = 1e-9  # sine between two axles
ROUNDED = 5e-3  # rad that a number with two decimals may be off
TWELFTH = math.pi / 12  # directions that people mean
STEEP = math.pi / 4
EPS = 1e-14  # rad, what directions that are meant exactly are off


def of_angles(vehicle: Vehicle, tables: dict[str, dict[str, Any]]) -> Iterator[Lint]:
    """All angles of a scene."""
    yield from of_degrees(vehicle, tables)
    table = "layout" if "wheel_angles" in tables.get("layout", {}) else "vehicle"
    given = "wheel_angles" in tables.get(table, {}) and not _looks_like_degrees(vehicle.wheel_angles)
    if given and (exact := evenly_spaced(vehicle.wheel_angles)):
        shown = ", ".join(map(repr, exact))
        text = "are a regular polygon but for rounding; a vehicle that is exactly symmetric has"
        yield Lint(table, "wheel_angles", f"{text} [{shown}]")
    if _are_parallel(vehicle.wheel_angles) and not any(vehicle.roller_angle):
        yield Lint(table, "wheel_angles", "all axles are parallel: along them nothing drives or brakes the vehicle")
    slope = tables.get("slope", {})
    if slope.get("angle", 0.0) > STEEP:
        text = (
            f"{slope['angle']:g} rad are {math.degrees(slope['angle']):.3g} degrees, on which rollers need a friction"
        )
        yield Lint("slope", "angle", f"{text} of {math.tan(slope['angle']):.3g}; is it meant in degrees?")


def of_degrees(vehicle: Vehicle, tables: dict[str, dict[str, Any]]) -> Iterator[Lint]:
    """Angles that look like degrees."""
    table = "layout" if "wheel_angles" in tables.get("layout", {}) else "vehicle"
    if "wheel_angles" in tables.get(table, {}) and _looks_like_degrees(vehicle.wheel_angles):
        yield Lint(table, "wheel_angles", _degrees(vehicle.wheel_angles))
    pose, slope = tables.get("start", {}).get("pose"), tables.get("slope", {})
    if pose and _looks_like_degrees(pose[2:]):
        yield Lint("start", "pose", _degrees(pose[2:]))
    if _looks_like_degrees([slope.get("direction", 0.0)]):
        yield Lint("slope", "direction", _degrees([slope["direction"]]))


def _looks_like_degrees(angles: Iterable[float]) -> bool:
    """Whether some angle is beyond a turn and all are whole or half degrees, which radians hardly ever are."""
    return any(abs(angle) > TURN for angle in angles) and all(float(2 * angle).is_integer() for angle in angles)


def _degrees(angles: Iterable[float]) -> str:
    return "looks like degrees; in radians: " + ", ".join(f"{math.radians(angle)!r}" for angle in angles)


def _are_parallel(angles: tuple[float, ...]) -> bool:
    return len(angles) > 1 and all(abs(math.sin(angle - angles[0])) < PARALLEL for angle in angles)


def evenly_spaced(angles: tuple[float, ...]) -> list[float] | None:
    """The exact directions of a regular polygon whose directions rounded are `angles`; None where there is none such.

    Directions that are exact already count as none, and so do fewer than three. The polygon's first direction is a
    multiple of 15 degrees, or the first one that is given, where the others are off by rounding then; else their mean.
    """
    count = len(angles)
    places = [round((angle - angles[0]) * count / TURN) for angle in angles]
    if count < 3 or len({place % count for place in places}) < count:
        return None
    offsets = [angle - TURN * place / count for angle, place in zip(angles, places, strict=True)]
    spread = max(offsets) - min(offsets)
    if spread > 2 * ROUNDED or spread < EPS * max(1.0, *map(abs, angles)):
        return None
    mean = sum(offsets) / count
    named = (TWELFTH * round(mean / TWELFTH), angles[0])
    first = next((one for one in named if all(abs(offset - one) <= ROUNDED for offset in offsets)), mean)
    return [first + TURN * place / count for place in places]
