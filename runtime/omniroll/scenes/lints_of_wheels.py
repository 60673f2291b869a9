"""Wheels with rollers at an angle or in two rows: arrangements that do not turn, rollers that are too short or too
thick."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from omniroll.scenes.lint import Lint
from omniroll.vehicles import wheel_kind
from omniroll.vehicles.vehicle import Vehicle

LESS = 0.99  # of the lever of yaw with the other hands, below which hands look exchanged
CLOSE = 0.02  # of a roller's radius, by which sizes may be rounded
SHORT = 0.02  # of a roller's length, likewise
BISECTIONS = 60


def of_wheels(table: dict[str, Any], vehicle: Vehicle) -> Iterator[Lint]:
    """All of them; the table is [vehicle]."""
    if vehicle.has_wheels_of_the_paper or vehicle.has_kinds:
        return
    numbers = {origin.name: origin.value for origin in vehicle.origins} | table
    if any(vehicle.roller_angle):
        yield from _of_hands(vehicle)
        yield from _of_neighbours(vehicle)
    if "roller_length" in numbers:
        yield from _of_length(numbers["roller_length"], vehicle)


def _of_hands(vehicle: Vehicle) -> Iterator[Lint]:
    """The other arrangement of hands, which turns by the difference of its levers in place of their sum."""
    own, other = (lever_of_yaw(one) for one in (vehicle, other_hands(vehicle)))
    if own < LESS * other:
        text = f"the lever of yaw is {own:.3g} m, with all signs changed it were {other:.3g} m"
        if vehicle.wheels == 4:
            text += ": the rollers on top of the wheels make an O, seen from above, in place of an X"
        yield Lint("vehicle", "roller_angle", f"{text}; are the left and the right wheels exchanged?")


def other_hands(vehicle: Vehicle) -> Vehicle:
    """The vehicle with all signs of roller_angle changed."""
    return vehicle.replace(roller_angle=[-angle for angle in vehicle.roller_angle])


def lever_of_yaw(vehicle: Vehicle) -> float:
    """The mean way of a wheel's rim per turn of the vehicle, in m per rad, with contacts in the wheels' middles."""
    return float(np.abs(vehicle.middle_rows()[:, 2]).mean()) * vehicle.wheel_radius


def _of_neighbours(vehicle: Vehicle) -> Iterator[Lint]:
    """Rollers that reach into each other."""
    of_row = vehicle.rollers_per_wheel // vehicle.rows
    angle = wheel_kind.size_of(vehicle.roller_angle)
    room, thickness = wheel_kind.room_for_rollers(vehicle.wheel_radius, vehicle.roller_axis_radius, of_row, angle)
    if thickness > room * (1 + CLOSE):
        text = f"rollers are {1e3 * thickness:.3g} mm thick to each side where their neighbours' axes leave"
        least = wheel_kind.axis_by_neighbours(vehicle.wheel_radius, of_row, angle)
        yield Lint(
            "vehicle", "roller_axis_radius", f"{text} {1e3 * room:.3g} mm; makers' wheels have some {least:.4g} m"
        )


def _of_length(length: float, vehicle: Vehicle) -> Iterator[Lint]:
    """Rollers that do not reach to the next."""
    least = 2 * half_length(vehicle, vehicle.rollers_per_wheel)
    if length < least * (1 - SHORT):
        gap = 2 * (math.pi / vehicle.rollers_per_wheel - reach(length, vehicle))
        text = f"{1e3 * length:.4g} mm leave a gap of {math.degrees(gap):.3g} degrees between rollers"
        yield Lint("vehicle", "roller_length", f"{text}, {1e3 * (least - length):.3g} mm too short; this is left out")


def half_length(vehicle: Vehicle, rollers: float) -> float:
    """Half-length in m of a roller that reaches to the angle pi/rollers on each side."""
    angle = wheel_kind.size_of(vehicle.roller_angle)
    return wheel_kind.half_length(vehicle.wheel_radius, vehicle.roller_axis_radius, rollers, angle)


def reach(length: float, vehicle: Vehicle) -> float:
    """The angle of the wheel in rad up to which a roller of that length carries, at most that of the joint."""
    low, high = 0.0, math.pi / vehicle.rollers_per_wheel
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        short = middle == 0 or half_length(vehicle, math.pi / middle) < length / 2
        low, high = (middle, high) if short else (low, middle)
    return low
