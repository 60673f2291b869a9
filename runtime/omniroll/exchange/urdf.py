"""A vehicle as a URDF file, with a link for each roller."""

import math
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.exchange.bodies import Bodies, bodies_of
from omniroll.exchange.mjcf import SPHERES, checked_spheres, roller_places, text_of
from omniroll.vehicles.vehicle import Vehicle


def to_urdf(vehicle: Vehicle, *, spheres: int = SPHERES, bodies: Bodies | None = None) -> str:
    """The text of a URDF file: a platform, wheels and rollers, in the position where the middles of rollers touch.

    vehicle  Vehicle
    spheres  number of spheres that stand for a roller
    bodies   Bodies; None: those that bodies_of finds

    Links and joints are named as in to_mjcf. A wheel's joint axis points outward: a positive rate raises chi. URDF has
    no motors, no ground and no friction between rollers and ground.

    Raises InvalidValueError for numbers that are not positive, and as bodies_of does.
    """
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    if not isinstance(bodies, Bodies | None):
        raise InvalidValueError("bodies", bodies, "must be Bodies or None")
    slants = checked_spheres(vehicle, spheres)
    made = bodies_of(vehicle) if bodies is None else bodies
    root = Element("robot", name="omniroll")
    across = made.platform_transverse_inertia
    _link(root, "platform", made.platform_mass, (across, across, made.platform_inertia), (*made.platform_place, 0))
    for i, (alpha, place) in enumerate(zip(vehicle.wheel_angles, vehicle.places(), strict=True), 1):
        across = made.hub_transverse_inertia
        _link(root, f"wheel{i}", made.hub_mass, (made.hub_axial_inertia, across, across))
        _joint(root, f"wheel{i}", "platform", (*place, 0), (0, 0, alpha), (1, 0, 0))
        _rollers(root, i, vehicle, made, slants)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _rollers(root: Element, i: int, vehicle: Vehicle, made: Bodies, slants: np.ndarray) -> None:
    """The rollers of wheel i; the axis of each is the y of its link turned by -psi about the link's z."""
    axis, across, psi = vehicle.roller_axis_radius, made.roller_transverse_inertia, vehicle.roller_angle[i - 1]
    line = np.array([math.sin(psi), math.cos(psi), 0.0])
    inertia = (across, made.roller_axial_inertia, across)
    for j, (kappa, side) in enumerate(roller_places(vehicle), 1):
        name = f"roller{i}_{j}"
        link = _link(root, name, made.roller_mass, inertia, turn=(0, 0, -psi))
        for slant in slants:
            place = axis * math.tan(slant) / math.cos(psi) * line
            solid = SubElement(link, "collision")
            SubElement(solid, "origin", xyz=text_of(*place), rpy="0 0 0")
            radius = text_of(vehicle.wheel_radius - axis / math.cos(slant))
            SubElement(SubElement(solid, "geometry"), "sphere", radius=radius)
        place = (side, axis * math.sin(kappa), -axis * math.cos(kappa))
        _joint(root, name, f"wheel{i}", place, (kappa, 0, 0), tuple(line))


def _link(
    root: Element,
    name: str,
    mass: float,
    inertia: tuple[float, ...],
    place: tuple[float, ...] = (0, 0, 0),
    turn: tuple[float, ...] = (0, 0, 0),
) -> Element:
    """A link with its mass, and its inertias about axes that are turned by roll, pitch and yaw."""
    link = SubElement(root, "link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=text_of(*place), rpy=text_of(*turn))
    SubElement(inertial, "mass", value=text_of(mass))
    own = dict(zip(("ixx", "iyy", "izz"), map(text_of, inertia), strict=True))
    SubElement(inertial, "inertia", **own, ixy="0", ixz="0", iyz="0")
    return link


def _joint(
    root: Element, name: str, parent: str, place: tuple[float, ...], turn: tuple[float, ...], axis: tuple[float, ...]
) -> None:
    """A hinge without limits, of the link of the same name."""
    joint = SubElement(root, "joint", name=name, type="continuous")
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=name)
    SubElement(joint, "origin", xyz=text_of(*place), rpy=text_of(*turn))
    SubElement(joint, "axis", xyz=text_of(*axis))
