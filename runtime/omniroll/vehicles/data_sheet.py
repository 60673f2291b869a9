"""The parts of a vehicle from what data sheets print: what is not given is derived, and what cannot be is assumed.

Every number keeps its origin, so that a user sees which of them are his own. Masses are assumed only where the mass of
the whole is given in the place of the platform's: what is assumed then moves mass from one part to another.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from omniroll import vocabulary
from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts, wheel_kind

GIVEN, PUBLISHED, DERIVED, ASSUMED = "given", "published", "derived", "assumed"
DENSITY = 1200.0  # kg/m^3, of polyurethane: wheels and rollers whose masses are not given
ENTRIES = vocabulary.by_name(
    vocabulary.PARTS, vocabulary.SOLIDS, vocabulary.DATA_SHEET, vocabulary.LENGTHS, vocabulary.INERTIAS
)
INSTEAD = (("wheel_diameter", "wheel_radius"), ("roller_diameter", "roller_radius"), ("wheel_width", "hub_width"))
BODIES = {  # inertias, and the sizes of a solid cylinder that they follow from where they are not given
    "platform_mass": (("platform_inertia",), ("platform_disk_radius",)),
    "hub_mass": (("hub_axial_inertia", "hub_transverse_inertia"), ("hub_radius", "hub_width")),
    "roller_mass": (("roller_axial_inertia", "roller_transverse_inertia"), ("roller_radius", "roller_length")),
}
NO_ROTOR = {
    "rotor_mass": 0.0, "rotor_axial_inertia": 0.0, "rotor_transverse_inertia": 0.0, "rotor_distance": 0.0,
    "gear_ratio": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class Origin:
    """Where a number of a vehicle or of its motors comes from.

    kind    "given", "published" by others, "derived" from other numbers, or "assumed"
    reason  the source, how it was derived, or what was assumed; empty where it was given
    """

    name: str
    value: float
    unit: str
    kind: str
    reason: str = ""


@dataclass
class Sheet:
    """Numbers by name as they become known, and their origins."""

    wheels: int
    rollers_per_wheel: int
    axis_angle: float = 0.0
    values: dict[str, float] = field(default_factory=dict)
    origins: list[Origin] = field(default_factory=list)

    def put(self, name: str, value: float, kind: str, reason: str = "") -> None:
        self.values[name] = ENTRIES[name].checked(value)
        self.origins.append(Origin(name, self.values[name], ENTRIES[name].unit, kind, reason))

    def get(self, name: str, instead: str = "") -> float:
        """A number that must be known. Raises InvalidValueError where it is not; `instead` is what would do too."""
        if name not in self.values:
            raise InvalidValueError(name, None, "must be given" + (f", or {instead}" if instead else ""))
        return self.values[name]

    def evaluate(self, name: str, **arguments: float) -> tuple[float, ...]:
        return parts.evaluate(name, self.wheels, self.rollers_per_wheel, **arguments)

    def evaluate_known(self, name: str, *arguments: str) -> float:
        """A generated function of known numbers that gives one."""
        return self.evaluate(name, **{argument: self.get(argument) for argument in arguments})[0]


def completed(wheels: int, rollers_per_wheel: int, given: Mapping[str, float], axis_angle: float = 0.0) -> Sheet:
    """All numbers of the parts of a vehicle, from those that are given by name. Raises InvalidValueError.

    axis_angle  size of the angle between rollers' axes and the planes of their wheels, in rad
    """
    sheet = Sheet(wheels, rollers_per_wheel, axis_angle)
    for name, value in given.items():
        sheet.put(name, value, GIVEN)
    whole = "mass" in given
    _refuse_both(sheet, *INSTEAD, ("mass", "platform_mass"), ("wheel_mass", "hub_mass"))
    for diameter, radius in INSTEAD[:2]:
        if diameter in given:
            sheet.put(radius, sheet.values[diameter] / 2, DERIVED, f"half of {diameter}")
    if "wheel_width" in given:
        sheet.put("hub_width", sheet.values["wheel_width"], DERIVED, "wheel_width")
    _roller_axis(sheet)
    if whole:
        _slanted_rollers(sheet)
        _masses_of_wheel(sheet)
        _sizes(sheet)
    sheet.values = NO_ROTOR | sheet.values
    if whole:
        _platform_mass(sheet)
    for mass, (inertias, sizes) in BODIES.items():
        _inertias(sheet, mass, inertias, sizes)
    return sheet


def _refuse_both(sheet: Sheet, *pairs: tuple[str, str]) -> None:
    for one, other in pairs:
        if one in sheet.values and other in sheet.values:
            raise InvalidValueError(one, sheet.values[one], f"must not be given beside {other}")


def _roller_axis(sheet: Sheet) -> None:
    known = sheet.values
    wheel_radius = sheet.get("wheel_radius", "wheel_diameter")
    if "roller_axis_radius" in known:
        return
    if "roller_radius" in known:
        value = sheet.evaluate_known("axis_of_radii", "wheel_radius", "roller_radius")
        if value <= 0:
            raise InvalidValueError("roller_radius", known["roller_radius"], "must be below wheel_radius")
        sheet.put("roller_axis_radius", value, DERIVED, "wheel_radius less roller_radius")
    else:
        value, reason = wheel_kind.assumed_axis_radius(wheel_radius, sheet.rollers_per_wheel, sheet.axis_angle)
        sheet.put("roller_axis_radius", value, ASSUMED, reason)


def _slanted_rollers(sheet: Sheet) -> None:
    """Radius and length of rollers at an angle, where they are not given."""
    known = sheet.values
    if not sheet.axis_angle:
        return
    axis, wheel_radius = sheet.get("roller_axis_radius"), sheet.get("wheel_radius")
    if "roller_radius" not in known:
        sheet.put("roller_radius", wheel_radius - axis, DERIVED, "wheel_radius less roller_axis_radius")
    if "roller_length" not in known and "roller_mass" not in known:
        length = 2 * wheel_kind.half_length(wheel_radius, axis, sheet.rollers_per_wheel, sheet.axis_angle)
        sheet.put("roller_length", length, ASSUMED, "as short as leaves no gap")


def _masses_of_wheel(sheet: Sheet) -> None:
    """The masses of roller and hub, where the whole vehicle's is given; the hub's last."""
    known, made_of = sheet.values, f"a solid cylinder of {DENSITY:g} kg/m^3"
    if "roller_mass" not in known:
        sizes = {
            "cylinder_radius": sheet.get("roller_radius", "roller_diameter, or roller_mass and both roller inertias"),
            "cylinder_length": sheet.get("roller_length", "roller_mass and both roller inertias"),
        }
        mass = sheet.evaluate("mass_of_cylinder", cylinder_density=DENSITY, **sizes)[0]
        sheet.put("roller_mass", mass, ASSUMED, made_of)
    if "hub_mass" in known:
        return
    if "wheel_mass" in known:
        mass = sheet.evaluate("mass_of_hub", mass_of_wheel=known["wheel_mass"], roller_mass=known["roller_mass"])[0]
        if mass < 0:
            raise InvalidValueError("wheel_mass", known["wheel_mass"], "must not be below the mass of its rollers")
        sheet.put("hub_mass", mass, DERIVED, "wheel_mass less that of its rollers")
    else:
        _sizes(sheet)
        sizes = {"cylinder_radius": known["hub_radius"], "cylinder_length": known["hub_width"]}
        mass = sheet.evaluate("mass_of_cylinder", cylinder_density=DENSITY, **sizes)[0]
        sheet.put("hub_mass", mass, ASSUMED, made_of)


def _sizes(sheet: Sheet) -> None:
    """Sizes of solid bodies in place of inertias that are not given, where the whole vehicle's mass is."""
    known = sheet.values
    usual = {
        "hub_radius": ("roller_axis_radius", 1.0, "up to the rollers' axes"),
        "hub_width": ("roller_radius", 2.0, "as wide as a roller is thick"),
        "platform_disk_radius": ("platform_radius", 1.0, "a disk as far out as the wheels"),
    }
    inertias = {size: names for names, sizes in BODIES.values() for size in sizes}
    for name, (like, factor, reason) in usual.items():
        if name not in known and not set(inertias[name]) <= set(known):
            sheet.put(name, factor * sheet.get(like), ASSUMED, reason)


