"""Axles that stick where wheels may slip: the set-valued law of Coulomb's friction, a mode for each axle.

There each wheel's rate is a speed of its own. Under a smooth law the ground's forces follow from the state, so that
what holds an axle is what its own wheel asks for, and no other axle has a part in it.

1. An axle that turns takes its sliding torque, against its rate. An axle at rest takes what its wheel asks for, up to
   its break-away torque, which is at least the sliding one.
2. A phase ends where the rate of a turning axle passes zero, and where a wheel asks for more than that. Both are
   located.
3. At such an instant, and wherever forces have jumped, each axle at rest is decided: it sticks if its wheel asks for no
   more than its break-away torque. If not, or where it has come to that bound on the way, it has broken away, and turns
   if its wheel asks for more than the sliding torque.
4. Where both torques are the same, an axle that comes to its bound has no acceleration yet. It gets the direction in
   which its wheel asks.
5. A switch changes no speed of a wheel.
"""

from dataclasses import replace

import numpy as np

from omniroll.effects.guards import EPS, PASSED, Guard
from omniroll.effects.sticking import AT_REST, HELD_ROUNDINGS, in_rounds
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State


class SlippingAxles:
    """The axles in one run.

    sliding   (N,) torques in N m of axles that turn
    holding   (N,) the largest torques in N m that axles at rest take
    resting   (N,) bool: axles whose rate is zero
    modes     (N,) int: 0 sticks, +-1 is the sign of the rate
    asked     (N,) in N m, torques that hold the axles which stick, at the start of the phase; else 0
    """

    def __init__(self, kernel: Kernel, sliding: np.ndarray, holding: np.ndarray):
        self.sliding, self.holding = sliding, holding
        self.reach = rate_per_speed(kernel)
        self.resting, self.modes = np.zeros(kernel.wheels, bool), np.zeros(kernel.wheels, int)
        self.released = np.zeros(kernel.wheels, int)  # signs of those that have been let go at this instant
        self.asked = np.zeros(kernel.wheels)
        self.least = 0.0  # in rad/s, what rates are rounded against at least

    # What the state says

    def at_rest(self, state: State) -> State:
        """The state with the rates of resting axles at zero. Those whose rates are zero within rounding rest, too."""
        self.resting |= np.abs(state.rates) <= AT_REST * EPS * self._sizes(state.nu, state.rates)
        rates = np.where(self.resting, 0.0, state.rates)
        self.modes = np.sign(rates).astype(int)
        return replace(state, rates=rates)

    def _sizes(self, nu: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """(N,) what rates are rounded against."""
        return np.maximum(np.abs(rates) + self.reach * np.linalg.norm(nu), self.least)

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.modes == 0
        self.released[:] = 0

    def switched(self) -> None:
        """Wheels have passed to their next rollers."""
        self.released[:] = 0

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards of the phase, (N,) bool, have ended it: those of turning axles, then of those that stick."""
        turning, stuck = np.flatnonzero(self.modes), np.flatnonzero(self.modes == 0)
        self.resting[turning[passed[: len(turning)]]] = True
        let_go = stuck[passed[len(turning) :]]
        self.released[let_go] = -np.sign(self.asked[let_go])

    # What follows

    def resting_on_ground(self) -> np.ndarray:
        """Places of those at rest, all of which touch the ground with their wheels."""
        return np.flatnonzero(self.resting)

    def torques(self) -> np.ndarray:
        """(N,) of the bearings of turning axles; 0 where an axle sticks."""
        return -self.modes * self.sliding

    def torque_sizes(self) -> np.ndarray:
        """(N,) what torques that hold are rounded against, several times: they are what is left of other torques."""
        return HELD_ROUNDINGS * (np.abs(self.asked) + self.holding)

    def rate_guards(self, nu: np.ndarray, rates: np.ndarray) -> list[Guard]:
        """Where the rate of a turning axle passes zero; nu (3,) and rates (N,) are those of the phase's start."""
        wheels, sizes = len(rates), self._sizes(nu, rates)
        weights = np.zeros((wheels, 6 + 2 * wheels))
        weights[:, 6 + wheels :] = np.diag(-self.modes)
        return [Guard(0.0, 0.0, weights[axle], sizes[axle]) for axle in np.flatnonzero(self.modes)]

    def excess(self, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S,) how much more than they take the axles that stick are asked for, `asked` (N,); and its rounding."""
        stuck = self.modes == 0
        torques, most = np.abs(asked[stuck]), self.holding[stuck]
        self.asked = asked.copy()
        return torques - most, HELD_ROUNDINGS * EPS * (torques + most)

    def decide(self, asked: np.ndarray) -> None:
        """Modes of the axles at rest (rule 3), of which `asked` (N,) are the torques that would hold them."""
        axles = np.flatnonzero(self.resting)
        self.modes[axles] = 0
        beyond, rounding = self.excess(np.where(self.resting, asked, 0.0))
        over = axles[beyond > PASSED * rounding]
        self.released[over] = -np.sign(asked[over])
        if not self.released.any():
            return
        wanted = asked[axles]

        def nearest(bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            torques = np.clip(wanted, -bounds, bounds)
            return torques - wanted, np.abs(wanted) + bounds, torques

        self.modes[axles] = in_rounds(self.released[axles], self.sliding[axles], self.holding[axles], nearest)


class BesideAxles:
    """Contacts, of a class behind this one, beside `axles` of the same wheels: what happens, happens to both."""

    axles: SlippingAxles

    def moved(self) -> None:
        """Some time has passed."""
        super().moved()  # type: ignore[misc]
        self.axles.moved()

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,)."""
        super().switched(directions)  # type: ignore[misc]
        self.axles.switched()


def rate_per_speed(kernel: Kernel) -> float:
    """The largest rate of a wheel that rolls, where |nu| is 1."""
    return float(np.linalg.norm(kernel.wheel_rows, axis=1).max())
