"""Guards: linear functions of time and state that end a phase where they become positive.

An example is the current of a motor. On a step whose polynomial is in Bernstein form a guard is a polynomial too, so
that its first zero is located as that of a wheel at its joint.

A guard counts as passed only where its value exceeds its own rounding. Where a step has ended on a guard, the guard of
the opposite transition is zero but for rounding: it must not end the next phase before the motion really turns back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

EPS = float(np.finfo(float).eps)
PASSED = 16  # a guard has been passed where its value is above this many of its roundings
GUARDED = ("rates", "tilt_rate", "tilt")  # what a guard of the compiled engine may read beside nu; events.c
LANDED = 2  # a guard is met where its value is within this many of its roundings


@dataclass(frozen=True)
class Guard:
    """constant + slope t + weights . y, with t from the phase's start; weights (k,) of the first components of y.

    size is the sum of the sizes of the constant's terms: they may cancel, and then it is rounded more than it shows.
    """

    constant: float
    slope: float
    weights: np.ndarray
    size: float = 0.0

    def of_parts(self, slices: Mapping[str, slice]) -> list[np.ndarray]:
        """The weights of nu, and of the states that GUARDED names, one after the other; slices: where each stands."""
        whole = np.zeros(max(part.stop for part in slices.values()))
        whole[: len(self.weights)] = self.weights
        return [whole[slices[name]] for name in ("nu", *GUARDED) if name in slices]

    def later(self, time: float) -> "Guard":
        """The same, where t counts from `time`."""
        return replace(self, constant=self.constant + self.slope * time)


class Guards:
    """Some guards (m,) on states of length `size`."""

    def __init__(self, guards: Sequence[Guard], size: int):
        self.constant = np.array([guard.constant for guard in guards], float)
        self.size = np.array([max(guard.size, abs(guard.constant)) for guard in guards], float)
        self.slope = np.array([guard.slope for guard in guards], float)
        self.weights = np.zeros((len(guards), size))
        for row, guard in zip(self.weights, guards, strict=True):
            row[: len(guard.weights)] = guard.weights

    def __len__(self) -> int:
        return len(self.constant)

    def values(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m,) values."""
        return self.constant + self.slope * time + self.weights @ y

    def rounding(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m,) eps times the sum of the terms' sizes."""
        return EPS * (self.size + np.abs(self.slope * time) + np.abs(self.weights) @ np.abs(y))

    def beyond(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m,) bool: passed."""
        return self.values(time, y) > PASSED * self.rounding(time, y)

    def waits(self, time: float, y: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) times until each becomes positive at its present rate, negative beyond; and their rounding."""
        rising = self.slope + self.weights @ rates
        value = self.values(time, y)
        with np.errstate(all="ignore"):
            waits = np.where(rising > 0, -value / rising, np.inf)
            noise = np.where(rising > 0, LANDED * self.rounding(time, y) / rising, 0.0)
        return waits, noise

    def margins(self, dense: np.ndarray, start: float, h: float) -> np.ndarray:
        """(d + 1, m) Bernstein coefficients on a step of the guards less what counts as rounding."""
        times = start + h * np.linspace(0, 1, len(dense))  # t itself, in Bernstein form
        values = self.constant + self.slope * times[:, None] + dense @ self.weights.T
        return values - PASSED * self.rounding(start + h, np.abs(dense).max(axis=0))


NO_GUARDS = Guards((), 0)
