"""Normal loads from their sum and moments, and the polygon of the contacts that they press on."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts
from omniroll.vehicles.vehicle import Vehicle

COLLINEAR = 1e-9  # width of the support, per its length, below which the contacts lie on one line
FEASIBLE = 1e-10  # residual of the least-distance program above which loads without a sign exist


def refuse_collinear(places: np.ndarray) -> None:
    """InvalidValueError unless there are three contacts (N, 2) or more that do not lie on one line."""
    wheels = len(places)
    if wheels < 3:
        raise InvalidValueError("wheels", wheels, "loads need three wheels or more: fewer cannot stand on their own")
    length, width = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if width <= COLLINEAR * length:
        bound = "contacts must not lie on one line: the loads' moment about that line cannot be balanced"
        raise InvalidValueError("wheel_places", places.tolist(), bound)


def contact_loads(places: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """Loads (..., N) with sum N_i (1, x_i, y_i) = sums (..., 3), for contacts (N, 2).

    Three contacts determine them. Of more, the loads are those of least norm, sqrt(sum N_i^2), among all that pull on
    no contact; where there are none (the vehicle tips), of least norm among all.
    """
    scale = np.abs(places).max()
    matrix = np.vstack([np.ones(len(places)), places.T / scale])
    moments = sums / np.array([1.0, scale, scale])
    loads = moments @ np.linalg.pinv(matrix).T
    if len(places) > 3:
        null = np.linalg.svd(matrix)[2][3:].T
        for row in map(tuple, np.argwhere((loads < 0).any(axis=-1))):
            loads[row] = _without_pulling(matrix, null, moments[row], loads[row])
    return loads


def loads_carried(places: np.ndarray, sums: np.ndarray, carries: np.ndarray) -> np.ndarray:
    """The same (N,) of one sum (3,), on numbers that may carry tangents, where it is known that the contacts `carries`
    (N,) bool, three or more, have loads and the others none."""
    matrix = np.vstack([np.ones(carries.sum()), places[carries].T])
    loads = np.zeros(len(places), np.result_type(places, sums))
    loads[carries] = matrix.T @ np.linalg.solve(matrix @ matrix.T, sums)
    return loads


@lru_cache(maxsize=64)
def loads_of_standing(vehicle: Vehicle, gravity: float) -> np.ndarray:
    """(N,) in N, the loads of the contacts of a vehicle at rest on level ground; not to be written to.

    Raises InvalidValueError where they do not follow from the vehicle, or where it tips.
    """
    places = vehicle.places()
    refuse_collinear(places)
    standing = {"mass": vehicle.mass, "gravity_strength": gravity, "center": vehicle.center_of_mass}
    sums = parts.of_vehicle("standing_loads", vehicle, **standing)
    found = contact_loads(places, np.array(sums)[None])[0]
    if found.min() < 0:
        raise InvalidValueError("load", found.tolist(), "must not be negative: the vehicle tips where it stands")
    found.flags.writeable = False
    return found


def _without_pulling(matrix: np.ndarray, null: np.ndarray, moments: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """The loads >= 0 of least norm, or `loads` where there are none.

    C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23: loads + null z with the least z,
    subject to null z >= -loads, is a least-squares problem in variables that are not negative.
    """
    from scipy.optimize import nnls

    program = np.vstack([null.T, -loads / np.abs(loads).max()])
    wanted = np.zeros(len(program))
    wanted[-1] = 1
    multipliers, residual = nnls(program, wanted)
    if residual < FEASIBLE:
        return loads
    pressed = multipliers == 0  # contacts with a multiplier carry no load; the others share it with the least norm
    least = np.zeros_like(loads)
    least[pressed] = np.linalg.pinv(matrix[:, pressed]) @ moments
    return least


class Springs:
    """A rigid platform that stands on equal springs at its contacts (N, 2), some of which carry.

    Of all loads of these contacts with given sums theirs have the least norm; maxima/effects/contact_loads.mac proves
    it. A contact that does not carry has the load that its spring would have if it were not lifted off: below zero.
    """

    def __init__(self, places: np.ndarray):
        self.places = places
        self.rows = np.column_stack([np.ones(len(places)), places])
        self._shares: dict[bytes, np.ndarray | None] = {}

    def shares(self, carries: np.ndarray) -> np.ndarray | None:
        """(N, 3) what the springs take of sums (3,), where `carries` (N,) bool do; None where those cannot stand."""
        key = carries.tobytes()
        if key not in self._shares:
            self._shares[key] = self._made(carries)
        return self._shares[key]

    def _made(self, carries: np.ndarray) -> np.ndarray | None:
        own = self.places[carries]
        if len(own) < 3:
            return None
        length, width = np.linalg.svd(own - own.mean(axis=0), compute_uv=False)
        if width <= COLLINEAR * length:
            return None
        inverse = np.linalg.pinv(self.rows[carries])
        return self.rows @ inverse @ inverse.T


@dataclass(frozen=True)
class SupportPolygon:
    """The convex polygon of the contacts; corners (K, 2) in m, against the clock."""

    corners: np.ndarray

    @classmethod
    def of(cls, places: np.ndarray) -> "SupportPolygon":
        """The smallest polygon around the contacts (N, 2)."""
        from scipy.spatial import ConvexHull

        return cls(places[ConvexHull(places).vertices])

    def margin(self, points: np.ndarray) -> np.ndarray:
        """Distance (...) of points (..., 2) to the polygon's edge: positive inside, negative outside."""
        starts = self.corners
        edges = np.roll(starts, -1, axis=0) - starts
        away = points[..., None, :] - starts
        along = np.clip((away * edges).sum(axis=-1) / (edges**2).sum(axis=-1), 0, 1)
        distance = np.linalg.norm(away - along[..., None] * edges, axis=-1).min(axis=-1)
        is_left = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] >= 0
        return np.where(is_left.all(axis=-1), distance, -distance)

    def nearest_edge(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The corners of the edge that a point (2,) is farthest beyond, or nearest to from inside."""
        ends = np.roll(self.corners, -1, axis=0)
        edges = ends - self.corners
        away = point - self.corners
        beyond = (away[:, 0] * edges[:, 1] - away[:, 1] * edges[:, 0]) / np.hypot(*edges.T)
        worst = int(np.argmax(beyond))
        return self.corners[worst], ends[worst]
