"""Slopes of rates by differences."""

from collections.abc import Callable

import numpy as np


def slopes(
    flow: Callable[[float, np.ndarray], np.ndarray], time: float, y: np.ndarray, rates: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """The slopes (d, d) of the rates in y, by differences of these steps (d,); `rates` are those at y."""
    matrix = np.empty((len(y), len(y)))
    for k, value in enumerate(y):
        moved = y.copy()
        moved[k] += steps[k]
        matrix[:, k] = (flow(time, moved) - rates) / (moved[k] - value)
    return matrix
