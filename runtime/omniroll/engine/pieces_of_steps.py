"""Steps of a run in which deviations are too fast for the nodes of a step: these are followed in pieces.

Where a deviation decays by exp(-z) in a step, collocation at s nodes of Gauss gives that as exactly as it looks while
z is less than about s. Beyond that it is off by about exp(-2 s (s + 1) / z), and at last by all of it. Most often that
does no harm: what is so fast has decayed before steps are long. But a run that rests has steps that are as long as it
lasts, whatever slips beside it would do. So a step is looked at twice. The slopes at the nodes say whether some rate is
fast. Where one is, the last two of Legendre's polynomials say how much of it there is: of the rates of a deviation of 1
they make about 4 s exp(-s (s + 1) / z). Inside a step collocation has half the order, and is off by about 3e-4 of what
they make where z is s. The same in C: csrc/deviations/pieces.c.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

FAST = 1.25  # a node: how many times its inverse length a rate in a step may be
FAST_INSIDE = 0.4  # the same where somebody looks between the rows
MOST_INSIDE = 300  # times what deviations may be off by: what the last two polynomials may make there
LEAST_WRONG = 1e-10  # of the deviations of speeds: what they may be off by behind a step,
ACCURACIES = 3.0  # or so many times the run's accuracy
SHORTEST = 2.0**-60  # of a step: a piece that is not cut


def most_wrong(accuracy: float) -> float:
    """Of the deviations of speeds, what they may be off by behind a step of a run of this accuracy."""
    return max(LEAST_WRONG, ACCURACIES * accuracy)


def fastest(slopes: np.ndarray) -> np.ndarray:
    """(...) about the largest of the absolute values of the eigenvalues of matrices (..., c, c).

    Where they are real the sum of their squares is at most what this is the root of, which depends on no units.
    """
    return np.sqrt(np.abs(slopes * slopes.swapaxes(-1, -2)).sum(axis=(-1, -2)))


class Tail(NamedTuple):
    """What is looked at of a step or a piece.

    made   (2, c, m + F) what the last two polynomials make of the rates of speeds, by a deviation and what is given
    rate   about the fastest, times the length
    nodes  s
    """

    made: np.ndarray
    rate: float
    nodes: int


class PiecesOfSteps:
    """The steps of a run that are followed in pieces.

    variations  Variations, which gives slopes and solves for rates
    gauss       Gauss of a piece
    slips       whether wheels may slip: all that is solved for then are speeds
    least       (P,) deviations of the wheels' angles that are nothing
    asked       whether steps are cut at all
    """

    def __init__(self, variations, gauss, slips: bool, least: np.ndarray | float, asked: bool):
        self.variations, self.gauss, self.least = variations, gauss, least
        core, self.asked = variations.deviations.core, asked
        self.most_wrong = most_wrong(variations.trajectory.accuracy)
        self.speeds = core if slips else core[:3]  # in 1/s
        self.tails: dict[int, Tail] = {}  # of the steps where rates are fast

    def look(self, steps: np.ndarray, A: np.ndarray, rates: np.ndarray) -> None:
        """Note in which of the steps (k,) rates are fast, from the slopes A (k, s, m, m) at their nodes and the rates
        (k, s, m, m + F)."""
        for k in range(len(steps)) if self.asked else ():
            step = int(steps[k])
            tail = self._tail(A[k], rates[k], self.variations.lengths[step], self.variations.inside)
            if tail is not None:
                self.tails[step] = tail

    def _tail(self, A: np.ndarray, rates: np.ndarray, length: float, inside) -> Tail | None:
        """None where no rate is fast."""
        core, count = self.variations.deviations.core, len(inside.nodes)
        rate = float(fastest(A[:, core[:, None], core]).max() * length)
        if not rate > FAST_INSIDE * count:
            return None
        tail = np.tensordot(np.stack([inside.last, inside.before_last]) * length, rates[:, self.speeds], 1)
        return Tail(tail, rate, count)

    def are_asked(self, step: int, start: np.ndarray, given: np.ndarray, end: np.ndarray) -> bool:
        """Whether a step is to be followed in pieces, where its nodes bring the deviation (m, P) from `start` to `end`
        under what is given (F, P)."""
        return step in self.tails and self._are_too_fast(step, self.tails[step], start, given, end)

    def asked_in(self, steps: np.ndarray, deviation: np.ndarray, given: np.ndarray) -> Iterator[int]:
        """Those of the steps (k,) which are, with deviations (S, m, P) at the starts of all steps, and (S, F, P)."""
        for step in self.tails.keys() & set(steps.tolist()):
            ((_, rates),) = self.variations.rates_at_nodes(np.array([step]))
            both = np.concatenate([deviation[step], given[step]])
            end = deviation[step] + self._change(rates[0], self.variations.lengths[step], self.variations.inside) @ both
            if self._are_too_fast(step, self.tails[step], deviation[step], given[step], end, between=True):
                yield step

    def _are_too_fast(
        self, step: int, tail: Tail, start: np.ndarray, given: np.ndarray, end: np.ndarray,
        between: bool = False,
    ) -> bool:  # fmt: skip
        """Whether a step or a piece of it is, by what _tail gives of it; `between` where somebody looks inside."""
        count = tail.nodes
        if not tail.rate > (FAST_INSIDE if between else FAST) * count:
            return False
        most = 4 * count * np.exp(count * (count + 1) / tail.rate)
        most = self.most_wrong * (min(most, MOST_INSIDE) if between else most)
        made = np.abs(tail.made @ np.concatenate([start, given])).sum(axis=(0, 1))
        size = (np.abs(start[self.speeds]) + np.abs(end[self.speeds])).sum(axis=0)
        return bool((made > most * (size + self.least / self.variations.lengths[step])).any())

    def _change(self, rates: np.ndarray, length: float, inside) -> np.ndarray:
        """(m, m + F) what comes to a deviation in a step or a piece, from the rates (s, m, m + F)."""
        return length * np.tensordot(inside.weights, rates, 1)

    def moved(self, step: int, up_to: float, start: np.ndarray, given: np.ndarray) -> np.ndarray:
        """(m, P) the deviation at a part of a step, from that at its start and what is given (F, P), in pieces.

        Where one is too fast it is cut in half. Behind the first ones what is fast has decayed, and they grow again.
        """
        piece, halved, now = 0, 1, start
        while halved > 0:
            part = up_to * 2.0**-halved
            end = self._behind_piece(step, part * piece, part, now, given)
            if end is None:
                halved, piece = halved + 1, 2 * piece
                continue
            piece, now = piece + 1, end
            while halved > 0 and piece % 2 == 0:
                halved, piece = halved - 1, piece // 2
        return now

    def _behind_piece(
        self, step: int, begins: float, part: float, start: np.ndarray, given: np.ndarray
    ) -> np.ndarray | None:
        """(m, P) the deviation behind a piece that begins at a part of a step and is such a part of it; None where it
        is too fast."""
        variations, length = self.variations, self.variations.lengths[step] * part
        A, G = variations.coefficients(np.array([step]), (begins + part * self.gauss.nodes)[None])
        (rates,) = variations.solved(A, G, self.gauss.to_nodes[None] * length)
        end = start + self._change(rates, length, self.gauss) @ np.concatenate([start, given])
        tail = self._tail(A[0], rates, length, self.gauss) if part >= SHORTEST else None
        return None if tail is not None and self._are_too_fast(step, tail, start, given, end) else end
