"""The time that estimates may take together, and what was left out because it was over."""

import math
import time
from collections.abc import Callable
from dataclasses import replace

from omniroll.engine.runs import Task

LONGEST = 1.5  # s of processor time that a run may take which is made for an estimate
WAITING = 0.1  # of the time that passes counts as work: a compiler's, which is another process


class Allowance:
    """Some seconds from now on.

    seconds   that may be taken. What has begun is not cut off by it: one run, or the making of one kernel
    clock     gives the time in s
    left_out  what there was no time for, in words
    """

    def __init__(self, seconds: float = math.inf, clock: Callable[[], float] = time.monotonic):
        self.clock = clock
        self.end = clock() + seconds
        self.left_out: list[str] = []

    def has_time(self, for_what: str) -> bool:
        """Whether there is time left; if not, it is noted what was left out."""
        if self.clock() < self.end:
            return True
        self.left_out.append(for_what)
        return False


def working_clock() -> Callable[[], float]:
    """A clock of the work of this process in s, by which neither other programs nor compilers take much."""
    began, worked = time.monotonic(), time.process_time()
    return lambda: max(time.process_time() - worked, WAITING * (time.monotonic() - began))


class Limit:
    """Ends a run some seconds of work after the run has first asked: kernels that are made for it take no part."""

    def __init__(self, seconds: float, clock: Callable[[], float] = time.process_time):
        self.seconds, self.clock = seconds, clock
        self.end = math.inf

    def __call__(self) -> str:
        """Why the run is to end, or ""."""
        now = self.clock()
        self.end = min(self.end, now + self.seconds)
        return f"it takes more than {self.seconds:g} s" if now > self.end else ""


def limited(task: Task, seconds: float | None = None) -> Task:
    """The task, which is stopped after some seconds of work; None: LONGEST."""
    return replace(task, interrupted=Limit(LONGEST if seconds is None else seconds))
