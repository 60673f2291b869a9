"""Question 6: many short runs against one long one."""

import time

import numpy as np

import omniroll
from omniroll.kernels.kernel import kept_kernel
from omniroll.sweeps import sweep

from .common import Answer, Target, Times, repeated

NU, MEMBERS, LENGTH, LONG = (1.0, 0.0, 1.0), 1000, 20.0, 1000.0
OPTIONS = {"nu": NU, "roller_model": "locked", "switching": "smooth", "accuracy": 1e-9}
REPEATS = 5


class Sweep:
    """simulate_many over vehicles of different masses, with error estimates, on a number of cores."""

    def __init__(self, cores):
        random = np.random.default_rng(1)
        paper = omniroll.Vehicle.paper()
        self.vehicles = [paper.replace(mass=paper.mass * factor) for factor in random.uniform(0.8, 1.2, MEMBERS)]
        self.cores = cores

    def __call__(self):
        """Seconds by the clock and seconds of all cores."""
        every, sweep.cores = sweep.cores, lambda: self.cores
        kept_kernel.cache_clear()  # the vehicles are new to the package
        began, began_cores = time.perf_counter(), time.process_time()
        try:
            self.found = omniroll.simulate_many(self.vehicles, duration=LENGTH, **OPTIONS)
        finally:
            sweep.cores = every
        return time.perf_counter() - began, time.process_time() - began_cores


def measured(cores):
    """Times by the clock and of all cores, and the largest error estimate."""
    sweep = Sweep(cores)
    sweep()
    pairs = np.array([sweep() for _ in range(REPEATS)])
    clock, core = (Times(*row) for row in zip(pairs.min(axis=0), np.median(pairs, axis=0), strict=True))
    assert not sweep.found.stopped.any()
    return clock, core, sweep.found.error_estimate.max()


def answer() -> Answer:
    vehicle = omniroll.Vehicle.paper()
    long = repeated(lambda: omniroll.simulate(vehicle, duration=LONG, control=False, **OPTIONS) and None, REPEATS)
    estimate = omniroll.simulate(vehicle, duration=LONG, **OPTIONS).stats["error_estimate"]
    one, one_core, error = measured(1)
    two, two_core, _ = measured(2)
    whole = MEMBERS * LENGTH
    ratio = one_core.least / whole / (long.least / LONG)
    faster = one.least / two.least
    rows = [
        ["one plain run of 1000 s", long.in_unit(1e6 / LONG), "", f"{estimate:.0e}"],
        ["1000 members, one thread", one_core.in_unit(1e6 / whole), one.in_unit(1e6 / whole), f"{error:.0e}"],
        ["1000 members, two threads", two_core.in_unit(1e6 / whole), two.in_unit(1e6 / whole), f"{error:.0e}"],
    ]
    return Answer(
        title="6. A sweep",
        text=(
            "Motion 3 (locked rollers, smooth switches, accuracy 1e-9): 1000 vehicles of different masses, 20 s each, "
            "with error estimates and without trajectories, against one run of 1000 s without an estimate. "
            "Microseconds for a simulated second, and the largest error estimate."
        ),
        headings=["run", "of the cores", "by the clock", "error"],
        rows=rows,
        targets=[
            Target("a sweep: core-time for a simulated second <= 3x that of one run", f"{ratio:.2f}x", ratio <= 3),
            Target("a sweep: >= 1.8x faster on two cores", f"{faster:.2f}x", faster >= 1.8),
        ],
    )
