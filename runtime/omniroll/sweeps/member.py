"""One run of a sweep: its arguments, and what is kept of it."""

from dataclasses import replace
from typing import Any

import numpy as np

from omniroll.engine.control import Controlled, controlling, making
from omniroll.engine.simulate import checked_task
from omniroll.engine.works import Work
from omniroll.errors import InvalidValueError
from omniroll.results.trajectory import Trajectory

ON_DEMAND = ("contact_spin", "spins", "energy")  # of Samples
SAMPLED = ("t", "nu", "chi", "contact", "pose", *ON_DEMAND)
FIRST_ROWS = 512  # after each call a thread waits for its turn, and nobody looks at a run between its calls
COUNTS = ("switches", "steps", "evaluations")

Run = dict[str, Any]  # the arguments of simulate
Found = dict[str, Any]  # what is kept of it


def finding(run: Run, times: np.ndarray | None, control: bool) -> Work[Found]:
    """What is kept of one run: where it ended, or how it failed."""
    try:
        task = replace(checked_task(**run), first_rows=FIRST_ROWS)
        if control and task.duration > 0:
            done = yield from controlling(task)
        else:
            done = Controlled((yield from making(task, task.accuracy)), None, lambda: None)
        stats, stopped = done.run.stats(), done.run.stop
        found = done.run.end() | {name: stats[name] for name in COUNTS}
        found |= {"reason": None if stopped is None else str(stopped), "start_axial": task.state.free_axial()}
        found["start_speeds"] = task.effects.own_speeds(task.kernel, task.state)
        found["error_estimate"] = None if stopped is not None else done.error_estimate
        found["samples"] = None if times is None else _samples(done.run.part(), times)
        done.run.release()
    except Exception as error:  # whatever it is, it must not take the others along
        return {"reason": shown(error)}
    return found


def shown(error: Exception) -> str:
    return str(error) if isinstance(error, InvalidValueError) else f"{type(error).__name__}: {error}"


def _samples(trajectory: Trajectory, times: np.ndarray) -> dict[str, np.ndarray | None]:
    """Samples at the times; beyond the trajectory's end nan, or -1 where whole numbers stand."""
    within = times <= trajectory.t[-1]
    samples = trajectory.sample(times[within])
    result: dict[str, np.ndarray | None] = {}
    for name in SAMPLED:
        values = getattr(samples, name)
        if values is None:
            result[name] = None
            continue
        result[name] = nothing((len(times), *values.shape[1:]), values.dtype)
        result[name][within] = values
    return result


def nothing(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """What stands where there is no number: nan, or -1."""
    dtype = np.dtype(dtype)
    return np.full(shape, -1 if dtype.kind in "iu" else np.nan, dtype)
