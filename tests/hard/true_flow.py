"""The true flow from a start, exactly as the floats have it: Taylor series in 28 digits over the generated formulas."""

from collections.abc import Callable
from typing import Any

import numpy as np

from hard.setting import end_of
from omniroll import Trajectory
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.reference import Reference, Taylor, digits, follow

TRIALS = 60


def motion(task: Task) -> Reference:
    """The motion up to its end: y (1, 6 + N) there, and the switches."""
    with digits():
        return follow(Taylor(task), task, np.array([task.duration]))


def missed(run: Trajectory, truth: Reference) -> float:
    """The distance of a run's end from the true one, and 1 for each switch too many or too few."""
    return float(np.abs(end_of(run) - truth.y[-1]).max()) + abs(len(run.switches) - len(truth.switches))


def first_switch(task: Task) -> tuple[float, int, int]:
    """(elapsed, wheel, direction) of the first switch; ValueError where there is none within the task's duration."""
    switches = motion(task).switches
    if not switches:
        raise ValueError("no switch within the duration")
    return switches[0]


def beyond_at(task: Task, wheel: int, sign: int, times: list[float]) -> list[float]:
    """sign chi - pi/n of a wheel at elapsed times within one Taylor step, as if its roller had no end."""
    with digits():
        taylor, at = _one_step(task, max(times))
        return [float(sign * at(taylor.mechanics.number(t))[3 + wheel] - taylor.mechanics.joint) for t in times]


def most_beyond(task: Task, wheel: int, sign: int) -> float:
    """How far beyond pi/n a wheel is where sign chi is largest, by bisection of its speed, within one Taylor step."""
    with digits():
        taylor, at = _one_step(task, task.duration)
        m = taylor.mechanics
        early, late = m.number(0.0), m.number(task.duration)
        for _ in range(TRIALS):
            middle = ((early + late) / 2).mid()
            outwards = sign * m.wheel_speeds(at(middle)[:3])[wheel] > 0
            early, late = (middle, late) if outwards else (early, middle)
        return float(sign * at(early)[3 + wheel] - m.joint)


def course(task: Task) -> Callable[[Any], list]:
    """y at any elapsed time of a run without switches, events and known times. Use it inside digits()."""
    taylor = Taylor(task)
    m = taylor.mechanics
    y, axial = m.start()
    y, now, pieces = m.begin(y, axial, m.number(0.0)), m.number(0.0), []
    while float(now) < task.duration:
        length, at = taylor.step(y, m.number(task.duration) - now)
        pieces.append((now, at))
        y, now = at(length), now + length

    def values(time: Any) -> list:
        start, at = next(piece for piece in reversed(pieces) if float(piece[0] - time) <= 0)
        return at(m.number(0.0) + time - start)

    return values


def _one_step(task: Task, duration: float) -> tuple[Taylor, Callable]:
    taylor = Taylor(task)
    m = taylor.mechanics
    y, axial = m.start()
    length, at = taylor.step(m.begin(y, axial, m.number(0.0)), m.number(duration))
    if float(length) < duration:
        raise ValueError(f"one Taylor step reaches {float(length):g}, not {duration:g}")
    return taylor, at
