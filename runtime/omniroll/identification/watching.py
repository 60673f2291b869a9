"""A fit while it lasts: what it says of itself, the best that it has found, and the wish that it end."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from omniroll.identification.prediction import Prediction

INTERVAL = 1.0  # s between two sentences


class Ended(Exception):
    """Somebody wishes that the fit end."""


class Watch:
    """Sees every prediction of a fit.

    report       called with a sentence now and then, or None
    interrupted  called after each prediction: whether somebody wishes that the fit end; or None
    best         the prediction of the whole logs whose residuals are smallest since `begin`, or None
    """

    def __init__(self, report: Callable[[str], Any] | None, interrupted: Callable[[], Any] | None):
        self.report, self.interrupted = report, interrupted
        self.best: Prediction | None = None
        self.least = np.inf
        self.seen, self.start = 0, time.monotonic()
        self.said = self.start

    def begin(self) -> None:
        """Residuals are counted anew, by another size of the noise."""
        self.best, self.least = None, np.inf

    def note(self, prediction: Prediction, residuals: np.ndarray, is_whole: bool) -> None:
        """A prediction was made, of the whole logs or of their beginnings. Raises Ended."""
        self.seen += 1
        cost = float(residuals @ residuals)
        if is_whole and cost < self.least:
            self.best, self.least = prediction, cost
        now = time.monotonic()
        if self.report is not None and now - self.said >= INTERVAL:
            self.said = now
            size = np.sqrt(cost / max(1, len(residuals)))
            what = "the whole logs" if is_whole else "their beginnings"
            took = f"{self.seen} predictions in {now - self.start:.0f} s"
            self.report(f"{took}, now of {what}: {size:.3g} times the noise")
        if self.interrupted is not None and self.interrupted():
            raise Ended
