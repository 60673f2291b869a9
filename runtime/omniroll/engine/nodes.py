"""The Radau IIA method with seven stages: its nodes and weights, and when its iteration has come to rest."""

import numpy as np
from scipy.special import roots_jacobi

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
