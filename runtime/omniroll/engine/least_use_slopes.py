"""How the least use of what holds standing wheels together changes with numbers (effects/least_use.py).

    use = min over A x = f of max_k (|B_k x + b_k| + l_k)

With multipliers lambda_k >= 0 of the uses that are largest, sum 1, and mu of the condition, it is the Lagrangian

    L = sum lambda_k (|B_k x + b_k| + l_k) - mu (A x - f)

that changes as the use does, x being what it is (the envelope theorem):

    0 = sum lambda_k B_k^T n_k - A^T mu,   n_k = (B_k x + b_k)/|B_k x + b_k|.

Forces that hold need not be determined for that, and neither need mu be: f stays among what A x can be. Where the
lambda are not determined several uses are as large by themselves, or by fewer of the others. Each set of uses that has
lambda of its own is one bound; there is a derivative where all bounds that have been reached agree.
"""

from itertools import combinations

import numpy as np

from omniroll.effects.least_use import Uses, least_use
from omniroll.engine.events_beside import REACHED
from omniroll.engine.standing import SAME
from omniroll.kernels.tangent_kernel import tangent_of

NEAR = 1e-4  # of the largest slope of a use: multipliers that leave less are those of a set, before x is put right
TAKES_PART = 1e-6  # of 1: multipliers that are smaller are none
ROUNDS, ROUNDED = 10, 1e-13  # of Newton's rule at most, and a change of x, relative, after which there is none


def slopes_of_use(
    rows: np.ndarray, force: np.ndarray, per_force: np.ndarray, given: np.ndarray, lacking: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(E,) the least use, as each set of uses bounds it, (c, E) its slopes, and (E, K) bool the sets; none where it is
    not near 1.

    rows (c, m, 3) is A^T, force (c, 3) f, per_force (c, K, 2, m) B, given (c, K, 2) b, lacking (c, K) l: they carry the
    tangents of c numbers.
    """
    columns, uses = rows[0].real.T, Uses(per_force[0].real, given[0].real, lacking[0].real)
    use, forces = least_use(columns, force[0].real, uses)
    if use < 1 - REACHED:
        return np.zeros(0), np.zeros((len(rows), 0)), np.zeros((0, len(uses.given)), bool)
    ways, active = _ways(columns), np.flatnonzero(uses.of(forces) >= use * (1 - REACHED))
    values, slopes, sets = [], [], []
    for some in (list(own) for count in range(1, ways.shape[1] + 2) for own in combinations(active, count)):
        found = _multipliers(uses, forces, ways, some)
        if found is None:
            continue
        x, part = _put_right(uses, forces, ways, some, found)
        towards = _towards(uses, x)[some]
        pulled = np.einsum("k,kcm,kc->m", part, uses.per_force[some], towards)
        mu = np.linalg.lstsq(columns.T, pulled, rcond=SAME)[0]
        taken = per_force[:, some] @ x + given[:, some]
        whole = np.einsum("k,nkc,kc->n", part, taken, towards) + lacking[:, some] @ part
        whole = whole - (np.einsum("nmi,m->ni", rows, x) - force) @ mu
        values.append(float(part @ uses.of(x)[some]))
        slopes.append(tangent_of(whole))
        sets.append(np.isin(np.arange(len(uses.given)), some))
    count = len(values)
    shape = (count, len(uses.given))
    return np.array(values), np.array(slopes).reshape(count, len(rows)).T, np.array(sets, bool).reshape(shape)


def _ways(columns: np.ndarray) -> np.ndarray:
    """(m, p) orthonormal, forces that do nothing: A (3, m) of them is 0."""
    _, sizes, right = np.linalg.svd(columns)
    return right[np.count_nonzero(sizes > SAME * sizes.max()) :].T


def _towards(uses: Uses, forces: np.ndarray) -> np.ndarray:
    """(K, 2) n, 0 where nothing is used."""
    found = uses.per_force @ forces + uses.given
    size = np.linalg.norm(found, axis=1, keepdims=True)
    return np.divide(found, size, out=np.zeros_like(found), where=size > 0)


def _slopes_along(uses: Uses, forces: np.ndarray, ways: np.ndarray, some: list[int]) -> np.ndarray:
    """(p, s) of some uses along the ways (m, p)."""
    return np.einsum("mp,kcm,kc->pk", ways, uses.per_force[some], _towards(uses, forces)[some])


def _multipliers(uses: Uses, forces: np.ndarray, ways: np.ndarray, some: list[int]) -> np.ndarray | None:
    """(s,) those of some uses alone; None where they have none, or not theirs alone."""
    slopes = _slopes_along(uses, forces, ways, some)
    size = max(float(np.abs(np.einsum("mp,kcm->kcp", ways, uses.per_force)).max(initial=0.0)), np.finfo(float).tiny)
    matrix = np.append(slopes / size, np.ones((1, len(some))), axis=0)
    right = np.append(np.zeros(len(slopes)), 1.0)
    found, _, rank, _ = np.linalg.lstsq(matrix, right, rcond=NEAR)
    fits = np.abs(matrix @ found - right).max() <= NEAR and rank == len(some)
    return found if fits and (found > TAKES_PART).all() else None


def _put_right(
    uses: Uses, forces: np.ndarray, ways: np.ndarray, some: list[int], part: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """x (m,) and the multipliers (s,) of some uses, to rounding: by Newton's rule for sum lambda g = 0, sum lambda = 1
    and uses that are all the same, along the ways."""
    count, (x, p) = len(some), (forces, ways.shape[1])
    if not p:
        return x, part
    for _ in range(ROUNDS):
        slopes, own = _slopes_along(uses, x, ways, some), uses.per_force[some] @ ways
        found, towards = uses.per_force[some] @ x + uses.given[some], _towards(uses, x)[some]
        size = np.linalg.norm(found, axis=1)
        across = np.eye(2) - towards[:, :, None] * towards[:, None, :]
        curve = np.einsum("k,kcp,kcd,kdq->pq", part / size, own, across, own)
        system = np.zeros((p + 1 + count, p + count + 1))  # unknown: the way, multipliers, the use
        system[:p, :p], system[:p, p : p + count] = curve, slopes
        system[p, p : p + count] = 1.0
        system[p + 1 :, :p], system[p + 1 :, -1] = slopes.T, -1.0
        use = uses.of(x)[some]
        left = np.concatenate([slopes @ part, [part.sum() - 1], use - use.mean()])
        scale = 1 / np.maximum(np.abs(system).max(axis=1), np.finfo(float).tiny)
        step = np.linalg.lstsq(system * scale[:, None], -left * scale, rcond=SAME)[0]
        x, part = x + ways @ step[:p], part + step[p : p + count]
        if np.abs(step[:p]).max() <= ROUNDED * max(float(np.abs(x).max()), np.finfo(float).tiny):
            break
    return x, part
