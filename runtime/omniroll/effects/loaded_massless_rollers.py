"""Massless rollers that stick, and axles, on a ground under a smooth law whose loads follow the motion.

The rules of massless_rollers.py hold for each roller, those of loaded_axles.py for axles and loads. Beside them:

1. Under the law `viscous` the state says which rollers stick in each set of contacts that may carry. Under
   `regularised` what is asked of a roller goes with its load, and one that begins to turn moves loads. So rollers and
   axles are decided together with the loads.
2. Of a load the bearing of a roller that turns leaves what is in no proportion to it, and one with viscous friction
   takes what is not, either: in its modes a phase has loads that are found by Newton's rule (loads_beside_bearings.py).
3. A roller has no inertia, and nothing keeps it turning. At each instant all are decided anew: one that has turned so
   far goes on where it is asked for more than its sliding torque, one that has stuck begins where it is asked for more
   than its break-away torque, and loads that jump may change both.
4. Loads and rollers determine each other where the coupled matrix has a positive determinant whichever of the rollers
   turn that can under these loads. That is looked at for them as it is for axles.
5. The roller of a contact that is off sticks.
"""

from collections.abc import Callable

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Grip
from omniroll.effects.ground_loads import Carried, SumsOf
from omniroll.effects.guards import PASSED
from omniroll.effects.loaded_axles import Settled
from omniroll.effects.loaded_bearings import GroundBesideBearings
from omniroll.effects.loads_beside_bearings import BesideBearings, at_loads, left_function, settled, taken_and_gain
from omniroll.effects.massless_rollers import rows_along_axles, torque_rounding
from omniroll.effects.slipping_bearings import MasslessSlippingBearings
from omniroll.kernels.kernel import Kernel


