"""The Robot Soccer Kit, as MuJoCo Menagerie has it."""

from omniroll.robots.robot import Robot, angles, assumed, derived, published

XML = "robot_soccer_kit.xml"

ROBOT = Robot(
    name="robot-soccer-kit",
    title="Robot Soccer Kit",
    source="google-deepmind/mujoco_menagerie, robot_soccer_kit/robot_soccer_kit.xml, commit cc0a8294, MIT",
    wheels=3,
    rollers_per_wheel=20,
    wheel_angles=angles(-30, 90, 210),
    numbers={
        "platform_radius": derived(0.0472 + 0.010, f"wheel joint and row of rollers, {XML}"),
        "wheel_radius": derived(0.0285 + 0.006, f"rollers' axes and radius of a roller, {XML}"),
        "roller_axis_radius": published(0.0285, XML),
        "platform_mass": derived(0.374118 + 0.00935, f"body and kicker, {XML}"),
        "platform_inertia": published(8.4026e-4, f"{XML}: the body, about its own centre of mass"),
        "hub_mass": published(0.0266331, XML),
        "hub_axial_inertia": published(7.07069e-6, XML),
        "hub_radius": assumed(0.0285, "a hub that reaches to the rollers' axes"),
        "hub_width": assumed(0.012, "a hub as wide as a roller is thick"),
        "roller_mass": published(0.00337198, XML),
        "roller_axial_inertia": published(6.05554e-8, XML),
        "roller_transverse_inertia": published(3.55777e-8, XML),
        "roller_radius": published(0.006, XML),
    },
    remarks=(
        "The rollers are short cylinders, 4 mm of a pitch of 9 mm: between them the wheel stands on two edges, where "
        "the preset has truncated barrels; roller_profile takes the edges.",
        "The body's centre of mass lies 1.75 mm beside S along both axes; the model has it at S.",
        "The firmware (Rhoban/robot-soccer-kit, 1fab6573) has a wheel radius of 35 mm, 1.4 % more, and a platform "
        "radius of 59.5 mm, 4 % more. Its wheels turn at 16 rad/s at most.",
        "No motor constants are published.",
    ),
)
