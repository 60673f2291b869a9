"""stats["sensitivity"] by a second run from a start that is moved, as it is made, and by the variational equations.

    python -m tests.benchmarks.sensitivity_stat

The second way follows one column, the direction in which control.py moves the start, along the run that there is.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import omniroll
from omniroll.engine import sensitivities
from omniroll.engine.columns import Column
from omniroll.engine.control import MOVED, made, moved, sensitivity
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task
from tests.sensitivities.costs import TASKS

REPEATS = 7


class Direction(Columns):
    """The one column in which the start is moved."""

    def __init__(self, run: omniroll.Trajectory, task: Task):
        super().__init__(run, ())
        other = moved(task, MOVED).state
        start = {name: (getattr(other, name) - getattr(task.state, name)) / MOVED for name in ("nu", "chi", "pose")}
        self.columns = (Column("moved", start=start),)
        self.start = {name: value[None] for name, value in start.items()}


def by_equations(run: omniroll.Trajectory, task: Task) -> float:
    """The largest size of the deviation in the rows; 1 at least."""
    sweep = sensitivities.Sweep(Motion(run), Direction(run, task))
    sweep.run()
    wheels, rows = run.vehicle.wheels, sweep.rows[:, :, 0]
    sizes = np.full(6 + wheels, math.inf)
    sizes[:3] = np.linalg.norm(run.nu, axis=1).max()
    sizes[3 + wheels :] = run.vehicle.platform_radius, run.vehicle.platform_radius, 1.0
    return max(1.0, float((np.abs(rows[:, : 6 + wheels]) / sizes).max()))


def least(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time in ms, and what the call gives."""
    times, found = [], None
    for _ in range(REPEATS):
        start = time.process_time()
        found = call()
        times.append(time.process_time() - start)
    return 1e3 * min(times), found


def main() -> None:
    print("rollers, effects    s   run  |  second run: ms  value  |  equations: ms  value")
    for name, options in TASKS.items():
        for duration in (10.0, 200.0):
            given = {"nu": (1, 0.3, 0.8), "chi": (0.1, -0.2, 0.15), "duration": duration, "accuracy": 1e-9}
            task = checked_task(omniroll.Vehicle.paper(), **given, **options)
            base = made(task, task.accuracy)
            plain, _ = least(lambda task=task: made(task, task.accuracy))
            with_run, one = least(lambda task=task, base=base: sensitivity(task, base))
            run = omniroll.simulate(omniroll.Vehicle.paper(), **given, **options, control=False)
            by_rates, other = least(lambda run=run, task=task: by_equations(run, task))
            print(
                f"{name:9} {duration:5.0f} {plain:6.2f} | {with_run:8.2f} {one:11.4g} | {by_rates:8.2f} {other:11.4g}"
            )


if __name__ == "__main__":
    main()
