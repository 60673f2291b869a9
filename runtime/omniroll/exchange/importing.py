"""Vehicles from URDF and MJCF files, as far as they say enough, with a list of what was assumed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.exchange.likeness import mean_of
from omniroll.exchange.missing_rollers import (
    SIZES,
    hands_of,
    kind_of_catalogue,
    rollers_of_catalogue,
    rollers_of_numbers,
)
from omniroll.exchange.tree import Rigid, Tree, inertia_about, mass_of, moment_of, read_tree
from omniroll.exchange.wheels import (
    KIND,
    NEAR,
    Wheel,
    centre_of,
    plain_wheel,
    rollers_of,
    rolling_wheel,
    wheels_of_one_body,
    wheels_with_rollers,
)
from omniroll.vehicles import wheel_kind
from omniroll.vehicles.data_sheet import ASSUMED, DERIVED, GIVEN, Origin
from omniroll.vehicles.parts import places_on_rays
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import VEHICLE, by_name

KIND_OF_WHEELS = ("roller_angle", "rows", "row_offset")
ROUNDING = 1e-9  # what is no difference, over the sizes
UP = np.array([0.0, 0.0, 1.0])
REASONS = {
    "platform_radius": "places of the rollers' joints, in the middle of a wheel's rows",
    "wheel_radius": "rollers' axes and how far the solids of a roller reach",
    "roller_axis_radius": "places of the rollers' joints",
    "mass": "of all bodies",
    "yaw_inertia": "of all bodies about the vertical through S",
    "wheel_inertia": "of a wheel's bodies about its joint",
    "roller_inertia": "of a roller's bodies about its joint",
}
NO_RADIUS = (
    "is not in the file, whose wheels have no sphere, capsule, cylinder or ellipsoid that may touch: give wheel_radius "
    "(--wheel-radius)"
)
FRICTION = ("wheel_viscous", "wheel_coulomb", "roller_viscous", "roller_coulomb")


@dataclass(frozen=True, eq=False)
class Imported:
    """A vehicle that a file describes.

    vehicle   Vehicle
    assumed   what was assumed or left out, in words
    friction  arguments of Bearings by name, as far as the file has them; they stick without a speed. A list has a
              number for each wheel
    """

    vehicle: Vehicle
    assumed: tuple[str, ...] = ()
    friction: dict[str, float | list[float]] = field(default_factory=dict)


def import_vehicle(
    path: str | PathLike,
    *,
    robot: str | None = None,
    wheel_names: Sequence[str] | None = None,
    wheel: str | None = None,
    **numbers: Any,
) -> Imported:
    """The vehicle of a URDF file or of an MJCF file.

    path     of the file, str or path
    robot    name of the robot's first body, of a file with several robots
    wheel_names   names of the bodies that are wheels; None: all that look like wheels
    wheel    one of omniroll.robots.wheels.WHEEL_NAMES, whose wheels these are, where they are one body each
    numbers  fields of Vehicle by name that stand in place of what the file says, or for what it does not say; of
             wheels of one body also roller_radius, roller_length and roller_mass. One roller_angle for such wheels, at
             the corners of a robot, is that of an X; rows = 1 takes two rows as one

    Wheels are bodies on a horizontal hinge that carry three hinges or more: their rollers. Where there are none, they
    are bodies without limits on the lowest horizontal hinges. Everything else is the platform, held in its reference
    position. xacro must be expanded beforehand.

    Raises InvalidValueError where the file is not read, has several robots, no such wheels, or wheels that are not
    alike; MissingPackageError without the extra `mujoco`.
    """
    names = [entry.name for entry in VEHICLE]
    validation.known(numbers, (*names, *SIZES), "import_vehicle")
    tree = read_tree(path)
    root, parts = _robot(path, tree, robot, wheel_names)
    notes = list(tree.assumed)
    bodies, middle = root.everything(), _middle(parts)
    wheels = _wheels(parts, middle, path, notes)
    values = _numbers(wheels, path, numbers, notes) | _layout(wheels, middle, numbers)
    values |= _kind(wheels, path, kind_of_catalogue(wheel) | numbers, notes)
    guessed = _rollers(wheels, values, wheel, numbers, notes)
    values |= guessed
    values["mass"] = mass_of(bodies)
    values["yaw_inertia"] = inertia_about(bodies, np.append(middle, 0.0), UP)
    center = moment_of(bodies)[:2] / values["mass"] - middle
    if np.abs(center).max() > ROUNDING * values["platform_radius"]:
        values["center_of_mass"] = tuple(center.tolist())
    notes += _assumptions(root, parts, wheels)
    notes.append(_masses(path, tree, root, parts))
    values |= {name: value for name, value in numbers.items() if name in names and name not in KIND_OF_WHEELS}
    if values["wheel_radius"] is None:
        raise InvalidValueError("wheel_radius", None, NO_RADIUS)
    vehicle = Vehicle(**values)
    vehicle = vehicle.replace(origins=_origins(vehicle, numbers, guessed))
    return Imported(vehicle, tuple(notes), _friction(wheels))


def _robot(
    path: object, tree: Tree, robot: str | None, wheel_names: Sequence[str] | None
) -> tuple[Rigid, Sequence[Rigid]]:
    """The first body of the robot, and its wheels. Raises InvalidValueError where there are none or several."""
    roots = [root for root in tree.roots if robot in (None, root.name)]
    if not roots:
        raise InvalidValueError("robot", robot, f"must be one of {', '.join(root.name for root in tree.roots)}")
    if wheel_names is not None:
        wanted = validation.sequence("wheel_names", wheel_names, "must be names of bodies")
        found = {root: [p for p in root.everything() if p.name in wanted and p.hinge is not None] for root in roots}
    else:
        found = {root: wheels_with_rollers(root, path) for root in roots}
        if not any(found.values()):
            found = {root: wheels_of_one_body(root) for root in roots}
    found = {root: wheels for root, wheels in found.items() if wheels}
    if len(found) > 1:
        bound = f"has {len(found)} robots: {', '.join(root.name for root in found)}; name one of them as `robot`"
        raise InvalidValueError("path", str(path), bound)
    for root, wheels in found.items():
        return root, wheels
    hinges = ", ".join(part.name for root in roots for part in root.everything() if part.hinge is not None)
    bound = f"must have wheels: {KIND}, or three bodies or more without rollers; it has hinges of {hinges or 'nothing'}"
    raise InvalidValueError("path", str(path), f"{bound}. wheel_names can name the wheels")


def _middle(parts: Sequence[Rigid]) -> np.ndarray:
    """(2,) S: the point that all axles pass through; where there is none, the platform's own origin."""
    centres = np.array([centre_of(part)[:2] for part in parts])
    axles = np.array([part.hinge.axis[:2] for part in parts])
    across = np.stack([np.eye(2) - np.outer(axle, axle) / (axle @ axle) for axle in axles])
    whole = across.sum(axis=0)
    if np.linalg.cond(whole) > 1 / NEAR:
        return np.zeros(2)
    point = np.linalg.solve(whole, np.einsum("ijk,ik->j", across, centres))
    missed = np.linalg.norm(np.einsum("ijk,ik->ij", across, centres - point), axis=1)
    distances = np.linalg.norm(centres - point, axis=1)
    return point if max(missed.max(), np.ptp(distances)) <= NEAR * distances.mean() else np.zeros(2)


