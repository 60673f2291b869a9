"""How much contacts and bearings must take that hold a vehicle together in more ways than one.

Forces x (m,) are to give together the force A x = f on nu, of three components. Contacts and bearings have a part in
them: each is used by |B_k x + b_k| + l_k, a norm in two components beside a number, and used up at 1. The vehicle can
be held if the largest of these uses can be at most 1,

    use = min over A x = f of max_k (|B_k x + b_k| + l_k) ,

which is a convex problem. Where the use is below 1 there are forces to choose from, and those of least norm are another
convex problem. Both are solved by Newton's rule with the barrier - sum log((t - l_k)^2 - |B_k x + b_k|^2), whose part
falls to nothing in rounds. It is self-concordant: a step of Newton's rule, made shorter by what it promises, leaves no
cone.

The number l_k is what the load of a contact lacks of the one by which forces are measured. A use in parts of a load
that vanishes would have no bound; this one is smooth where the load passes zero.
"""

from dataclasses import dataclass

import numpy as np

from omniroll.effects.complementarity import PARALLEL

FIRST, FINER, FINEST = 0.1, 0.1, 1e-14  # the part of the barrier at first, from round to round, and at last
NEWTON = 30
CENTRED = 1e-9  # the square of what a step promises, below which a round has ended
SHORT = 0.25  # a step that promises more is made shorter
LEAST_PART = 1e-3  # of a step: where less of it stays inside, rounding is all that is left
INSIDE = 1e-9  # below 1: a use that leaves forces to choose


@dataclass(frozen=True)
class Uses:
    """B (K, 2, m), b (K, 2), and l (K,) or one for all."""

    per_force: np.ndarray
    given: np.ndarray
    lacking: np.ndarray | float = 0.0

    def of(self, forces: np.ndarray) -> np.ndarray:
        """(K,) how much forces (m,) use."""
        return np.linalg.norm(self.per_force @ forces + self.given, axis=1) + self.lacking

    def along(self, start: np.ndarray, ways: np.ndarray, size: float) -> "Uses":
        """The same of forces start (m,) + size ways (m, p) z, over `size`, by z."""
        return Uses(self.per_force @ ways, (self.per_force @ start + self.given) / size, self.lacking / size)


def least_use(columns: np.ndarray, force: np.ndarray, uses: Uses) -> tuple[float, np.ndarray]:
    """The use above, and forces (m,) that make it; columns (3, m) is A, force (3,) is f."""
    start, ways = _ways(columns, force)
    largest, count = float(uses.of(start).max()), ways.shape[1]
    if count == 0 or largest == 0:
        return largest, start
    found = np.append(np.zeros(count), 1.5)  # z and t, of forces that use 1 at the start
    for part in _parts():
        aim = np.append(np.zeros(count), 1 / part)
        found = _centred(uses.along(start, ways, largest), found, aim, 0 * aim)
    forces = start + ways @ found[:-1] * largest
    return float(uses.of(forces).max()), forces


def least_norm(columns: np.ndarray, force: np.ndarray, uses: Uses) -> np.ndarray:
    """The forces (m,) of least norm that use nothing up; where nothing is left to choose, those of the least use."""
    start, ways = _ways(columns, force)
    if (uses.of(start) <= 1).all():
        return start
    use, forces = least_use(columns, force, uses)
    if ways.shape[1] == 0 or use > 1 - INSIDE:
        return forces
    found, size = np.append(ways.T @ (forces - start), 1.0), float(forces @ forces)
    for part in _parts():
        curve = np.append(np.full(ways.shape[1], 1 / (part * size)), 0.0)  # start is across the ways
        found = _centred(uses.along(start, ways, 1.0), found, 0 * curve, curve)
    return start + ways @ found[:-1]


def _ways(columns: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The forces (m,) of least norm with A x = f, and (m, p) orthonormal, what may be added to them."""
    left, sizes, right = np.linalg.svd(columns)
    rank = int(np.count_nonzero(sizes > PARALLEL * sizes.max()))
    start = right[:rank].T @ ((left[:, :rank].T @ force) / sizes[:rank])
    return start, right[rank:].T


def _parts() -> list[float]:
    """The parts of the barrier, round by round."""
    rounds = round(np.log(FINEST / FIRST) / np.log(FINER))
    return [FIRST * FINER ** (k + 1) for k in range(rounds)]


def _barrier(uses: Uses, place: np.ndarray, use: float) -> tuple[np.ndarray, np.ndarray]:
    """Slope (p + 1,) and second derivative (p + 1, p + 1) of the barrier by z and t."""
    found = uses.per_force @ place + uses.given
    length = np.linalg.norm(found, axis=1)
    most = np.full(len(found), use) - uses.lacking
    left = (most - length) * (most + length)
    rows = np.column_stack([np.einsum("kcp,kc->kp", uses.per_force, found), -most])
    scaled = rows / left[:, None]
    matrix = 4 * scaled.T @ scaled
    matrix[:-1, :-1] += np.einsum("kcp,kcq,k->pq", uses.per_force, uses.per_force, 2 / left)
    matrix[-1, -1] -= (2 / left).sum()
    return (2 / left) @ rows, matrix


def _centred(uses: Uses, found: np.ndarray, aim: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """(p + 1,) z and t where the barrier is in balance with aim . (z, t) + curve . (z, t)^2/2, from a place inside. An
    aim at z alone leaves t as it is."""
    count = len(found) if aim[-1] else len(found) - 1
    for _ in range(NEWTON):
        slope, matrix = _barrier(uses, found[:-1], found[-1])
        slope = (slope + aim + curve * found)[:count]
        step = -_solved((matrix + np.diag(curve))[:count, :count], slope)
        promised = float(np.sqrt(max(-slope @ step, 0.0)))
        part = 1 / (1 + promised) if promised > SHORT else 1.0
        moved = found.copy()
        while True:
            moved[:count] = found[:count] + part * step
            if (moved[-1] > uses.of(moved[:-1])).all():
                break
            part /= 2
            if part < LEAST_PART:
                return found
        found = moved
        if promised**2 <= CENTRED:
            break
    return found


def _solved(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """The solution, with rows and columns brought to one size: what bodies can take differs by many powers of ten."""
    size = 1 / np.sqrt(np.abs(np.diag(matrix)))
    return size * np.linalg.lstsq(matrix * size[:, None] * size, size * vector, rcond=None)[0]
