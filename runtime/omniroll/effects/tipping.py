"""Over which edge a vehicle tips whose loads are not found where it stands.

1. Loads that press on all contacts are points in the polygon of these, where they act; the motion asks under them for
   loads that act somewhere. Where everything has one friction that is a continuous map of the polygon. Such a map has
   a point that it leaves where it is, or moves straight out of the polygon: across the edge on which the point is, or
   at a corner between these of both its edges (Hartman and Stampacchia). So the vehicle stands or it tips.
2. On an edge its two contacts share the weight. The map is asked next to nothing inside, where a third contact carries
   that much, since three determine loads.
3. On each edge it is looked for between points at which the motion asks for loads further along, and further back.
"""

from collections.abc import Callable

import numpy as np

from omniroll.vehicles.loads import SupportPolygon

NEXT_TO_EDGE = 1e-9  # of the way from an edge to the contact that is farthest from it
EDGE_POINTS = 16  # on an edge
HALVINGS = 40  # of the way between two of them

# From where loads act (2,), per the weight, on contacts (N,) bool, to how much further those do that are asked for.
MovedBy = Callable[[np.ndarray, np.ndarray], np.ndarray]


def where_it_tips(places: np.ndarray, moved_by: MovedBy) -> np.ndarray | None:
    """(2,) where the loads act that are asked for, beyond an edge of the contacts (N, 2); None where there is none."""
    corners = SupportPolygon.of(places).corners
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        found = _beyond(places, start, end, moved_by)
        if found is not None:
            return found
    return None


def _beyond(places: np.ndarray, start: np.ndarray, end: np.ndarray, moved_by: MovedBy) -> np.ndarray | None:
    """The same of one edge, from `start` (2,) to `end` (2,); the end belongs to the next one."""
    along = end - start
    beside = along[0] * (places - start)[:, 1] - along[1] * (places - start)[:, 0]
    third = int(np.argmax(beside))
    carries = np.zeros(len(places), bool)
    carries[[_number(places, start), _number(places, end), third]] = True

    def at(part: float) -> tuple[np.ndarray, np.ndarray]:
        point = start + part * along
        point = point + NEXT_TO_EDGE * (places[third] - point)
        return point, moved_by(point, carries)

    point, moved = at(0.0)
    if _leaves(places, start, moved):
        return point + moved
    for k in range(EDGE_POINTS):
        low, high = k / EDGE_POINTS, (k + 1) / EDGE_POINTS
        if not (at(low)[1] @ along > 0 >= at(high)[1] @ along):
            continue
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if at(middle)[1] @ along > 0 else (low, middle)
        point, moved = at(low)  # as the map was asked last
        if moved[0] * along[1] - moved[1] * along[0] > 0:
            return point + moved
    return None


def _leaves(places: np.ndarray, corner: np.ndarray, moved: np.ndarray) -> bool:
    """Whether `moved` (2,) points away from all other contacts, at a corner (2,) of theirs."""
    return bool(np.isfinite(moved).all() and ((places - corner) @ moved <= 0).all())


def _number(places: np.ndarray, place: np.ndarray) -> int:
    return int(np.argmin(np.hypot(*(places - place).T)))
