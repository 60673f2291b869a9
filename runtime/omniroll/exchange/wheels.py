"""Wheels among the bodies of a file: on rollers of their own, or as one body each."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.exchange.likeness import mean_of
from omniroll.exchange.tree import Hinge, Rigid, inertia_about, mass_of, moment_of, radius_about

ROUNDED = 1e-7  # rad that axes may be off by the rounding of a file
NEAR = 1e-3  # how far places may be off, over the sizes they belong to, and angles in rad: files have few digits
UNEVEN = 0.02  # of the angle between neighbours that rollers may be off
LEAST_ROLLERS = 3
KIND = "bodies on a horizontal hinge that carry three hinges or more, their rollers"


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel as a file has it: its centre (3,), its axle (3,) outward, and numbers of it and its rollers.

    rollers, roller_axis_radius and roller_inertia are None of a wheel that is one body, wheel_radius where no solid
    says it. roller_angle, rows and row_offset as a Vehicle has them, row_offset with the sign of the lowest roller's
    row. friction: viscous and Coulomb's at the axle and at a roller.
    """

    name: str
    centre: np.ndarray
    axle: np.ndarray
    rollers: int | None
    roller_axis_radius: float | None
    wheel_radius: float | None
    wheel_inertia: float
    roller_inertia: float | None
    roller_angle: float
    rows: int
    row_offset: float
    is_inward: bool
    friction: tuple[float, float, float, float]


def rollers_of(wheel: Rigid) -> list[Rigid]:
    return [child for child in wheel.children if child.hinge is not None]


def is_wheel(part: Rigid) -> bool:
    """Whether a body has a hinge and rollers, which carry no hinge themselves."""
    rollers = rollers_of(part)
    if part.hinge is None or len(rollers) < LEAST_ROLLERS or any(rollers_of(roller) for roller in rollers):
        return False
    return part.hinge.is_horizontal or not _stand_around(part.hinge, rollers)


def _stand_around(hinge: Hinge, parts: Sequence[Rigid]) -> bool:
    """Whether hinges point away from the line of another, as the axles of a platform on a vertical hinge do."""
    away = [part.hinge.place - hinge.place for part in parts]
    return any(abs(a @ part.hinge.axis) > 0.5 * np.linalg.norm(a) for a, part in zip(away, parts, strict=True))


def wheels_with_rollers(root: Rigid, path: object) -> list[Rigid]:
    """All wheels of a robot. Raises InvalidValueError where some lie flat."""
    wheels = [part for part in root.everything() if is_wheel(part)]
    if flat := [wheel.name for wheel in wheels if not wheel.hinge.is_horizontal]:
        bound = f"has wheels whose axles are not horizontal in its reference position: {', '.join(flat)}"
        raise InvalidValueError("path", str(path), bound)
    return wheels


def wheels_of_one_body(root: Rigid) -> list[Rigid]:
    """Bodies without hinges on a horizontal hinge without limits, as low as the lowest; no casters."""
    found = list(_ends(root))
    if len(found) < LEAST_ROLLERS:
        return []
    places = np.array([part.hinge.place for part in found])
    width = np.ptp(places[:, :2], axis=0).max()
    low = places[:, 2] <= places[:, 2].min() + UNEVEN * width
    return [part for part, is_low in zip(found, low, strict=True) if is_low]


def _ends(part: Rigid) -> Iterator[Rigid]:
    """Candidates below a body; what turns freely about the vertical is steered, and carries none."""
    for child in part.children:
        hinge = child.hinge
        if hinge is None:
            yield from _ends(child)
        elif hinge.has_limits or hinge.is_horizontal:
            if rollers_of(child) or hinge.has_limits:
                yield from _ends(child)
            else:
                yield child


def centre_of(wheel: Rigid) -> np.ndarray:
    """The point of the axle in the middle of the rollers' axes, of the solids that touch, or of the mass."""
    rollers = rollers_of(wheel)
    if rollers:
        points = np.array([roller.hinge.place for roller in rollers])
    elif wheel.solids:
        points = np.array([place for place, *_ in wheel.solids])
    else:
        points = moment_of([wheel])[None] / mass_of([wheel])
    return wheel.hinge.place + float(np.mean((points - wheel.hinge.place) @ wheel.hinge.axis)) * wheel.hinge.axis


def plain_wheel(part: Rigid, middle: np.ndarray) -> Wheel:
    """What a wheel that is one body says."""
    hinge, centre = part.hinge, centre_of(part)
    inward = bool(hinge.axis @ (centre - middle) < 0)
    return Wheel(
        name=part.name,
        centre=centre,
        axle=-hinge.axis if inward else hinge.axis,
        rollers=None,
        roller_axis_radius=None,
        wheel_radius=radius_about(part, hinge.place, hinge.axis),
        wheel_inertia=inertia_about(part.everything(), hinge.place, hinge.axis) + hinge.armature,
        roller_inertia=None,
        roller_angle=0.0,
        rows=1,
        row_offset=0.0,
        is_inward=inward,
        friction=(hinge.damping, hinge.friction, 0.0, 0.0),
    )


