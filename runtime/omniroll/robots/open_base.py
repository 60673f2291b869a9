"""OpenBase, a small base with double-row wheels."""

from omniroll.robots.robot import Robot, angles, assumed, derived, published
from omniroll.vehicles.parts import cylinder

XACRO = "OpenBase, xacro"
HUB_MASS, ROLLERS, ROLLER_MASS, OFFSET = 0.00835758, 8, 0.00113845, 0.0055
_, HUB_TRANSVERSE = cylinder(HUB_MASS, 0.01355, 0.022)

ROBOT = Robot(
    name="open-base",
    title="OpenBase",
    source="GuiRitter/OpenBase, ROS/open_base/xacro (main, rim, roller), commit 05dfe70f, MIT",
    wheels=3,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(150, 270, 30),
    row_offset=OFFSET,
    numbers={
        "platform_radius": published(0.040, f"{XACRO}; the mean of the two rows"),
        "wheel_radius": derived(0.01355 + 0.0055, f"rollers' axes, {XACRO}, and radius of a roller, from its mesh"),
        "roller_axis_radius": published(0.01355, XACRO),
        "platform_mass": published(0.0786294, XACRO),
        "platform_inertia": published(3.94596e-5, XACRO),
        "hub_mass": published(HUB_MASS, XACRO),
        "hub_axial_inertia": published(9.40333e-7, XACRO),
        "hub_transverse_inertia": assumed(
            HUB_TRANSVERSE + ROLLERS * ROLLER_MASS * OFFSET**2,
            "a hub that reaches to the rollers' axes and is as wide as two rows of 11 mm, and what their rollers add "
            "that lie 5.5 mm beside the wheel's middle",
        ),
        "roller_mass": published(ROLLER_MASS, XACRO),
        "roller_axial_inertia": published(1.47666e-8, XACRO),
        "roller_transverse_inertia": published(2.53776e-8, XACRO),
        "roller_radius": derived(0.0055, "the mesh of the roller"),
    },
    remarks=("No motor is published; the joints have a gear of 1.",),
)
