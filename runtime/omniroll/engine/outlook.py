"""What is left of a run at its present pace: a run whose steps collapse, or that would fill more memory than it may, is
stopped while it is young.

The pace is the time that a step gains. Where it grew over the last two windows of steps it is taken to go on growing
in the same way, since a vehicle that slows down passes fewer joints; it is never taken to shrink. Where forces change
fast for a moment it is low in one window alone.
"""

import math
from dataclasses import dataclass, field

FEW_SWITCHES = 1 / 8  # of the steps: with more the steps follow the joints, and have not collapsed by themselves
WINDOWS = 3  # that show whether the pace grows, where there are few switches
SURE = 8192  # steps after which switches are no reason to wait any longer
FIRST = 32  # steps of the first window; each is twice as long as the one before
DOUBT, IN_A_ROW = 4.0, 2  # so many times the estimate must exceed the limit, in so many windows in a row
MOST_IN_SESSION = 1_000_000  # steps of the engine that are left in one step of a session: some seconds
MEMORY = "memory"
TO_HOLD_MORE = (
    "let the run take more by `memory` (on the command line --memory; --stream writes rows to the disk meanwhile), or "
    "go on in another run from the state that this one ends with"
)
UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB", "EB")


@dataclass
class Outlook:
    """Looks at a run from time to time.

    duration     of the run, in s
    step_memory  bytes that a step takes
    memory       bytes that the run may take
    where        what holds them
    """

    duration: float
    step_memory: float
    memory: float
    where: str = MEMORY
    steps: int = 0
    switches: int = 0
    elapsed: float = 0.0
    windows: int = 0
    pace: float = 0.0  # s of motion that a step gained in the last window
    length: int = 0  # of the last window, in steps
    doubts: int = 0  # windows, up to the last one, in which the estimate exceeded the limit
    left: float = field(default=0.0, init=False)  # steps that are left, by the estimate

    def is_hopeless(self, steps: int, switches: int, elapsed: float) -> bool:
        """Whether the run cannot end within its memory.

        steps, switches  how many there were since its start
        elapsed          s of motion since its start
        """
        length, switched = steps - self.steps, switches - self.switches
        if not length:
            return False
        pace = (elapsed - self.elapsed) / length
        self.left = self._left(pace, length, self.duration - elapsed)
        self.steps, self.switches, self.elapsed = steps, switches, elapsed
        self.pace, self.length, self.windows = pace, length, self.windows + 1
        self.doubts = self.doubts + 1 if self.left * self.step_memory > DOUBT * self.memory else 0
        return self.doubts >= IN_A_ROW and (self.has_collapsed(length, switched) or steps >= SURE)

    def has_collapsed(self, steps: int, switches: int) -> bool:
        """Whether steps with so few switches among them are short by themselves; False until some windows are past."""
        return switches < FEW_SWITCHES * steps and self.windows >= WINDOWS

    def _left(self, pace: float, length: int, rest: float) -> float:
        """Steps to go for `rest` s, from the pace now and in the window before."""
        if pace <= 0:
            return math.inf
        growth = math.log(pace / self.pace) / ((length + self.length) / 2) if 0 < self.pace < pace else 0.0
        linear = rest / pace
        return math.log1p(growth * linear) / growth if growth > 0 else linear

    def described(self) -> str:
        """The estimate in words."""
        if not math.isfinite(self.left):
            return "at its present pace the run would never end"
        room, allowed = shown_bytes(self.left * self.step_memory), shown_bytes(self.memory)
        text = f"at its present pace the run needs {self.left:.0e} more steps and {room}; {self.where} allows {allowed}"
        return f"{text}: {TO_HOLD_MORE}" if self.where == MEMORY else text


class OutlookOfStep(Outlook):
    """That of one step of a session, which keeps nothing: it counts the engine's steps, not their memory."""

    def __init__(self, duration: float):
        super().__init__(duration, 1.0, MOST_IN_SESSION / DOUBT)

    def described(self) -> str:
        needs = f"at its present pace this step of the session needs {self.left:.0e} more steps of the engine"
        return f"{needs}; it may need {MOST_IN_SESSION:.0e} at most: make shorter ones"


def outlook_of(duration: float, step_memory: float, memory: float, room: float | None) -> Outlook:
    """That of a run in memory, or where `room` is given, of one whose rows go to the disk."""
    return Outlook(duration, step_memory, memory) if room is None else Outlook(duration, step_memory, room, "the disk")


def shown_bytes(number: float) -> str:
    """A number of bytes for people: 3.2 GB."""
    power = min(int(math.log10(max(number, 1.0)) // 3), len(UNITS) - 1)
    return f"{number / 1000**power:.3g} {UNITS[power]}"
