"""Vehicles from URDF and MJCF files, as far as they say enough, with a list of what was assumed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.exchange.tree import Rigid, inertia_about, mass_of, moment_of, radius_about, read_tree
from omniroll.vehicles.data_sheet import DERIVED, GIVEN, Origin
from omniroll.vehicles.parts import places_on_rays
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import VEHICLE, by_name

NEAR = 1e-3  # how far places may be off, over the sizes they belong to, and angles in rad: files have few digits
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


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel as a file has it: its centre (3,), its axle (3,) outward, and numbers of it and its rollers."""

    centre: np.ndarray
    axle: np.ndarray
    rollers: int
    roller_axis_radius: float
    wheel_radius: float | None
    wheel_inertia: float
    roller_inertia: float
    row_offset: float
    is_inward: bool
    friction: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Imported:
    """A vehicle that a file describes.

    vehicle   Vehicle
    assumed   what was assumed or left out, in words
    friction  arguments of Bearings by name, as far as the file has them; they stick without a speed
    row_offset  in m, of double rows from the wheel's middle along the axle; 0 for single ones
    """

    vehicle: Vehicle
    assumed: tuple[str, ...] = ()
    friction: dict[str, float] = field(default_factory=dict)
    row_offset: float = 0.0


def import_vehicle(path: str | PathLike, **numbers: Any) -> Imported:
    """The vehicle of a URDF file or of an MJCF file.

    path     of the file, str or path
    numbers  fields of Vehicle by name that stand in place of what the file says, or for what it does not say

    Wheels are bodies on a horizontal hinge that carry three hinges or more: their rollers. Everything else is the
    platform, held in its reference position. xacro must be expanded beforehand.

    Raises InvalidValueError where the file is not read, has no such wheels, or wheels that are not alike;
    MissingPackageError without the extra `mujoco`.
    """
    roots, assumed = read_tree(path)
    base, parts = _base_and_wheels(path, roots)
    centres = np.array([_centre(part) for part in parts])
    middle = _middle(centres[:, :2], np.array([part.hinge.axis[:2] for part in parts]))
    wheels = [_wheel(part, np.append(middle, 0.0), path) for part in parts]
    bodies = base.everything()
    values = _numbers(wheels, path) | _layout(wheels, middle)
    values["mass"] = mass_of(bodies)
    values["yaw_inertia"] = inertia_about(bodies, np.append(middle, 0.0), UP)
    center = moment_of(bodies)[:2] / values["mass"] - middle
    if np.abs(center).max() > ROUNDING * values["platform_radius"]:
        values["center_of_mass"] = tuple(center.tolist())
    assumed += _assumptions(base, parts, wheels, bodies, values["platform_radius"])
    if values["wheel_radius"] is None and "wheel_radius" not in numbers:
        bound = "is not in the file, whose rollers have no sphere, capsule, cylinder or ellipsoid; give it"
        raise InvalidValueError("wheel_radius", None, bound)
    vehicle = Vehicle(**values | numbers)
    friction = dict(
        zip(("wheel_viscous", "wheel_coulomb", "roller_viscous", "roller_coulomb"), wheels[0].friction, strict=True)
    )
    return Imported(
        vehicle.replace(origins=_origins(vehicle, numbers)),
        tuple(assumed),
        {name: value for name, value in friction.items() if value},
        wheels[0].row_offset,
    )


def _base_and_wheels(path: object, roots: Sequence[Rigid]) -> tuple[Rigid, list[Rigid]]:
    """The body that carries wheels, and these. Raises InvalidValueError where there are none, or some lie flat."""
    for rigid in (part for root in roots for part in root.everything()):
        wheels = [child for child in rigid.children if child.hinge is not None and len(_rollers(child)) >= 3]
        standing = [wheel.name for wheel in wheels if abs(wheel.hinge.axis[2]) > NEAR]
        if standing:
            bound = f"has wheels whose axles are not horizontal in its reference position: {', '.join(standing)}"
            raise InvalidValueError("path", str(path), bound)
        if wheels:
            return rigid, wheels
    found = ", ".join(part.name for root in roots for part in root.everything() if part.hinge is not None)
    bound = "must have wheels: bodies on a hinge that carry three hinges or more, their rollers"
    raise InvalidValueError("path", str(path), f"{bound}; it has hinges of {found or 'nothing'}")


