"""A run as short polynomials: those of its steps, of the lowest degree that keeps what a picture needs.

A step's own polynomials have a degree that serves the integration. A picture needs fewer digits, and most steps are so
short that a cubic has them. Both ends of a piece are the run's own rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.results.dense import bernstein_through, values_at
from omniroll.results.trajectory import Trajectory

ANGLE = 1e-8  # rad, and R for x and y: largest distance of a piece to the run
SPEED = 1e-5  # of the run's largest |nu|: the same for nu
SPIN_ANGLE = 1e-3  # rad: the same for what the roller in contact has turned
QUANTUM = 1 / 64  # of these: coefficients are multiples of it, so that bits which nobody sees do not fill the file


@dataclass(frozen=True)
class Pieces:
    """P pieces of a run. The last one has no length: it is the run's last row, which may follow a switch.

    start         (P,) in s since the start of the run
    contact       (P, N) physical rollers in contact
    rows          (2, P) rows of the trajectory at which each piece starts and ends
    degree        (P,) of its polynomials
    coefficients  (C, L) Bernstein coefficients of the C columns, piece after piece, degree + 1 of each: the first one,
                  then what is to be added to get the next. Columns: x and y in R, theta, nu, chi (N), and the angle (N)
                  by which the roller in contact has turned on its disk since the start of the piece
    """

    start: np.ndarray
    contact: np.ndarray
    rows: np.ndarray
    degree: np.ndarray
    coefficients: np.ndarray


def pieces_of(run: Trajectory) -> Pieces:
    """The pieces of a run. Raises InvalidValueError for a run that was saved without its polynomials."""
    last = len(run) - 1
    if run.dense is None and last > 0:
        bound = (
            "was saved without its polynomials (dense=False), so that it cannot move: take the .npz file or the folder "
            "that omniroll run has written"
        )
        raise InvalidValueError("run", run, bound)
    rows = np.column_stack([[run.step_rows, run.step_rows + 1], [last, last]])
    tolerances = _tolerances(run)
    short = _shortened(_steps(run, np.diff(run.elapsed[rows], axis=0)[0, :-1]), tolerances) if last > 0 else []
    end = np.concatenate([_columns(run, run.nu[-1], run.chi[-1], run.pose[-1]), np.zeros(run.vehicle.wheels)])
    short.append(end[None])
    changes = [np.vstack([piece[:1], np.diff(piece, axis=0)]) for piece in short]
    quantum = 2.0 ** np.floor(np.log2(QUANTUM * tolerances))[:, None]
    return Pieces(
        start=run.elapsed[rows[0]],
        contact=run.contact[rows[0]],
        rows=rows,
        degree=np.array([len(piece) - 1 for piece in short]),
        coefficients=np.round(np.concatenate(changes).T / quantum) * quantum,
    )


def _columns(run: Trajectory, nu: np.ndarray, chi: np.ndarray, pose: np.ndarray) -> np.ndarray:
    radius = run.vehicle.platform_radius
    return np.concatenate([pose / [radius, radius, 1.0], nu, chi], axis=-1)


def _tolerances(run: Trajectory) -> np.ndarray:
    """(C,) the largest error of each column."""
    wheels = run.vehicle.wheels
    speed = SPEED * (np.abs(run.nu).max() or 1.0)
    return np.array([ANGLE] * 3 + [speed] * 3 + [ANGLE] * wheels + [SPIN_ANGLE] * wheels)


def _steps(run: Trajectory, lengths: np.ndarray) -> np.ndarray:
    """(S, d + 1, C) Bernstein coefficients of all columns, of the degree that the run has."""
    degree, wheels = run.dense.shape[1] - 1, run.vehicle.wheels
    nu, chi, pose = np.split(run.dense[..., : 6 + wheels], [3, 3 + wheels], axis=-1)
    nodes = _nodes(degree)
    at_nodes = _basis(degree, nodes)
    times = run.t[run.step_rows][:, None] + nodes * lengths[:, None]
    row = np.broadcast_to(run.step_rows[:, None], times.shape)
    spin = _through(nodes, run.contact_spins_in(at_nodes @ run.dense, times, row))
    turned = np.concatenate([np.zeros_like(spin[:, :1]), np.cumsum(spin, axis=1)], axis=1) / (degree + 1)
    turned = _through(nodes, _basis(degree + 1, nodes) @ turned * lengths[:, None, None])
    return np.concatenate([_columns(run, nu, chi, pose), turned], axis=-1)


def _shortened(steps: np.ndarray, tolerances: np.ndarray) -> list[np.ndarray]:
    """The same polynomials (d + 1, C), each of the lowest degree that keeps within the tolerances (C,)."""
    count, highest = len(steps), steps.shape[1] - 1
    short: list[np.ndarray] = list(steps)
    left = np.arange(count)
    between = np.linspace(0, 1, 2 * highest + 1)
    for degree in range(1, highest):
        nodes = _nodes(degree)
        lower = np.linalg.solve(_basis(degree, nodes), _basis(highest, nodes))
        residual = _basis(degree, between) @ lower - _basis(highest, between)
        fits = (np.abs(residual @ steps[left]) <= tolerances).all(axis=(1, 2))
        for step in left[fits]:
            short[step] = lower @ steps[step]
        left = left[~fits]
    return short


def _nodes(degree: int) -> np.ndarray:
    """(degree + 1,) Chebyshev's points of [0, 1] with both ends."""
    return (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2


def _basis(degree: int, x: Sequence[float] | np.ndarray) -> np.ndarray:
    """(T, degree + 1) Bernstein polynomials at x (T,)."""
    x = np.asarray(x)
    return values_at(np.broadcast_to(np.eye(degree + 1), (len(x), degree + 1, degree + 1)), x)


def _through(nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(S, d + 1, c) coefficients of the polynomials with `values` (S, d + 1, c) at the nodes."""
    return bernstein_through(nodes, np.eye(len(nodes))) @ values
