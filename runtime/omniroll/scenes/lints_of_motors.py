"""Numbers of motors in units that people print and scenes do not have: rpm, mN m."""

import math
from collections.abc import Iterator
from typing import Any

from omniroll.effects.motor import Motor
from omniroll.scenes.lint import Lint
from omniroll.scenes.loading import Scene
from omniroll.vocabulary import STANDARD_GRAVITY

FASTEST = 2000.0  # rad/s, 19 000 rpm: no motor of a robot's wheel is faster without load
STRONGEST = 50.0  # weights of the vehicle with which its motors may push at the wheels' rims
PER_RPM = math.pi / 30


def of_motors(scene: Scene) -> Iterator[Lint]:
    """What the numbers of [drive] come to at the rims."""
    table: dict[str, Any] = scene.tables.get("drive", {})
    speed = table.get("free_speed", 0.0)
    if speed > FASTEST:
        text = f"{speed:g} rad/s are {speed / PER_RPM:.4g} rpm; if it is in rpm, write {PER_RPM * speed:.4g}"
        yield Lint("drive", "free_speed", f'{text}, or "{speed:g} rpm"')
    motors = [effect for effect in scene.options.get("effects", ()) if isinstance(effect, Motor)]
    if not motors or "stall_torque" not in table:
        return
    vehicle = scene.vehicle
    force = vehicle.wheels * table["stall_torque"] * abs(motors[0].gear_ratio) / vehicle.wheel_radius
    weights = force / (vehicle.mass * STANDARD_GRAVITY)
    if weights > STRONGEST:
        text = f"{table['stall_torque']:g} N m push with {weights:.3g} times the vehicle's weight at the rims"
        yield Lint("drive", "stall_torque", f'{text}; if it is in mN m, write "{table["stall_torque"]:g} mN m"')
