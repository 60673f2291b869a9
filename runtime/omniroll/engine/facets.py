"""The facets of what bearings at rest can hold together, of rates that follow from nu."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from omniroll.engine.holds import PARALLEL, unit_rows


def span(rows: np.ndarray) -> np.ndarray:
    """An orthonormal basis (r, 3) of what the rows (m, 3) span."""
    _, sizes, basis = np.linalg.svd(unit_rows(rows)) if len(rows) else (0, np.zeros(0), np.eye(3))
    return basis[: np.count_nonzero(sizes > PARALLEL)]


def facet_normals(rows: np.ndarray) -> np.ndarray:
    """(K, 3) unit vectors: each motion, within the span of the rows, in which rows that span all but it are at rest.

    Both signs of each stand there.
    """
    basis, units = span(rows), unit_rows(rows)
    if len(basis) < 2:
        normals = basis
    elif len(basis) == 2:
        turned = np.array([[0.0, -1.0], [1.0, 0.0]])
        normals = units @ basis.T @ turned @ basis
    else:
        first, second = np.array(list(combinations(range(len(units)), 2))).T
        normals = np.cross(units[first], units[second])
        normals = unit_rows(normals[np.linalg.norm(normals, axis=1) > PARALLEL])
    return np.concatenate([normals, -normals])


@dataclass(frozen=True)
class Facets:
    """The facets of the forces that some bearings can take, as functions of the force that would hold them.

    normals  (K, 3)
    moved    (K, m) the rates of the bearings in the motion along each normal
    reach    (K,) the power that the bearings can take in it
    """

    normals: np.ndarray
    moved: np.ndarray
    reach: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, bounds: np.ndarray) -> "Facets":
        normals = facet_normals(rows)
        moved = normals @ rows.T
        moved[np.abs(moved) < PARALLEL * np.linalg.norm(rows, axis=1)] = 0.0
        return cls(normals, moved, np.abs(moved) @ bounds)

    def excess(self, force: np.ndarray) -> np.ndarray:
        """(K,) how much more power than the bearings can give a holding force (3,) asks for; positive: it cannot be."""
        return self.normals @ force - self.reach
