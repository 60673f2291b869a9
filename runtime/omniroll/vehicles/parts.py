"""A vehicle from the masses and sizes of its parts, through the generated functions of the set "parts"."""

from collections.abc import Sequence
from typing import Any

from omniroll import validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles.vehicle import Vehicle


def evaluate(name: str, wheels: int, rollers_per_wheel: int, **values: float) -> tuple[float, ...]:
    """The generated function `name` of the set "parts"; its outputs as floats."""
    from omniroll.generated.python import parts

    try:
        found = getattr(parts, name)(wheels, rollers_per_wheel, **values)
    except (ZeroDivisionError, OverflowError):
        found = float("nan")
    return tuple(float(value) for value in (found if isinstance(found, (tuple, list)) else (found,)))


def cylinder(mass: float, radius: float, length: float) -> tuple[float, float]:
    """Axial and transverse inertia (kg m^2) of a solid cylinder: mass in kg, radius and length in m."""
    values = {"cylinder_mass": mass, "cylinder_radius": radius, "cylinder_length": length}
    return evaluate("cylinder", 1, 3, **{name: validation.positive(name, value) for name, value in values.items()})


def vehicle_from_parts(
    *,
    wheels: int,
    rollers_per_wheel: int,
    wheel_angles: Sequence[float] | None = None,
    platform_radius: float,
    wheel_radius: float,
    roller_axis_radius: float | None = None,
    yaw_scale: float = 1.0,
    platform_mass: float,
    platform_inertia: float,
    hub_mass: float,
    hub_axial_inertia: float,
    hub_transverse_inertia: float,
    roller_mass: float,
    roller_axial_inertia: float,
    roller_transverse_inertia: float,
    rotor_mass: float = 0.0,
    rotor_axial_inertia: float = 0.0,
    rotor_transverse_inertia: float = 0.0,
    rotor_distance: float = 0.0,
    gear_ratio: float = 1.0,
) -> Vehicle:
    """A vehicle from a platform, and for each wheel a hub, n rollers and a motor's rotor; SI units.

    platform_mass, platform_inertia    yaw inertia about S
    hub_mass, hub_axial_inertia, hub_transverse_inertia    about the axle and across it
    roller_mass, roller_axial_inertia, roller_transverse_inertia    about the roller's axis and across it
    rotor_mass, rotor_axial_inertia, rotor_transverse_inertia    about the rotor's axis, parallel to the axle
    rotor_distance    from S to the rotor's centre
    gear_ratio        turns of the rotor per turn of the wheel, negative where it turns the other way

    The other arguments are fields of Vehicle. Raises InvalidValueError: the roller's numbers must be
    positive, the others not negative, and the vehicle that comes out must be a vehicle.
    """
    sizes = {
        "platform_mass": platform_mass,
        "platform_inertia": platform_inertia,
        "hub_mass": hub_mass,
        "hub_axial_inertia": hub_axial_inertia,
        "hub_transverse_inertia": hub_transverse_inertia,
        "rotor_mass": rotor_mass,
        "rotor_axial_inertia": rotor_axial_inertia,
        "rotor_transverse_inertia": rotor_transverse_inertia,
        "rotor_distance": rotor_distance,
    }
    rollers = {
        "roller_mass": roller_mass,
        "roller_axial_inertia": roller_axial_inertia,
        "roller_transverse_inertia": roller_transverse_inertia,
    }
    wheels = validation.integer("wheels", wheels, 1)
    rollers_per_wheel = validation.integer("rollers_per_wheel", rollers_per_wheel, 3)
    if roller_axis_radius is None:
        roller_axis_radius = truncated_axis_radius(wheel_radius, rollers_per_wheel)
    fields: dict[str, Any] = {
        "platform_radius": validation.positive("platform_radius", platform_radius),
        "roller_axis_radius": validation.positive("roller_axis_radius", roller_axis_radius),
    }
    values = {name: _not_negative(name, value) for name, value in sizes.items()}
    values |= {name: validation.positive(name, value) for name, value in rollers.items()}
    values["gear_ratio"] = validation.real("gear_ratio", gear_ratio)
    mass, yaw_inertia, wheel_inertia, roller_inertia = evaluate(
        "inertias", wheels, rollers_per_wheel, **values, **fields
    )
    return Vehicle(
        wheels=wheels,
        rollers_per_wheel=rollers_per_wheel,
        wheel_angles=wheel_angles,
        wheel_radius=wheel_radius,
        **fields,
        mass=mass,
        yaw_inertia=yaw_inertia,
        wheel_inertia=wheel_inertia,
        roller_inertia=roller_inertia,
        yaw_scale=yaw_scale,
    )


def truncated_axis_radius(wheel_radius: float, rollers_per_wheel: int) -> float:
    """r of a wheel with truncated rollers, section 4 of the paper; needs four rollers or more."""
    if rollers_per_wheel < 4:
        raise InvalidValueError(
            "roller_axis_radius",
            None,
            "must be given: the truncated wheel of section 4 needs rollers_per_wheel >= 4",
        )
    wheel_radius = validation.positive("wheel_radius", wheel_radius)
    return evaluate("truncated_axis_radius", 1, rollers_per_wheel, wheel_radius=wheel_radius)[0]


def paper_vehicle(wheels: int = 3, rollers_per_wheel: int = 5) -> Vehicle:
    """The paper's vehicle. The paper leaves its numbers out; these are from the authors' public scripts.

    Platform: a disk of 1 kg whose radius is R = 0.15 m. Hub: a cylinder of 0.15 kg, radius r, 0.01 m thick.
    Rollers: 0.05 kg each, r = 0.05 m, truncated as in section 4, with the inertia of a cylinder. Lambda =
    I_S/(M l^2).
    """
    wheels = validation.integer("wheels", wheels, 1)
    rollers_per_wheel = validation.integer("rollers_per_wheel", rollers_per_wheel, 4)
    platform_radius, axis_radius, hub_thickness = 0.15, 0.05, 0.01
    platform_mass, hub_mass, roller_mass = 1.0, 0.15, 0.05
    wheel_radius, roller_radius, roller_length = evaluate(
        "truncated_wheel", wheels, rollers_per_wheel, roller_axis_radius=axis_radius
    )
    # The platform's thickness does not enter its axial inertia.
    platform_inertia, _ = cylinder(platform_mass, platform_radius, platform_radius)
    hub_axial, hub_transverse = cylinder(hub_mass, axis_radius, hub_thickness)
    roller_axial, roller_transverse = cylinder(roller_mass, roller_radius, roller_length)
    vehicle = vehicle_from_parts(
        wheels=wheels,
        rollers_per_wheel=rollers_per_wheel,
        platform_radius=platform_radius,
        wheel_radius=wheel_radius,
        roller_axis_radius=axis_radius,
        platform_mass=platform_mass,
        platform_inertia=platform_inertia,
        hub_mass=hub_mass,
        hub_axial_inertia=hub_axial,
        hub_transverse_inertia=hub_transverse,
        roller_mass=roller_mass,
        roller_axial_inertia=roller_axial,
        roller_transverse_inertia=roller_transverse,
    )
    (yaw_scale,) = evaluate(
        "natural_yaw_scale",
        wheels,
        rollers_per_wheel,
        mass=vehicle.mass,
        yaw_inertia=vehicle.yaw_inertia,
        wheel_radius=wheel_radius,
    )
    return vehicle.replace(yaw_scale=yaw_scale)


def _not_negative(field: str, value: Any) -> float:
    number = validation.real(field, value)
    return number if number == 0 else validation.positive(field, value)
