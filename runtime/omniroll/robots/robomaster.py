"""The RoboMaster standard robot with four double-row wheels."""

from omniroll.robots.robot import Robot, angles, assumed, derived, published
from omniroll.vehicles.parts import evaluate

DESCRIPTION = "rm_description"
WHEELS, ROLLERS, RADIUS, OF_WHEEL = 4, 26, 0.196, 0.59
GEAR, BATTERY, RATE, EFFORT = 19.2032, 24.0, 50.0, 5.0
# The published wheel holds its rollers: as a hub inside the rollers' axes its inertia would be impossible by 3 %.
MASS, YAW_INERTIA, _, _ = evaluate(
    "inertias", WHEELS, ROLLERS, platform_radius=RADIUS, roller_axis_radius=0.0672, platform_mass=12.326,
    platform_inertia=0.3187, hub_mass=OF_WHEEL, hub_axial_inertia=2.749e-3, hub_transverse_inertia=1.416e-3,
    roller_mass=0.0, roller_axial_inertia=0.0, roller_transverse_inertia=0.0, rotor_mass=0.0,
    rotor_axial_inertia=0.0, rotor_transverse_inertia=0.0, rotor_distance=0.0, gear_ratio=1.0,
)  # fmt: skip
BACK_EMF = BATTERY / (RATE * GEAR)

ROBOT = Robot(
    name="robomaster-standard",
    title="RoboMaster standard robot",
    source="rm-controls/rm_description, urdf/common/omni_wheel.urdf.xacro, urdf/standard/chassis.urdf.xacro, "
    "commit a4b31828, BSD",
    wheels=WHEELS,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(45, 135, 225, 315),
    row_offset=0.009563,
    numbers={
        "platform_radius": published(RADIUS, f"{DESCRIPTION}; the mean of the two rows"),
        "wheel_radius": published(0.0762, DESCRIPTION),
        "roller_axis_radius": derived(0.0762 - 0.009, f"wheel radius less that of a roller, {DESCRIPTION}"),
        "mass": derived(MASS, f"{DESCRIPTION}: body, and four wheels of {OF_WHEEL} kg with their rollers"),
        "yaw_inertia": derived(YAW_INERTIA, f"{DESCRIPTION}: body, and four wheels with their rollers"),
        "wheel_inertia": published(2.749e-3, f"{DESCRIPTION}; read as with its rollers"),
        "roller_inertia": published(2.70867e-7, DESCRIPTION),
    },
    motor_numbers={
        "torque_constant": assumed(BACK_EMF, "as the back EMF: a DC motor's are alike"),
        "back_emf": assumed(BACK_EMF, f"{BATTERY:g} V, which nobody states, at the joint's limit of {RATE:g} rad/s"),
        "resistance": assumed(0.2, "of the size of such windings; the current's limit acts long before it"),
        "gear_ratio": published(GEAR, f"{DESCRIPTION}; its sign, minus, is that of axles that point inward"),
        "current_limit": derived(EFFORT / (GEAR * BACK_EMF), f"the joint's limit of {EFFORT:g} N m, {DESCRIPTION}"),
        "rotor_inertia": assumed(1.81e-5, "that of a Maxon EC 45 flat of 70 W (catalogue), a motor of this size"),
    },
    bearing_numbers={
        "wheel_coulomb": published(0.05, f"friction of the wheel joint, {DESCRIPTION}"),
        "roller_coulomb": published(0.001, f"friction of the roller joint, {DESCRIPTION}"),
    },
    remarks=(
        "The wheel's 0.59 kg are read as with its 26 rollers of 5.8 g, without which its inertia is impossible; the "
        "file itself counts them once more.",
        "Its sibling standard4 has the same chassis with a gear of 13, 73 rad/s and 3.42 N m.",
    ),
)
