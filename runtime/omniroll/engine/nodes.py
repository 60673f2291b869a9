"""The Radau IIA method with seven stages: its nodes and weights, when its iteration has come to rest, and what all of
its steps are.
"""

from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.special import roots_jacobi

from omniroll.results.dense import bernstein_through

STAGES = 7
NODES = np.append((roots_jacobi(STAGES - 1, 1.0, 0.0)[0] + 1) / 2, 1.0)
ITERATIONS = 20
CONTRACTS = 0.3  # a correction that is larger than this times the one before is rounding, or asks for better slopes
RENEWALS = 3  # of the slopes, in one step
AT_REST, ROUNDED = 1e-15, 1e-13  # of a component: corrections that end the iteration, and that are rounding at most


def _integrals() -> np.ndarray:
    """(s, s) of the polynomials that are 1 at one node and 0 at the others, from 0 to each node."""
    powers = np.arange(STAGES)
    return np.linalg.solve(np.vander(NODES, increasing=True).T, (NODES[:, None] ** (powers + 1) / (powers + 1)).T).T


WEIGHTS = _integrals()
AT_START = np.linalg.solve(np.vander(NODES, increasing=True).T, np.eye(STAGES)[0])  # their values at 0


class RadauStep:
    """A step of length h from y, where the rates are `rates`, to y_end; `stages` are the rates (s, d) at its nodes.

    converged says whether they were found.
    """

    y: np.ndarray
    rates: np.ndarray
    h: float
    stages: np.ndarray
    y_end: np.ndarray
    converged: bool
    order: ClassVar[int] = STAGES + 1
    further: ClassVar[int] = 0

    @property
    def _defect(self) -> np.ndarray:
        """(d,) how far the rates at the start are from the polynomial's, over the first node."""
        return self.h * NODES[0] * (self.rates - AT_START @ self.stages)

    @cached_property
    def _error(self) -> np.ndarray:
        return self._defect

    def error(self, scale: np.ndarray) -> float:
        """The size of the local error in units of `scale` (d,); infinite where the stages were not found."""
        if not self.converged:
            return np.inf
        return float(np.sqrt(np.mean((self._error / scale) ** 2)))

    def polynomial(self) -> np.ndarray:
        """Bernstein coefficients (8, d)."""
        values = np.concatenate([self.y[None], self.y + self.h * (WEIGHTS @ self.stages)])
        coefficients = bernstein_through(np.concatenate([[0.0], NODES]), values)
        coefficients[0], coefficients[-1] = self.y, self.y_end
        return coefficients
