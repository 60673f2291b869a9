"""Numbers of a run by name, moved by a little: nu[0], mass, friction[1]."""

from typing import Any

# Numbers of effects that the arguments of `prepare` call otherwise.
CONSTANTS = {
    "wheel_viscous": "axle_damping", "wheel_coulomb": "axle_torque", "wheel_speed": "axle_fade_speed",
    "roller_viscous": "roller_damping", "roller_coulomb": "roller_torque", "roller_speed": "roller_fade_speed",
    "angle": "slope_angle",
}  # fmt: skip


def split(name: str) -> tuple[str, tuple[int, ...]]:
    """The number and its place in it."""
    number, *places = name.replace("]", "").split("[")
    return number, tuple(map(int, places))


def larger(values: Any, place: tuple[int, ...], change: Any) -> Any:
    """Nested lists with the number at `place`, or without a place all of them, larger by `change`."""
    if not isinstance(values, list):
        return values + change
    return [larger(value, place[1:], change) if not place or place[0] == k else value for k, value in enumerate(values)]
