"""Contacts and axles that may all stick in a run whose loads follow the motion.

The rules of ground_with_axles.py hold for contacts and axles, those of ground_loads.py for the loads. Beside them:

1. What standing wheels and the bearings can take follows the loads at all times. So does the force on a standing wheel,
   whose part along the rolling direction is not determinate; the loads are, since their balance asks for accelerations
   alone.
2. At an instant modes and loads are found for each other in turn: contacts and axles at rest are decided together under
   the loads, and the loads in these modes, until nothing changes. What has been let go on the way there, under loads
   that are not the last, is decided anew.
3. Axles take torques between bounds that know no loads. In the modes of the contacts that have been found, loads and
   axles determine each other where the coupled matrix has a positive determinant whichever axles at rest turn (maxima,
   contact_axles). That is looked at up to MOST axles; else the ground fails.
4. Before friction of a standing wheel falls below zero with its load it is used up: what the ground leaves along the
   rolling direction is no quotient of forces and loads here, so that it is smooth there.
5. Where a load vanishes the friction of its contact does, too, and may be told first: the contact is off even so.
"""

from itertools import product

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Dynamics, Grip
from omniroll.effects.ground_loads import DETERMINED, FITS, MOST, UNDETERMINED, carried
from omniroll.effects.ground_with_axles import Evaluate, GroundWithAxles
from omniroll.effects.loaded_ground import LoadedGround, telling_what_tips
from omniroll.effects.slipping_axles import SlippingAxles
from omniroll.kernels.kernel import Kernel


class LoadedGroundWithAxles(GroundWithAxles, LoadedGround):
    """Contacts and axles in one run whose loads follow the motion."""

    def __init__(self, kernel: Kernel, grip: Grip, axles: SlippingAxles, rates: BoundRates):
        LoadedGround.__init__(self, kernel, grip, rates)
        self._put_axles(axles, rates.buffers)

    def pass_guards(self, passed: np.ndarray) -> None:
        """As without loads; a contact that lets go where its load is gone is off (rule 5)."""
        super().pass_guards(passed)
        gone = self.released & (self.pressing <= FITS * self.loads.weight)
        self.loads.dropped |= gone
        self.released &= ~gone

    def _left_of_ground(self) -> np.ndarray:
        axle, rolling = self.grip.static[self.stands].T
        reach = self.pressing[self.stands] * rolling
        if self.directions.start:
            return reach
        along = self.held["ground_force"][self.stands, 0] * rolling / axle
        return np.copysign(np.sqrt(np.maximum(reach**2 - along**2, 0.0)), reach)

    def begin(self, slip: np.ndarray, evaluate: Evaluate) -> None:
        """Modes of all contacts and axles, and the loads, in the phase that begins now (rule 2)."""

        def dynamics(sticks: np.ndarray, pushed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            evaluate(sticks, self.axles.modes == 0, pushed, self.axles.torques())
            return self.held["ground_force"].copy(), self.held["slip_dot"].copy()

        self.axles.modes[self.axles.resting] = 0
        rests = self._under_loads(slip, self.resting | self.still)
        self.aim(slip, ~rests)
        with telling_what_tips(self._fails_at_rest(self.forces_per_load(), rests, dynamics)):
            self._settle_beside_axles(slip, rests, evaluate, dynamics)
        self._refuse_unless_determined(slip, dynamics)

    def _under_loads(self, slip: np.ndarray, rests: np.ndarray) -> np.ndarray:
        """(N,) bool: contacts whose slip (N, 2) in m/s is zero, `rests` so far, under the present loads."""
        return rests

    @property
    def bearings(self) -> SlippingAxles:
        return self.axles

    def _settle_beside_axles(self, slip: np.ndarray, rests: np.ndarray, evaluate: Evaluate, dynamics: Dynamics) -> None:
        """Modes and loads that belong together; `rests` (N,) bool, contacts whose slip is zero."""
        let_go = self.released.copy(), self.axles.released.copy()
        begin = super().begin

        def find_modes(still: np.ndarray) -> np.ndarray:
            self.released, self.axles.released = (own.copy() for own in let_go)
            still = self._under_loads(slip, still)
            self.resting = still & ~self.off
            begin(slip, evaluate)
            return still

        self.find_modes_and_loads(rests, find_modes, dynamics)

    def _undecided(self, slip: np.ndarray) -> np.ndarray:
        """Places of the bearings at rest, which turn or stick; contacts slip with (N, 2) in m/s."""
        return self.axles.resting_on_ground()

    def _signs(self, places: np.ndarray) -> np.ndarray:
        """Of the rates with which bearings at these places would turn: any, where only torques have them."""
        return np.ones(len(places), int)

    def _refuse_unless_determined(self, slip: np.ndarray, dynamics: Dynamics) -> None:
        """Raises GroundFailsError where loads and axles need not determine each other (rule 3)."""
        resting, modes = self._undecided(slip), self.axles.modes
        if len(resting) > MOST:
            return
        shares = self.loads.springs.shares(self.loads.carries)
        for choice in product((0, 1), repeat=len(resting)):
            self.axles.modes = modes.copy()
            self.axles.modes[resting] = np.array(choice, int) * self._signs(resting)
            sums_of = self._sums_of_pushes(dynamics)
            found = carried(shares, self.loads.carries, sums_of, self.loads.start, self.loads.arm)
            if not found.determinant > DETERMINED:
                self.loads.refuse(UNDETERMINED, found)
        self.axles.modes = modes
