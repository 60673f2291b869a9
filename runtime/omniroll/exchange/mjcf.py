"""A vehicle as an MJCF file for MuJoCo, with a body for each roller."""

import math
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.exchange.bodies import Bodies, bodies_of
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import STANDARD_GRAVITY

SPHERES = 31  # of a roller
MOST_SPHERES = 10_000
MOST_IN_ALL = 1_000_000  # some 100 MB of text
UP = (0.0, 0.0, -STANDARD_GRAVITY)


def to_mjcf(
    vehicle: Vehicle,
    *,
    step: float = 5e-4,
    friction: float = 1.0,
    spheres: int = SPHERES,
    gravity: tuple[float, float, float] = UP,
    armature: float = 0.0,
    roller_damping: float = 0.0,
    bodies: Bodies | None = None,
    height: float | None = None,
) -> str:
    """The text of an MJCF file: the vehicle on a plane, in the position where the middles of rollers touch.

    vehicle         Vehicle
    step            in s, MuJoCo's time step; contacts are as stiff as it allows
    friction        coefficient between rollers and ground
    spheres         number of spheres that stand for a roller
    gravity         (3,) in m/s^2
    armature        in kg m^2, inertia that motors add at each wheel's axle
    roller_damping  in N m s, of each roller's axle
    bodies          Bodies; None: those that bodies_of finds
    height          in m, of the centre of mass of the whole above the ground; None: the axles' height

    A roller is a row of spheres that touch its barrel from inside, at any angle to its wheel's plane: each roller
    touches the plane at one place, where a mesh would rest on several vertices, which resists its rolling. Joints are
    named wheel1, roller1_1 and so on, and each wheel has an actuator motor1 that takes a torque. A wheel's joint axis
    points outward: a positive rate raises chi. In skids the wheels of such a model hop: results then need not come
    nearer with a smaller step.

    Raises InvalidValueError for numbers that are not positive, and as bodies_of does.
    """
    step, friction = validation.positive("step", step), validation.positive("friction", friction)
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    slants = checked_spheres(vehicle, spheres)
    gravity = validation.real_array("gravity", gravity, (3,))
    armature = validation.not_negative("armature", armature)
    roller_damping = validation.not_negative("roller_damping", roller_damping)
    if not isinstance(bodies, Bodies | None):
        raise InvalidValueError("bodies", bodies, "must be Bodies or None")
    height = None if height is None else validation.positive("height", height)
    made = bodies_of(vehicle) if bodies is None else bodies
    root = Element("mujoco", model="omniroll")
    SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    SubElement(
        root, "option", timestep=text_of(step), gravity=text_of(*gravity), integrator="implicitfast", cone="elliptic",
        impratio="100", tolerance="1e-12", jacobian="dense",  # MuJoCo 4.0.0 errs where it takes sparse ones
    )  # fmt: skip
    contact = {"contype": "1", "conaffinity": "0", "friction": text_of(friction, 0, 0)}
    stiff = {"solref": text_of(2 * step, 1), "solimp": "0.99 0.999 1e-4"}
    SubElement(SubElement(root, "default"), "geom", type="sphere", **contact, **stiff)
    world = SubElement(root, "worldbody")
    SubElement(world, "geom", name="ground", type="plane", size="0 0 1", contype="0", conaffinity="1")
    base = SubElement(world, "body", name="platform", pos=text_of(0, 0, vehicle.wheel_radius))
    SubElement(base, "freejoint")
    across = made.platform_transverse_inertia
    above = 0.0 if height is None else height - vehicle.wheel_radius  # of the axles, where wheels have their centres
    place = (*made.platform_place, above * vehicle.mass / made.platform_mass)
    _inertial(base, made.platform_mass, (across, across, made.platform_inertia), place)
    actuators = SubElement(root, "actuator")
    places = vehicle.places()
    for i, (alpha, place) in enumerate(zip(vehicle.wheel_angles, places, strict=True), 1):
        wheel = SubElement(base, "body", name=f"wheel{i}", pos=text_of(*place, 0), quat=_turn(alpha, 2))
        SubElement(wheel, "joint", name=f"wheel{i}", type="hinge", axis="1 0 0", armature=text_of(armature))
        across = made.hub_transverse_inertia
        _inertial(wheel, made.hub_mass, (made.hub_axial_inertia, across, across))
        _rollers(wheel, i, vehicle, made, slants, roller_damping)
        SubElement(actuators, "motor", name=f"motor{i}", joint=f"wheel{i}", gear="1")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _rollers(wheel: Element, i: int, vehicle: Vehicle, made: Bodies, slants: np.ndarray, damping: float) -> None:
    """The rollers of wheel i, the first below the axle; chi and the places of rollers grow about the axle.

    A roller's own axis is the y of its body."""
    axis, across = vehicle.roller_axis_radius, made.roller_transverse_inertia
    psi = vehicle.roller_angle[i - 1]
    for j, (kappa, side) in enumerate(roller_places(vehicle), 1):
        place = text_of(side, axis * math.sin(kappa), -axis * math.cos(kappa))
        roller = SubElement(wheel, "body", name=f"roller{i}_{j}", pos=place, quat=_turn(kappa, 0, -psi))
        SubElement(roller, "joint", name=f"roller{i}_{j}", type="hinge", axis="0 1 0", damping=text_of(damping))
        _inertial(roller, made.roller_mass, (across, made.roller_axial_inertia, across))
        for slant in slants:
            size = vehicle.wheel_radius - axis / math.cos(slant)
            along = axis * math.tan(slant) / math.cos(psi)
            SubElement(roller, "geom", pos=text_of(0, along, 0), size=text_of(size))


