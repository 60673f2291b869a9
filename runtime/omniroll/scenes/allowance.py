"""The time that estimates may take together, and what was left out because it was over."""

import math
import time
from collections.abc import Callable


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
