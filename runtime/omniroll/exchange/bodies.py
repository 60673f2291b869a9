"""The bodies of a vehicle: a platform, and for each wheel a hub and n rollers.

A Vehicle has only what its motion depends on: the masses and inertias of the whole. Simulators of bodies want each
body's own. Where the vehicle was made from parts they are known; otherwise bodies are found that add up to the same.
"""

from dataclasses import asdict, dataclass, replace

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts, profiles, wheel_kind
from omniroll.vehicles.checks import refuse_kinds
from omniroll.vehicles.vehicle import Vehicle

SAME = 1e-12  # relative difference below which parts add up to a vehicle
SHARES = tuple(0.5**k for k in range(12))  # of the masses that solid rollers and hubs would have
FLAT = 0.5  # inertia of a hub or platform across its axis over that about it: that of a disk
ADDED = ("mass", "yaw_inertia", "wheel_inertia", "roller_inertia")


@dataclass(frozen=True)
class Bodies:
    """Masses in kg and inertias in kg m^2 about the bodies' own centres; that of the platform is about the vertical.

    platform_place  (2,) in m, of the platform's centre of mass from S
    """

    platform_mass: float
    platform_inertia: float
    hub_mass: float
    hub_axial_inertia: float
    hub_transverse_inertia: float
    roller_mass: float
    roller_axial_inertia: float
    roller_transverse_inertia: float
    platform_place: tuple[float, float] = (0.0, 0.0)

    @property
    def platform_transverse_inertia(self) -> float:
        """About a horizontal axis. A planar motion does not know it; it is that of something flat."""
        return FLAT * self.platform_inertia


def bodies_of(vehicle: Vehicle) -> Bodies:
    """Bodies that add up to the vehicle: its parts where it was made of them.

    vehicle  Vehicle

    Raises InvalidValueError where no platform is left beside wheels with such inertias.
    """
    refuse_kinds(vehicle, "vehicle", vehicle.wheel_kinds, "bodies of an export are known of wheels that are all alike")
    if vehicle.has_profile:
        field = profiles.field_of(vehicle)
        raise InvalidValueError(field, getattr(vehicle, field), "cannot be exported: bodies keep their wheels round")
    known = {origin.name: origin.value for origin in vehicle.origins}
    names = [name for name in asdict(_NOTHING) if name != "platform_place"]
    if set(names) <= set(known) and vehicle.rotor is None and not any(_wheels_centre(vehicle)):
        made = Bodies(**{name: known[name] for name in names})
        whole = _whole(vehicle, made)
        if all(abs(whole[name] - getattr(vehicle, name)) <= SAME * whole[name] for name in ADDED):
            return made
    for share in SHARES:
        made = _with_platform(vehicle, _wheel(vehicle, share))
        if min(made.hub_axial_inertia, made.platform_mass, made.platform_inertia) > 0:
            return made
    bound = "leaves no inertia for a platform beside wheels and rollers"
    raise InvalidValueError("yaw_inertia", vehicle.yaw_inertia, bound)


_NOTHING = Bodies(*[0.0] * 8)


def _wheel(vehicle: Vehicle, share: float) -> Bodies:
    """Hub and rollers with the vehicle's J and B, and `share` of the masses of solid ones; no platform."""
    thickness, inertia = vehicle.roller_radius, vehicle.roller_inertia
    solid, _ = parts.cylinder(1.0, 1.0, 1.0)  # axial inertia over mass and squared radius
    roller = replace(
        _NOTHING,
        roller_mass=share * inertia / (solid * thickness**2),
        roller_axial_inertia=inertia,
        roller_transverse_inertia=inertia,
    )
    axial = vehicle.wheel_inertia - _whole(vehicle, roller)["wheel_inertia"]
    mass = share * axial / (solid * vehicle.roller_axis_radius**2)
    return replace(roller, hub_mass=mass, hub_axial_inertia=axial, hub_transverse_inertia=FLAT * axial)


def _with_platform(vehicle: Vehicle, wheel: Bodies) -> Bodies:
    """The platform that is missing. Its centre of mass is where the vehicle's whole asks for it."""
    wheels = _whole(vehicle, wheel)
    mass, inertia = vehicle.mass - wheels["mass"], vehicle.yaw_inertia - wheels["yaw_inertia"]
    if mass <= 0:
        return replace(wheel, platform_mass=mass)
    moment = vehicle.mass * np.array(vehicle.center_of_mass) - wheels["mass"] * _wheels_centre(vehicle)
    place = moment / mass
    inertia -= mass * float(place @ place)
    return replace(wheel, platform_mass=mass, platform_inertia=inertia, platform_place=tuple(place.tolist()))


def _wheels_centre(vehicle: Vehicle) -> np.ndarray:
    """(2,) in m: the middle of the wheels' centres from S; exactly 0 where it is so but for rounding."""
    places = vehicle.places()
    middle = places.mean(axis=0)
    return np.where(np.abs(middle) > SAME * np.abs(places).max(), middle, 0.0)


def _whole(vehicle: Vehicle, made: Bodies) -> dict[str, float]:
    """What bodies add up to, by the generated function, about S; wheels wherever they stand."""
    numbers = {name: value for name, value in asdict(made).items() if name != "platform_place"}
    rotor = dict.fromkeys(("rotor_mass", "rotor_axial_inertia", "rotor_transverse_inertia", "rotor_distance"), 0.0)
    distance = float(np.sqrt(np.mean(np.sum(np.square(vehicle.places()), axis=1))))
    found = parts.evaluate(
        "inertias", vehicle.wheels, vehicle.rollers_per_wheel, platform_radius=distance,
        roller_axis_radius=vehicle.roller_axis_radius, gear_ratio=1.0, **numbers, **rotor,
    )  # fmt: skip
    whole = dict(zip(ADDED, found, strict=True))
    if vehicle.has_wheels_of_the_paper:
        return whole
    counts, angle = (vehicle.wheels, vehicle.rollers_per_wheel), wheel_kind.size_of(vehicle.roller_angle)
    more = wheel_kind.inertias_beyond(*counts, numbers, angle, vehicle.row_offset)
    return whole | {name: whole[name] + value for name, value in more.items()}
