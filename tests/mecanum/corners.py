"""Mecanum vehicles and starts at the edges of what there is: wheels that both rollers push back, wheels of few rollers,
steep ones, sharp ones, and one whose rate vanishes at its joint."""

import math

import numpy as np

from omniroll import Vehicle
from omniroll.kernels.kernel import kernel

JOINT = math.pi / 9
TURNING = {"nu": (0.35 * 1.5 / 0.3, 0.0, 1.5), "chi": (0.1, 0.0, -0.1, 0.2)}  # where the front left wheel comes to rest
HANDS = np.array([1, -1, -1, 1])


def usual(psi: float = math.pi / 4, **changes) -> Vehicle:
    """Four wheels, front left, front right, rear left, rear right, whose axles point outward."""
    numbers = {
        "wheels": 4, "rollers_per_wheel": 9, "mass": 20.0, "yaw_inertia": 0.9, "wheel_inertia": 3e-3,
        "roller_inertia": 3e-6, "platform_radius": 0.3, "wheel_radius": 0.05, "roller_axis_radius": 0.037,
        "wheel_angles": (math.pi / 2, -math.pi / 2, math.pi / 2, -math.pi / 2),
        "wheel_places": ((0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)),
        "roller_angle": tuple(psi * HANDS),
    }  # fmt: skip
    return Vehicle(**numbers | changes)


def trio() -> Vehicle:
    """Three wheels of one hand on rays."""
    angles = np.arange(3) * 2 * np.pi / 3
    return usual(wheels=3, wheel_angles=tuple(angles), roller_angle=(math.pi / 4,) * 3, yaw_scale=1.0,
                 wheel_places=tuple((0.25 * np.cos(a), 0.25 * np.sin(a)) for a in angles))  # fmt: skip


def two_stand(turn: float = 1.0) -> dict:
    """A start of the trio at which two of its wheels are at rest between their rollers, which both turn them back."""
    bound = kernel(trio(), "massless")
    rows = sum(bound.wheel_speeds(np.eye(3), np.full(3, angle)).T for angle in (JOINT, -JOINT))[:2]
    return {"nu": [*np.linalg.solve(rows[:, :2], -turn * rows[:, 2]), turn], "chi": (JOINT, -JOINT, 0.1)}


def vanishing_rate(yaw: float) -> dict:
    """A start at which the front left wheel stands on its joint without a rate, while the vehicle goes sideways."""
    row = kernel(usual(), "massless").wheel_speeds(np.eye(3), np.full(4, JOINT)).T[0]
    return {"nu": (-(row[1] + row[2] * yaw) / row[0], 1.0, yaw), "chi": (JOINT, 0.1, 0.0, -0.1)}


CORNERS = {
    "O layout, square": usual(wheel_places=((0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)),
                              roller_angle=tuple(-math.pi / 4 * HANDS)),
    "three rollers": usual(rollers_per_wheel=3, roller_axis_radius=0.02),
    "89 degrees": usual(math.radians(89)),
    "nearly sharp tips": usual(roller_axis_radius=0.05 * math.cos(math.pi / 9) * (1 - 2e-3)),
}  # fmt: skip
