"""When events happen in the motions beside a run: what is told from what, and the error where that is not known."""

from collections.abc import Iterable

from omniroll.errors import NoDerivativeError

JUMPS = 1e-9  # of what a rate or a drive is, or could be: it does not jump by less
TOGETHER = 1e-9  # of the larger one: times, and deviations, that differ by less are the same
REACHED = 1e-6  # of what a body takes, or a facet: it has been reached
GRAZES = 1e-6  # of the rate that it could have: what comes to zero, or to its bound, more slowly grazes it

RESTS_ONLY_JUST = "a contact or a bearing only just comes to rest, so that a change however small lets it go on"
LETS_GO_ONLY_JUST = "what holds a contact or a bearing only just comes to its bound: a small change lets it stick on"
APART = "several contacts or bearings stop or let go together, and apart where a number changes; by {}"
UNKNOWN = (
    "several contacts or bearings change modes together, or one only just does: a small change makes another motion"
)


def no_derivative(t: float, reason: str, wheels: Iterable[int]) -> NoDerivativeError:
    """The error of what happens to some wheels at a time."""
    return NoDerivativeError(reason, t=float(t), wheels=tuple(sorted({int(wheel) for wheel in wheels})))
