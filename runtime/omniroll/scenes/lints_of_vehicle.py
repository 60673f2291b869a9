"""Numbers of a vehicle that no body has, or that do not fit each other.

The inertias that mass and size allow at most come from the generated functions of parts: a ring has all of its
mass as far out as it can be.
"""

import math
from collections.abc import Iterator
from typing import Any

from omniroll import generated_data
from omniroll.scenes.lint import Lint
from omniroll.vehicles.parts import cylinder, evaluate
from omniroll.vehicles.vehicle import Vehicle

FAR = 2.0  # a part lies at most this many times as far from S as the wheels reach
CLOSE = 0.05  # least yaw inertia of a body, over that with all of its mass at the wheels' centres
BLUNT = 0.05  # least height of a roller's axis above the ground at the joint, over that in the middle of the roller
AIR, OSMIUM = 1.2, 22_600.0  # kg/m^3: no vehicle is lighter, no body heavier
FIT = 0.02  # what the radius of a roller may be off, over itself
PART_ARGUMENTS = tuple(
    argument["name"]
    for function in generated_data.load("kernels")["functions"]
    if "parts" in function["sets"] and function["name"] == "inertias"
    for argument in function["arguments"]
    if argument["role"] == "in"
)


def ring(mass: float, radius: float) -> float:
    """The largest inertia of a mass about an axis that none of it is farther from, kg m^2: of sizeless rollers."""
    sizeless = {name: 0.0 for name in PART_ARGUMENTS if name not in ("roller_mass", "roller_axis_radius")}
    points = 3
    _, _, inertia, _ = evaluate("inertias", 1, points, **sizeless, roller_mass=mass / points, roller_axis_radius=radius)
    return inertia


def distance_of_wheels(vehicle: Vehicle) -> float:
    """The distance in m of the wheel centre that is farthest from S."""
    places = vehicle.wheel_places
    return vehicle.platform_radius if places is None else max(math.hypot(*place) for place in places)


def reach(vehicle: Vehicle) -> float:
    """How far the vehicle goes from S in m, as far as its wheels tell."""
    return distance_of_wheels(vehicle) + vehicle.wheel_radius


def _joint_height(vehicle: Vehicle) -> float:
    """The height of a roller's axis above the ground at the joint, m: the margin of the derivation's bound on r."""
    margin = next(
        bound["positive"]
        for bound in generated_data.load("bounds")["bounds"]
        if bound["field"] == "roller_axis_radius" and isinstance(bound["positive"], list)
    )
    codes = generated_data.code_names().items()
    return generated_data.evaluate(margin, {symbol: getattr(vehicle, code, None) for symbol, code in codes})


def _density(mass: float, radius: float, length: float) -> float:
    """Of a solid cylinder, kg/m^3."""
    sizes = {"cylinder_radius": radius, "cylinder_length": length}
    return mass / evaluate("mass_of_cylinder", 1, 3, cylinder_density=1.0, **sizes)[0]


def of_sizes(vehicle: Vehicle) -> Iterator[Lint]:
    """Sizes and mass: a unit such as the millimetre or the gram in place of SI's."""
    size = reach(vehicle)
    density = _density(vehicle.mass, size, 2 * size)
    if not AIR <= density <= OSMIUM:
        lighter = "lighter than air" if density < AIR else "heavier than any matter"
        text = f"{vehicle.mass:.3g} kg in a vehicle that goes {size:.3g} m from its centre is {lighter}"
        yield Lint("vehicle", "mass", f"{text}; are all lengths in m and masses in kg?")
    side = vehicle.platform_radius * math.tan(math.pi / vehicle.wheels) if vehicle.wheels > 2 else math.inf
    if vehicle.wheel_places is None and vehicle.wheel_radius > side * (1 + 1e-9) and _is_even(vehicle):
        text = f"wheels this large, {vehicle.wheels} of them {vehicle.platform_radius:g} m out, reach into each other"
        yield Lint("vehicle", "wheel_radius", f"{text} from {side:.3g} m on")


def _is_even(vehicle: Vehicle) -> bool:
    """Whether the axles' directions are about evenly spaced."""
    spacing = 2 * math.pi / vehicle.wheels
    angles = sorted(angle % (2 * math.pi) for angle in vehicle.wheel_angles)
    return all(abs(b - a - spacing) < spacing / 4 for a, b in zip(angles, angles[1:], strict=False))


def of_numbers(vehicle: Vehicle) -> Iterator[Lint]:
    """Mass and inertias beside the sizes."""
    rollers, share = vehicle.rollers_per_wheel, vehicle.mass / vehicle.wheels
    most = ring(share, vehicle.wheel_radius)
    if vehicle.wheel_inertia > most:
        text = f"{vehicle.wheel_inertia:.3g} kg m^2 is more than a wheel with its share of the mass can have"
        yield Lint("vehicle", "wheel_inertia", f"{text}, {most:.3g}; only a rotor behind a gear gives more")
    yield from _of_yaw("yaw_inertia", vehicle.yaw_inertia, vehicle.mass, vehicle)
    # With all of its mass at its largest radius a roller weighs least; the wheel's inertia says what it weighs at most.
    least = vehicle.roller_inertia / ring(1.0, vehicle.roller_radius)
    if least > vehicle.wheel_inertia / ring(rollers, vehicle.roller_axis_radius):
        text = f"needs rollers of {least:.3g} kg or more; {rollers} of them make wheel_inertia larger than it is"
        yield Lint("vehicle", "roller_inertia", text)
    if least * rollers > share:
        text = f"needs rollers of {least:.3g} kg or more; those of a wheel outweigh the wheel's share of the mass"
        yield Lint("vehicle", "roller_inertia", f"{text}, {share:.3g} kg")
    tip = _joint_height(vehicle)
    if tip < BLUNT * vehicle.roller_radius:
        text = f"the joint is close to the tips: a roller's axis is {tip:.3g} m above the ground there"
        yield Lint("vehicle", "roller_axis_radius", f"{text}, {vehicle.roller_radius:.3g} m in the roller's middle")


