"""Dense output of one step as a polynomial in Bernstein form, and where such a polynomial passes a bound.

p(x) = sum_k b_k C(d, k) x^k (1 - x)^(d - k), 0 <= x <= 1. The ends are b_0 and b_d exactly, and p lies
between the smallest and the largest of its coefficients: a step that stays inside a bound shows it without
any search.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import comb

import numpy as np

DEPTH = 40  # halvings of a step after which a polynomial that only touches zero counts as crossing it


def _nested_form_to_bernstein(powers: int) -> np.ndarray:
    """Matrix from F to Bernstein coefficients for p(x) = x (F_0 + (1-x) (F_1 + x (F_2 + (1-x) (...)))).

    The terms are x^a (1-x)^b F_k, and x^a (1-x)^b has only non-negative Bernstein coefficients: nothing
    cancels.
    """
    matrix = np.zeros((powers + 1, powers))
    for term in range(powers):
        rising, falling = term // 2 + 1, (term + 1) // 2
        rest = powers - rising - falling
        for k in range(rising, rising + rest + 1):
            matrix[k, term] = comb(rest, k - rising) / comb(powers, k)
    return matrix


FROM_DOP853 = _nested_form_to_bernstein(7)


def bernstein_of_dop853(start: np.ndarray, end: np.ndarray, nested: np.ndarray) -> np.ndarray:
    """Bernstein coefficients (8, d) of a DOP853 step from its ends (d,) and its nested form F (7, d)."""
    coefficients = start + FROM_DOP853 @ nested
    coefficients[0], coefficients[-1] = start, end
    return coefficients


def value(coefficients: Sequence[float], x: float) -> float:
    """p(x) by de Casteljau's rule, for one component."""
    row = list(coefficients)
    while len(row) > 1:
        row = [a + (b - a) * x for a, b in pairwise(row)]
    return row[0]


def weights_at(degree: int, x: np.ndarray) -> np.ndarray:
    """(d + 1, T) the factors of the coefficients in p(x), at x (T,)."""
    counts = np.array([[comb(degree, k)] for k in range(degree + 1)], float)
    return counts * _powers(degree, x) * _powers(degree, 1 - x)[::-1]


def _powers(degree: int, x: np.ndarray) -> np.ndarray:
    """(d + 1, T) x^0 ... x^d, by multiplication: a power function costs twenty times as much."""
    factors = np.empty((degree + 1, len(x)))
    factors[0], factors[1:] = 1, x
    return np.multiply.accumulate(factors)


def bernstein_through(x: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Coefficients (d + 1, c) of the polynomials that are `values` (d + 1, c) at x (d + 1,)."""
    return np.linalg.solve(weights_at(len(x) - 1, x).T, values)


def values_at(coefficients: np.ndarray, x: np.ndarray) -> np.ndarray:
    """p(x) (T, c) of polynomials (T, d + 1, c), each at its own x (T,)."""
    weights = weights_at(coefficients.shape[1] - 1, x)
    # One layout in memory, so that the sums are always made in one order.
    return (np.ascontiguousarray(weights.T)[:, None] @ np.ascontiguousarray(coefficients))[:, 0]


def integrals_at(coefficients: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(T, c) polynomials (T, d + 1, c), each integrated from 0 to its own x (T,): the integral of a polynomial in this
    form has the running sums of its coefficients, over their number."""
    sums = np.cumsum(coefficients, axis=1) / coefficients.shape[1]
    return values_at(np.concatenate([np.zeros_like(sums[:, :1]), sums], axis=1), x)


def steps_of(elapsed: np.ndarray, step_rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and lengths (S,) of a run's steps, from the times of its rows and the rows at which steps start."""
    starts = elapsed[step_rows]
    return starts, np.append(starts[1:], elapsed[-1]) - starts


def places_in_steps(starts: np.ndarray, lengths: np.ndarray, elapsed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The step in which each of the times `elapsed` lies, and which part of it has gone by then."""
    step = np.clip(np.searchsorted(starts, elapsed, side="right") - 1, 0, len(starts) - 1)
    with np.errstate(divide="ignore", invalid="ignore"):  # a step may be shorter than the rounding of the time
        return step, np.where(lengths[step] > 0, (elapsed - starts[step]) / lengths[step], 0.0)


def halves(coefficients: Sequence[float]) -> tuple[list[float], list[float]]:
    """The polynomial on [0, 1/2] and on [1/2, 1]."""
    row, left, right = list(coefficients), [coefficients[0]], [coefficients[-1]]
    while len(row) > 1:
        row = [(a + b) / 2 for a, b in pairwise(row)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]


def first_positive(coefficients: Sequence[float], depth: int = DEPTH) -> float | None:
    """The smallest x after which p is positive, or None if p <= 0 on [0, 1]. Double crossings are found."""
    if max(coefficients) <= 0:
        return None
    if _rises_at_once(coefficients) or depth == 0:
        return 0.0
    if coefficients[-1] > 0 and _sign_changes(coefficients) == 1 and coefficients[0] < 0:
        from scipy.optimize import brentq  # SciPy is large; a motion without switches does without it

        return float(brentq(lambda x: value(coefficients, x), 0.0, 1.0, xtol=1e-15))
    left, right = halves(coefficients)
    first = first_positive(left, depth - 1)
    if first is not None:
        return first / 2
    first = first_positive(right, depth - 1)
    return None if first is None else (1 + first) / 2


def _rises_at_once(coefficients: Sequence[float]) -> bool:
    first = next((c for c in coefficients if c != 0), 0.0)
    return first > 0


def _sign_changes(coefficients: Sequence[float]) -> int:
    signs = [c > 0 for c in coefficients if c != 0]
    return sum(a != b for a, b in pairwise(signs))
