"""Which massless rollers stick on their disks in the rows of a run in which wheels may slip.

A roller without inertia passes on what its bearing takes: its sliding torque while it turns, and what the ground asks
of it while it sticks (effects/massless_rollers.py). Rows keep that torque, by which its mode is told.
"""

import numpy as np

from omniroll.effects.massless_rollers import given_in_rows, holds
from omniroll.engine.roller_modes import IN_CONTACT
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory


class MasslessModes:
    """The rollers in contact (N,) of a run.

    place    of their effect among those of the run
    sliding  (N,) in N m, torques of those that turn
    holding  (N,) in N m, the largest torques of those that stick
    modes    (T, N) in each row 0 where one sticks, else the sign of its spin: in a row where a step starts those of the
             step, in others those with which a phase ends
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel):
        found = [effect.roller_torques(plain) for effect in trajectory.effects.effects]
        self.place, (self.sliding, self.holding) = next((k, own) for k, own in enumerate(found) if own is not None)
        taken = trajectory.drive[:, trajectory.effects.drives().index(IN_CONTACT)]
        turns, first = ~holds(taken, self.sliding), trajectory.step_rows
        inside = turns[first] & turns[first + 1]  # one that sticks may have its sliding torque where it begins or ends
        turns[first + 1] = inside
        turns[first] = inside
        self.modes = np.where(turns, -np.sign(taken), 0).astype(int)

    @property
    def torques(self) -> np.ndarray:
        """(T, N) in N m, what generated functions take of the bearings: of rollers that turn, 0 where one sticks."""
        return -self.modes * self.sliding

    @staticmethod
    def where(modes: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take where rollers have modes (..., N) and torques (..., N), by name."""
        return given_in_rows(torques, modes == 0)

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What they take of the modes in rows (...), by name."""
        return {"contact_sticks": (self.modes[rows] == 0).astype(float)}
