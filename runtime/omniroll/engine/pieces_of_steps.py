"""Steps of a run in which deviations are too fast for the nodes of a step: these are followed in equal pieces.

Collocation with s nodes sees a deviation that decays as exp(-lambda t) while lambda times the length is below about s;
beyond that it does not decay as it should, and at last not at all. Most often that does no harm: what is so fast has
decayed before steps are long. But a run that rests has steps that are as long as it lasts, whatever slips beside it
would do. So a step is cut where two things meet: some rate is so fast, which the slopes at the nodes say, and of the
deviations' rates the last two of Legendre's polynomials make more than next to nothing. The run's polynomial has the
states in between.
"""

import warnings
from math import ceil

import numpy as np

from omniroll.errors import AccuracyWarning

FASTEST = 1.25  # a node: how many times its inverse length a rate in a step may be
IN_PIECES = 0.7  # the same in a piece, whose inside is looked at as well
MOST_TAIL = 1e-5  # of the deviations of speeds: what the last two of Legendre's polynomials may make of them in a step
MOST_PIECES = 2**15  # of a step
PIECES_AT_ONCE = 64
STARTS_KEPT = 2**23  # numbers that are kept of the maps to the starts of pieces


def fastest(slopes: np.ndarray) -> np.ndarray:
    """(...) about the largest of the absolute values of the eigenvalues of matrices (..., c, c).

    The eighth root of the sum of their eighth powers, which is too large by the eighth root of c at most, and does not
    depend on units.
    """
    fourth = np.linalg.matrix_power(slopes, 4)
    return np.abs(np.einsum("...ij,...ji->...", fourth, fourth)) ** 0.125


class PiecesOfSteps:
    """The steps of a run that are followed in pieces.

    variations  Variations, which gives slopes and solves for rates
    gauss       Gauss of a piece
    slips       whether wheels may slip: all that is solved for then are speeds
    asked       whether steps are cut at all
    cut         the numbers of those that are
    """

    def __init__(self, variations, gauss, slips: bool, asked: bool):
        self.variations, self.gauss = variations, gauss
        contacts, deviations = variations.contacts, variations.deviations
        # Where directions of slips turn, their forces are no slopes by the slips.
        self.asked = asked and not (contacts is not None and contacts.turns)
        self.speeds = deviations.core if slips else deviations.core[:3]  # in 1/s
        self.cut: set[int] = set()
        self.rates: dict[int, float] = {}  # of the steps where these are fast: the fastest, times the length
        self.tails: dict[int, np.ndarray] = {}  # (2, c, m + F) what the last two polynomials make of speeds in these
        self.kept: dict[int, np.ndarray] = {}

    def look(self, steps: np.ndarray, A: np.ndarray, rates: np.ndarray) -> None:
        """Note in which of the steps (k,) rates are fast, from the slopes A (k, s, m, m) at their nodes and the rates
        (k, s, m, m + F)."""
        if not self.asked:
            return
        core, lengths, inside = self.variations.deviations.core, self.variations.lengths[steps], self.variations.inside
        found = fastest(A[:, :, core[:, None], core]).max(axis=1) * lengths
        for k in np.flatnonzero(found > FASTEST * len(inside.nodes)):
            step = int(steps[k])
            tail = np.stack([inside.last, inside.before_last]) * lengths[k]
            self.tails[step] = np.tensordot(tail, rates[k][:, self.speeds], 1)
            self.rates[step] = float(found[k])

    def end(self, step: int, start: np.ndarray, given: np.ndarray, end: np.ndarray, least: np.ndarray) -> np.ndarray:
        """(m, P) the deviation at the end of a step, from that at its start and what is given (F, P), where the nodes
        of the step have brought it to `end`; `least` (P,), deviations of the wheels' angles that are nothing."""
        if step not in self.tails:
            return end
        both = np.concatenate([start, given])
        size = (np.abs(start[self.speeds]) + np.abs(end[self.speeds])).sum(axis=0)
        if (
            np.abs(self.tails[step] @ both).sum(axis=0) <= MOST_TAIL * (size + least / self.variations.lengths[step])
        ).all():
            return end
        self.cut_step(step)
        return self.starts(step)[-1] @ both

    def count(self, step: int) -> int:
        """Into how many pieces a step is cut."""
        return min(ceil(self.rates[step] / (IN_PIECES * len(self.gauss.nodes))), MOST_PIECES)

    def cut_step(self, step: int) -> None:
        """Cut a step in which rates are fast."""
        if self.count(step) == MOST_PIECES:
            start = float(self.variations.trajectory.start_time + self.variations.starts[step])
            text = f"in the step from t = {start!r} deviations decay by exp(-{self.rates[step]:.3g}): not exact"
            warnings.warn(AccuracyWarning(text), stacklevel=2)
        self.cut.add(step)

    def starts(self, step: int) -> np.ndarray:
        """(n + 1, m, m + F) what the deviation is at the start of each of its n pieces, and at its end, by what it is
        at the step's start and by what is given."""
        if step not in self.kept:
            if sum(own.size for own in self.kept.values()) > STARTS_KEPT:
                self.kept.clear()
            self.kept[step] = self._followed(step)
        return self.kept[step]

    def map_to(self, step: int, x: float) -> np.ndarray:
        """(m, m + F) what the deviation is at a part of the step, from 0 to 1, by the same."""
        count, starts = self.count(step), self.starts(step)
        piece = min(int(x * count), count - 1)
        (rates,) = self._rates(step, np.array([piece]))
        weights = self.gauss.integrals(np.array([x * count - piece]))[0]
        return _behind(self._grown(step, rates, weights), starts[piece])

    def _followed(self, step: int) -> np.ndarray:
        count, (size, given) = self.count(step), self.variations.width
        found = np.zeros((count + 1, size, size + given))
        found[0, :, :size] = np.eye(size)
        for pieces in np.array_split(np.arange(count), -(-count // PIECES_AT_ONCE)):
            for piece, rates in zip(pieces, self._rates(step, pieces), strict=True):
                found[piece + 1] = _behind(self._grown(step, rates, self.gauss.weights), found[piece])
        return found

    def _grown(self, step: int, rates: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(m, m + F) the deviation in a piece, by that at its start, from its rates (s, m, m + F) and weights (s,)."""
        length = self.variations.lengths[step] / self.count(step)
        return np.eye(*rates.shape[1:]) + length * np.tensordot(weights, rates, 1)

    def _rates(self, step: int, pieces: np.ndarray) -> np.ndarray:
        """(k, s, m, m + F) the rates at the nodes of pieces (k,) by the deviations at their starts."""
        variations, count = self.variations, self.count(step)
        steps = np.full(len(pieces), step)
        A, G = variations.coefficients(steps, (pieces[:, None] + self.gauss.nodes) / count)
        to_nodes = np.broadcast_to(self.gauss.to_nodes * (variations.lengths[step] / count),
                                   (len(pieces), *self.gauss.to_nodes.shape))  # fmt: skip
        return variations.solved(A, G, to_nodes)


def _behind(grown: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(m, m + F) a map of a deviation and of what is given, behind another; what is given does not change."""
    size = len(grown)
    found = grown[:, :size] @ start
    found[:, size:] += grown[:, size:]
    return found
