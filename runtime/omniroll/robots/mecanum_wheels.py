"""What robots with mecanum wheels have in common: hands, places, and rollers whose masses nobody publishes."""

import math

from omniroll.vehicles import parts, wheel_kind
from omniroll.vehicles.data_sheet import DENSITY

X_HANDS = (1, -1, -1, 1)  # of wheels front left, front right, rear left, rear right
CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))


def corners(half_length: float, half_width: float) -> tuple[tuple[float, float], ...]:
    """Places of wheels front left, front right, rear left, rear right, in m."""
    return tuple((x * half_length, y * half_width) for x, y in CORNERS)


def solid_roller(wheel_radius: float, axis_radius: float, rollers: int) -> tuple[float, float, str]:
    """Mass and axial inertia of a roller at 45 degrees of polyurethane, and what was assumed, in words."""
    length = 2 * wheel_kind.half_length(wheel_radius, axis_radius, rollers, math.pi / 4)
    ends = wheel_radius * math.cos(math.pi / rollers) - axis_radius
    radius = (wheel_radius - axis_radius + ends) / 2
    sizes = {"cylinder_density": DENSITY, "cylinder_radius": radius, "cylinder_length": length}
    mass = parts.evaluate("mass_of_cylinder", 1, 3, **sizes)[0]
    said = f"a cylinder of {DENSITY:g} kg/m^3, {1e3 * radius:.3g} mm thick to each side and {1e3 * length:.3g} mm long"
    return mass, parts.cylinder(mass, radius, length)[0], said
