"""Which wheels stand in the rows of a run, and what they leave to nu.

A wheel whose contact sticks stands along its axle where its roller in contact sticks as well, and along its rolling
direction where its axle does. It takes the direction from nu in which it would move (ground_with_bearings.py). What is
left are the columns of A.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from omniroll.engine.axle_modes import AxleModes
from omniroll.engine.contact_modes import ContactModes
from omniroll.engine.events_beside import TOGETHER
from omniroll.engine.holds import directions_left
from omniroll.engine.massless_modes import StripModes
from omniroll.engine.roller_modes import RollerModes
from omniroll.kernels.kernel import Kernel

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


class Standing:
    """The wheels (N,) of a run that stand, along the axle and along the rolling direction (N, 2) bool.

    rows     (N, 2, 3) as above
    sets     (H, N, 2) bool: where wheels stand together
    which    (T,) the place of each row's set
    allowed  (H, 3, 3) A of each set, columns; 0 where there are fewer
    """

    def __init__(
        self,
        plain: Kernel,
        contacts: ContactModes,
        axles: AxleModes | None,
        rollers: RollerModes | StripModes | None,
    ):
        self.rows = rows_of_standing(plain)
        of_axles = None if axles is None else axles.modes == 0
        of_rollers = None if rollers is None else rollers.modes[..., 0] == 0
        self.sets, which = np.unique(stands_of(contacts.sticks, of_axles, of_rollers), axis=0, return_inverse=True)
        self.which = which.reshape(-1)
        self.allowed = np.array([directions_left(self.rows[stands]) for stands in self.sets])

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the wheels in rows (...), by name."""
        return leaving(self.allowed[self.which[rows]])

    def where(self, stands: np.ndarray) -> dict[str, np.ndarray]:
        """The same where wheels stand, (N, 2) bool."""
        return leaving(directions_left(self.rows[stands]))

    def turning(self, turning: np.ndarray, refused: Callable[[int, np.ndarray], Exception]) -> np.ndarray:
        """(H, P, 3, 3) how numbers turn A, that turn all rows by (P, N, 2, 3). Raises what `refused` gives for a row
        and the numbers (P,) bool by which its wheels would leave less to nu."""
        found = np.zeros((len(self.sets), len(turning), 3, 3))
        for k, stands in enumerate(self.sets):
            found[k], left = turned(self.rows[stands], turning[:, stands], self.allowed[k])
            if left.any():
                raise refused(int(np.flatnonzero(self.which == k)[0]), left)
        return found


def turned(rows: np.ndarray, turning: np.ndarray, allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(P, 3, 3) dA where the rows (m, 3) turn by (P, m, 3), and (P,) bool: numbers by which fewer directions are
    left."""
    asked = turning @ allowed
    if not asked.any():
        return np.zeros((len(turning), 3, 3)), np.zeros(len(turning), bool)
    found = -np.linalg.pinv(rows, rcond=SAME) @ asked
    left = np.abs(rows @ found + asked).max(axis=(1, 2)) > TOGETHER * np.abs(turning).max(axis=(1, 2))
    return found, left


def stands_of(contacts: np.ndarray, axles: np.ndarray | None, rollers: np.ndarray | None) -> np.ndarray:
    """(..., N, 2) bool where wheels stand whose contacts, axles and rollers in contact (..., N) stick; None: they
    never do."""
    never = np.zeros(contacts.shape, bool)
    bearings = [never if own is None else own for own in (rollers, axles)]
    return contacts[..., None] & np.stack(bearings, axis=-1)


def leaving(allowed: np.ndarray) -> dict[str, np.ndarray]:
    """What generated functions take of the directions A (..., 3, 3), by name."""
    absent = (~allowed.any(axis=-2)).astype(float)
    return {"directions": allowed.reshape(*allowed.shape[:-2], 9), "absent": absent}
