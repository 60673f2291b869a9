"""Which rollers stick on their disks in the rows of a run in which wheels may slip, and where the others turn to.

There each roller has an axial speed of its own, in contact or not, and its spin is what that is
beyond the speed of its disk. The spin of one that sticks is rounding, and what a step misses of its disk's speed.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.effects.effect_set import MOMENTS
from omniroll.effects.state_vector import StateVector
from omniroll.engine.axle_modes import bearing_of
from omniroll.kernels.kernel import Kernel
from omniroll.results.dense import values_at
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import by_place, by_roller

IN_CONTACT, FREE = "contact_bearing", "free_bearing"  # what generated functions take of the rollers' bearings
KEPT = (IN_CONTACT, *MOMENTS)  # what rows keep of these
AT_REST = 1e-12  # of the fastest spin that a run could make: spins of what sticks are rounding
MISSED = 1e-3  # of the accuracy: so much of the fastest they may be, too


def spins(kernel: Kernel, known: Mapping[str, np.ndarray]) -> np.ndarray:
    """(..., N, n) in rad/s, relative to the disks, by place: of rollers in contact, then of the others."""
    nu, chi = known["nu"], known["chi"]
    own = kernel.call("slip_spins", nu, chi, known["contact_omega"])
    return np.concatenate([own[..., None], kernel.spins_from_axial(nu, chi, known["axial"])], axis=-1)


class RollerModes:
    """The rollers (N, n) of a run, by place.

    place     of their effect among those of the run
    sliding   (N, n) in N m, torques of those that turn
    holding   (N, n) in N m, the largest torques of those at rest
    spins     (T, N, n) in rad/s, in the rows
    rest      (N, n) in rad/s, what spins of rollers that stick are below
    of_steps  (S, N, n) in each step 0 where one sticks, else the sign of its spin
    modes     (T, N, n) the same in each row: in a row where a step starts those of the step, in others those with which
              a phase ends
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel, vector: StateVector, y: np.ndarray):
        self.trajectory, self.plain, self.vector = trajectory, plain, vector
        self.place, rollers = bearing_of(trajectory.effects, plain, "roller")
        own = (rollers.sliding, rollers.holding)
        self.sliding, self.holding = (np.repeat(of[:, None], plain.rollers_per_wheel, axis=1) for of in own)
        self.spins = spins(plain, vector.views(y))
        vehicle = trajectory.vehicle
        fastest = np.abs(self.spins).max() + np.linalg.norm(trajectory.nu, axis=1).max() / vehicle.yaw_scale
        by_torque = self.holding / vehicle.roller_inertia * trajectory.elapsed[-1]  # also where all have stood so far
        self.rest = max(AT_REST, MISSED * trajectory.accuracy) * (fastest + by_torque)
        self.of_steps = self._of_steps() if len(trajectory.step_rows) else np.zeros((0, *self.sliding.shape), int)

    def _of_steps(self) -> np.ndarray:
        """(S, N, n) modes, by what the polynomials have at as many places as they have coefficients."""
        dense = self.trajectory.dense
        steps, places = dense.shape[:2]
        y = values_at(np.repeat(dense, places, axis=0), np.tile(np.linspace(0, 1, places), steps))
        inside = spins(self.plain, self.vector.views(y)).reshape(steps, places, *self.sliding.shape)
        moves = np.abs(inside).max(axis=1) > self.rest
        return np.where(moves, np.sign(inside.mean(axis=1)), 0).astype(int)

    @cached_property
    def modes(self) -> np.ndarray:
        trajectory, first = self.trajectory, self.trajectory.step_rows
        modes = np.where(np.abs(self.spins) > self.rest, np.sign(self.spins), 0).astype(int)
        if not len(first):
            return modes
        between = np.setdiff1d(np.arange(len(trajectory)), np.concatenate([first, first + 1]))
        modes[first + 1] = self.of_steps
        modes[first] = self.of_steps
        for row in between[::-1]:  # of one that has come to rest says the next step whether it sticks
            if row + 1 < len(trajectory):
                modes[row] = np.where(modes[row] == 0, self.by_roller_of(row + 1, row, modes), modes[row])
        return modes

    def by_roller_of(self, row: int, of: int, modes: np.ndarray) -> np.ndarray:
        """(N, n) the modes (T, N, n) of a row for the places of another one."""
        contact = self.trajectory.contact
        return by_place(by_roller(modes[row], contact[row]), contact[of])

    @property
    def torques(self) -> np.ndarray:
        """(T, N, n) in N m, what generated functions take of the bearings: of rollers that turn, 0 where one sticks."""
        return -self.modes * self.sliding

    @staticmethod
    def given(torques: np.ndarray) -> dict[str, np.ndarray]:
        """The inputs of generated functions that are torques (..., N, n), by name."""
        return {IN_CONTACT: torques[..., 0], FREE: torques[..., 1:]}

    @staticmethod
    def where(sticks: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the modes where rollers (..., N, n) bool stick, by name."""
        found = sticks.astype(float)
        return {"contact_sticks": found[..., 0], "free_sticks": found[..., 1:]}

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The same in rows (...)."""
        return self.where(self.modes[rows] == 0)

    @cached_property
    def alone(self) -> np.ndarray:
        """(T,) bool: rows in which a step ends and the next one starts, with other modes."""
        found, first = np.zeros(len(self.trajectory), bool), self.trajectory.step_rows
        changed = (self.of_steps[1:] != self.of_steps[:-1]).any(axis=(1, 2))
        found[first[1:][(first[1:] == first[:-1] + 1) & changed]] = True
        return found
