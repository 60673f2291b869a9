"""Rollers whose meridian is made of arcs: the wheel's centre rises and falls while it rolls over them."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts, wheel_kind
from omniroll.vocabulary import STANDARD_GRAVITY

NODES = 32  # of Gauss and Legendre, which give means over an arc to rounding
SAME = 1e-9  # of a roller's radius, that two lengths of a profile may differ by rounding
ROUNDED = 1e-6  # of the distance of two arcs: where one touches the other from inside, numbers of seven digits do
FITS = 1e-2  # of a roller's radius in the middle, that wheel_radius - roller_axis_radius may have otherwise
NARROW = 1e-9  # of the joint's angle: an arc that carries over less does not

Arc = tuple[float, float, float]  # along the roller's axis from its middle and from it its centre; its radius; in m


class Piece(NamedTuple):
    """An arc of a roller's meridian, and the angles of the wheel in rad between which it carries."""

    arc: Arc
    first: float
    last: float

    @property
    def middle(self) -> float:
        return (self.first + self.last) / 2


def check(vehicle: Any) -> None:
    """Raise InvalidValueError for a meridian on which no wheel rolls on."""
    if vehicle.roller_profile is not None:
        _check_arcs(vehicle)
    if least_contact(vehicle) <= 0:
        bound = "must keep the contact roller's axis above the ground at the joint"
        raise InvalidValueError(field_of(vehicle), getattr(vehicle, field_of(vehicle)), bound)


def field_of(vehicle: Any) -> str:
    """The field by which a vehicle's rollers have a profile; "" where they have none."""
    return next((name for name in ("meridian_radius", "roller_profile") if getattr(vehicle, name) is not None), "")


def least_contact(vehicle: Any) -> float:
    """The least distance in m of a roller's axis from its contact, in the wheel's plane; of rollers with a profile."""
    return min(
        ride(piece.arc, vehicle, end, angle)["contact"]
        for angle in {abs(angle) for angle in vehicle.roller_angle}
        for piece in pieces(vehicle, angle)
        for end in piece[1:]
    )


def _check_arcs(vehicle: Any) -> None:
    arcs, thick = vehicle.roller_profile, vehicle.roller_radius

    def refuse(bound: str) -> None:
        raise InvalidValueError("roller_profile", arcs, bound)

    if vehicle.meridian_radius is not None:
        refuse("does not go with meridian_radius: one arc is [0, roller radius - meridian_radius, meridian_radius]")
    if min(radius for _, _, radius in arcs) < 0:
        refuse("must have no radius below 0; an edge has 0")
    if any(after[0] <= before[0] for before, after in zip(arcs, arcs[1:], strict=False)):
        refuse("must go along the roller's axis: the first numbers of its arcs must increase")
    mirrored = [(-along, aside, radius) for along, aside, radius in reversed(arcs)]
    if not np.allclose(arcs, mirrored, rtol=0, atol=SAME * thick):
        refuse("must be the same from both ends of the roller: arcs come in pairs, at -along and along")
    if len({abs(angle) for angle in vehicle.roller_angle}) > 1:
        refuse("takes rollers whose angles have one size, whatever their signs")
    angle = abs(vehicle.roller_angle[0])
    middle = next(piece for piece in pieces(vehicle, angle) if piece.last >= 0)
    radius = ride(middle.arc, vehicle, 0.0, angle)["height"] - vehicle.roller_axis_radius
    if abs(radius - thick) > FITS * thick:
        refuse(f"has the radius {radius:.6g} in the middle; wheel_radius - roller_axis_radius is {thick:.6g}")


def arcs_of(vehicle: Any) -> tuple[Arc, ...]:
    """The arcs of a roller's meridian from one end to the other; of a vehicle without a profile the one of a roller
    that keeps an omni-wheel round."""
    if vehicle.roller_profile is not None:
        return vehicle.roller_profile
    if vehicle.meridian_radius is None:
        return ((0.0, -vehicle.roller_axis_radius, vehicle.wheel_radius),)
    return ((0.0, vehicle.roller_radius - vehicle.meridian_radius, vehicle.meridian_radius),)


def pieces(vehicle: Any, axis_angle: float) -> tuple[Piece, ...]:
    """The arcs that carry a wheel between two joints, in the order in which it comes over them turning forward.

    axis_angle  in rad, of the wheel's rollers

    Raises InvalidValueError for an arc that lies behind others, so that none of its points is outermost.
    """
    return _pieces(arcs_of(vehicle)[::-1], math.pi / vehicle.rollers_per_wheel, abs(axis_angle))


@lru_cache(maxsize=256)
def _pieces(arcs: tuple[Arc, ...], joint: float, axis_angle: float) -> tuple[Piece, ...]:
    pairs = zip(arcs, arcs[1:], strict=False)
    borders = [-math.inf, *(_border(*pair, arcs, axis_angle) for pair in pairs), math.inf]
    for arc, first, last in zip(arcs, borders, borders[1:], strict=False):
        if first > last + SAME:
            raise InvalidValueError("roller_profile", arcs[::-1], f"has an arc that never carries: leave {arc} out")
    ends = np.clip(borders, -joint, joint).tolist()
    found = zip(arcs, ends, ends[1:], strict=False)
    return tuple(Piece(*piece) for piece in found if piece[2] - piece[1] > NARROW * joint)