def checked_spheres(vehicle: Vehicle, spheres: int) -> np.ndarray:
    """The angles of a wheel in rad at which the spheres of a roller touch. Raises InvalidValueError for too many."""
    if validation.integer("spheres", spheres, 1) > MOST_SPHERES:
        raise InvalidValueError("spheres", spheres, f"must be at most {MOST_SPHERES}")
    rollers = vehicle.wheels * vehicle.rollers_per_wheel
    if rollers * spheres > MOST_IN_ALL:
        bound = f"must be at most {MOST_IN_ALL // rollers} for {rollers} rollers: the file has them all"
        raise InvalidValueError("spheres", spheres, bound)
    return np.linspace(-math.pi, math.pi, spheres) / vehicle.rollers_per_wheel if spheres > 1 else np.zeros(1)


def roller_places(vehicle: Vehicle) -> list[tuple[float, float]]:
    """Of each roller of a wheel its angle on the disk from the one below, in rad, and its row's place along the axle,
    in m."""
    n, d = vehicle.rollers_per_wheel, vehicle.row_offset
    return [(2 * math.pi * j / n, d if j % 2 == 0 else -d) for j in range(n)]


def _inertial(body: Element, mass: float, inertia: tuple[float, ...], place: tuple[float, ...] = (0, 0, 0)) -> None:
    SubElement(body, "inertial", pos=text_of(*place), mass=text_of(mass), diaginertia=text_of(*inertia))


def _turn(angle: float, axis: int, then: float = 0.0) -> str:
    """A quaternion w x y z: by `angle` about the axis x, y or z; after one about x, by `then` about z as it is now."""
    quaternion = [math.cos(angle / 2), 0.0, 0.0, 0.0]
    quaternion[1 + axis] = math.sin(angle / 2)
    if then:
        (w, x, *_), c, s = quaternion, math.cos(then / 2), math.sin(then / 2)
        quaternion = [w * c, x * c, -x * s, w * s]
    return text_of(*quaternion)


def text_of(*numbers: float) -> str:
    return " ".join(f"{float(number):.17g}" for number in numbers)
