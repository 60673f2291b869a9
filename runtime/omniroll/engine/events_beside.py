"""When events happen in the motions beside a run: what is told from what, and the error where that is not known."""

from collections.abc import Iterable, Sequence

import numpy as np

from omniroll.errors import NoDerivativeError

JUMPS = 1e-9  # of what a rate or a drive is, or could be: it does not jump by less
TOGETHER = 1e-9  # of the larger one: times, and deviations, that differ by less are the same
REACHED = 1e-6  # of what a body takes, or a facet: it has been reached
GRAZES = 1e-6  # of the rate that it could have: what comes to zero, or to its bound, more slowly grazes it


def apart(names: Sequence[str], times: np.ndarray) -> str:
    """Of the numbers of these names (P,), those by which deviations of times (k, P) differ; "" where none is."""
    found = np.ptp(times, axis=0) > TOGETHER * np.abs(times).max(axis=0)
    return ", ".join(np.array(names)[found])


def no_derivative(t: float, reason: str, wheels: Iterable[int]) -> NoDerivativeError:
    """The error of what happens to some wheels at a time."""
    return NoDerivativeError(reason, t=float(t), wheels=tuple(sorted({int(wheel) for wheel in wheels})))