class GroundBesideMasslessRollers(GroundBesideBearings):
    """Contacts and bearings in one run.

    axles    all bearings (2 N,), of axles and then of rollers in contact, with their modes
    about    (N,) in N, loads about which friction beside rollers that turn is linear
    turned   (2 N,) bool: rollers that have turned up to this instant
    before   (2 N,) int, modes of all bearings up to this instant
    carries  (N,) bool: contacts that carry in the rates that were computed last
    """

    axles: MasslessSlippingBearings

    def __init__(self, kernel: Kernel, grip: Grip, bearings: MasslessSlippingBearings, rates: BoundRates):
        super().__init__(kernel, grip, bearings, rates)
        buffers, count = rates.buffers, kernel.wheels
        bearings.resting[bearings.contact] = True
        self.about, self.carries = grip.loads, np.ones(count, bool)
        self.turned, self.before = np.zeros(2 * count, bool), np.zeros(2 * count, int)
        self.rows = rows_along_axles(kernel)
        buffers.setdefault("contact_spin", np.zeros(count))
        self._unturned = np.ones(count)  # load_factor of rollers that stick
        stuck = {"contact_sticks": np.ones(count), "contact_bearing": np.zeros(count), "load_factor": self._unturned}
        own = {argument.name: np.zeros(argument.shape) for argument in kernel.signatures["slip_spins"].outputs}
        self._held = own["contact_holding"]
        self._look = kernel.bind("slip_spins", buffers | stuck | own)
        self._beside: BesideBearings | None = None
        if function := left_function(kernel):
            signature = kernel.signatures[function]
            for argument in (*signature.inputs, *signature.outputs):
                buffers.setdefault(argument.name, np.zeros(argument.shape))
            self._says_what_is_left = [argument.name for argument in signature.outputs]
            self._find_left = kernel.bind(function, buffers)

    # What has happened

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,), which stand on their disks."""
        came = self.axles.contact[directions != 0]
        self.axles.released[:] = 0
        self.axles.resting[came], self.axles.modes[came] = True, 0

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards that have ended the phase: of loads with the coupled matrix, and of bearings. A roller that comes to
        rest at the instant at which it was let go has come to rest."""
        super().pass_guards(passed)
        rests = np.zeros(len(self.turned), bool)
        rests[self.axles.contact] = (passed[len(self.off) + 1 :] & (self.axles.modes != 0))[self.axles.contact]
        self.axles.released[rests] = 0

    # Loads beside bearings

    def press(self, loads: np.ndarray, carries: np.ndarray) -> None:
        """The rates have loads (N,), where `carries` (N,) bool (rules 2 and 5)."""
        buffers, self.carries = self.buffers, carries
        buffers["contact_sticks"][~carries], buffers["contact_bearing"][~carries] = 1.0, 0.0
        self._unturned[:] = self.grip.factor(loads, carries)
        self.factor[:] = self._unturned
        turns = buffers["contact_sticks"] == 0
        if self.grip.law == "viscous" or not turns.any():
            return
        if self._beside is None:
            self._beside = BesideBearings.at(self._left, turns, self.about)
            buffers["bearing_factor"][:] = 1 / self._beside.about
        self.factor[turns] = self._beside.factor(loads)[turns]

    def _left(self, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) and (N,), loads that bearings take, and the gains at loads (N,)."""
        for name, value in at_loads(loads).items():
            if name in self.buffers:
                self.buffers[name][:] = value
        self._find_left()
        return taken_and_gain({name: self.buffers[name].copy() for name in self._says_what_is_left})

    def _put(self, modes: np.ndarray, bounds: np.ndarray) -> None:
        super()._put(modes, bounds)
        self._beside = None

    def solve(self, evaluate: Callable[[], object], carries: np.ndarray) -> Carried:
        return self._about(lambda: super(GroundBesideMasslessRollers, self).solve(evaluate, carries))

    def _about(self, solve: Callable[[], Carried]) -> Carried:
        """The loads that `solve` finds about themselves."""

        def found(loads: np.ndarray) -> Carried:
            self.about, self._beside = loads, None
            return solve()

        if self.grip.law == "viscous" or (self.buffers["contact_sticks"] == 1).all():
            return solve()
        return settled(found, self.about, self.loads.weight)

    # Which bearings stick

    def decide(self, evaluate: Callable[[], object]) -> None:
        """Which contacts carry and which bearings stick in the phase that begins now (rule 3)."""
        rollers, modes = self.axles.contact, self.axles.modes
        self.before = modes.copy()
        self.turned[rollers] = modes[rollers] != 0
        self.axles.resting[rollers] = True
        self.about = self.load
        super().decide(evaluate)
        self.axles.resting[rollers] = self.axles.modes[rollers] == 0

    def _starting(self) -> tuple[np.ndarray, np.ndarray]:
        """As for axles; rollers begin as they are. One that has just come to rest is at its bound only as long as the
        others turn that do."""
        modes, broken = super()._starting()
        return np.where(self.turned, self.before, modes), broken | self.turned

    def _settle(self, evaluated: Callable[[], Carried]) -> tuple[Carried, Settled]:
        return super()._settle(lambda: self._about(evaluated))

    def _wrong(self, modes: np.ndarray, bounds: np.ndarray) -> np.ndarray:
        """(2 N,) bool, as for axles; a roller turns no longer where it is asked for less than its bound by more than
        rounding."""
        found, rollers = super()._wrong(modes, bounds), self.axles.contact
        against = (modes * self.gains() < -PASSED * self._rounding(bounds))[rollers]
        found[rollers] |= (modes[rollers] != 0) & (against | ~self.carries)
        return found

    def _undecided(self, settled: Settled, sums_of: SumsOf) -> np.ndarray:
        """Places of the bearings that may stick and turn under these loads, (rule 4)."""
        self.about = self.load
        self._put(settled.modes, self.axles.sliding)
        sums_of(self.load)
        rollers = self.axles.contact
        turns = np.abs(self._asked_of_rollers()) >= self.axles.sliding[rollers]
        return np.append(np.flatnonzero(self.axles.resting[: self.axles.wheels]), rollers[turns & self.carries])

    def _ways(self) -> np.ndarray:
        """As for axles; a roller turns as its wheel moves along the axle."""
        ways = super()._ways()
        ways[self.axles.contact] = np.where(self._asked_of_rollers() > 0, -1, 1)
        return ways

    # What holds them

    def _asked_of_rollers(self) -> np.ndarray:
        """(N,) in N m, what would hold the rollers if they stuck, in the state and under the loads of the rates that
        were computed last."""
        self._look()
        return self._held

    @property
    def holding(self) -> np.ndarray:
        """(2 N,) in N m, what holds the bearings that stick, as the rates that were computed last have it."""
        sticks = self.buffers["contact_sticks"] == 1
        of_axles = self.buffers.get("axle_holding", np.zeros(len(sticks)))
        return np.append(of_axles, np.where(sticks, self._asked_of_rollers(), 0.0))

    def gains(self) -> np.ndarray:
        """(2 N,) in N m, what would give the bearings' accelerations: of rollers what they are asked for, if they
        stuck, beyond what they take."""
        of_axles = self.buffers["rates_dot"] * self.kernel.vehicle.wheel_inertia
        return np.append(of_axles, self.buffers["contact_bearing"] - self._asked_of_rollers())

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """(2 N,) how far each bearing is beyond the end of its mode, and the rounding; the rates have been computed."""
        values, rounding = super().excess()
        rollers, asked = self.axles.contact, self._asked_of_rollers()
        modes, sliding, holding = (own[rollers] for own in (self.axles.modes, self.axles.sliding, self.axles.holding))
        values[rollers] = np.where(modes == 0, np.abs(asked) - holding, sliding + modes * asked)
        rounding[rollers] = torque_rounding(asked, holding, self.rows, self.buffers["nu"])
        return values, rounding
