"""A base of three mecanum wheels on rays, which nobody sells: what such wheels do that are not four."""

import math

from omniroll.robots.robot import Robot, angles, assumed, derived
from omniroll.robots.strafer import AXIS, INERTIA, RADIUS, ROLLERS, SIZES, WHEEL_INERTIA, WHEEL_MASS

PLATFORM, MASS = 0.15, 3.0
LAYOUT = "Project Chrono's demonstration demo_MBS_mecanum has three mecanum wheels"

ROBOT = Robot(
    name="mecanum-trio",
    title="Three mecanum wheels on rays",
    source=f"{LAYOUT}; sizes are those of goBILDA's 96 mm wheels, see strafer",
    wheels=3,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(60, 180, -60),
    more={"roller_angle": (math.pi / 4,) * 3},
    numbers={
        "platform_radius": assumed(PLATFORM, "a base of the size of a small robot"),
        "wheel_radius": derived(RADIUS, "the wheel of the strafer"),
        "roller_axis_radius": assumed(AXIS, "the wheel of the strafer"),
        "mass": assumed(MASS, "a base of that size with batteries"),
        "yaw_inertia": assumed(
            (MASS - 3 * WHEEL_MASS) * PLATFORM**2 / 2 + 3 * WHEEL_MASS * PLATFORM**2,
            "a disk, and three wheels at its rim",
        ),
        "wheel_inertia": assumed(WHEEL_INERTIA, "the wheel of the strafer"),
        "roller_inertia": assumed(INERTIA, SIZES),
    },
    remarks=("All rollers have one hand: wheels that turn alike turn the base, and no pair of them opposes another.",),
)
