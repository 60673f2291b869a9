"""Massless rollers that stick on their disks where wheels may slip: a mode for each roller in contact.

A roller without inertia passes on what its bearing takes, so that bearing and ground are in series along the axle: one
force, and speeds that add up to the speed of the wheel along its axle (maxima/effects/contact_massless.mac). Under a
smooth law of the ground that force follows from the state, and no roller has a part in another one's.

1. A roller that turns has its sliding torque, against its spin. One that sticks slips on the ground with its wheel, and
   its bearing takes the moment of the ground's force, up to its break-away torque.
2. A phase ends where a roller that sticks is asked for more than that; and where one that turns would be asked for no
   more than its sliding torque if it stuck: there its spin is zero, since the ground's force rises with the slip.
3. Between the two torques both modes are possible: a roller stays in the one that it is in. At the start, and where a
   roller comes into contact, it sticks if it can: one without inertia that leaves the ground stops on its disk at once.
"""

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.guards import EPS, PASSED
from omniroll.effects.sticking import HELD_ROUNDINGS
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State

SMALLEST = float(np.finfo(float).tiny)
AT_SLIDING = 1e-9  # a torque that is nearer to the sliding one than this part of it may be that of a roller that turns


def holds(taken: np.ndarray, sliding: np.ndarray, heading: np.ndarray | None = None) -> np.ndarray:
    """(..., N) bool: torques (..., N) in N m that hold rollers, where those that turn have sliding (N,).

    heading  (..., N) in rad, where contacts go that may stick: those of rollers that turn along the rolling direction
    """
    holding = np.abs(np.abs(taken) - sliding) > AT_SLIDING * sliding
    return holding if heading is None else holding | (np.abs(np.cos(heading)) > AT_SLIDING)


def given_in_rows(taken: np.ndarray, sticks: np.ndarray) -> dict[str, np.ndarray]:
    """What the kernel takes, by name, where bearings take (..., N) in N m, those of rollers that stick (..., N) too."""
    return {"contact_sticks": sticks.astype(float), "contact_bearing": np.where(sticks, 0.0, taken)}


def rows_along_axles(kernel: Kernel) -> np.ndarray:
    """(N, 3) of nu, the speeds of the wheels along their axles."""
    middle = np.zeros(kernel.wheels)
    _, spins = kernel.wheel_rates(np.eye(3), middle)
    return (spins * kernel.call("contact_reaches", middle)).T


def torque_rounding(asked: np.ndarray, holding: np.ndarray, rows: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """(N,) in N m, of what would hold each roller: the speed along the axle, `rows` (N, 3) nu, is what is left of
    others."""
    left = np.abs(rows) @ np.abs(nu) / np.maximum(np.abs(rows @ nu), SMALLEST)
    return HELD_ROUNDINGS * EPS * (np.abs(asked) * (1 + left) + holding)


class MasslessRollers:
    """The rollers in contact in one run.

    sliding   (N,) torques in N m of rollers that turn
    holding   (N,) the largest torques in N m that rollers which stick take
    resting   (N,) bool: those that do not turn, whose modes are to be found
    modes     (N,) int: 0 sticks, +-1 is the sign of the spin
    released  (N,) bool: those that have been let go at this instant
    """

    def __init__(self, sliding: np.ndarray, holding: np.ndarray, rates: BoundRates):
        self.sliding, self.holding, self.rates = sliding, holding, rates
        self.modes = np.zeros(len(sliding), int)
        self.resting, self.released = np.ones(len(sliding), bool), np.zeros(len(sliding), bool)
        self.asked = np.zeros(len(sliding))  # in N m, what would hold each, as last looked at
        kernel, buffers = rates.kernel, rates.buffers
        self.rows = rows_along_axles(kernel)
        signature = kernel.signatures["slip_spins"]
        stuck = {"contact_sticks": np.ones(kernel.wheels), "contact_bearing": np.zeros(kernel.wheels)}
        own = {argument.name: np.zeros(argument.shape) for argument in signature.outputs}
        self._held = own["contact_holding"]
        self._look = kernel.bind("slip_spins", buffers | stuck | own)

    # What the state says

    def at_rest(self, state: State) -> State:
        """The state, in which they have no part."""
        return state

    def _asked_in(self, y: np.ndarray) -> np.ndarray:
        """(N,) in N m, what would hold each in the state y."""
        self.rates.y[:] = y
        self._look()
        return self._held.copy()

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.modes == 0
        self.released[:] = False

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,), which stand on their disks."""
        self.resting |= directions != 0
        self.released[:] = False

    def pass_guards(self, passed: np.ndarray) -> None:
        """Functions of the phase, (N,) bool, have ended it: of each roller that of its mode."""
        stuck = self.modes == 0
        self.released |= passed & stuck
        self.resting |= passed & ~stuck

    # What follows

    def torques(self) -> np.ndarray:
        """(N,) of the bearings of rollers that turn; 0 where one sticks."""
        return -self.modes * self.sliding

    def inputs(self) -> dict[str, np.ndarray]:
        """What the kernel takes, by name."""
        return {"contact_sticks": self.modes == 0, "contact_bearing": self.torques()}

    def held_in_contact(self) -> np.ndarray:
        """(N,) in N m, what holds those that stick in the state in which the rates were computed last; else 0."""
        self._look()
        return np.where(self.modes == 0, self._held, 0.0)

    def torque_sizes(self) -> np.ndarray:
        """(N,) what torques are rounded against, several times."""
        return HELD_ROUNDINGS * (np.abs(self.asked) + self.holding)

    def excess(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) how far each is beyond the end of its mode in the state y, in N m, and its rounding."""
        self.asked = self._asked_in(y)
        size = np.abs(self.asked)
        turning = self.sliding + self.modes * self.asked
        rounding = torque_rounding(self.asked, self.holding, self.rows, y[:3])
        return np.where(self.modes == 0, size - self.holding, turning), rounding

    def decide(self, y: np.ndarray) -> None:
        """Modes of those that do not turn, in the state y (rules 1 and 3)."""
        self.modes[self.resting] = 0
        beyond, rounding = self.excess(y)
        goes = self.resting & ((beyond > PASSED * rounding) | self.released)
        self.modes[goes] = -np.sign(self.asked[goes]).astype(int)
