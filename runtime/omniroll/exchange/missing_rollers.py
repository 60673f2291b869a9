"""Rollers of wheels that a file has as one body: from numbers that are given, or from a wheel of the catalogue."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.robots.wheels import WHEEL_NAMES, wheel_numbers
from omniroll.vehicles import parts, wheel_kind
from omniroll.vehicles.data_sheet import DENSITY

SIZES = ("roller_radius", "roller_length", "roller_mass")  # of a roller; a Vehicle has its inertia and its axis
OF_WHEEL = ("rollers_per_wheel", "roller_axis_radius", "roller_inertia")
SAME_WHEEL = 0.02  # of its radius that a wheel of the catalogue may differ from that of a file


def rollers_of_numbers(
    wheel_radius: float, given: Mapping[str, Any], axis_angle: float, assumed: list[str]
) -> dict[str, Any]:
    """rollers_per_wheel, roller_axis_radius and roller_inertia of solid cylinders; what is assumed is noted.

    given       those three, or the sizes of a roller, by name
    axis_angle  size of roller_angle in rad
    assumed     where the notes are added

    Raises InvalidValueError for what is missing.
    """
    missing = [] if "rollers_per_wheel" in given else ["rollers_per_wheel"]
    missing += [] if {"roller_radius", "roller_axis_radius"} & set(given) else ["roller_radius"]
    if missing and not (axis_angle and missing == ["roller_radius"]):
        bound = f"must be given{' with ' + missing[1] if missing[1:] else ''}: the file has wheels of one body each"
        raise InvalidValueError(missing[0], None, f"{bound}; or name a wheel of {', '.join(WHEEL_NAMES)}")
    count = given["rollers_per_wheel"]
    if missing[:1] == ["roller_radius"]:
        axis = wheel_kind.axis_by_neighbours(wheel_radius, count, axis_angle)
        assumed.append(f"assumed: rollers' axes {axis:.4g} m from the axle, where they touch their neighbours")
        given = {**given, "roller_axis_radius": axis}
    radius = given.get("roller_radius", wheel_radius - given.get("roller_axis_radius", 0.0))
    radius = validation.positive("roller_radius", radius)
    found = {"rollers_per_wheel": count, "roller_axis_radius": given.get("roller_axis_radius", wheel_radius - radius)}
    if "roller_inertia" in given:
        return found | {"roller_inertia": given["roller_inertia"]}
    length = given.get("roller_length")
    if length is None:
        length = 2 * found["roller_axis_radius"] * math.tan(math.pi / count)
        if axis_angle:
            length = 2 * wheel_kind.half_length(wheel_radius, found["roller_axis_radius"], count, axis_angle)
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
    wheel = wheel_numbers(name)
    radius = wheel["wheel_radius"]
    if wheel_radius is not None and abs(wheel_radius - radius) > SAME_WHEEL * radius:
        bound = f"has a radius of {radius:.6g} m, and the file's wheels have {wheel_radius:.6g} m"
        raise InvalidValueError("wheel", name, bound)
    assumed.append(f"assumed: rollers and radius of the wheels are those of {name} in the catalogue")
    return {key: wheel[key] for key in (*OF_WHEEL, "wheel_radius")}


def kind_of_catalogue(name: str | None) -> dict[str, Any]:
    """roller_angle, rows and row_offset of a wheel of the catalogue; nothing for no wheel, and for omni-wheels."""
    wheel = wheel_numbers(name) if name is not None else {}
    return {key: wheel[key] for key in ("roller_angle", "rows", "row_offset") if key in wheel}


def hands_of(roller_angle: ArrayLike, places: np.ndarray, assumed: list[str]) -> list[float]:
    """roller_angle by wheel. One positive number, for four wheels at the corners of a robot, is that of an X.

    places   (N, 2) of the wheels
    assumed  where the notes are added

    Raises InvalidValueError for what are not such numbers.
    """
    angles = validation.real_array("roller_angle", roller_angle)
    if angles.ndim:
        return validation.real_array("roller_angle", angles, (len(places),)).tolist()
    corners = np.sign(places - places.mean(axis=0))
    if len({tuple(corner) for corner in corners.tolist()}) != len(places) or len(places) != 4 or not corners.all():
        return [float(angles)] * len(places)
    if angles:
        assumed.append(
            "assumed: the rollers on top of the wheels make an X, seen from above; give roller_angle by wheel"
        )
    return (angles * corners.prod(axis=1)).tolist()
