"""goBILDA's Strafer kit, a chassis for students with four mecanum wheels of 96 mm."""

import math

from omniroll.robots.mecanum_wheels import X_HANDS, corners, solid_roller
from omniroll.robots.robot import Robot, angles, assumed, derived, published
from omniroll.vehicles import parts, wheel_kind

SHEET = "goBILDA, by Sim2RealLab, strafer_shared/constants.py, commit 4f144bad"
RADIUS, ROLLERS, WIDTH, WHEEL_MASS = 0.048, 10, 0.038, 0.12
BASE, TRACK, MASS = 0.336, 0.4132, 4.149
AXIS = wheel_kind.axis_by_neighbours(RADIUS, ROLLERS, math.pi / 4)
_, INERTIA, SIZES = solid_roller(RADIUS, AXIS, ROLLERS)
WHEEL_INERTIA, _ = parts.cylinder(WHEEL_MASS, RADIUS, WIDTH)
YAW_INERTIA = MASS * ((BASE + 2 * RADIUS) ** 2 + (TRACK + WIDTH) ** 2) / 12
STALL, RATE, VOLTAGE = 24.3 * 9.80665e-2, 312 * math.pi / 30, 12.0

ROBOT = Robot(
    name="strafer",
    title="goBILDA Strafer kit",
    source=SHEET,
    wheels=4,
    rollers_per_wheel=ROLLERS,
    wheel_angles=angles(90, -90, 90, -90),
    more={
        "wheel_places": corners(BASE / 2, TRACK / 2),
        "roller_angle": tuple(math.pi / 4 * hand for hand in X_HANDS),
    },
    numbers={
        "platform_radius": derived(math.hypot(BASE, TRACK) / 2, f"half of the wheelbase and of the track, {SHEET}"),
        "wheel_radius": published(RADIUS, SHEET),
        "roller_axis_radius": assumed(AXIS, "rollers touch their neighbours: makers fill the room"),
        "mass": published(MASS, f"{SHEET}: the kit; with camera and battery 5.1 kg"),
        "yaw_inertia": assumed(YAW_INERTIA, "an even plate that goes as far as the wheels"),
        "wheel_inertia": assumed(WHEEL_INERTIA, f"an even disk of {WHEEL_MASS:g} kg, estimated: nobody publishes it"),
        "roller_inertia": assumed(INERTIA, SIZES),
    },
    motor_numbers={
        "torque_constant": derived(VOLTAGE / RATE, "12 V at 312 rpm of the geared shaft, the current without load out"),
        "back_emf": derived(VOLTAGE / RATE, "as torque_constant: a DC motor's are alike"),
        "resistance": derived(VOLTAGE**2 / (RATE * STALL), "12 V over the current of the stall torque, 24.3 kg cm"),
        "gear_ratio": derived(1.0, "its numbers are those of the geared shaft"),
        "rotor_inertia": assumed(0.0, "nobody publishes it: what it adds behind the gear is left out"),
    },
    remarks=("The kit's own odometry wheels are not in the model.",),
)
