"""What friction that sticks leaves to nu.

Bearings of wheels that roll have rates that follow from nu. A wheel that may slip stands where its contact sticks:
along its axle where its roller in contact sticks as well, and along its rolling direction where its axle does. The
direction in nu of such a rate never changes. So where some are held, nu has the directions that are the columns of A
with G A = 0, whatever the state is.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from omniroll.engine.events_beside import TOGETHER
from omniroll.kernels.kernel import Kernel

PARALLEL = 1e-12  # sine of the angle below which rows are parallel, and a row lies in the span of others
SAME = 1e-9  # relative: directions that are nearer to each other are the same


@lru_cache(maxsize=64)
def rows_of_standing(kernel: Kernel) -> np.ndarray:
    """(..., N, 2, 3) for each of nu the spins of rollers in contact whose wheels roll along their axles, and the rates
    of rolling wheels; the former have this direction whatever chi is. For reading alone."""
    still, units = np.zeros(kernel.wheels), np.eye(3)
    along = np.stack([kernel.call("wheel_rates", unit, still)[1] for unit in units], axis=-1)
    rolling = np.stack([kernel.call("wheel_speeds", unit) for unit in units], axis=-1)
    found = np.stack([along, rolling], axis=-2)
    found.flags.writeable = False
    return found


class Directions:
    """The directions that are left to nu in the rows of a run.

    rows     (R, 3) rates for each of nu, which are zero where they are held
    sets     (H, R) bool: those that are held together
    which    (T,) the place of each row's set
    allowed  (H, 3, 3) A of each set, columns; 0 where there are fewer
    """

    def __init__(self, rows: np.ndarray, held: np.ndarray):
        """held: (T, R) bool, rates that are held in the rows of the run."""
        self.rows = rows
        self.sets, which = np.unique(held, axis=0, return_inverse=True)
        self.which = which.reshape(-1)
        self.allowed = np.array([directions_left(rows[own]) for own in self.sets])

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take in rows (...), by name."""
        return leaving(self.allowed[self.which[rows]])

    def turning(self, turning: np.ndarray, refused: Callable[[int, np.ndarray, np.ndarray], Exception]) -> np.ndarray:
        """(H, P, 3, 3) how numbers turn A, that turn the rows by (P, R, 3). Raises what `refused` gives for a row of
        the run, what is held there (R,) bool and the numbers (P,) bool by which that would leave less to nu."""
        found, lengths = np.zeros((len(self.sets), len(turning), 3, 3)), np.linalg.norm(self.rows, axis=1)[:, None]
        lengths[lengths == 0] = 1.0
        for k, held in enumerate(self.sets):
            rows, turns = (self.rows / lengths)[held], (turning / lengths)[:, held]
            found[k], left = _turned(rows, turns, self.allowed[k])
            if left.any():
                raise refused(int(np.flatnonzero(self.which == k)[0]), held, left)
        return found

    def tables(self, turning: np.ndarray) -> np.ndarray:
        """(H, 12 + 9 Q) for C: A and which of its columns are absent in each set, and how Q numbers turn A
        (H, Q, 3, 3)."""
        parts = (self.allowed, leaving(self.allowed)["absent"], turning)
        return np.concatenate([own.reshape(len(self.sets), -1) for own in parts], axis=1)


def directions_left(rows: np.ndarray) -> np.ndarray:
    """(3, 3) orthonormal columns that span the nu which leave all rates `rows` nu at zero; 0 where there are fewer."""
    if not len(rows):
        return np.eye(3)
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    _, sizes, basis = np.linalg.svd(rows / np.where(lengths > 0, lengths, 1.0))
    rank = np.count_nonzero(sizes > PARALLEL)
    columns = np.zeros((3, 3))
    columns[:, : 3 - rank] = basis[rank:].T
    return columns


def leaving(allowed: np.ndarray) -> dict[str, np.ndarray]:
    """What generated functions take of the directions A (..., 3, 3), by name: directions (..., 9), absent (..., 3)."""
    absent = (~allowed.any(axis=-2)).astype(float)
    return {"directions": allowed.reshape(*allowed.shape[:-2], 9), "absent": absent}


def _turned(rows: np.ndarray, turning: np.ndarray, allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(P, 3, 3) dA where the rows (m, 3) turn by (P, m, 3), and (P,) bool: numbers by which fewer directions are
    left."""
    asked = turning @ allowed
    if not asked.any():
        return np.zeros((len(turning), 3, 3)), np.zeros(len(turning), bool)
    found = -np.linalg.pinv(rows, rcond=SAME) @ asked
    left = np.abs(rows @ found + asked).max(axis=(1, 2)) > TOGETHER * np.abs(turning).max(axis=(1, 2))
    return found, left
