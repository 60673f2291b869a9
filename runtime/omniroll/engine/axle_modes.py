"""Which axles stick in the rows of a run in which wheels may slip, and which way the others turn there.

There each wheel's rate is a speed of its own. An axle that sticks has a rate that is rounding in
the whole step, whose rate of change is zero.
"""

import numpy as np

from omniroll.effects.effect_set import EffectSet
from omniroll.effects.friction import Bearing
from omniroll.effects.state_vector import StateVector
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory

TORQUE = "bearing_torque"  # what rows keep of the axles' bearings
AT_REST = 1e-13  # of the fastest that a wheel has been: rates of what sticks are rounding


def bearing_of(effects: EffectSet, plain: Kernel, name: str) -> tuple[int, Bearing]:
    """The place of the effect whose bearings of this name may stick, and these."""
    found = ((k, effect.bearings(plain).get(name)) for k, effect in enumerate(effects.effects))
    return next((k, bearing) for k, bearing in found if bearing is not None)


class AxleModes:
    """The axles (N,) of a run.

    place    of their effect among those of the run
    sliding  (N,) in N m, torques of those that turn
    holding  (N,) in N m, the largest torques of those at rest
    of_steps (S, N) in each step 0 where one sticks, else the sign of its rate
    modes    (T, N) in each row 0 where one sticks, else the sign of its rate: in a row where a step starts those of the
             step, in others those with which a phase ends
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel, vector: StateVector, y: np.ndarray):
        self.place, axles = bearing_of(trajectory.effects, plain, "axle")
        self.sliding, self.holding = axles.sliding, axles.holding
        self.modes = self._modes(trajectory, vector, y)

    def _modes(self, trajectory: Trajectory, vector: StateVector, y: np.ndarray) -> np.ndarray:
        own, first = vector.slices["rates"], trajectory.step_rows
        rates = y[:, own]
        rest = AT_REST * np.maximum.accumulate(np.abs(rates).max(axis=1))[:, None]
        taken = trajectory.drive[:, trajectory.effects.drives().index(TORQUE)]
        at_rest = np.where(np.abs(taken) == self.sliding, -np.sign(taken), 0)
        modes = np.where(np.abs(rates) > rest, np.sign(rates), at_rest).astype(int)  # of rows between two transitions
        self.of_steps = np.zeros((len(first), rates.shape[1]), int)
        if len(first):
            inside = trajectory.dense[:, :, own]
            still = np.abs(inside).max(axis=1) <= rest[first]
            self.of_steps = np.where(still, 0, np.sign(inside.mean(axis=1))).astype(int)
            modes[first + 1] = self.of_steps
            modes[first] = self.of_steps
        return modes

    @property
    def torques(self) -> np.ndarray:
        """(T, N) in N m, what generated functions take of the bearings: of axles that turn, 0 where one sticks."""
        return -self.modes * self.sliding

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the modes in rows (...), by name."""
        return {"axle_sticks": (self.modes[rows] == 0).astype(float)}
