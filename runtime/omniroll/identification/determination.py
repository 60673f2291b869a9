"""Which combinations of numbers logs determine, from the singular values of the Jacobian, and how to say it."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import svd

VAGUE = 0.5  # relative deviation from which on a direction counts as not determined
LOOSE = 10.0  # sizes of a number that the fit may leave its guess for nothing: what no log determines stays there
NEAR = 0.05  # how far apart parts of a direction may be that are said to be equal, and how large one that is left out


def deviations(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (n,) along the directions (n, n), rows, of numbers whose weighted Jacobian is (m, n)."""
    _, values, directions = svd(jacobian, full_matrices=False)
    with np.errstate(divide="ignore"):
        return 1 / values, directions


def undetermined(jacobian: np.ndarray, names: Sequence[str], sizes: Sequence[float]) -> tuple[str, ...]:
    """What readings with the Jacobian (m, n) do not determine, in words."""
    return tuple(in_words(row, names, sizes) for row in vague_directions(jacobian))


def vague_directions(jacobian: np.ndarray) -> np.ndarray:
    """(k, n) directions in which numbers are not determined, each with few parts; columns of (m, n) are relative.

    Row reduction makes the parts few; the largest of each direction is 1.
    """
    along, directions = deviations(jacobian)
    rows = directions[along > VAGUE].copy()
    for k in range(len(rows)):
        pivot = int(np.abs(rows[k]).argmax())
        rows[k] /= rows[k, pivot]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, pivot] * rows[k]
    sizes = np.abs(rows).max(axis=1, keepdims=True)
    return np.where(np.abs(rows) < NEAR * sizes, 0.0, rows / sizes)


def in_words(direction: np.ndarray, names: Sequence[str], sizes: Sequence[float]) -> str:
    """What is not determined: numbers that may change together along a direction, relative to their sizes."""
    places = np.flatnonzero(direction)
    present, parts = [names[k] for k in places], direction[places]
    if len(present) == 1:
        return f"{present[0]}: not determined"
    listed = f"{', '.join(present[:-1])} and {present[-1]}"
    if np.abs(parts - parts[0]).max() < NEAR:
        return f"{listed} only as their ratio" + ("s" if len(present) > 2 else "")
    if len(present) == 2 and abs(parts.sum()) < NEAR:
        return f"{listed} only as their product"
    if len(present) == 2:
        factor = -direction[places[0]] * sizes[places[0]] / (direction[places[1]] * sizes[places[1]])
        sign = "+" if factor > 0 else "-"
        return f"{listed} only as {present[0]} {sign} {abs(factor):.4g} {present[1]}"
    together = ", ".join(f"{name} {part:+.2g}" for name, part in zip(present, parts, strict=True))
    return f"{listed} not apart: they may change together, in relative terms by {together}"
