"""Which bearings at rest stick and which break away: the complementarity problem of the set-valued law of friction.

m bearings at rest turn at rates G nu, with G (m, 3). A bearing takes any torque u with |u| <= b while it stays at rest,
and the whole bound, against its motion, when it moves. With M* nu' = f + G^T u this is the condition of a minimum:

  nu' makes (nu' - M*^-1 f)^T M* (nu' - M*^-1 f)/2 + sum b_i |G_i nu'| least.

The sum is strictly convex in nu', so that there is one nu', always. The torques u are as many as the bearings, more
than the three equations: they need not be unique. G^T u fills a zonotope, the polytope of the forces that the bearings
can take; M* nu' is f less the nearest of these forces, in the metric of M*^-1. Everything stays at rest where f lies
inside: where no virtual motion n gets more power from f than the bearings can take of it,

  n . f <= sum b_i |G_i n|   for all n.

Only the finitely many n that are normal to a facet need be asked: motions in which as many bearings rest as can.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy  # which imports scipy.optimize when it is first used: most scenes do without

PARALLEL = 1e-12  # sine of the angle below which rows are parallel, and a row lies in the span of others
HEAVY = 1e6  # weight of an equation beside what is made small under it
CUT_OFF = 1e-10  # of its bound: the weighted equation leaves a torque at it as far from it as this
ITERATIONS = 20  # of the library's active set, for each bearing


def directions(rows: np.ndarray) -> np.ndarray:
    """The rows (m, 3) of length 1; rows of zeros stay."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(lengths > 0, lengths, 1.0)


def span(rows: np.ndarray) -> np.ndarray:
    """An orthonormal basis (r, 3) of what the rows (m, 3) span."""
    _, sizes, basis = np.linalg.svd(directions(rows)) if len(rows) else (0, np.zeros(0), np.eye(3))
    return basis[: np.count_nonzero(sizes > PARALLEL)]


def allowed_by(rows: np.ndarray) -> np.ndarray:
    """(3, 3) the symmetric projection on the nu that leave all rates `rows` nu at zero."""
    basis = span(rows)
    return np.zeros((3, 3)) if len(basis) == 3 else np.eye(3) - basis.T @ basis


def directions_allowed(rows: np.ndarray, mass_matrix: np.ndarray) -> np.ndarray:
    """(3, 3) columns that span the nu which leave all rates `rows` nu at zero, 0 where there are fewer than three.

    They are orthonormal in the metric of mass_matrix (3, 3): whatever the scales of nu, sums along them keep digits.
    Where rounding has left that matrix without its smallest part they are as long as its diagonal says.
    """
    rank = len(span(rows))
    across = np.linalg.svd(span(rows))[2][rank:].T if rank else np.eye(3)
    columns = np.zeros((3, 3))
    if rank < 3:
        metric = across.T @ mass_matrix @ across
        try:
            root = np.linalg.cholesky(metric)
        except np.linalg.LinAlgError:
            root = np.diag(np.sqrt(np.diag(metric)))
        columns[:, : 3 - rank] = np.linalg.solve(root, across.T).T
    return columns


def facet_normals(rows: np.ndarray) -> np.ndarray:
    """(K, 3) unit vectors: each motion, within the span of the rows, in which rows that span all but it are at rest.

    Both signs of each stand there.
    """
    basis, units = span(rows), directions(rows)
    if len(basis) < 2:
        normals = basis
    elif len(basis) == 2:
        turned = np.array([[0.0, -1.0], [1.0, 0.0]])
        normals = units @ basis.T @ turned @ basis
    else:
        first, second = np.array(list(combinations(range(len(units)), 2))).T
        normals = np.cross(units[first], units[second])
        normals = directions(normals[np.linalg.norm(normals, axis=1) > PARALLEL])
    return np.concatenate([normals, -normals])


def nearest_force(
    mass_matrix: np.ndarray, force: np.ndarray, rows: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """nu' (3,), and torques (m,) within the bounds (m,) that make it: the minimum above.

    mass_matrix  (3, 3)
    force        (3,) all generalised forces but those of these bearings
    rows         (m, 3)
    """
    root = np.linalg.cholesky(mass_matrix)
    reach, target = np.linalg.solve(root, rows.T), np.linalg.solve(root, force)
    torques = bounded_fit(reach, -target, bounds)
    return np.linalg.solve(root.T, target + reach @ torques), torques


def bounded_fit(columns: np.ndarray, wanted: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """The x (m,) within the bounds (m,) for which columns x (k, m) is nearest to `wanted` (k,), by an active set."""
    x = np.zeros(len(bounds))
    taking = bounds > 0
    size = np.abs(wanted).max()
    if taking.any() and size > 0:
        scaled = columns[:, taking] * (bounds[taking] / size)
        iterations = ITERATIONS * (1 + len(bounds))
        found = scipy.optimize.lsq_linear(scaled, wanted / size, (-1, 1), method="bvls", tol=0.0, max_iter=iterations).x
        x[taking] = np.clip(found, -1, 1)  # the library keeps its bounds within rounding
    return x * bounds


def least_torques(force: np.ndarray, rows: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """The torques (m,) of least norm within the bounds (m,) with rows^T torques = force (3,), which some do."""
    return least_forces(force, rows, -bounds, bounds)


def least_forces(force: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The x (m,) of least norm from low (m,) to high (m,) with rows^T x = force (3,), which some do."""
    least = np.linalg.lstsq(rows.T, force, rcond=PARALLEL)[0]
    if (least <= high).all() and (least >= low).all():
        return least
    middle, bounds = (low + high) / 2, np.maximum((high - low) / 2, 0.0)
    size = np.abs(rows).max()
    columns = np.concatenate([HEAVY / size * rows.T, np.eye(len(rows))])
    beside = bounded_fit(columns, np.concatenate([HEAVY / size * (force - rows.T @ middle), -middle]), bounds)
    free = np.abs(beside) < bounds * (1 - CUT_OFF)  # these once more, without the equation's weight in their digits
    found = middle + np.copysign(bounds, beside)
    found[free] = np.linalg.lstsq(rows[free].T, force - rows[~free].T @ found[~free], rcond=PARALLEL)[0]
    return np.clip(found, low, high)


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

    def directions(self, passed: np.ndarray) -> np.ndarray:
        """(m,) the signs of the rates of the bearings that break away where the facets `passed` (K,) are passed."""
        return -np.sign(np.sign(self.moved[passed]).sum(axis=0)).astype(int)
