"""`python -m benchmarks.ground_in_mujoco` from tests/: wheels that slip, beside a body for each roller in MuJoCo.

It prints the table of docs/ground-contact.md. The vehicle starts from rest under constant torques. Its centre of mass
is on the ground, so that accelerations hardly change the loads, which are those at rest in the law of the ground here.
"""

import math

import mujoco
import numpy as np

import omniroll

WHEELS, ROLLERS, RADIUS, PLATFORM_RADIUS = 3, 8, 0.05, 0.15  # m
PLATFORM, HUB, ROLLER = 1.5, 0.15, 0.05  # kg, 3.15 in all
YAW, HUB_AXIAL, HUB_ACROSS = 0.02, 8e-5, 5e-5  # kg m^2
ROLLER_AXIAL = 4e-5  # about any axis
TORQUES, DURATION = (0.03, -0.01, -0.02), 1.0  # N m, s
FRICTIONS, STEPS, NAMED_SPEED = (0.3, 0.1, 0.08, 1.0), (1e-4, 5e-5), 1e-4
SPHERES = 61  # of a roller: a row that touches the barrel from inside
AXIS = RADIUS * math.cos(math.pi / (ROLLERS - 1))
ANGLES = tuple(2 * math.pi * i / WHEELS for i in range(WHEELS))
WHEEL = HUB + ROLLERS * ROLLER

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="100" tolerance="1e-12"
    iterations="200"/>
  <default>
    <geom type="sphere" contype="1" conaffinity="0" friction="{friction} 0 0" solref="{stiffness} 1"
      solimp="0.99 0.999 1e-4"/>
  </default>
  <worldbody>
    <geom type="plane" size="0 0 1" contype="0" conaffinity="1" friction="{friction} 0 0"/>
    <body pos="0 0 {height}">
      <freejoint/>
      <inertial pos="0 0 {low}" mass="{mass}" diaginertia="0.012 0.012 {yaw}"/>{wheels}
    </body>
  </worldbody>
  <actuator>{motors}</actuator>
</mujoco>"""


def model(friction: float, step: float, height: float = 0.0, roller: float = ROLLER_AXIAL) -> mujoco.MjModel:
    """height: of the centre of mass above the ground, in m; roller: inertia of one about any axis, in kg m^2."""
    slants = np.linspace(-math.pi / ROLLERS, math.pi / ROLLERS, SPHERES)
    spheres = "".join(
        f'<geom pos="0 {AXIS * math.tan(u):.9g} 0" size="{RADIUS - AXIS / math.cos(u):.9g}"/>' for u in slants
    )
    rollers = "".join(
        f'<body pos="0 {AXIS * math.sin(k):.12g} {-AXIS * math.cos(k):.12g}" euler="{k:.12g} 0 0">'
        f'<joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0" mass="{ROLLER}" '
        f'diaginertia="{roller} {roller} {roller}"/>{spheres}</body>'
        for k in 2 * math.pi * np.arange(ROLLERS) / ROLLERS
    )
    wheels = "".join(
        f'<body pos="{PLATFORM_RADIUS * math.cos(a):.12g} {PLATFORM_RADIUS * math.sin(a):.12g} 0" '
        f'euler="0 0 {a:.12g}"><joint name="wheel{i}" type="hinge" axis="1 0 0"/><inertial pos="0 0 0" mass="{HUB}" '
        f'diaginertia="{HUB_AXIAL} {HUB_ACROSS} {HUB_ACROSS}"/>{rollers}</body>'
        for i, a in enumerate(ANGLES)
    )
    motors = "".join(f'<motor joint="wheel{i}"/>' for i in range(WHEELS))
    low = -RADIUS + (height * (PLATFORM + WHEELS * WHEEL) - WHEELS * WHEEL * RADIUS) / PLATFORM
    return mujoco.MjModel.from_xml_string(
        MODEL.format(
            step=step, stiffness=2 * step, friction=friction, height=RADIUS, low=low, mass=PLATFORM, yaw=YAW,
            wheels=wheels, motors=motors,
        )
    )  # fmt: skip


def in_mujoco(friction: float, step: float) -> np.ndarray:
    """x, y and theta at the end."""
    bodies = model(friction, step)
    data = mujoco.MjData(bodies)
    data.ctrl[:] = TORQUES
    for _ in range(round(DURATION / step)):
        mujoco.mj_step(bodies, data)
    return np.array([*data.qpos[:2], 2 * math.atan2(data.qpos[6], data.qpos[3])])


def driven(bodies: mujoco.MjModel, times: np.ndarray, torques: np.ndarray, duration: float) -> np.ndarray:
    """x and y at the end, under torques (K, N) that are linear between their times (K,)."""
    data, step = mujoco.MjData(bodies), bodies.opt.timestep
    for k in range(round(duration / step)):
        data.ctrl[:] = [np.interp((k + 0.5) * step, times, torque) for torque in torques.T]
        mujoco.mj_step(bodies, data)
    return data.qpos[:2].copy()


def vehicle(roller: float = ROLLER_AXIAL) -> omniroll.Vehicle:
    """The same bodies as numbers of the whole."""
    of_wheel = WHEEL * PLATFORM_RADIUS**2 + HUB_ACROSS
    of_rollers = ROLLERS * (ROLLER * AXIS**2 / 2 + roller)
    return omniroll.Vehicle(
        wheels=WHEELS, rollers_per_wheel=ROLLERS, wheel_angles=ANGLES, mass=PLATFORM + WHEELS * WHEEL,
        yaw_inertia=YAW + WHEELS * (of_wheel + of_rollers), roller_inertia=roller,
        wheel_inertia=HUB_AXIAL + ROLLERS * (ROLLER * AXIS**2 + roller), platform_radius=PLATFORM_RADIUS,
        wheel_radius=RADIUS, roller_axis_radius=AXIS,
    )  # fmt: skip


def here(*ground: omniroll.Contact) -> omniroll.Trajectory:
    return omniroll.simulate(
        vehicle(), nu=(0, 0, 0), duration=DURATION, effects=[omniroll.Torque(TORQUES), *ground], control=False
    )


def main() -> None:
    rolling = here().pose[-1]
    print("| friction | with slip: " + " | ".join(f"step {step:g} s" for step in STEPS) + " | rolling | way |")
    print("| --- |" + " --- |" * (len(STEPS) + 2))
    for friction in FRICTIONS:
        run = here(omniroll.Contact(law="regularised", friction=friction, speed=NAMED_SPEED))
        way = np.hypot(*np.diff(run.sample(np.linspace(0, DURATION, 2001)).pose[:, :2], axis=0).T).sum()
        ends = [in_mujoco(friction, step) for step in STEPS]
        shown = [f"{np.hypot(*(run.pose[-1] - end)[:2]) / way:.2%}" for end in ends]
        apart = np.hypot(*(rolling - ends[-1])[:2]) / way
        print(f"| {friction:g} | " + " | ".join(shown) + f" | {apart:.1%} | {way:.4f} m |", flush=True)


if __name__ == "__main__":
    main()