def _rollers(wheel: Rigid) -> list[Rigid]:
    return [child for child in wheel.children if child.hinge is not None]


def _centre(wheel: Rigid) -> np.ndarray:
    """The point of the axle in the middle of the rollers' axes."""
    along = [(roller.hinge.place - wheel.hinge.place) @ wheel.hinge.axis for roller in _rollers(wheel)]
    return wheel.hinge.place + np.mean(along) * wheel.hinge.axis


def _middle(centres: np.ndarray, axles: np.ndarray) -> np.ndarray:
    """(2,) S: the point that all axles pass through; where there is none, the platform's own origin."""
    across = np.stack([np.eye(2) - np.outer(axle, axle) / (axle @ axle) for axle in axles])
    whole = across.sum(axis=0)
    if np.linalg.cond(whole) > 1 / NEAR:
        return np.zeros(2)
    point = np.linalg.solve(whole, np.einsum("ijk,ik->j", across, centres))
    missed = np.linalg.norm(np.einsum("ijk,ik->ij", across, centres - point), axis=1)
    distances = np.linalg.norm(centres - point, axis=1)
    return point if max(missed.max(), np.ptp(distances)) <= NEAR * distances.mean() else np.zeros(2)


def _wheel(part: Rigid, middle: np.ndarray, path: object) -> Wheel:
    """What a wheel's bodies say. Raises InvalidValueError where they are no wheel of the kind that is modelled."""
    rollers, axis, centre = _rollers(part), part.hinge.axis, _centre(part)
    away = np.array([roller.hinge.place - centre for roller in rollers])
    along = away @ axis
    radial = away - np.outer(along, axis)
    complaint = _complaint(axis, radial, np.array([roller.hinge.axis for roller in rollers]))
    if complaint:
        raise InvalidValueError("path", str(path), f"has a wheel {part.name} {complaint}")
    inward = axis @ (centre - middle) < 0
    radius = float(np.linalg.norm(radial, axis=1).mean())
    reach = [radius_about(roller, roller.hinge.place, roller.hinge.axis) for roller in rollers]
    spun = [inertia_about(roller.everything(), roller.hinge.place, roller.hinge.axis) for roller in rollers]
    return Wheel(
        centre=centre,
        axle=-axis if inward else axis,
        rollers=len(rollers),
        roller_axis_radius=radius,
        wheel_radius=None if None in reach else float(radius + np.mean(reach)),
        wheel_inertia=inertia_about(part.everything(), centre, axis) + part.hinge.armature,
        roller_inertia=float(np.mean(spun)),
        row_offset=float(np.abs(along).max()),
        is_inward=bool(inward),
        friction=(part.hinge.damping, part.hinge.friction, rollers[0].hinge.damping, rollers[0].hinge.friction),
    )


def _complaint(axis: np.ndarray, radial: np.ndarray, axes: np.ndarray) -> str | None:
    """Why a wheel cannot be modelled: its axle (3,), the places (n, 3) of its rollers from the axle, their axes."""
    radii = np.linalg.norm(radial, axis=1)
    if np.ptp(radii) > NEAR * radii.mean():
        return f"with rollers' axes at {radii.min():.6g} to {radii.max():.6g} m: they must be equally far out"
    slant = np.abs(axes @ axis).max()
    if slant > NEAR:
        angle = math.degrees(math.asin(min(slant, 1.0)))
        return f"whose rollers' axes make {angle:.3g} degrees with its plane: only 0 is modelled, no mecanum"
    if (np.abs((axes * radial).sum(axis=1)) > NEAR * radii).any():
        return "whose rollers' axes do not lie along the rim"
    first = radial[0] / radii[0]
    angles = np.sort(np.arctan2(np.cross(axis, first) @ radial.T, first @ radial.T) % (2 * math.pi))
    gaps = np.diff(np.append(angles, angles[0] + 2 * math.pi))
    return "whose rollers are not evenly spaced" if np.ptp(gaps) > NEAR else None


