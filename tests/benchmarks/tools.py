"""This project as a tool that is timed, the engine alone and `simulate`; ladders of settings, the cheapest of them."""

import time

import matplotlib.pyplot as plt
import numpy as np

import omniroll
from omniroll.engine.compiled_engine import DONE, FULL, CompiledRun
from omniroll.engine.simulate import checked_task

from .common import ROOT, repeated


class Engine:
    """The compiled engine alone: one run, its buffers filled and not read."""

    def __init__(self, vehicle, tolerance, **options):
        self.task, self.tolerance = checked_task(vehicle, **options, accuracy=tolerance), tolerance

    def __call__(self):
        seconds, run, self.switches = run_alone(self.task, self.tolerance)
        self.end = np.array(run.nu), np.array(run.pose)
        return seconds


class Simulate:
    """`simulate`, whole: with the trajectory that it returns."""

    def __init__(self, vehicle, tolerance, **options):
        self.vehicle, self.options = vehicle, options | {"accuracy": tolerance}

    def __call__(self):
        run = omniroll.simulate(self.vehicle, **self.options)
        self.end = run.nu[-1], run.pose[-1]


def run_alone(task, tolerance):
    """(seconds in the compiled engine, its run at the end, switches) of a task."""
    run = CompiledRun(task, tolerance)
    step, model = run.module.lib.omniroll_run, run.kernel.model_for(run.module.ffi)
    seconds, status, switches = 0.0, FULL, 0
    while status == FULL:
        run.run.record.row_count = run.run.record.switch_count = 0
        start = time.thread_time()
        status = step(run.struct, model)
        seconds += time.thread_time() - start
        switches += run.run.record.switch_count
    assert status == DONE
    return seconds, run, switches


def error_at_end(vehicle, end, reference, speed):
    """The norm of `accuracy`: ((x, y)/R, theta, nu/speed), speed the largest |nu|; an end is (nu, pose)."""
    nu, pose = (np.asarray(own, float) - true for own, true in zip(end, reference, strict=True))
    return float(np.abs([*pose[:2] / vehicle.platform_radius, pose[2], *nu / speed]).max())


def ladder(make, tolerances, repeats, error):
    """[(tolerance, Times, error)] of the tools that `make` gives for tolerances; `error` of their ends."""
    found = []
    for tolerance in tolerances:
        tool = make(tolerance)
        times = repeated(tool, repeats)
        found.append((tolerance, times, error(tool.end)))
    return found


def cheapest(found, goal):
    """The fastest setting whose achieved error is below the goal, or None."""
    enough = [entry for entry in found if entry[2] <= goal]
    return min(enough, key=lambda entry: entry[1].least) if enough else None


def figure(name, curves, **axis_labels):
    """docs/NAME: a curve of (speed or time, error) for each tool."""
    made, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    for tool, points in curves.items():
        axes.loglog(*zip(*points, strict=True), "-o", label=tool)
    axes.set(**axis_labels)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    made.savefig(ROOT / "docs" / name, dpi=120, metadata={"Software": None})
    plt.close(made)
