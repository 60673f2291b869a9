"""Rollers of wheels that a file has as one body: from numbers that are given, or from a wheel of the catalogue."""

import math
from collections.abc import Mapping
from typing import Any

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.robots.catalogue import ROBOTS, robot
from omniroll.vehicles import parts
from omniroll.vehicles.data_sheet import DENSITY

SIZES = ("roller_radius", "roller_length", "roller_mass")  # of a roller; a Vehicle has its inertia and its axis
OF_WHEEL = ("rollers_per_wheel", "roller_axis_radius", "roller_inertia")
SAME_WHEEL = 0.02  # of its radius that a wheel of the catalogue may differ from that of a file


def rollers_of_numbers(wheel_radius: float, given: Mapping[str, Any], assumed: list[str]) -> dict[str, Any]:
    """rollers_per_wheel, roller_axis_radius and roller_inertia of solid cylinders; what is assumed is noted.

    given    those three, or the sizes of a roller, by name
    assumed  where the notes are added

    Raises InvalidValueError for what is missing.
    """
    missing = [] if "rollers_per_wheel" in given else ["rollers_per_wheel"]
    missing += [] if {"roller_radius", "roller_axis_radius"} & set(given) else ["roller_radius"]
    if missing:
        bound = f"must be given{' with ' + missing[1] if missing[1:] else ''}: the file has wheels of one body each"
        raise InvalidValueError(missing[0], None, f"{bound}; or name a wheel of {', '.join(ROBOTS)}")
    count = given["rollers_per_wheel"]
    radius = given.get("roller_radius", wheel_radius - given.get("roller_axis_radius", 0.0))
    radius = validation.positive("roller_radius", radius)
    found = {"rollers_per_wheel": count, "roller_axis_radius": given.get("roller_axis_radius", wheel_radius - radius)}
    if "roller_inertia" in given:
        return found | {"roller_inertia": given["roller_inertia"]}
    length = given.get("roller_length")
    if length is None:
        length = 2 * found["roller_axis_radius"] * math.tan(math.pi / count)
        assumed.append(f"assumed: rollers {length:.4g} m long, up to their neighbours")
    mass = given.get("roller_mass")
    if mass is None:
        mass = parts.evaluate(
            "mass_of_cylinder", 1, 3, cylinder_radius=radius, cylinder_length=length, cylinder_density=DENSITY
        )[0]
        assumed.append(f"assumed: rollers of {DENSITY:g} kg/m^3, {mass:.4g} kg each")
    found["roller_inertia"], _ = parts.cylinder(mass, radius, length)
    assumed.append(f"assumed: roller_inertia {found['roller_inertia']:.4g} kg m^2, of solid cylinders")
    return found


def rollers_of_catalogue(name: str, wheel_radius: float | None, assumed: list[str]) -> dict[str, Any]:
    """The same, and wheel_radius, of the wheel of a robot of the catalogue.

    Raises InvalidValueError for another name, and where the file's wheel has another radius.
    """
    wheel = robot(validation.choice("wheel", name, tuple(ROBOTS))).vehicle
    if wheel_radius is not None and abs(wheel_radius - wheel.wheel_radius) > SAME_WHEEL * wheel.wheel_radius:
        bound = f"has a radius of {wheel.wheel_radius:.6g} m, and the file's wheels have {wheel_radius:.6g} m"
        raise InvalidValueError("wheel", name, bound)
    assumed.append(f"assumed: rollers and radius of the wheels are those of {name} in the catalogue of robots")
    return {key: getattr(wheel, key) for key in (*OF_WHEEL, "wheel_radius")}


def refuse_slanted(angle: float) -> None:
    """Raises InvalidValueError for rollers whose axes do not lie in the wheel's plane."""
    if abs(float(validation.real_array("roller_angle", angle, ()))) > 0:
        bound = "must be 0, the angle between rollers' axes and the wheel's plane: mecanum wheels are not modelled"
        raise InvalidValueError("roller_angle", angle, bound)
