"""Contacts, axles and massless rollers that may all stick in a run whose loads follow the motion.

The rules of ground_with_massless_rollers.py hold for contacts and bearings, those of loaded_ground_with_bearings.py for
the loads. Beside them:

1. Where a contact slips and its roller turns, the friction across is in no proportion to the load: loads are found by
   Newton's rule (loads_beside_bearings.py; maxima/effects/contact_loads.mac).
2. Whether the roller of a contact that slips sticks follows from the state and the load. So it is decided under each of
   the loads that are found for the modes in turn: one that has turned so far goes on where it would be asked for its
   sliding torque at least, one that has stuck begins beyond its break-away torque.
3. The roller of a contact that is off sticks, and the bearing takes nothing.
4. Loads and bearings determine each other where the coupled matrix has a positive determinant whichever of the axles at
   rest and of the rollers at rest under contacts that stick turn, and whichever of the rollers do under contacts that
   slip which can under these loads.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import HELD_ROUNDINGS, Dynamics, Grip, Ground
from omniroll.effects.ground_loads import NONE, Carried, GroundFailsError, Loads, SumsOf
from omniroll.effects.ground_with_axles import Evaluate
from omniroll.effects.ground_with_massless_rollers import GroundWithMasslessRollers, StripFlow
from omniroll.effects.guards import EPS, PASSED
from omniroll.effects.loaded_ground import PATIENT, LoadedFlow
from omniroll.effects.loaded_ground_with_bearings import LoadedGroundWithBearings
from omniroll.effects.loads_beside_bearings import BesideBearings, settled
from omniroll.effects.slipping_bearings import MasslessSlippingBearings
from omniroll.kernels.kernel import Kernel


class LoadsInCorners(Loads):
    """Loads that are those about which friction is linear (rule 1).

    about  finds loads by a function that finds them where friction is linear about others
    """

    def __init__(self, places: np.ndarray, at_rest: np.ndarray, about: Callable[[Callable[[], Carried]], Carried]):
        super().__init__(places, at_rest)
        self.about = about

    def solve(self, sums_of: SumsOf) -> Carried:
        return self.about(partial(super().solve, sums_of))

    def in_set(self, shares: np.ndarray, carries: np.ndarray, sums_of: SumsOf) -> Carried:
        return self.about(partial(super().in_set, shares, carries, sums_of))


class LoadedGroundWithMasslessRollers(LoadedGroundWithBearings, GroundWithMasslessRollers):
    """Contacts, axles and massless rollers in one run whose loads follow the motion.

    axles     all bearings (2 N,): of axles, then of rollers in contact
    carrying  (N,) bool: contacts that carry in the rates that are computed
    speeds    (N, 2) in m/s, of wheels along their axles and slips along rolling directions, at the start of the phase
    moving    (N,) bool: contacts that slip there already
    """

    axles: MasslessSlippingBearings
    seeks_everywhere = True

    def __init__(self, kernel: Kernel, grip: Grip, bearings: MasslessSlippingBearings, rates: BoundRates):
        LoadedGroundWithBearings.__init__(self, kernel, grip, bearings, rates)
        self.directions = slice(0, 2)
        bearings.resting[bearings.contact] = True
        self.loads = LoadsInCorners(kernel.vehicle.places(), grip.loads, self._about)
        self.carrying, self.moving = ~self.off, np.zeros(kernel.wheels, bool)
        self.speeds = np.zeros((kernel.wheels, 2))
        self._linear_about(grip.loads)

    # Loads in corners

    @property
    def corners(self) -> np.ndarray:
        """(N,) bool: contacts that carry, whose rollers turn; of those that stick no force goes with factors()."""
        return (self.turning != 0) & self.carrying

    def trying(self, carries: np.ndarray) -> None:
        self.carrying = carries

    def _corner_loads(self, loads: np.ndarray) -> list[np.ndarray]:
        taken = self.axles.torques()[self.axles.contact]
        return self.kernel.call("corner_loads", self.held["chi"], taken, self.grip.sliding, loads)

    def _linear_about(self, loads: np.ndarray) -> None:
        """Friction in corners is linear about loads (N,)."""
        corners = self.corners
        self.beside = BesideBearings.at(lambda there: tuple(self._corner_loads(there)[:2]), corners, loads)
        self.left = np.where(corners, self._corner_loads(self.beside.about)[2] if corners.any() else 1.0, 1.0)

    def _about(self, solve: Callable[[], Carried]) -> Carried:
        """The loads that `solve` finds about themselves."""

        def found(loads: np.ndarray) -> Carried:
            self._linear_about(loads)
            return solve()

        if not self.corners.any():
            return found(self.load)
        first = np.where(np.isfinite(self.load), self.load, self.grip.loads)
        return settled(found, first, self.loads.weight)

    def forces_per_load(self) -> np.ndarray:
        """(N, 2) those on the ellipses: what is left of them in corners is said by factors()."""
        decided = self.towards.copy()
        self.aim(self.speeds, self.moving)  # by the modes that are looked at
        found = Ground.sliding_forces(self, np.ones(len(self.sticks)))
        self.towards = decided
        return found

    def _sums_of_pushes(self, dynamics: Dynamics) -> SumsOf:
        self._linear_about(self.load)
        return super()._sums_of_pushes(dynamics)

    def factors(self, loads: np.ndarray) -> np.ndarray:
        return self.beside.factor(loads) * self.left

    def press(self, found: Carried) -> None:
        super().press(found)
        self._linear_about(self.pressing)
        if "ground_yield" in self.held:
            self.held["ground_yield"][:] = self._yields()

    def _yields(self) -> np.ndarray:
        """(N,) in 1/N, corner_yield of contacts that slip, whose rollers turn; 0 of others."""
        both = self.corners & ~self.sticks
        if not both.any():
            return np.zeros(len(both))
        taken, given = self.axles.torques()[self.axles.contact], np.where(both, self.load, 1.0)
        found = self.kernel.call("corner_forces", self.held["chi"], self.towards, given, self.grip.sliding, taken)
        return np.where(both, found[1], 0.0)

    # What the state says

    def _turn(self, pair: np.ndarray, chi: np.ndarray, rounding: np.ndarray, wheels: np.ndarray) -> None:
        """None: loads have a part in that (rule 2)."""

    @property
    def may_turn(self) -> np.ndarray:
        return self.turning == 0

    def begin(self, slip: np.ndarray, evaluate: Evaluate) -> None:
        """Modes of all contacts and bearings, and the loads, in the phase that begins now."""
        rollers = self.axles.contact

        def of_carrying(sticks: np.ndarray, stuck: np.ndarray, pushed: np.ndarray, torques: np.ndarray) -> None:
            away, stuck, torques = rollers[~self.carrying], stuck.copy(), torques.copy()
            stuck[away], torques[away] = True, 0.0
            evaluate(sticks, stuck, pushed, torques)

        self.trying(~self.off)
        self.before = self.axles.modes[rollers].copy(), self.axles.resting[rollers].copy()
        self.turns, self.speeds = 0, slip
        super().begin(slip, of_carrying)
        off = rollers[self.off]
        self.axles.modes[off], self.axles.resting[off] = 0, True
        self._stand()

    def _under_loads(self, slip: np.ndarray, rests: np.ndarray) -> np.ndarray:
        """Which rollers turn under the present loads (rule 2), and which contacts rest then."""
        bearings, rollers = self.axles, self.axles.contact
        now = bearings.modes[rollers].copy()
        bearings.modes[rollers], bearings.resting[rollers] = self.before
        stuck, rounding = bearings.resting[rollers], self.roundings(self.held["nu"], self.held["rates"], None)
        slips = ~self.still & ~(rests & ~stuck)
        turned = ~stuck | ((now != 0) if self.turns > PATIENT else False)
        asked = self._asked_of_rigid(slip, rounding)
        bound = np.where(turned, bearings.sliding[rollers], bearings.holding[rollers])
        size = HELD_ROUNDINGS * EPS * (np.abs(asked) + bound)
        beyond = np.abs(asked) - bound > np.where(turned, -PASSED, PASSED) * size
        turns = slips & ~self.off & (beyond | (stuck & (bearings.released[rollers] != 0)))
        stops = slips & ~turns
        bearings.modes[rollers[turns]] = -np.sign(asked[turns]).astype(int)
        bearings.resting[rollers[turns]] = False
        bearings.modes[rollers[stops]], bearings.resting[rollers[stops]] = 0, True
        self.turns += 1
        rolls = (self.turning != 0) & (np.abs(slip[:, 1]) <= rounding)
        rests = np.where(slips, rolls, rests)
        self.moving = ~rests
        return rests

    def bearings_in_rounds(self) -> np.ndarray:
        """Axles at rest, and rollers that have stuck so far; what their contacts do follows from the loads."""
        resting = super().bearings_in_rounds()
        resting[self.axles.contact] = self.before[1]
        return resting

    def may_be_elsewhere(self, fails: GroundFailsError) -> bool:
        """Also loads for some modes of the rollers, which go with the loads. A vehicle that tips does so."""
        return not fails.ends or (fails.failure == NONE and not fails.tips)

    def contacts_in_rounds(self, rests: np.ndarray) -> np.ndarray:
        """Also those that rest as soon as their rollers turn."""
        rounding = self.roundings(self.held["nu"], self.held["rates"], None)
        return rests | (np.abs(self.speeds[:, 1]) <= rounding)

    def carry_by_moments(self, sums: np.ndarray) -> None:
        """Those carry whose springs would be compressed: of all loads with sums (3,) that pull on no contact these have
        the least norm."""
        loads = self.loads
        for _ in range(2 * len(self.off)):
            carries = (loads.springs.shares(loads.carries) @ sums > 0) & ~loads.dropped
            if (carries == loads.carries).all() or loads.springs.shares(carries) is None:
                break
            loads.carries = carries
        self.off = ~loads.carries
        self.trying(loads.carries)

    def _asked_of_rigid(self, slip: np.ndarray, rounding: np.ndarray) -> np.ndarray:
        """(N,) in N m, what would hold the rollers of contacts that slip (N, 2) if they stuck."""
        towards = np.where(np.linalg.norm(slip, axis=1)[:, None] > rounding[:, None], slip, self.towards)
        return self._reach(self.held["chi"]) * self.grip.sliding_forces(self.kernel, towards, self.load)[:, 0]

    # Whether loads and bearings determine each other

    def _refuse_unless_determined(self, slip: np.ndarray, dynamics: Dynamics) -> None:
        super()._refuse_unless_determined(slip, dynamics)
        self._linear_about(self.load)

    def _undecided(self, slip: np.ndarray) -> np.ndarray:
        """Places of the bearings that may stick and turn under these loads (rule 4)."""
        rollers, carries = self.axles.contact, ~self.off
        asked = self._asked_of_rigid(slip, self.roundings(self.held["nu"], self.held["rates"], None))
        slides = ~self.sticks & carries & (np.abs(asked) >= self.axles.sliding[rollers])
        holds = self.sticks & self.axles.resting[rollers]
        of_axles = np.flatnonzero(self.axles.resting[: self.axles.wheels])
        return np.append(of_axles, rollers[slides | holds])


class LoadedStripFlow(LoadedFlow, StripFlow):
    """The rates of a phase; forces in corners are those of ellipses, of which the ground's factors() leave a part."""

    def _slide_or_turn(self) -> None:
        self._ellipse()
