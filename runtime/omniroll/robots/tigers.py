"""The robot of 2020 of TIGERs Mannheim, a Small Size League team: motor and body are published, the rollers are not."""

import math

from omniroll.robots.robot import Robot, angles, assumed, derived, published
from omniroll.vehicles.data_sheet import DENSITY
from omniroll.vehicles.parts import cylinder, evaluate

FIRMWARE = "the firmware"
MASS, RADIUS, WHEEL_RADIUS, FACTOR = 2.78, 0.079, 0.032, 0.7
ROLLERS, ROLLER_RADIUS = 20, 0.005
PITCH = 2 * math.pi * (WHEEL_RADIUS - ROLLER_RADIUS) / ROLLERS
(ROLLER_MASS,) = evaluate(
    "mass_of_cylinder", 1, ROLLERS, cylinder_density=DENSITY, cylinder_radius=ROLLER_RADIUS, cylinder_length=PITCH
)
ROLLER_INERTIA, _ = cylinder(ROLLER_MASS, ROLLER_RADIUS, PITCH)
DQ = 1.5  # the firmware's constants are of currents and voltages in the rotor's frame, with all three phases in them

ROBOT = Robot(
    name="tigers-2020",
    title="TIGERs Mannheim v2020",
    source="TIGERs-Mannheim/Firmware, src/main2019/robot_impl.c, dev/motors.c, test/test_motor.c, "
    "commit 1e483265, own non-commercial licence (numbers only)",
    wheels=4,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(90 - 31, 90 + 45, 270 - 45, 270 + 31),
    numbers={
        "platform_radius": published(RADIUS, FIRMWARE),
        "wheel_radius": published(WHEEL_RADIUS, FIRMWARE),
        "roller_axis_radius": assumed(
            WHEEL_RADIUS - ROLLER_RADIUS,
            "rollers of 5 mm radius; the Robot Soccer Kit's, on a wheel 8 % larger, have 6 mm",
        ),
        "mass": published(MASS, FIRMWARE),
        "yaw_inertia": derived(FACTOR * MASS * RADIUS**2, f"{FACTOR:g} M R^2, the factor published, {FIRMWARE}"),
        "wheel_inertia": published(3.6e-5, f"{FIRMWARE}: the drive's inertia, wheel and rotor"),
        "roller_inertia": assumed(
            ROLLER_INERTIA,
            f"{ROLLERS} solid rollers of {DENSITY:g} kg/m^3 that fill their "
            f"circle, {1e3 * ROLLER_MASS:.2f} g each; the number is the Robot Soccer Kit's",
        ),
    },
    motor_numbers={
        "torque_constant": derived(0.03375 / DQ, f"{FIRMWARE}, over {DQ:g}: a DC motor's equals the back EMF"),
        "back_emf": published(0.0225, FIRMWARE),
        "resistance": derived(0.4875 / DQ, f"{FIRMWARE}, over {DQ:g}: that of a phase"),
        "gear_ratio": published(1.0, f"{FIRMWARE}: direct drive"),
        "current_limit": derived(9.0 * DQ, f"9 A, {FIRMWARE}, times {DQ:g}: the same torque"),
    },
    bearing_numbers={"wheel_viscous": published(8.85475e-6, FIRMWARE)},
    remarks=(
        "Number, size and mass of the rollers are not published.",
        "The centre of mass lies 5 mm beside S (firmware), in a frame that the file does not name; the model has it "
        "at S.",
        "The firmware's own friction of the whole robot, 2.65 N and 0.097 N m, is not in the model.",
        "A variant with a planetary gear of 25/7 has the same motors.",
    ),
)
