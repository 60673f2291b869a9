"""Rollers whose meridian is an arc: the wheel's centre rises and falls while it rolls over them."""

import math
from typing import Any

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts, wheel_kind
from omniroll.vocabulary import STANDARD_GRAVITY

NODES = 32  # of Gauss and Legendre, which give means over a pitch to rounding


def check(vehicle: Any) -> None:
    """Raise InvalidValueError for a meridian_radius whose rollers' axes touch the ground at the joint."""
    for angle in sorted({abs(angle) for angle in vehicle.roller_angle}):
        if ride(vehicle, np.pi / vehicle.rollers_per_wheel, angle)["contact"] <= 0:
            bound = "is too large: the contact roller's axis must stay above the ground at the joint"
            raise InvalidValueError("meridian_radius", vehicle.meridian_radius, bound)


def ride(vehicle: Any, turn: float, axis_angle: float) -> dict[str, float]:
    """Of a wheel at `turn` in rad from its roller's middle, all in m.

    axis_angle  in rad, of its rollers

    height, slope, bend  the height H of its centre over the ground, H', H + H''
    contact              rho, the contact's distance from the roller's axis in the wheel's plane
    side                 how far outward of the roller's middle plane the contact is
    """
    found = parts.evaluate(
        "ride_of_profile", 1, 3, arc_of_meridian=vehicle.meridian_radius, wheel_radius=vehicle.wheel_radius,
        roller_axis_radius=vehicle.roller_axis_radius, axis_angle=axis_angle, wheel_turn=turn,
    )  # fmt: skip
    return dict(zip(("height", "slope", "bend", "contact", "side"), found, strict=True))


def rate_on_ground(vehicle: Any, gravity: float = STANDARD_GRAVITY) -> float:
    """In rad/s, the rate beyond which a wheel that turns steadily leaves the ground in the middle of its rollers."""
    middles = [ride(vehicle, 0.0, abs(angle)) for angle in set(vehicle.roller_angle)]
    fall = max(middle["height"] - middle["bend"] for middle in middles)  # times the square of the rate: acceleration
    return math.sqrt(gravity / fall) if fall > 0 else math.inf


def mean_radii(vehicle: Any) -> np.ndarray:
    """(N,) in m, the way ahead of each wheel per angle that it turns, in the mean over a pitch: wheel_radius, unless
    the vehicle has a meridian_radius. Controllers and odometry know this one."""
    if vehicle.meridian_radius is None:
        return np.array(vehicle.by_wheel["wheel_radius"])
    mean_of = {angle: _mean(vehicle, abs(angle))[0] for angle in set(vehicle.roller_angle)}
    return np.array([mean_of[angle] for angle in vehicle.roller_angle])


def _mean(vehicle: Any, axis_angle: float) -> tuple[float, float]:
    """The means of H and of H cos(chi) over a pitch."""
    joint = np.pi / vehicle.rollers_per_wheel
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    heights = np.array([ride(vehicle, joint * node, axis_angle)["height"] for node in nodes])
    return float(weights @ heights) / 2, float(weights @ (heights * np.cos(joint * nodes))) / 2


def riding(vehicle: Any) -> dict[str, float]:
    """How the wheels of a vehicle with a meridian_radius roll, in m.

    highest, lowest    heights of a wheel's centre over the ground
    contact_shift      how far the contact is from the wheel's middle at the joint
    forward_radius     way ahead per angle of the wheel, in the mean over a pitch
    sideways_radius    the same sideways, of rollers at an angle

    Raises InvalidValueError for angles of rollers of several sizes.
    """
    angle, joint = wheel_kind.size_of(vehicle.roller_angle), np.pi / vehicle.rollers_per_wheel
    ahead, aside = _mean(vehicle, angle)
    middle, end = (ride(vehicle, turn, angle) for turn in (0.0, joint))
    found = {
        "highest": max(middle["height"], end["height"]), "lowest": min(middle["height"], end["height"]),
        "contact_shift": abs(end["side"]), "forward_radius": ahead,
    }  # fmt: skip
    return found | ({"sideways_radius": aside / float(np.tan(angle))} if angle else {})
