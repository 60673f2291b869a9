"""Question 4: simulated seconds per second, beside a MuJoCo model of the same vehicle with a body for each roller."""

import math
import time

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import omniroll
from omniroll.kernels.kernel import kernel
from omniroll.vehicles.parts import cylinder

from .common import ROOT, Answer, Target, Times, repeated
from .motion import NU, Engine, error_at_end

DURATION, REPEATS = 2.0, 2
STEPS = (2e-3, 1e-3, 5e-4, 2e-4)
ACCURACY = 1e-9
SPHERES = 31  # of a roller

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="100" tolerance="1e-12"/>
  <default>
    <geom type="sphere" contype="1" conaffinity="0" friction="1 0 0" solref="{stiffness} 1" solimp="0.99 0.999 1e-4"/>
  </default>
  <worldbody>
    <geom type="plane" size="0 0 1" contype="0" conaffinity="1"/>
    <body pos="0 0 {height}">
      <freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="{tilt} {tilt} {yaw}"/>{wheels}
    </body>
  </worldbody>
</mujoco>"""

WHEEL = """
      <body pos="{x} {y} 0" euler="0 0 {alpha}">
        <joint name="wheel{i}" type="hinge" axis="1 0 0"/>
        <inertial pos="0 0 0" mass="0.15" diaginertia="{axial} {across} {across}"/>{rollers}
      </body>"""

ROLLER = """
        <body pos="0 {y} {z}" euler="{kappa} 0 0">
          <joint name="roller{i}_{j}" type="hinge" axis="0 1 0"/>
          <inertial pos="0 0 0" mass="0.05" diaginertia="{across} {axial} {across}"/>
          {spheres}
        </body>"""


def model_text(vehicle, step):
    """The paper's vehicle, part by part; rollers are rows of spheres that touch the barrel from inside, at slants u.

    A mesh of the barrel would rest on several vertices, which resists its rolling.
    """
    n, R, l, r = (  # noqa: E741
        vehicle.rollers_per_wheel, vehicle.platform_radius, vehicle.wheel_radius, vehicle.roller_axis_radius
    )  # fmt: skip
    slant = np.linspace(-math.pi / n, math.pi / n, SPHERES)
    spheres = "".join(f'<geom pos="0 {r * math.tan(u):.9g} 0" size="{l - r / math.cos(u):.9g}"/>' for u in slant)
    axial, across = cylinder(0.05, (l - r) / 2, 2 * l * math.sin(math.pi / n))
    hub_axial, hub_across = cylinder(0.15, r, 0.01)
    wheels = []
    for i, alpha in enumerate(vehicle.wheel_angles):
        kappas = 2 * math.pi * np.arange(n) / n
        rollers = [
            ROLLER.format(
                i=i, j=j, kappa=k, y=r * math.sin(k), z=-r * math.cos(k), axial=axial, across=across, spheres=spheres
            )
            for j, k in enumerate(kappas)
        ]
        x, y = R * math.cos(alpha), R * math.sin(alpha)
        wheels.append(
            WHEEL.format(i=i, x=x, y=y, alpha=alpha, axial=hub_axial, across=hub_across, rollers="".join(rollers))
        )
    return MODEL.format(step=step, stiffness=2 * step, height=l, yaw=R**2 / 2, tilt=R**2 / 4, wheels="".join(wheels))


class Mujoco:
    """The contact model, started with wheels and contact rollers that roll."""

    def __init__(self, vehicle, step):
        self.vehicle, self.step = vehicle, step
        self.model = mujoco.MjModel.from_xml_string(model_text(vehicle, step))
        self.data = mujoco.MjData(self.model)

    def _start(self):
        vehicle, data = self.vehicle, self.data
        mujoco.mj_resetData(self.model, data)
        nu, R = np.array(NU), vehicle.platform_radius
        wheel, contact = kernel(vehicle, "free", "python").wheel_rates(nu, np.zeros(vehicle.wheels))
        data.qvel[:6] = R * nu[0], R * nu[1], 0, 0, 0, nu[2] / vehicle.yaw_scale
        for i in range(vehicle.wheels):
            data.joint(f"wheel{i}").qvel[0] = wheel[i]
            data.joint(f"roller{i}_0").qvel[0] = contact[i]

    def __call__(self):
        self._start()
        start = time.thread_time()
        for _ in range(round(DURATION / self.step)):
            mujoco.mj_step(self.model, self.data)
        seconds = time.thread_time() - start
        self.end = self._end()
        return seconds

    def _end(self):
        """(nu, pose). theta over 2 s stays below a turn."""
        q, v, R = self.data.qpos, self.data.qvel, self.vehicle.platform_radius
        theta = 2 * math.atan2(q[6], q[3])
        c, s = math.cos(theta), math.sin(theta)
        nu = (v[0] * c + v[1] * s) / R, (v[1] * c - v[0] * s) / R, v[5] * self.vehicle.yaw_scale
        return np.array(nu), np.array([q[0], q[1], theta])


def answer() -> Answer:
    vehicle = omniroll.Vehicle.paper()
    fine = Engine(vehicle, 1e-13, "free", "impact", DURATION)
    fine()
    rows, points = [], []

    def add(tool, setting, times, end):
        error = error_at_end(vehicle, end, fine.end)
        speed = Times(DURATION / times.least, DURATION / times.median)
        rows.append([tool, setting, f"{speed.least:.3g} ({speed.median:.3g})", f"{error:.1e}"])
        points.append((tool, speed.least, error))
        return speed.least

    engine = Engine(vehicle, ACCURACY, "free", "impact", DURATION)
    times = repeated(engine, 20)
    own = add("omniroll, the C engine alone", f"accuracy {ACCURACY:g}", times, engine.end)

    def simulated():
        found = omniroll.simulate(vehicle, nu=NU, duration=DURATION, accuracy=ACCURACY)
        simulated.end = found.nu[-1], found.pose[-1]

    times = repeated(simulated, 10)
    add("omniroll, simulate()", f"accuracy {ACCURACY:g}", times, simulated.end)
    peers = []
    for step in STEPS:
        tool = Mujoco(vehicle, step)
        times = repeated(tool, REPEATS)
        peers.append(add("MuJoCo", f"step {1e3 * step:g} ms", times, tool.end))
    _figure(points)
    return Answer(
        title="4. A body for each roller in MuJoCo",
        text=(
            f"The paper's vehicle, free rollers, impact, nu = (1, 0, 1), {DURATION:g} s. Simulated seconds "
            "per second, best (median), and the error of the end state, in the norm of `accuracy`, "
            f"against this project's run at 1e-13. MuJoCo: 19 bodies, each roller a row of {SPHERES} "
            "spheres inside its barrel, elliptic friction cone with coefficient 1, contacts as stiff as "
            "the step allows. Its error is a difference of models too: its wheels may slip and sink. It "
            "simulates what this project does not: tilting, slipping, lifting off."
        ),
        headings=["tool", "setting", "simulated s per s", "error"],
        rows=rows,
        targets=[Target("faster than MuJoCo's fastest step", f"{own / max(peers):.0f}x", own > max(peers))],
        figures=["benchmark-mujoco.png"],
    )


def _figure(points):
    figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
    for tool in dict.fromkeys(tool for tool, *_ in points):
        chosen = [(speed, error) for name, speed, error in points if name == tool]
        axes.loglog(*zip(*chosen, strict=True), "-o", label=tool)
    axes.set(xlabel="simulated seconds per second", ylabel="error after 2 s")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(ROOT / "docs/benchmark-mujoco.png", dpi=120, metadata={"Software": None})
    plt.close(figure)