def _of_yaw(name: str, inertia: float, mass: float, vehicle: Vehicle) -> Iterator[Lint]:
    """An inertia about the vertical axis, of the vehicle or of its platform."""
    most, least = ring(mass, reach(vehicle)), CLOSE * ring(mass, distance_of_wheels(vehicle))
    if inertia > most:
        text = f"{inertia:.3g} kg m^2 is more than with all of {mass:.3g} kg as far out as the wheels reach"
        yield Lint("vehicle", name, f"{text}, {most:.3g}")
    elif inertia < least:
        text = f"{inertia:.3g} kg m^2 has {mass:.3g} kg within {math.sqrt(inertia / mass):.2g} m of the centre"
        yield Lint("vehicle", name, f"{text}, while the wheels stand {distance_of_wheels(vehicle):.2g} m out")


def of_parts(table: dict[str, Any], vehicle: Vehicle) -> Iterator[Lint]:
    """The parts, where the vehicle is made of them: those in the table, and those that follow."""
    parts = {origin.name: origin.value for origin in vehicle.origins} | table
    yield from _of_inertias(parts, vehicle)
    yield from _of_rollers(parts, vehicle)
    far = FAR * reach(vehicle)
    for name in ("platform_disk_radius", "rotor_distance"):
        if parts.get(name, 0) > far:
            text = f"is more than {FAR:g} times as far out as the wheels reach, {reach(vehicle):.3g} m"
            yield Lint("vehicle", name, text)
    if parts.get("hub_radius", 0) > vehicle.wheel_radius:
        yield Lint("vehicle", "hub_radius", f"is more than the wheel's, {vehicle.wheel_radius:.3g} m")
    for body, sizes in {"hub": ("hub_radius", "hub_width"), "roller": ("roller_radius", "roller_length")}.items():
        if {f"{body}_mass", *sizes} <= set(parts):
            density = _density(parts[f"{body}_mass"], parts[sizes[0]], parts[sizes[1]])
            if density > OSMIUM or 0 < density < AIR:
                text = f"a {body} of {' and '.join(sizes)} would have {density:.3g} kg/m^3"
                yield Lint("vehicle", f"{body}_mass", f"{text}; are lengths in m and masses in kg?")


def _of_inertias(parts: dict[str, Any], vehicle: Vehicle) -> Iterator[Lint]:
    outermost = {
        "platform_inertia": ("platform_mass", parts.get("platform_disk_radius", math.inf)),
        "hub_axial_inertia": ("hub_mass", parts.get("hub_radius", vehicle.roller_axis_radius)),
        "roller_axial_inertia": ("roller_mass", parts.get("roller_radius", vehicle.roller_radius)),
    }
    for name, (mass, radius) in outermost.items():
        if name in parts and math.isfinite(radius) and parts[name] > (most := ring(parts[mass], radius)):
            text = (
                f"{parts[name]:.3g} kg m^2 is more than {parts[mass]:g} kg within {radius:.3g} m of the axis can have"
            )
            yield Lint("vehicle", name, f"{text}, {most:.3g}")
    if parts.get("platform_mass"):
        yield from _of_yaw("platform_inertia", parts["platform_inertia"], parts["platform_mass"], vehicle)
    axial, transverse = cylinder(1.0, 1.0, 1e-9)  # nothing is flatter than a disk
    for body in ("hub", "roller", "rotor"):
        names = f"{body}_axial_inertia", f"{body}_transverse_inertia"
        if set(names) <= set(parts) and parts[names[0]] * transverse > parts[names[1]] * axial * (1 + 1e-9):
            text = f"more than {axial / transverse:.3g} times the inertia across the axis, which not even a disk has"
            yield Lint("vehicle", names[0], text)


def _of_rollers(parts: dict[str, Any], vehicle: Vehicle) -> Iterator[Lint]:
    if parts.get("roller_mass", 0) > parts.get("hub_mass", math.inf):
        yield Lint("vehicle", "roller_mass", "a roller is heavier than the wheel that carries it")
    thickness, tip = vehicle.roller_radius, _joint_height(vehicle)
    radius = parts.get("roller_radius")
    if radius is not None and not tip * (1 - FIT) <= radius <= thickness * (1 + FIT):
        text = f"{radius:.3g} m does not fit: wheel_radius and roller_axis_radius make rollers of {thickness:.3g} m"
        yield Lint("vehicle", "roller_radius", f"{text} in the middle and {tip:.3g} m at the joint")
    pitch = 2 * vehicle.wheel_radius * math.sin(math.pi / vehicle.rollers_per_wheel)
    if parts.get("roller_length", 0) > 2 * pitch:  # two rows of rollers may overlap, by less than that
        text = f"is more than twice what a wheel has for each of its {vehicle.rollers_per_wheel} rollers"
        yield Lint("vehicle", "roller_length", f"{text}, {pitch:.3g} m")
