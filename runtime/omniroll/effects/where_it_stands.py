"""Where a vehicle may stand: loads that the motion asks for under themselves, where Newton's rule finds none from a few
starts.

1. The polygon of the contacts is cut into triangles: one from the middle of the contacts to each edge, and each of
   these into FAN_PARTS^2 cells. Where the moves of a cell's corners (tipping.py) hold zero between them, it may stand
   with loads in the cell: a map that is linear between the corners has such.
2. A cell is halved, across its longest side, as long as a half holds zero. Where that comes to an end, since the map
   bends, Newton's rule goes on from where the linear map vanishes.
"""

from collections.abc import Callable, Iterator

import numpy as np

from omniroll.effects.tipping import NEXT_TO_EDGE
from omniroll.vehicles.loads import SupportPolygon

FAN_PARTS = 8  # of each side of a triangle
CLOSER = 30  # halvings of a cell

# From where loads act (2,), per the weight, to how much further those do that are asked for.
Moved = Callable[[np.ndarray], np.ndarray]


def where_it_may_stand(places: np.ndarray, moved: Moved) -> Iterator[np.ndarray]:
    """Points (2,) in m near which loads on contacts (N, 2) act that are asked for under themselves."""
    middle, corners = places.mean(axis=0), SupportPolygon.of(places).corners
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        nodes = {
            (x, y): middle + (1 - NEXT_TO_EDGE) * (x * (start - middle) + y * (end - middle)) / FAN_PARTS
            for x in range(FAN_PARTS + 1)
            for y in range(FAN_PARTS + 1 - x)
        }
        known = {place: moved(point) for place, point in nodes.items()}
        for cell in _cells():
            points, moves = (np.array([of[place] for place in cell]) for of in (nodes, known))
            if _weights(moves).min() >= 0:
                yield _close_in(points, moves, moved)


def _cells() -> Iterator[list[tuple[int, int]]]:
    """Corners of the cells of a triangle."""
    for x in range(FAN_PARTS):
        for y in range(FAN_PARTS - x):
            yield [(x, y), (x + 1, y), (x, y + 1)]
            if x + y < FAN_PARTS - 1:
                yield [(x + 1, y + 1), (x, y + 1), (x + 1, y)]


def _weights(moves: np.ndarray) -> np.ndarray:
    """(3,) with the sum 1, by which moves (3, 2) cancel; negative ones, or none, where zero is not between them."""
    (a, b), (c, d), (e, f) = moves
    parts = np.array([c * f - d * e, e * b - f * a, a * d - b * c])
    whole = parts.sum()
    return parts / whole if np.isfinite(whole) and whole != 0 else np.full(3, -np.inf)


def _close_in(points: np.ndarray, moves: np.ndarray, moved: Moved) -> np.ndarray:
    """(2,) where the linear map of a cell with corners (3, 2) vanishes, halved (rule 2)."""
    for _ in range(CLOSER):
        longest = int(np.argmax(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)))
        middle = (points[longest] + points[longest - 1]) / 2
        there, halves = moved(middle), []
        for corner in (longest, longest - 1):
            half = points.copy(), moves.copy()
            half[0][corner], half[1][corner] = middle, there
            halves.append(half)
        best = max(halves, key=lambda half: _weights(half[1]).min())
        if _weights(best[1]).min() < 0:
            break
        points, moves = best
    return _weights(moves) @ points
