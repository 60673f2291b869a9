"""The RoboMaster hero, the larger sibling of the standard robot, with mecanum wheels."""

import math

from omniroll.robots.mecanum_wheels import X_HANDS, corners
from omniroll.robots.robomaster import BACK_EMF, BATTERY, DESCRIPTION, EFFORT, GEAR, OF_WHEEL, RATE
from omniroll.robots.robot import Robot, angles, assumed, derived, published
from omniroll.vehicles.parts import evaluate

WHEELS, ROLLERS, HALF = 4, 16, 0.2
RADIUS = math.hypot(HALF, HALF)
MESH = "left_threaded_mecanum_wheel.stl"
# The published wheel holds its rollers: 16 of 36 g are 576 of its 590 g.
MASS, YAW_INERTIA, _, _ = evaluate(
    "inertias", WHEELS, ROLLERS, platform_radius=RADIUS, roller_axis_radius=0.06688, platform_mass=10.34,
    platform_inertia=0.4074, hub_mass=OF_WHEEL, hub_axial_inertia=2.749e-3, hub_transverse_inertia=1.416e-3,
    roller_mass=0.0, roller_axial_inertia=0.0, roller_transverse_inertia=0.0, rotor_mass=0.0,
    rotor_axial_inertia=0.0, rotor_transverse_inertia=0.0, rotor_distance=0.0, gear_ratio=1.0,
)  # fmt: skip

ROBOT = Robot(
    name="robomaster-hero",
    title="RoboMaster hero",
    source="rm-controls/rm_description, urdf/common/mecanum_wheel.urdf.xacro, urdf/hero/chassis.urdf.xacro, commit "
    "a4b31828, BSD",
    wheels=WHEELS,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(90, -90, 90, -90),
    more={
        "wheel_places": corners(HALF, HALF),
        "roller_angle": tuple(math.pi / 4 * hand for hand in X_HANDS),
    },
    numbers={
        "platform_radius": derived(RADIUS, f"wheels at 0.2 m ahead and aside, {DESCRIPTION}"),
        "wheel_radius": published(0.07625, DESCRIPTION),
        "roller_axis_radius": derived(0.06688, f"measured on the mesh, {MESH}"),
        "mass": derived(MASS, f"{DESCRIPTION}: body, and four wheels of {OF_WHEEL} kg with their rollers"),
        "yaw_inertia": derived(YAW_INERTIA, f"{DESCRIPTION}: body, and four wheels with their rollers"),
        "wheel_inertia": published(2.749e-3, f"{DESCRIPTION}; read as with its rollers"),
        "roller_inertia": assumed(
            0.45 * 0.036 * 0.00937**2,
            "rubber on a core, 0.45 m a^2 of 36 g (published) and 9.37 mm (mesh); the file has 3.128e-6 about all "
            "axes, 0.99 m a^2, which a tube would have",
        ),
    },
    motor_numbers={
        "torque_constant": assumed(BACK_EMF, "as the back EMF: a DC motor's are alike"),
        "back_emf": assumed(BACK_EMF, f"{BATTERY:g} V, which nobody states, at the joint's limit of {RATE:g} rad/s"),
        "resistance": assumed(0.2, "of the size of such windings; the current's limit acts long before it"),
        "gear_ratio": published(GEAR, DESCRIPTION),
        "current_limit": derived(EFFORT / (GEAR * BACK_EMF), f"the joint's limit of {EFFORT:g} N m, {DESCRIPTION}"),
        "rotor_inertia": assumed(1.81e-5, "that of a Maxon EC 45 flat of 70 W (catalogue), a motor of this size"),
    },
    bearing_numbers={
        "wheel_coulomb": published(0.05, f"friction of the wheel joint, {DESCRIPTION}"),
        "roller_coulomb": published(0.001, f"friction of the roller joint, {DESCRIPTION}"),
    },
    remarks=("The mesh has rollers of 38.1 mm; 39.9 mm would leave no gap. The mesh's angle is 44.9 degrees.",),
)
