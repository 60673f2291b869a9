"""The numbers of a vehicle from the masses and sizes of its parts, by the generated functions of the set "parts".

Everything here works on plain numbers; omniroll.vehicles.vehicle makes vehicles of them.
"""

from collections.abc import Sequence
from typing import Any

from omniroll import validation, vocabulary
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kinds import Whole


def evaluate(name: str, wheels: int, rollers_per_wheel: int, **values: float) -> tuple[float, ...]:
    """The generated function `name` of the set "parts"; its outputs as floats."""
    try:
        outputs = getattr(parts, name)(wheels, rollers_per_wheel, **values)
    except (ZeroDivisionError, OverflowError):
        outputs = float("nan")
    return tuple(float(output) for output in (outputs if isinstance(outputs, (tuple, list)) else (outputs,)))


def of_vehicle(name: str, vehicle: Any, **values: Any) -> tuple[float, ...]:
    """The same with as many wheels and rollers as a Vehicle has."""
    return evaluate(name, vehicle.wheels, vehicle.rollers_per_wheel, **values)


def places_on_rays(wheels: int, rollers_per_wheel: int, platform_radius: float, wheel_angles: Sequence[float]) -> Any:
    """(N, 2) in m as nested lists, of wheels on rays from S at the platform radius."""
    return parts.places_on_rays(wheels, rollers_per_wheel, platform_radius, list(wheel_angles))


def cylinder(mass: float, radius: float, length: float) -> tuple[float, float]:
    """Axial and transverse inertia (kg m^2) of a solid cylinder: mass in kg, radius and length in m."""
    values = {"cylinder_mass": mass, "cylinder_radius": radius, "cylinder_length": length}
    return evaluate("cylinder", 1, 3, **{name: validation.positive(name, value) for name, value in values.items()})


def inertias(
    wheels: int,
    rollers_per_wheel: int,
    **given: float,
) -> dict[str, float]:
    """mass, yaw_inertia, wheel_inertia and roller_inertia of a vehicle from the numbers of its parts, by their names.

    `given` has those of omniroll.vocabulary.PARTS, platform_radius and roller_axis_radius; others have no part in it.
    Raises InvalidValueError.
    """
    lengths = vocabulary.by_name(vocabulary.LENGTHS)
    numbers = {}
    for entry in (*vocabulary.PARTS, lengths["platform_radius"], lengths["roller_axis_radius"]):
        if entry.name not in given:
            raise InvalidValueError(entry.name, None, "must be given")
        numbers[entry.name] = entry.checked(given[entry.name])
    names = ("mass", "yaw_inertia", "wheel_inertia", "roller_inertia")
    return dict(zip(names, evaluate("inertias", wheels, rollers_per_wheel, **numbers), strict=True))


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


def paper_numbers(wheels: int = 3, rollers_per_wheel: int = 5) -> dict[str, Any]:
    """The fields of the paper's vehicle. The paper leaves its numbers out; these are from the authors' public scripts.

    Platform: a disk of 1 kg whose radius is R = 0.15 m. Hub: a cylinder of 0.15 kg, radius r, 0.01 m thick.
    Rollers: 0.05 kg each, r = 0.05 m, truncated as in section 4, with the inertia of a cylinder. Lambda =
    I_S/(M l^2). Raises InvalidValueError for fewer than one wheel or four rollers.
    """
    wheels = vocabulary.WHEELS.checked(wheels)
    rollers_per_wheel = Whole(4, vocabulary.MOST_OF_A_KIND).checked("rollers_per_wheel", rollers_per_wheel)
    platform_radius, axis_radius, hub_thickness = 0.15, 0.05, 0.01
    platform_mass, hub_mass, roller_mass = 1.0, 0.15, 0.05
    wheel_radius, roller_radius, roller_length = evaluate(
        "truncated_wheel", wheels, rollers_per_wheel, roller_axis_radius=axis_radius
    )
    # The platform's thickness does not enter its axial inertia.
    platform_inertia, _ = cylinder(platform_mass, platform_radius, platform_radius)
    hub_axial, hub_transverse = cylinder(hub_mass, axis_radius, hub_thickness)
    roller_axial, roller_transverse = cylinder(roller_mass, roller_radius, roller_length)
    lengths = {"platform_radius": platform_radius, "roller_axis_radius": axis_radius}
    whole = inertias(
        wheels,
        rollers_per_wheel,
        **lengths,
        platform_mass=platform_mass,
        platform_inertia=platform_inertia,
        hub_mass=hub_mass,
        hub_axial_inertia=hub_axial,
        hub_transverse_inertia=hub_transverse,
        roller_mass=roller_mass,
        roller_axial_inertia=roller_axial,
        roller_transverse_inertia=roller_transverse,
        rotor_mass=0.0,
        rotor_axial_inertia=0.0,
        rotor_transverse_inertia=0.0,
        rotor_distance=0.0,
        gear_ratio=1.0,
    )
    scale_of = {"mass": whole["mass"], "yaw_inertia": whole["yaw_inertia"], "wheel_radius": wheel_radius}
    (yaw_scale,) = evaluate("natural_yaw_scale", wheels, rollers_per_wheel, **scale_of)
    counts = {"wheels": wheels, "rollers_per_wheel": rollers_per_wheel}
    return counts | lengths | whole | {"wheel_radius": wheel_radius, "yaw_scale": yaw_scale}
