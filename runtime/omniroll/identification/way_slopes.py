"""How nu integrated since the start, which tracking wheels count, depends on the numbers of a run."""

import numpy as np

from omniroll.engine.sensitivities import Followed, Look
from omniroll.kernels.kernel import kernel
from omniroll.results.trajectory import Trajectory

NODES = 6  # of Gauss's rule in each step


def way_slopes(run: Trajectory, followed: Followed, times: np.ndarray) -> np.ndarray:
    """(P, T, 3) derivatives of nu's integral from the start of the run to times (T,) within it."""
    ends = np.unique(np.concatenate([run.t, times]))
    lengths = np.diff(ends)
    x, weights = np.polynomial.legendre.leggauss(NODES)
    nodes = ends[:-1, None] + lengths[:, None] * (1 + x) / 2
    grown = np.zeros((len(followed.names), len(ends), 3))
    if nodes.size:
        moved = _moved(followed.look_at(run, nodes.ravel()), "nu").reshape(-1, *nodes.shape, 3)
        np.cumsum(np.einsum("sn,psnc->psc", lengths[:, None] * weights / 2, moved), axis=1, out=grown[:, 1:])
    jumps = _jumps(run)
    in_rows = followed.look_at(run, None) if len(jumps) else None
    for row in jumps:
        grown[:, ends >= run.t[row]] += _of_jump(run, _moved(in_rows, "chi")[:, row], row)[:, None]
    return grown[:, np.searchsorted(ends, times)]


def _moved(look: Look, name: str) -> np.ndarray:
    """(P, ..., k) deviations of what the state has by that name."""
    return look.motion.vector.view(look.motion.whole(np.moveaxis(look.moved, -1, 0)), name)


def _jumps(run: Trajectory) -> np.ndarray:
    """The rows before switches at which nu jumps."""
    switches = (run.contact[1:] != run.contact[:-1]).any(axis=1) & (run.t[1:] == run.t[:-1])
    return np.flatnonzero(switches & (run.nu[1:] != run.nu[:-1]).any(axis=1))


def _of_jump(run: Trajectory, chi: np.ndarray, row: int) -> np.ndarray:
    """(P, 3) what the time of a jump, at which a wheel's chi reaches its joint, adds as it deviates.

    chi  (P, N) deviations of the angles before the jump
    """
    wheel = int(np.flatnonzero(run.contact[row + 1] != run.contact[row])[0])
    rate = kernel(run.vehicle, "massless", "python").wheel_speeds(run.nu[row])[wheel]
    return np.outer(-chi[:, wheel] / rate, run.nu[row] - run.nu[row + 1])
