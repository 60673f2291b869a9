"""Wheels on sale, and those of the robots: what `--wheel` names."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from omniroll.errors import InvalidValueError
from omniroll.robots import robomaster_hero, strafer, youbot
from omniroll.robots.catalogue import ROBOTS
from omniroll.robots.mecanum_wheels import solid_roller
from omniroll.robots.robot import UNITS, Stated, assumed, published
from omniroll.vehicles import parts, wheel_kind

FIELDS = ("rollers_per_wheel", "wheel_radius", "roller_axis_radius", "wheel_inertia", "roller_inertia")
FUJI = "fuji_mecanum (DaiGuard) and Mecanum-TDK (Kemenylegeny)"
NEXUS = "a comment in cleany's cleany.xml, commit 0ca556de, which cites Nexus"


@dataclass(frozen=True, eq=False)
class SoldWheel:
    """A wheel that one can buy: its name, what it is, and its numbers as arguments of Vehicle."""

    name: str
    title: str
    rollers: int
    roller_angle: float
    numbers: Mapping[str, Stated]


def _mecanum(name: str, title: str, rollers: int, **numbers: Stated) -> SoldWheel:
    return SoldWheel(name, title, rollers, math.pi / 4, numbers)


def _of_robot(module: Any, name: str, title: str) -> SoldWheel:
    numbers = {field: module.ROBOT.numbers[field] for field in FIELDS[1:]}
    return _mecanum(name, title, module.ROBOT.rollers_per_wheel, **numbers)


def _disk(mass: float, radius: float, width: float) -> Stated:
    inertia, _ = parts.cylinder(mass, radius, width)
    return assumed(inertia, f"an even disk of {mass:g} kg, estimated: nobody publishes it")


def _fuji() -> SoldWheel:
    inertia, _ = parts.cylinder(0.03, 0.013, 0.056)
    return _mecanum(
        "fuji-fm202", "FUJI FM202-205-15U, mecanum, 205 mm", 15,
        wheel_radius=published(0.1025, FUJI),
        roller_axis_radius=published(0.0895, FUJI),
        wheel_inertia=_disk(1.0, 0.1025, 0.05),
        roller_inertia=assumed(inertia, "a cylinder of 13 mm by 56 mm (published) and 30 g, estimated"),
    )  # fmt: skip


def _nexus() -> SoldWheel:
    axis = wheel_kind.axis_by_neighbours(0.0635, 12, math.pi / 4)
    _, inertia, said = solid_roller(0.0635, axis, 12)
    return _mecanum(
        "nexus-14198", "Nexus 14198, mecanum, 127 mm", 12,
        wheel_radius=published(0.0635, NEXUS),
        roller_axis_radius=assumed(axis, "rollers touch their neighbours: makers fill the room"),
        wheel_inertia=_disk(0.5, 0.0635, 0.051),
        roller_inertia=assumed(inertia, said),
    )  # fmt: skip


@cache
def sold_wheels() -> dict[str, SoldWheel]:
    """Wheels on sale by name."""
    found = (
        _of_robot(strafer, "gobilda-96", "goBILDA, mecanum, 96 mm"),
        _of_robot(robomaster_hero, "robomaster-mecanum", "RoboMaster, mecanum, 152 mm"),
        _of_robot(youbot, "youbot-wheel", "KUKA youBot, mecanum, 100 mm"),
        _fuji(),
        _nexus(),
    )
    return {wheel.name: wheel for wheel in found}


WHEEL_NAMES = (*ROBOTS, "gobilda-96", "robomaster-mecanum", "youbot-wheel", "fuji-fm202", "nexus-14198")


def wheel_numbers(name: str) -> dict[str, Any]:
    """Arguments of Vehicle that are a wheel's: of one on sale, or of a robot. One roller_angle is without its hand.

    name  one of WHEEL_NAMES

    Raises InvalidValueError for another name.
    """
    if name in ROBOTS:
        vehicle = ROBOTS[name].vehicle
        found = {field: getattr(vehicle, field) for field in FIELDS}
        if vehicle.has_wheels_of_the_paper:
            return found
        angle = wheel_kind.size_of(vehicle.roller_angle)
        return found | {"roller_angle": angle, "rows": vehicle.rows, "row_offset": vehicle.row_offset}
    if name not in sold_wheels():
        raise InvalidValueError("wheel", name, "must be one of " + ", ".join(WHEEL_NAMES))
    sold = sold_wheels()[name]
    found = {field: stated.value for field, stated in sold.numbers.items()}
    return {"rollers_per_wheel": sold.rollers, **found, "roller_angle": sold.roller_angle}


def summary_of_wheel(wheel: SoldWheel) -> dict[str, Any]:
    """All that is known of a wheel on sale, in plain Python types."""
    return {
        "name": wheel.name,
        "title": wheel.title,
        "rollers": wheel.rollers,
        "roller_angle_in_degrees": math.degrees(wheel.roller_angle),
        "numbers": [
            {"name": name, "value": stated.value, "unit": UNITS[name], "kind": stated.kind, "reason": stated.reason}
            for name, stated in wheel.numbers.items()
        ],
    }
