"""Which massless rollers stick on their disks in the rows of a run in which wheels may slip.

A roller without inertia passes on what its bearing takes: its sliding torque while it turns, and what the ground asks
of it while it sticks. Rows keep that torque, by which its mode is told; beside contacts
that may stick also where these go.
"""

from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import bearing_of
from omniroll.engine.roller_modes import IN_CONTACT
from omniroll.kernels.kernel import Kernel
from omniroll.results.slipping import given_in_rows, rollers_hold
from omniroll.results.trajectory import Trajectory

HEADING = "slip_heading"  # what rows keep of contacts that may stick: where they go


class MasslessModes:
    """The rollers in contact (N,) of a run.

    place    of their effect among those of the run
    sliding  (N,) in N m, torques of those that turn
    holding  (N,) in N m, the largest torques of those that stick
    modes    (T, N) in each row 0 where one sticks, else the sign of its spin: in a row where a step starts those of the
             step, in others those with which a phase ends
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel):
        self.place, rollers = bearing_of(trajectory.effects, plain, "roller")
        self.sliding, self.holding = rollers.sliding, rollers.holding
        drives, first = trajectory.effects.drives(), trajectory.step_rows
        taken = trajectory.drive[:, drives.index(IN_CONTACT)]
        headings = trajectory.drive[:, drives.index(HEADING)] if HEADING in drives else None
        turns = ~rollers_hold(taken, self.sliding, headings)
        inside = turns[first] & turns[first + 1]  # one that sticks may have its sliding torque where it begins or ends
        turns[first + 1] = inside
        turns[first] = inside
        against = np.where(self.sliding > 0, taken, -self._rolling(trajectory, plain))
        self.modes = np.where(turns, -np.sign(against), 0).astype(int)

    @staticmethod
    def _rolling(trajectory: Trajectory, plain: Kernel) -> np.ndarray:
        """(T, N) in rad/s, spins of rollers whose bearings take nothing: their contacts do not slip along the axle. In
        the rows of a step those of the step."""
        _, found = plain.wheel_rates(trajectory.nu, trajectory.chi)
        first = trajectory.step_rows
        found[first] = found[first + 1] = found[first] + found[first + 1]
        return found

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


class StripModes:
    """The same rollers (N, 1) beside contacts that may stick, as RollerModes has them: of each wheel one, that in
    contact. One that comes into contact is another roller at the same place, which stands on its disk."""

    def __init__(self, massless: MasslessModes):
        self.massless, self.place = massless, massless.place
        self.sliding, self.holding = massless.sliding[:, None], massless.holding[:, None]
        self.alone = np.zeros(len(massless.modes), bool)

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, N, 1)."""
        return self.massless.modes[..., None]

    @staticmethod
    def by_roller_of(row: int, of: int, modes: np.ndarray) -> np.ndarray:
        """(N, 1) the modes (T, N, 1) of a row."""
        return modes[row]

    @staticmethod
    def given(torques: np.ndarray) -> dict[str, np.ndarray]:
        """The inputs of generated functions that are torques (..., N, 1), by name."""
        return {IN_CONTACT: torques[..., 0]}

    @staticmethod
    def where(sticks: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the modes where rollers (..., N, 1) bool stick, by name."""
        return {"contact_sticks": sticks[..., 0].astype(float)}

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The same in rows (...)."""
        return self.where(self.modes[rows] == 0)
