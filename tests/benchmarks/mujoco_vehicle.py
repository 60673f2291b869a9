"""Question 4: simulated seconds per second, beside a MuJoCo model of the same vehicle with a body for each roller."""

import math
import time

import mujoco
import numpy as np

import omniroll
from omniroll.exchange.bodies import Bodies
from omniroll.exchange.mjcf import SPHERES, to_mjcf
from omniroll.kernels.kernel import kernel
from omniroll.vehicles.parts import cylinder

from .common import Answer, Target, Times, repeated
from .motion import NU
from .tools import Engine, Simulate, error_at_end, figure

DURATION, REPEATS = 2.0, 2
STEPS = (2e-3, 1e-3, 5e-4, 2e-4)
ACCURACY = 1e-9


def bodies_of_paper(vehicle):
    """The paper's vehicle, part by part, of masses that omniroll.vehicles.parts.paper_numbers has."""
    n, R, l, r = (  # noqa: E741
        vehicle.rollers_per_wheel, vehicle.platform_radius, vehicle.wheel_radius, vehicle.roller_axis_radius
    )  # fmt: skip
    roller = cylinder(0.05, (l - r) / 2, 2 * l * math.sin(math.pi / n))
    return Bodies(1.0, R**2 / 2, 0.15, *cylinder(0.15, r, 0.01), 0.05, *roller)


class Mujoco:
    """The contact model, started with wheels and contact rollers that roll."""

    def __init__(self, vehicle, step):
        self.vehicle, self.step = vehicle, step
        self.model = mujoco.MjModel.from_xml_string(to_mjcf(vehicle, step=step, bodies=bodies_of_paper(vehicle)))
        self.data = mujoco.MjData(self.model)

    def _start(self):
        vehicle, data = self.vehicle, self.data
        mujoco.mj_resetData(self.model, data)
        nu, R = np.array(NU), vehicle.platform_radius
        wheel, contact = kernel(vehicle, "free", "python").wheel_rates(nu, np.zeros(vehicle.wheels))
        data.qvel[:6] = R * nu[0], R * nu[1], 0, 0, 0, nu[2] / vehicle.yaw_scale
        for i in range(vehicle.wheels):
            data.joint(f"wheel{i + 1}").qvel[0] = wheel[i]
            data.joint(f"roller{i + 1}_1").qvel[0] = contact[i]

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
    vehicle, task = omniroll.Vehicle.paper(), {"nu": NU, "duration": DURATION}  # free rollers, impact
    fine = Engine(vehicle, 1e-13, **task)
    fine()
    rows, curves = [], {}

    def add(name, setting, tool, repeats):
        times = repeated(tool, repeats)
        error = error_at_end(vehicle, tool.end, fine.end, np.linalg.norm(NU))
        speed = Times(DURATION / times.least, DURATION / times.median)
        curves.setdefault(name, []).append((speed.least, error))
        rows.append([name, setting, f"{speed.least:.3g} ({speed.median:.3g})", f"{error:.1e}"])
        return speed.least

    setting = f"accuracy {ACCURACY:g}"
    own = add("omniroll, the C engine alone", setting, Engine(vehicle, ACCURACY, **task), 20)
    add("omniroll, simulate()", setting, Simulate(vehicle, ACCURACY, **task), 10)
    peers = [add("MuJoCo", f"step {1e3 * step:g} ms", Mujoco(vehicle, step), REPEATS) for step in STEPS]
    figure("benchmark-mujoco.png", curves, xlabel="simulated seconds per second", ylabel="error after 2 s")
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
