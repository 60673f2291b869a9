"""Question 9: a scene with motors, beside SciPy over the same compiled kernel, and MuJoCo with the same motors."""

import time
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.integrate import DOP853

import omniroll
from omniroll.effects.effect_set import EffectRun
from omniroll.engine.simulate import checked_task
from omniroll.engine.switching import SwitchingModel
from omniroll.exchange.run_in_mujoco import run_in_mujoco

from .common import ROOT, Answer, Target
from .tools import Engine, Simulate, cheapest, error_at_end, ladder

SCENE = ROOT / "scenes/driven.toml"
GOAL, FINE = 1e-9, 1e-14
LADDER = tuple(float(f"{10 ** (-k / 2):.0e}") for k in range(12, 27))
SCIPY_LADDER = (1e-9, 1e-10, 1e-11, 1e-12)
STEP = 2e-3  # s, MuJoCo's
REPEATS, OF_PEERS = 9, 3


def phases_of(run):
    """[(start, end, (N,) directions of the wheels that switch at the end)] of the phases of a run that take time."""
    rollers, knots = run.vehicle.rollers_per_wheel, run.effects.effects[0].times
    # The last row before each transition, at each knot, and of the run.
    ends = np.flatnonzero(np.append(np.diff(run.t) == 0, True) | np.isin(run.t, knots))
    found, start = [], run.t[0]
    for row in ends:
        passed = (run.contact[min(row + 1, len(run) - 1)] - run.contact[row]) % rollers
        directions = np.where(passed == 1, -1, np.where(passed == rollers - 1, 1, 0))
        if run.t[row] > start or directions.any():
            found.append((start, run.t[row], directions))
        start = run.t[row]
    return found


class Scipy:
    """DOP853 with the compiled kernel in its right-hand side. It is told where each phase ends and which motors are at
    their limits in it, as a fine run has found, and starts anew there: what finds that is not counted."""

    def __init__(self, fine, task, tolerance):
        self.fine, self.phases, self.tolerance, self.task = fine, phases_of(fine), tolerance, task
        self.model = SwitchingModel(self.task.kernel, self.task.switching)

    def _flow(self, state, start, end):
        """Rates of a phase, and y at its start, where a motor may be exactly at its limit: in the middle of the phase
        it is clear on which side it is."""
        middle, wheels = (start + end) / 2, self.task.vehicle.wheels
        inside = self.fine.sample([middle])
        acting = EffectRun(self.task.effects, self.task.kernel, middle)
        acting.pass_time(0.0, state)
        y = np.zeros(acting.state_vector.size)
        passed = np.ones(1, bool)
        while passed.any():
            y[: 6 + wheels] = np.concatenate([inside.nu[0], inside.chi[0], inside.pose[0]])
            flow, guards = acting.phase(0.0, state.free_axial())
            passed = guards.beyond(0.0, y)
            acting.pass_guards(passed)
        y[: 6 + wheels] = np.concatenate([state.nu, state.chi, state.pose])
        return lambda t, y: flow(t + start - middle, y), y

    def __call__(self):
        seconds, state, wheels = 0.0, self.task.state, self.task.vehicle.wheels
        self.evaluations = 0
        for start, end, directions in self.phases:
            if end > start:
                flow, y = self._flow(state, start, end)
                began = time.thread_time()
                stepper = DOP853(flow, 0.0, y, end - start, rtol=self.tolerance, atol=0.01 * self.tolerance)
                while stepper.status == "running":
                    stepper.step()
                seconds += time.thread_time() - began
                self.evaluations += stepper.nfev
                nu, chi, pose = np.split(stepper.y[: 6 + wheels], [3, 3 + wheels])
                state = replace(state, nu=nu, chi=chi, pose=pose)  # the free rollers' axial speeds stay
            if directions.any():
                state = self.model.apply(state, directions)
        self.end = state.nu, state.pose
        return seconds


class Mujoco:
    """A body for each roller, with the torques that the motors gave and lose."""

    def __init__(self, run, step):
        self.run, self.step = run, step

    def __call__(self):
        times = np.linspace(*self.run.t[[0, -1]], 200)  # the heading is followed through its turns
        found = run_in_mujoco(self.run, times, self.step, friction=1.0)
        self.end = found.nu[-1], found.pose[-1]
        return found.seconds


def answer() -> Answer:
    scene = omniroll.load_scene(SCENE)
    vehicle, options = scene.vehicle, {name: value for name, value in scene.options.items() if name != "accuracy"}
    fine = omniroll.simulate(vehicle, **options, accuracy=FINE, control=False)
    task, last, speed = checked_task(vehicle, **options), (fine.nu[-1], fine.pose[-1]), np.linalg.norm(fine.nu, axis=1)

    def error_of(end):
        return error_at_end(vehicle, end, last, speed.max())

    tools = {
        "omniroll, the C engine alone": (partial(Engine, vehicle, **options), LADDER, REPEATS),
        "omniroll, simulate(control=False)": (partial(Simulate, vehicle, control=False, **options), LADDER, REPEATS),
        "SciPy DOP853, same kernel": (partial(Scipy, fine, task), SCIPY_LADDER, OF_PEERS),
    }
    best = {tool: cheapest(ladder(*how, error_of), GOAL) for tool, how in tools.items()}
    ((_, times, error),) = ladder(partial(Mujoco, fine), (STEP,), OF_PEERS, error_of)
    rows = [
        [tool, f"tol {found[0]:.0e}", found[1].in_unit(1e3), f"{found[2]:.0e}"] if found else [tool, "", "-", "-"]
        for tool, found in best.items()
    ]
    rows.append(["MuJoCo", f"step {1e3 * STEP:g} ms", times.in_unit(1e3), f"{error:.0e}"])
    own, other = best["omniroll, the C engine alone"], best["SciPy DOP853, same kernel"]
    targets = []
    for name, ratio, least in (
        ("SciPy's DOP853 over the same kernel, at equal error", other[1].least / own[1].least if other else 0, 20),
        ("MuJoCo at its step of 2 ms", times.least / own[1].least, 50),
    ):
        targets.append(Target(f"driven.toml: >= {least}x faster than {name}", f"{ratio:.0f}x", ratio >= least))
    return Answer(
        title="9. A scene with motors",
        text=(
            "scenes/driven.toml: 6 s, free rollers, impact, geared motors with current limits, "
            f"{len(phases_of(fine))} phases. ms for the whole motion, minimum (median), of the fastest setting whose "
            f"error of the end state is below {GOAL:g}, in the norm of `accuracy`, against a run at {FINE:g}. SciPy "
            "evaluates the same compiled kernel; it is told where each phase ends and which motors are limited, and "
            "what finds that is not counted. MuJoCo has a body for each roller, and the torques of the same motors at "
            "its own wheel rates."
        ),
        headings=["tool", "setting", "ms", "error"],
        rows=rows,
        targets=targets,
    )
