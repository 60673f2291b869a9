"""Axles that stick on a ground under a smooth law whose loads follow the motion.

The rules of slipping_axles.py hold for each axle, those of ground_loads.py for the loads. An axle that begins to turn
moves loads, and loads move what the ground asks of other axles. So at an instant all is found together:

1. In each set of contacts that may carry, the modes of the axles at rest are found with its loads: a problem of
   complementarity, linear in their accelerations, with the torques of the bearings between bounds.
2. Whichever axles are wrong change at once: one that sticks and is asked for more than its bound turns, and one that
   would turn against its acceleration sticks. Where that has not ended after a few turns the first wrong one changes
   alone, which ends where the problem has one solution for all that may be asked (Murty).
3. So it has where the coupled matrix has a positive determinant whichever of the axles at rest turn (maxima,
   contact_loads). That is looked at in the set that carries, up to MOST axles; else the ground fails.
4. Static friction above the sliding one goes in rounds: an axle that turns in one has broken away in the next. Axles
   that come to their bounds together break away together: one that turns may take from the others what they hold.
5. In a phase the modes are given, and loads and accelerations are solved together as they are without axles that stick.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Grip
from omniroll.effects.ground_loads import DETERMINED, MOST, UNDETERMINED, Carried, Loads, SumsOf, carried
from omniroll.effects.guards import EPS, PASSED, Guard
from omniroll.effects.slipping_axles import BesideAxles, SlippingAxles
from omniroll.effects.smooth_ground import SmoothGround
from omniroll.effects.sticking import AT_BOUND, HELD_ROUNDINGS, MOVES
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State

ALL_AT_ONCE, TURNS = 20, 2000  # turns in which all wrong axles change; and all turns
TOGETHER = 256  # roundings: so near to its bound an axle is at it where another one has come to its


@dataclass(frozen=True)
class Settled:
    """Axles in a set of contacts that carries: their modes (N,) int, which have broken away (N,) bool, and the torques
    (N,) in N m that hold those which stick."""

    modes: np.ndarray
    broken: np.ndarray
    asked: np.ndarray


Settle = Callable[[Callable[[], Carried]], tuple[Carried, Settled]]


class LoadsBesideAxles(Loads):
    """The loads in one run, each set of contacts with its own modes of the axles.

    settle  finds the loads of a set with its axles, from what finds them in the modes that the rates have
    axles   of each set that has been tried at this instant, by the bytes of its (N,) bool
    """

    def __init__(self, places: np.ndarray, at_rest: np.ndarray, settle: Settle):
        super().__init__(places, at_rest)
        self.settle = settle
        self.axles: dict[bytes, Settled] = {}

    def in_set(self, shares: np.ndarray, carries: np.ndarray, sums_of: SumsOf) -> Carried:
        found, self.axles[carries.tobytes()] = self.settle(lambda: self._evaluated(shares, carries, sums_of))
        return found

    def _evaluated(self, shares: np.ndarray, carries: np.ndarray, sums_of: SumsOf) -> Carried:
        """The loads of a set, which the rates that were computed last have."""
        found = carried(shares, carries, sums_of, self.start, self.arm)
        sums_of(found.loads)
        return found


class GroundBesideAxles(BesideAxles, SmoothGround):
    """Contacts and axles in one run.

    axles  with their modes
    """

    def __init__(self, kernel: Kernel, grip: Grip, axles: SlippingAxles, rates: BoundRates):
        super().__init__(kernel, grip, rates)
        self.axles, self.buffers = axles, rates.buffers
        self.loads = LoadsBesideAxles(kernel.vehicle.places(), grip.loads, self._settle)

    def at_rest(self, state: State) -> State:
        """The state with the rates of resting axles at zero."""
        return self.axles.at_rest(state)

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards that have ended the phase: of turning axles, of loads with the coupled matrix, of axles that stick."""
        turning = int((self.axles.modes != 0).sum())
        of_turning, of_loads, of_stuck = np.split(passed, [turning, turning + len(self.off) + 1])
        super().pass_guards(of_loads)
        self.axles.pass_guards(np.append(of_turning, of_stuck))

    @property
    def holding(self) -> np.ndarray:
        """(N,) in N m, what holds the axles that stick, as the rates that were computed last have it."""
        return self.buffers["axle_holding"]

    def gains(self) -> np.ndarray:
        """(N,) in N m, the axles' accelerations times their inertia, as the rates that were computed last say."""
        return self.buffers["rates_dot"] * self.kernel.vehicle.wheel_inertia

    def inputs(self, modes: np.ndarray, bounds: np.ndarray) -> dict[str, np.ndarray]:
        """What the rates take, by name, of axles with modes (N,) that take torques (N,) where they turn."""
        return {"axle_sticks": modes == 0, "bearing_torque": -modes * bounds}

    def turning_guards(self, nu: np.ndarray, rates: np.ndarray) -> list[Guard]:
        """Where the rate of a turning axle passes zero; nu (3,) and rates (N,) are those of the phase's start."""
        return self.axles.rate_guards(nu, rates)

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """(S,) what axles that stick are asked for beyond what they take, and the rounding; the rates have been
        computed."""
        return self.axles.excess(self.holding)

    def torques_in_rows(self) -> dict[str, np.ndarray]:
        """What rows keep of the bearings (N,), by name."""
        return {"bearing_torque": self.axles.torques() + self.holding}

    def _put(self, modes: np.ndarray, bounds: np.ndarray) -> None:
        """The modes of the axles, with the torques (N,) of those that turn, where the rates have them."""
        for name, values in self.inputs(modes, bounds).items():
            self.buffers[name][:] = values

    def decide(self, evaluate: Callable[[], object]) -> None:
        """Which contacts carry and which axles stick in the phase that begins now."""
        self.axles.modes[self.axles.resting] = 0
        self.loads.axles.clear()
        super().decide(evaluate)
        settled = self.loads.axles[self.loads.carries.tobytes()]
        self._refuse_unless_determined(settled, self.sums_under(evaluate, self.loads.carries))
        self._take(settled)

    def _settle(self, evaluated: Callable[[], Carried]) -> tuple[Carried, Settled]:
        """The loads in a set of contacts, and the axles at rest with them (rules 2 and 4); not a number where that has
        not ended."""
        axles = self.axles
        modes, broken = self._starting()
        seen: set[bytes] = set()  # of turns in which one bearing changes: those that come back go round for ever
        for turn in range(TURNS):
            bounds = np.where(broken | ~axles.resting, axles.sliding, axles.holding)
            self._put(modes, bounds)
            found = evaluated()
            if turn == 0 and broken.any():
                broken |= axles.resting & (np.abs(self.holding) - bounds > -TOGETHER * self._rounding(bounds))
                continue
            wrong = self._wrong(modes, bounds)
            if wrong.any():
                wrong = wrong if turn < ALL_AT_ONCE else wrong & (np.cumsum(wrong) == 1)
                modes = np.where(wrong, np.where(modes == 0, -np.sign(self.holding).astype(int), 0), modes)
                state = modes.tobytes() + broken.tobytes()
                if state in seen:
                    break
                if turn >= ALL_AT_ONCE:
                    seen.add(state)
                continue
            turns = axles.resting & (modes != 0)
            if not (turns & ~broken).any():
                return found, Settled(modes, broken, self.holding.copy())
            broken |= turns
        nowhere = replace(found, compression=np.full(len(found.compression), np.nan), determinant=np.nan)
        return nowhere, Settled(modes, broken, bounds)

    def _starting(self) -> tuple[np.ndarray, np.ndarray]:
        """(N,) int and (N,) bool, modes of the axles with which a search for them begins, and which have broken away at
        this instant before anything is looked at."""
        return self.axles.modes.copy(), self.axles.released != 0

    def _wrong(self, modes: np.ndarray, bounds: np.ndarray) -> np.ndarray:
        """(N,) bool, axles at rest whose mode is not theirs in the rates that were computed last."""
        asked, gains = np.abs(self.holding), modes * self.gains()
        too_much = asked - bounds > PASSED * self._rounding(bounds)
        against = gains < -MOVES * (np.abs(gains) + bounds)
        return self.axles.resting & np.where(modes == 0, too_much, against)

    def _rounding(self, bounds: np.ndarray) -> np.ndarray:
        """(N,) in N m, of what holds axles that take these torques at most."""
        return HELD_ROUNDINGS * EPS * (np.abs(self.holding) + bounds)

    def _refuse_unless_determined(self, settled: Settled, sums_of: SumsOf) -> None:
        """Raises GroundFailsError where loads and axles need not determine each other (rule 3)."""
        if self.grip.law == "viscous":
            return
        resting = self._undecided(settled, sums_of)
        if len(resting) > MOST:
            return
        ways = self._ways()
        carries = self.loads.carries
        shares = self.loads.springs.shares(carries)
        for choice in product((0, 1), repeat=len(resting)):
            modes = settled.modes.copy()
            modes[resting] = choice * ways[resting]
            self._put(modes, self.axles.sliding)
            found = carried(shares, carries, sums_of, self.loads.start, self.loads.arm)
            if not found.determinant > DETERMINED:
                self.loads.refuse(UNDETERMINED, found)

    def _undecided(self, settled: Settled, sums_of: SumsOf) -> np.ndarray:
        """Places of the axles at rest, which turn or stick."""
        return self.axles.resting_on_ground()

    def _ways(self) -> np.ndarray:
        """(N,) int, signs of the rates that axles would have if they turned, where that matters."""
        return np.ones(len(self.axles.modes), int)

    def _take(self, settled: Settled) -> None:
        """The modes of the axles at rest; one that has come to its bound goes where it has been let go (rule 4 of
        slipping_axles.py)."""
        axles, resting = self.axles, self.axles.resting
        released = axles.released
        at_bound = -released * settled.asked >= axles.sliding * (1 - AT_BOUND)
        let_go = resting & (settled.modes == 0) & (released != 0) & at_bound
        axles.modes = np.where(resting, np.where(let_go, released, settled.modes), axles.modes)
        axles.released = np.where(resting & settled.broken & (released == 0), settled.modes, released)
        axles.asked = np.where(axles.modes == 0, settled.asked, 0.0)
