"""Which axles stick beside contacts that stick in the rows of a run, and what wheels that stand leave to nu.

A wheel whose contact and axle stick stands, and takes the direction from nu in which it would turn
(ground_with_axles.py). What is left are the columns of A.
"""

import numpy as np

from omniroll.effects.state_vector import StateVector
from omniroll.engine.axle_modes import AxleModes
from omniroll.engine.holds import directions_left
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory


class StandingAxles(AxleModes):
    """The axles (N,) of a run beside contacts that stick, (T, N) bool.

    rows     (N, 3) the rates of rolling wheels for each of nu
    sets     (H, N) bool: wheels that stand together
    which    (T,) the place of each row's set
    allowed  (H, 3, 3) A of each set, columns; 0 where there are fewer
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel, vector: StateVector, y: np.ndarray, sticks: np.ndarray):
        super().__init__(trajectory, plain, vector, y)
        self.rows = plain.wheel_rows
        self.sets, which = np.unique(sticks & (self.modes == 0), axis=0, return_inverse=True)
        self.which = which.reshape(-1)
        self.allowed = np.array([directions_left(self.rows[stands]) for stands in self.sets])

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        return super().at(rows) | self._leaving(self.allowed[self.which[rows]])

    def where(self, sticks: np.ndarray, stuck: np.ndarray) -> dict[str, np.ndarray]:
        """The same where contacts and axles (N,) bool stick."""
        return {"axle_sticks": stuck.astype(float)} | self._leaving(directions_left(self.rows[sticks & stuck]))

    @staticmethod
    def _leaving(allowed: np.ndarray) -> dict[str, np.ndarray]:
        absent = (~allowed.any(axis=-2)).astype(float)
        return {"directions": allowed.reshape(*allowed.shape[:-2], 9), "absent": absent}