def _border(before: Arc, after: Arc, arcs: tuple[Arc, ...], axis_angle: float) -> float:
    """The angle of a wheel in rad at which a roller passes from one arc to the next."""
    two = {"arc_before": before, "arc_after": after}
    (square,) = parts.evaluate("tangent_of_arcs", 1, 3, **two)
    if square < -ROUNDED * math.dist(before[:2], after[:2]) ** 2:
        inner = min(before, after, key=lambda arc: arc[2])
        bound = f"has an arc inside another: {inner} lies inside the circle of its neighbour; it must touch it"
        raise InvalidValueError("roller_profile", arcs[::-1], bound)
    sine, cosine = parts.evaluate("border_of_arcs", 1, 3, **two, tangent=math.sqrt(max(square, 0.0)))
    turn = sine / math.cos(axis_angle)  # sin(delta) = cos(psi) sin(chi)
    return math.asin(turn) if cosine > 0 and abs(turn) < 1 else math.copysign(math.inf, sine)


def ride(arc: Arc, vehicle: Any, turn: float, axis_angle: float) -> dict[str, float]:
    """Of a wheel that stands on an arc, at `turn` in rad from its roller's middle, all in m.

    axis_angle  in rad, of its rollers

    height, slope, bend  the height H of its centre over the ground, H', H + H''
    contact              rho, the contact's distance from the roller's axis in the wheel's plane
    side                 how far outward of the roller's middle plane the contact is
    """
    found = parts.evaluate(
        "ride_of_profile", 1, 3, arc_of_meridian=arc, roller_axis_radius=vehicle.roller_axis_radius,
        axis_angle=axis_angle, wheel_turn=turn,
    )  # fmt: skip
    return dict(zip(("height", "slope", "bend", "contact", "side"), found, strict=True))


def rate_on_ground(vehicle: Any, gravity: float = STANDARD_GRAVITY) -> float:
    """In rad/s, the rate beyond which a wheel that turns steadily leaves the ground on an arc of its rollers."""
    found = [
        ride(piece.arc, vehicle, turn, angle)
        for angle in {abs(angle) for angle in vehicle.roller_angle}
        for piece in pieces(vehicle, angle)
        for turn in _turns(piece, vehicle, angle)
    ]
    fall = max(one["height"] - one["bend"] for one in found)  # times the square of the rate: acceleration
    return math.sqrt(gravity / fall) if fall > 0 else math.inf


def mean_radii(vehicle: Any) -> np.ndarray:
    """(N,) in m, the way ahead of each wheel per angle that it turns, in the mean over a pitch: wheel_radius, unless
    the rollers have a profile. Controllers and odometry know this one."""
    if not vehicle.has_profile:
        return np.array(vehicle.by_wheel["wheel_radius"])
    mean_of = {angle: _mean(vehicle, abs(angle))[0] for angle in set(vehicle.roller_angle)}
    return np.array([mean_of[angle] for angle in vehicle.roller_angle])


def _mean(vehicle: Any, axis_angle: float) -> tuple[float, float]:
    """The means of H and of H cos(chi) over a pitch."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    sums, joint = np.zeros(2), math.pi / vehicle.rollers_per_wheel
    for piece in pieces(vehicle, axis_angle):
        half = (piece.last - piece.first) / 2
        turns = piece.middle + half * nodes
        heights = np.array([ride(piece.arc, vehicle, turn, axis_angle)["height"] for turn in turns.tolist()])
        sums += half * np.array([weights @ heights, weights @ (heights * np.cos(turns))])
    ahead, aside = sums / (2 * joint)
    return float(ahead), float(aside)


def riding(vehicle: Any) -> dict[str, float]:
    """How the wheels of a vehicle whose rollers have a profile roll, in m.

    highest, lowest    heights of a wheel's centre over the ground
    contact_shift      how far the contact is from the wheel's middle at the joint
    forward_radius     way ahead per angle of the wheel, in the mean over a pitch
    sideways_radius    the same sideways, of rollers at an angle

    Raises InvalidValueError for angles of rollers of several sizes.
    """
    angle = wheel_kind.size_of(vehicle.roller_angle)
    ahead, aside = _mean(vehicle, angle)
    found = [
        ride(piece.arc, vehicle, turn, angle)
        for piece in pieces(vehicle, angle)
        for turn in _turns(piece, vehicle, angle)
    ]
    heights = [one["height"] for one in found]
    radii = {"highest": max(heights), "lowest": min(heights), "contact_shift": abs(found[-1]["side"])}
    radii |= {"forward_radius": ahead}
    return radii | ({"sideways_radius": aside / float(np.tan(angle))} if angle else {})


def _turns(piece: Piece, vehicle: Any, axis_angle: float) -> tuple[float, ...]:
    """Where a wheel may be highest or lowest on a piece, its last end behind all others."""
    from scipy.optimize import brentq  # which a vehicle by itself does not need

    slope = lambda turn: ride(piece.arc, vehicle, turn, axis_angle)["slope"]  # noqa: E731
    level = (brentq(slope, *piece[1:]),) if slope(piece.first) * slope(piece.last) < 0 else ()
    return (*level, piece.first, piece.last)
