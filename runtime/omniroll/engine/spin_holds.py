"""Which free rollers stick on their disks in the rows of a run, and which way the others turn there.

A free roller has a state and a bearing of its own. While it sticks, its spin is rounding.
Where nothing but free rollers comes to rest or passes it, no row stands on each side of that: the row in which one step
ends and the next one starts has the modes of the next one.
"""

from functools import cached_property

import numpy as np

from omniroll.effects.friction import Bearing
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import by_place, by_roller

AT_REST = 1e-13  # of the fastest that a roller has been: spins of what sticks are rounding


class SpinHolds:
    """The bearings (N, n-1) of the free rollers of a run, by place, where these may stick.

    sliding   in N m, torques of those that turn
    holding   in N m, the largest torques of those at rest
    of_steps  (S, N, n-1) in each step 0 where one sticks, else the sign of its rate
    modes     (T, N, n-1) the same in each row: in a row where a step starts those of the step, in others those with
              which a phase ends
    """

    def __init__(self, trajectory: Trajectory, rollers: Bearing, spins: slice):
        self.trajectory = trajectory
        shape = trajectory.spins.shape[1:]
        own = (rollers.sliding, rollers.holding)
        self.sliding, self.holding = (np.repeat(of[:, None], shape[1], axis=1) for of in own)
        self.of_steps = np.zeros((0, *shape), int)
        if len(trajectory.step_rows):
            self.of_steps = self._of_steps(trajectory.dense[:, :, spins].reshape(len(trajectory.dense), -1, *shape))

    def _of_steps(self, inside: np.ndarray) -> np.ndarray:
        """(S, N, n-1) modes, from the polynomials, in which a spin that is zero has what rounding has left over."""
        trajectory, first = self.trajectory, self.trajectory.step_rows
        yaw = np.abs(trajectory.nu).max(axis=1) / trajectory.vehicle.yaw_scale
        fastest = np.maximum.accumulate(np.abs(trajectory.spins).max(axis=(1, 2)) + yaw)
        moves = np.abs(inside).max(axis=1) > AT_REST * fastest[first][:, None, None]
        return np.where(moves, np.sign(inside.mean(axis=1)), 0).astype(int)

    @cached_property
    def modes(self) -> np.ndarray:
        trajectory, first = self.trajectory, self.trajectory.step_rows
        modes = np.sign(trajectory.spins).astype(int)
        if not len(first):
            return modes
        between = np.setdiff1d(np.arange(len(trajectory)), np.concatenate([first, first + 1]))
        for row in between[::-1]:  # of one that has come to rest says the next step whether it sticks
            later = self._by_roller(modes, min(row + 1, len(trajectory) - 1), row)
            modes[row] = np.where(modes[row] == 0, later, modes[row])
        modes[first + 1] = self.of_steps
        modes[first] = self.of_steps
        return modes

    def _by_roller(self, modes: np.ndarray, row: int, of: int) -> np.ndarray:
        """(N, n-1) the modes of a row for the places of another one."""
        own = np.concatenate([np.zeros_like(modes[row][:, :1]), modes[row]], axis=1)
        return by_place(by_roller(own, self.trajectory.contact[row]), self.trajectory.contact[of])[:, 1:]

    @property
    def torques(self) -> np.ndarray:
        """(T, N, n-1) torques in N m of those that turn; 0 of those that stick."""
        return -self.modes * self.sliding

    @cached_property
    def alone(self) -> np.ndarray:
        """(T,) bool: rows in which a step ends and the next one starts, with other modes."""
        found, first = np.zeros(len(self.trajectory), bool), self.trajectory.step_rows
        same_row = first[1:] == first[:-1] + 1
        changed = (self.of_steps[1:] != self.of_steps[:-1]).any(axis=(1, 2))
        found[first[1:][same_row & changed]] = True
        return found