def _numbers(wheels: Sequence[Wheel], path: object) -> dict[str, Any]:
    """What all wheels have in common: means, where they are alike. Raises InvalidValueError where they are not."""
    found: dict[str, Any] = {"wheels": len(wheels), "rollers_per_wheel": wheels[0].rollers}
    if len({wheel.rollers for wheel in wheels}) > 1:
        raise InvalidValueError("path", str(path), "must have wheels with one number of rollers")
    for name in ("roller_axis_radius", "wheel_radius", "wheel_inertia", "roller_inertia"):
        values = [getattr(wheel, name) for wheel in wheels]
        if None in values:
            found[name] = None
        elif np.ptp(values) > NEAR * np.mean(values):
            shown = ", ".join(f"{value:.6g}" for value in values)
            raise InvalidValueError("path", str(path), f"must have wheels that are alike; {name} is {shown}")
        else:
            found[name] = float(np.mean(values))
    return found


def _layout(wheels: Sequence[Wheel], middle: np.ndarray) -> dict[str, Any]:
    """Angles of the axles; their common distance from S where they are on rays, their places elsewhere."""
    places = np.array([wheel.centre[:2] for wheel in wheels]) - middle
    angles = [math.atan2(wheel.axle[1], wheel.axle[0]) for wheel in wheels]
    distances = np.linalg.norm(places, axis=1)
    found: dict[str, Any] = {"wheel_angles": angles, "platform_radius": float(distances.mean())}
    rays = np.array(places_on_rays(len(wheels), wheels[0].rollers, found["platform_radius"], angles))
    if np.abs(places - rays).max() > NEAR * distances.mean():
        found["wheel_places"] = places.tolist()
    return found


def _assumptions(
    base: Rigid, parts: Sequence[Rigid], wheels: Sequence[Wheel], bodies: Sequence[Rigid], platform_radius: float
) -> list[str]:
    moving = {id(part) for wheel in parts for part in wheel.everything()}
    held = [part for part in bodies if part is not base and id(part) not in moving]
    found = ["x is forward, y to the left, z up, as in ROS (REP 103)"]
    found += [f"{part.name} is held where the file has it" for part in held if part.hinge or part.others]
    if any(wheel.is_inward for wheel in wheels):
        found.append("axles point inward in the file: a positive rate there is a negative one of chi")
    if wheels[0].row_offset > NEAR * wheels[0].roller_axis_radius:
        row, lever = wheels[0].row_offset, 2 * wheels[0].row_offset / platform_radius
        found.append(
            f"two rows of rollers, {1e3 * row:.4g} mm to each side, count as one in the middle: the lever of yaw "
            f"alternates by {100 * lever:.3g} %, which is left out"
        )
    if armature := max(part.hinge.armature for part in parts):
        found.append(f"armature {armature:.6g} kg m^2 of the wheels' joints is part of wheel_inertia")
    if armature := max(roller.hinge.armature for part in parts for roller in _rollers(part)):
        found.append(f"armature {armature:.6g} kg m^2 of the rollers' joints is left out: a roller has no motor")
    found.append("rollers reach to their neighbours, with a round barrel: gaps and flat parts are left out")
    return found


def _origins(vehicle: Vehicle, numbers: dict[str, Any]) -> tuple[Origin, ...]:
    units = {name: entry.unit for name, entry in by_name(VEHICLE).items()}
    return tuple(
        Origin(name, getattr(vehicle, name), units[name], *((GIVEN, "") if name in numbers else (DERIVED, reason)))
        for name, reason in REASONS.items()
    )
