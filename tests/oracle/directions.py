"""What sticks leaves to nu: directions in which all rates of some bearings are zero, by the textbook."""

import numpy as np

PARALLEL = 1e-12  # sine of the angle below which rows are parallel, and a row lies in the span of others


def _basis(rows: np.ndarray) -> np.ndarray:
    """(3, 3) orthonormal rows, the first ones of which span `rows` (m, 3); and how many these are."""
    if not len(rows):
        return np.eye(3), 0
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    _, sizes, basis = np.linalg.svd(rows / np.where(lengths > 0, lengths, 1.0))
    return basis, int(np.count_nonzero(sizes > PARALLEL))


def allowed_by(rows: np.ndarray) -> np.ndarray:
    """(3, 3) the symmetric projection on the nu that leave all rates `rows` nu at zero."""
    basis, rank = _basis(rows)
    return basis[rank:].T @ basis[rank:]


def directions_allowed(rows: np.ndarray, mass_matrix: np.ndarray) -> np.ndarray:
    """(3, 3) columns that span the nu which leave all rates `rows` nu at zero, 0 where there are fewer than three; they
    are orthonormal in the metric of mass_matrix (3, 3)."""
    basis, rank = _basis(rows)
    across, columns = basis[rank:].T, np.zeros((3, 3))
    if rank < 3:
        metric = across.T @ mass_matrix @ across
        try:
            root = np.linalg.cholesky(metric)
        except np.linalg.LinAlgError:  # rounding has left the matrix without its smallest part
            root = np.diag(np.sqrt(np.diag(metric)))
        columns[:, : 3 - rank] = np.linalg.solve(root, across.T).T
    return columns