def _wheels(parts: Sequence[Rigid], middle: np.ndarray, path: object, notes: list[str]) -> list[Wheel]:
    """The wheels; one note for all where they say the same of themselves."""
    centre, said = np.append(middle, 0.0), []
    wheels = []
    for part in parts:
        spoken: list[str] = []
        wheels.append(rolling_wheel(part, centre, path, spoken) if rollers_of(part) else plain_wheel(part, centre))
        said += [words for words in spoken if words not in said]
    notes += said
    return wheels


def _numbers(wheels: Sequence[Wheel], path: object, given: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """What all wheels have in common: means, where they are alike. Raises InvalidValueError where they are not."""
    found: dict[str, Any] = {"wheels": len(wheels), "rollers_per_wheel": wheels[0].rollers}
    if len({wheel.rollers for wheel in wheels}) > 1:
        shown = ", ".join(f"{wheel.name} {wheel.rollers or 0}" for wheel in wheels)
        raise InvalidValueError("path", str(path), f"must have wheels with one number of rollers; it has {shown}")
    for name in ("roller_axis_radius", "wheel_radius", "wheel_inertia", "roller_inertia"):
        values = [getattr(wheel, name) for wheel in wheels]
        if None in values or name in given:
            found[name] = given.get(name)
        else:
            found[name] = mean_of(f"wheels whose {name} is", values, path, notes, name)
    return found


def _kind(wheels: Sequence[Wheel], path: object, given: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """roller_angle by wheel, rows and row_offset. Raises InvalidValueError where wheels have other rows."""
    places = np.array([wheel.centre[:2] for wheel in wheels])
    angles = [wheel.roller_angle for wheel in wheels]
    if "roller_angle" in given:
        angles = hands_of(given["roller_angle"], places, notes)
    found: dict[str, Any] = {"roller_angle": angles}
    if len({wheel.rows for wheel in wheels}) > 1:
        shown = ", ".join(f"{wheel.name} {wheel.rows}" for wheel in wheels)
        raise InvalidValueError(
            "path", str(path), f"must have wheels with one number of rows of rollers; it has {shown}"
        )
    found["rows"] = given.get("rows", wheels[0].rows)
    if wheels[0].rows == 1:
        return found | ({"row_offset": given["row_offset"]} if "row_offset" in given else {})
    sides = mean_of("rows of rollers, in m from the middle,", [abs(w.row_offset) for w in wheels], path, notes)
    if found["rows"] == 1:
        notes.append(f"two rows of rollers, {1e3 * sides:.4g} mm to each side, count as one in the middle")
        return found
    inward = {wheel.row_offset < 0 for wheel in wheels}
    if len(inward) > 1:
        notes.append("roller 0 is of the outer row: the lowest one is so on some wheels only")
    found["row_offset"] = given.get("row_offset", -sides if inward == {True} else sides)
    return found


def _layout(wheels: Sequence[Wheel], middle: np.ndarray, given: dict[str, Any]) -> dict[str, Any]:
    """Angles of the axles; their common distance from S where they are on rays, their places elsewhere."""
    places = np.array([wheel.centre[:2] for wheel in wheels]) - middle
    angles = [math.atan2(wheel.axle[1], wheel.axle[0]) for wheel in wheels]
    distances = np.linalg.norm(places, axis=1)
    found: dict[str, Any] = {"wheel_angles": angles, "platform_radius": float(distances.mean())}
    rays = np.array(places_on_rays(len(wheels), 4, found["platform_radius"], angles))
    if np.abs(places - rays).max() > NEAR * distances.mean():
        found["wheel_places"] = places.tolist()
    return found


def _rollers(
    wheels: Sequence[Wheel], values: dict[str, Any], wheel: str | None, given: dict[str, Any], notes: list[str]
) -> dict[str, Any]:
    """The numbers of rollers that the file has not."""
    sizes = [name for name in SIZES if name in given]
    if wheels[0].rollers is not None:
        if sizes or wheel is not None:
            bound = "must not be given: the file has bodies for the rollers"
            raise InvalidValueError(sizes[0] if sizes else "wheel", given.get(sizes[0]) if sizes else wheel, bound)
        return {}
    notes.append(f"wheels are one body each, the lowest on horizontal hinges: {', '.join(w.name for w in wheels)}")
    if wheel is not None:
        return rollers_of_catalogue(wheel, values["wheel_radius"], notes)
    if values["wheel_radius"] is None:
        raise InvalidValueError("wheel_radius", None, NO_RADIUS)
    axis_angle = wheel_kind.size_of(values["roller_angle"])
    return rollers_of_numbers(values["wheel_radius"], given, axis_angle, notes)


def _friction(wheels: Sequence[Wheel]) -> dict[str, float | list[float]]:
    """Arguments of Bearings: one number where all wheels have it."""
    found: dict[str, float | list[float]] = {}
    for name, values in zip(FRICTION, zip(*(wheel.friction for wheel in wheels), strict=True), strict=True):
        if any(values):
            found[name] = values[0] if len(set(values)) == 1 else list(values)
    return found


def _masses(path: object, tree: Tree, root: Rigid, parts: Sequence[Rigid]) -> str:
    """A sentence on the masses. Raises InvalidValueError unless they add up to that of the file."""
    other = [body for body in tree.roots if body is not root]
    whole, wheels = mass_of(root.everything()), sum(mass_of(part.everything()) for part in parts)
    beside = sum(mass_of(body.everything()) for body in other)
    if abs(whole + beside - tree.mass) > ROUNDING * tree.mass:
        bound = f"has {tree.mass:.9g} kg, of which {whole + beside:.9g} were found; give it as one tree of bodies"
        raise InvalidValueError("path", str(path), bound)
    said = f"masses: {whole - wheels:.6g} kg of platform and {wheels:.6g} kg of {len(parts)} wheels are {whole:.6g} kg"
    if not beside:
        return f"{said}, all that the file has"
    names = ", ".join(body.name for body in other)
    return f"{said}; {beside:.6g} kg of {names} belong to others, in all the file's {tree.mass:.6g} kg"


def _assumptions(root: Rigid, parts: Sequence[Rigid], wheels: Sequence[Wheel]) -> list[str]:
    moving = {id(part) for wheel in parts for part in wheel.everything()}
    held = [part for part in root.everything() if part is not root and id(part) not in moving]
    found = ["x is forward, y to the left, z up, as in ROS (REP 103)"]
    found += [f"{part.name} is held where the file has it" for part in held if part.hinge or part.others]
    if any(wheel.is_inward for wheel in wheels):
        found.append("axles point inward in the file: a positive rate there is a negative one of chi")
    if armature := max(part.hinge.armature for part in parts):
        found.append(f"armature {armature:.6g} kg m^2 of the wheels' joints is part of wheel_inertia")
    if armature := max((roller.hinge.armature for part in parts for roller in rollers_of(part)), default=0.0):
        found.append(f"armature {armature:.6g} kg m^2 of the rollers' joints is left out: a roller has no motor")
    found.append("rollers reach to their neighbours, with a round barrel: gaps and flat parts are left out")
    return found


def _origins(vehicle: Vehicle, numbers: dict[str, Any], guessed: dict[str, Any]) -> tuple[Origin, ...]:
    units = {name: entry.unit for name, entry in by_name(VEHICLE).items()}

    def came(name: str, reason: str) -> tuple[str, str]:
        if name in numbers:
            return GIVEN, ""
        return (ASSUMED, "the file has wheels of one body each") if name in guessed else (DERIVED, reason)

    return tuple(Origin(name, getattr(vehicle, name), units[name], *came(name, why)) for name, why in REASONS.items())