def _platform_mass(sheet: Sheet) -> None:
    mass = sheet.evaluate_known("mass_of_platform", "mass", "hub_mass", "roller_mass", "rotor_mass")
    if mass < 0:
        whole = sheet.get("mass")
        raise InvalidValueError("mass", whole, f"must not be below {whole - mass!r}, what wheels and rotors weigh")
    sheet.put("platform_mass", mass, DERIVED, "mass less that of wheels and rotors")


def _inertias(sheet: Sheet, mass: str, inertias: tuple[str, ...], sizes: tuple[str, ...]) -> None:
    """Those of a body that are not given, from its sizes."""
    missing = [name for name in inertias if name not in sheet.values]
    if not missing:
        return
    body = sheet.get(mass, "mass" if mass == "platform_mass" else "")
    for size in sizes:
        if size not in sheet.values:
            raise InvalidValueError(missing[0], None, f"must be given, or {' and '.join(sizes)}")
    # A disk's thickness does not enter its axial inertia.
    solid = parts.cylinder(body, sheet.get(sizes[0]), sheet.get(sizes[-1])) if body else (0.0, 0.0)
    shape = "disk" if len(sizes) == 1 else "cylinder"
    for name, value in zip(inertias, solid, strict=False):
        if name in missing:
            sheet.put(name, value, DERIVED, f"a solid {shape} of {' and '.join((mass, *sizes))}")


def motor_constants(rated_voltage: float, stall_torque: float, free_speed: float) -> dict[str, Origin]:
    """torque_constant in N m/A and resistance in ohm of a motor, from its rated_voltage in V, its stall_torque in N m
    and its free_speed in rad/s, with their origins. Raises InvalidValueError."""
    given = dict(rated_voltage=rated_voltage, stall_torque=stall_torque, free_speed=free_speed)
    entries = vocabulary.by_name(vocabulary.MOTOR_SHEET, vocabulary.MOTOR)
    numbers = {name: entries[name].checked(value) for name, value in given.items()}
    reasons = {
        "torque_constant": "rated_voltage over free_speed, the current without load left out",
        "resistance": "rated_voltage over the current that gives stall_torque",
    }
    found = zip(reasons, parts.evaluate("motor_of_data_sheet", 1, 3, **numbers), strict=True)
    return {name: Origin(name, value, entries[name].unit, DERIVED, reasons[name]) for name, value in found}
