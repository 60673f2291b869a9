"""The ground under a smooth law in a run whose loads follow the motion: contacts carry or are off, and none sticks."""

from collections.abc import Callable

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Grip
from omniroll.effects.ground_loads import Carried, Loads
from omniroll.effects.loaded_ground import LoadBalance
from omniroll.kernels.kernel import Flow, Kernel
from omniroll.vehicles.state import State


class SmoothGround:
    """The contacts in one run.

    load  (N,) in N, those of the last state
    off   (N,) bool: those that do not carry
    """

    def __init__(self, kernel: Kernel, grip: Grip, rates: BoundRates):
        self.kernel, self.grip = kernel, grip
        self.loads = Loads(kernel.vehicle.places(), grip.loads)
        self.balance = LoadBalance(kernel, grip.balance, rates.buffers)
        self.factor = rates.buffers["load_factor"]
        self.load, self.off = grip.loads, np.zeros(kernel.wheels, bool)

    def at_rest(self, state: State) -> State:
        """The state; no contact rests under such a law."""
        return state

    def moved(self) -> None:
        """Some time has passed."""
        self.loads.moved()

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,), which changes no contact at once."""

    def pass_guards(self, passed: np.ndarray) -> None:
        """Loads, (N,) bool, that have vanished, or that come back."""
        self.loads.pass_guards(passed[: len(self.off)])

    def sums_under(self, evaluate: Callable[[], object], carries: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """The sums that loads (N,) lead to, where `carries` (N,) bool; `evaluate` computes the rates."""

        def sums_of(loads: np.ndarray) -> np.ndarray:
            self.press(loads, carries)
            evaluate()
            return self.balance()

        return sums_of

    def press(self, loads: np.ndarray, carries: np.ndarray) -> None:
        """The rates have loads (N,), where `carries` (N,) bool."""
        self.factor[:] = self.grip.factor(loads, carries)

    def solve(self, evaluate: Callable[[], object], carries: np.ndarray) -> Carried:
        """The loads in a phase, in which `carries` (N,) bool; `evaluate` computes the rates."""
        return self.loads.solve(self.sums_under(evaluate, carries))

    def decide(self, evaluate: Callable[[], object]) -> None:
        """Which contacts carry in the phase that begins now; `evaluate` computes the rates at its start."""
        found = self.loads.decide(lambda carries: self.sums_under(evaluate, carries), self.grip.law != "viscous")
        self.off = ~self.loads.carries
        self.load = np.maximum(found.loads, 0.0)


class SmoothFlow:
    """The rates f(time, y) -> y' of a phase; after a call `carried` are the loads of the state."""

    def __init__(self, ground: SmoothGround, plain: Flow):
        self.ground, self.plain = ground, plain

    def in_row(self, time: float, y: np.ndarray) -> None:
        """Evaluates the rates under the forces that a row says."""
        self(time, y)

    def __call__(self, time: float, y: np.ndarray) -> np.ndarray:
        ground = self.ground
        carries = ground.loads.carries
        self.carried = ground.solve(lambda: self.plain(time, y), carries)
        ground.load = np.maximum(self.carried.loads, 0.0)
        ground.press(self.carried.loads, carries)
        return self.plain(time, y)
