"""The base of the KUKA youBot, with four mecanum wheels of six rollers."""

import math

from omniroll.robots.mecanum_wheels import X_HANDS, corners, solid_roller
from omniroll.robots.robot import Robot, angles, assumed, derived, published

PAPER = "Adamov and Saipulaev, Rus. J. Nonlin. Dyn. 16 (2020), 291-307, (5.1)"
RADIUS, AXIS, ROLLERS = 0.05, 0.0355, 6
LENGTH, WIDTH = 0.235, 0.15
MASS, BOX = 30.0, (0.57, 0.36)
_, INERTIA, SIZES = solid_roller(RADIUS, AXIS, ROLLERS)

ROBOT = Robot(
    name="youbot",
    title="KUKA youBot",
    source=f"{PAPER}, doi 10.20537/nd200205",
    wheels=4,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(90, -90, 90, -90),
    more={
        "wheel_places": corners(LENGTH, WIDTH),
        "center_of_mass": (0.016, -0.026),
        "roller_angle": tuple(math.pi / 4 * hand for hand in X_HANDS),
    },
    numbers={
        "platform_radius": derived(math.hypot(LENGTH, WIDTH), f"half of the wheelbase and of the track, {PAPER}"),
        "wheel_radius": published(RADIUS, PAPER),
        "roller_axis_radius": published(AXIS, PAPER),
        "mass": derived(MASS, f"{PAPER}: read as that of the whole"),
        "yaw_inertia": assumed(
            MASS * (BOX[0] ** 2 + BOX[1] ** 2) / 12,
            f"an even box of {BOX[0]:g} m by {BOX[1]:g} m, as youbot_description has it: the source's 4.42 kg m^2 are "
            "more than this mass can have with all of it at the wheels' rims",
        ),
        "wheel_inertia": published(5.87e-3, f"{PAPER}; more than 1.4 kg at the rim have: it holds the drive's"),
        "roller_inertia": assumed(INERTIA, f"{SIZES}; the source has massless rollers"),
    },
    bearing_numbers={
        "wheel_viscous": published(0.11, PAPER),
        "roller_viscous": published(5.78e-3, PAPER),
    },
    remarks=(
        "The motors have 0.0335 N m/A and a gear of 9405/364 (youbot_driver); no resistance was found.",
        "Another description of the robot, youbot_description, has inertias that no body has.",
    ),
)