def rolling_wheel(part: Rigid, middle: np.ndarray, path: object, notes: list[str]) -> Wheel:
    """What a wheel and its rollers say. Raises InvalidValueError where it is none that is modelled."""
    plain = plain_wheel(part, middle)
    rollers, axis, centre = rollers_of(part), plain.axle, centre_of(part)
    away = np.array([roller.hinge.place - centre for roller in rollers])
    along = away @ axis
    radial = away - np.outer(along, axis)
    radii = np.linalg.norm(radial, axis=1)
    spoken: list[str] = []
    radius = mean_of(f"rollers' axes of {part.name}, in m from its axle,", radii, path, spoken)
    try:
        angles = _spaced(axis, radial, spoken)
        psi = _angle_of_axes(axis, radial, np.array([roller.hinge.axis for roller in rollers]), spoken)
        rows, row_offset = _rows(along, radial, angles, radius)
    except ValueError as complaint:
        raise InvalidValueError("path", str(path), f"has {part.name}, a wheel {complaint}") from None
    reach = [radius_about(roller, roller.hinge.place, roller.hinge.axis) for roller in rollers]
    spun = [inertia_about(roller.everything(), roller.hinge.place, roller.hinge.axis) for roller in rollers]
    resisting = {
        "damping": [roller.hinge.damping for roller in rollers],
        "friction": [roller.hinge.friction for roller in rollers],
    }
    of = f"of {part.name}'s rollers"
    known = None if None in reach else mean_of(f"radii {of}, in m,", reach, path, spoken, "wheel_radius")
    found = Wheel(
        name=part.name,
        centre=centre,
        axle=plain.axle,
        rollers=len(rollers),
        roller_axis_radius=radius,
        wheel_radius=None if known is None else radius + known,
        wheel_inertia=inertia_about(part.everything(), centre, axis) + part.hinge.armature,
        roller_inertia=mean_of(f"inertias {of}, in kg m^2,", spun, path, spoken, "roller_inertia"),
        roller_angle=psi,
        rows=rows,
        row_offset=row_offset,
        is_inward=plain.is_inward,
        friction=(*plain.friction[:2], *(_of_rollers(name, of, v, spoken) for name, v in resisting.items())),
    )
    notes += spoken
    return found


def _of_rollers(name: str, of: str, values: Sequence[float], notes: list[str]) -> float:
    """The mean friction of a wheel's rollers."""
    if np.ptp(values) > 0:
        notes.append(f"{name} {of} from {min(values):.6g} to {max(values):.6g} counts as its mean")
    return float(np.mean(values))


def _spaced(axis: np.ndarray, radial: np.ndarray, notes: list[str]) -> np.ndarray:
    """(n,) the rollers' angles about the axle from the first. Raises ValueError unless they are evenly spaced."""
    first = radial[0] / np.linalg.norm(radial[0])
    angles = np.arctan2(np.cross(axis, first) @ radial.T, first @ radial.T) % (2 * math.pi)
    angles = np.where(angles > 2 * math.pi - NEAR, angles - 2 * math.pi, angles)
    ordered = np.sort(angles)
    gaps = np.degrees(np.diff(np.append(ordered, ordered[0] + 2 * math.pi)))
    if np.ptp(gaps) > UNEVEN * gaps.mean():
        words = f"neighbours are {gaps.min():.4g} to {gaps.max():.4g} degrees apart"
        raise ValueError(f"whose rollers are not evenly spaced: {words}")
    if np.ptp(gaps) > np.degrees(NEAR):
        notes.append(f"rollers {gaps.min():.6g} to {gaps.max():.6g} degrees apart count as evenly spaced")
    return angles


def _angle_of_axes(axle: np.ndarray, radial: np.ndarray, axes: np.ndarray, notes: list[str]) -> float:
    """psi in rad: the axle (3,) points outward, the places (n, 3) of the rollers are from it, their axes (n, 3) either
    way. Raises ValueError where they do not lie along the rim, at one angle."""
    outward = radial / np.linalg.norm(radial, axis=1)[:, None]
    if (np.abs((axes * outward).sum(axis=1)) > NEAR).any():
        raise ValueError("whose rollers' axes do not lie along the rim")
    aside, along = axes @ axle, (axes * np.cross(axle, outward)).sum(axis=1)
    angles = np.arctan2(aside * np.sign(along), np.abs(along))
    if np.ptp(angles) > NEAR:
        least, most = np.degrees([angles.min(), angles.max()])
        raise ValueError(f"whose rollers' axes make {least:.4g} to {most:.4g} degrees with its plane: one is modelled")
    mean = float(angles.mean())
    if np.ptp(angles) > ROUNDED:
        notes.append(f"rollers' axes count as {math.degrees(mean):.6g} degrees out of the wheel's plane, their mean")
    return mean if abs(mean) > NEAR else 0.0


def _rows(along: np.ndarray, radial: np.ndarray, angles: np.ndarray, radius: float) -> tuple[int, float]:
    """Rows of rollers, and the place along the axle, outward, of the row whose roller is lowest.

    Raises ValueError unless there is one row, or two that stand by turns."""
    if np.abs(along).max() <= NEAR * radius:
        return 1, 0.0
    in_turn = along[np.argsort(angles)]
    offset = float(np.abs(in_turn).mean())
    signs = np.where(np.arange(len(in_turn)) % 2, -1.0, 1.0) * np.sign(in_turn[0])
    if len(in_turn) % 2 or np.abs(in_turn - offset * signs).max() > UNEVEN * offset:
        words = "by turns on both sides of its middle, equally far"
        raise ValueError(f"whose rollers stand neither in one row nor in two, {words}")
    return 2, offset * float(np.sign(along[radial[:, 2].argmin()]))
