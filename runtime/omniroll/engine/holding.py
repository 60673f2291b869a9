"""What ends a phase in which something sticks: the guards of the effects, and functions of the motion, such as the
facets of what the bearings of axles can hold.

A facet's excess is no linear function of time and state as a guard is. On a step it is taken as the polynomial through
as many places as the step has coefficients, so that its first zero is found as that of a guard; then it is located on
the motion itself.
"""

from abc import ABC, abstractmethod

import numpy as np

from omniroll.effects.guards import LANDED, PASSED, Guards
from omniroll.effects.massless_rollers import MasslessRollers
from omniroll.effects.slipping_axles import SlippingAxles
from omniroll.effects.slipping_rollers import SlippingRollers
from omniroll.effects.state_vector import StateVector
from omniroll.effects.sticking import Axles
from omniroll.effects.sticking_bearings import StickingBearings
from omniroll.kernels.kernel import Flow
from omniroll.results.dense import bernstein_through, values_at

START = 1e-6  # of the largest spin in a step: a roller that is slower at its start begins to turn
PROBE = 1e-4  # of a step: over this time the rate of an excess is measured


class MotionGuards(ABC):
    """The guards (m,) of a phase, then K functions of its motion; what the integrator asks of Guards."""

    def __init__(self, guards: Guards, count: int):
        self.guards, self.count = guards, count
        self.probe = 1.0

    def __len__(self) -> int:
        return len(self.guards) + self.count

    @abstractmethod
    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(K,) the functions' values, and their rounding."""

    def _rising(self, time: float, y: np.ndarray, rates: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(K,) their rates."""
        return (self._own(time + self.probe, y + self.probe * rates)[0] - values) / self.probe

    def _missed(self, values: np.ndarray) -> np.ndarray | float:
        """(K,) what the polynomial through values (P, K) at places of a step may miss by more than rounding."""
        return 0.0

    def longest_step(self, time: float, y: np.ndarray, rates: np.ndarray) -> float:
        """The time that a step from here may last."""
        return self.guards.longest_step(time, y, rates)

    def values(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m + K,) values."""
        return np.concatenate([self.guards.values(time, y), self._own(time, y)[0]])

    def beyond(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m + K,) bool: passed."""
        values, rounding = self._own(time, y)
        return np.concatenate([self.guards.beyond(time, y), values > PASSED * rounding])

    def waits(self, time: float, y: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m + K,) times until each becomes positive at its present rate, negative beyond; and their rounding."""
        waits, noise = self.guards.waits(time, y, rates)
        values, rounding = self._own(time, y)
        rising = self._rising(time, y, rates, values)
        with np.errstate(all="ignore"):
            own_waits = np.where(rising > 0, -values / rising, np.inf)
            own_noise = np.where(rising > 0, LANDED * rounding / rising, 0.0)
        return np.concatenate([waits, own_waits]), np.concatenate([noise, own_noise])

    def margins(self, dense: np.ndarray, start: float, h: float) -> np.ndarray:
        """(d + 1, m + K) Bernstein coefficients on a step of the values less what counts as rounding."""
        self.probe = PROBE * h
        places = (1 - np.cos(np.pi * np.linspace(0, 1, len(dense)))) / 2
        states = values_at(np.broadcast_to(dense, (len(places), *dense.shape)), places)
        found = [self._own(start + h * x, y) for x, y in zip(places, states, strict=True)]
        values, rounding = (np.array(numbers) for numbers in zip(*found, strict=True))
        own = values - PASSED * rounding - self._missed(values)
        return np.concatenate([self.guards.margins(dense, start, h), bernstein_through(places, own)], axis=1)


class HoldingGuards(MotionGuards):
    """The guards of a phase, then the facets (K,) of what the axles that stick can hold.

    guards      of the effects
    axles       in their modes
    flow        the rates of the phase
    held_force  (3,) where flow leaves the force that holds what sticks
    """

    def __init__(self, guards: Guards, axles: Axles, flow: Flow, held_force: np.ndarray):
        super().__init__(guards, len(axles.facets.reach))
        self.axles, self.flow, self.held_force = axles, flow, held_force

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.flow(time, y)
        return self.axles.facets.excess(self.held_force), self.axles.facet_rounding(self.held_force)


class SlippingAxleGuards(MotionGuards):
    """The guards of a phase, then what the axles (S,) that stick where wheels may slip are asked for beyond what they
    take.

    guards   of the effects, and of axles that turn
    axles    in their modes
    flow     the rates of the phase
    holding  (N,) where flow leaves the torques that hold what sticks
    """

    def __init__(self, guards: Guards, axles: SlippingAxles, flow: Flow, holding: np.ndarray):
        super().__init__(guards, int((axles.modes == 0).sum()))
        self.axles, self.flow, self.holding = axles, flow, holding

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.flow(time, y)
        return self.axles.excess(self.holding)


class SlippingRollerGuards(MotionGuards):
    """The guards of a phase, then of each roller (N n,) where wheels may slip how far it is beyond the end of its mode.

    guards   of the effects and of axles
    rollers  in their modes
    flow     the rates of the phase
    layout   of y
    """

    def __init__(self, guards: Guards, rollers: SlippingRollers, flow: Flow, layout: StateVector):
        super().__init__(guards, rollers.modes.size)
        self.rollers, self.flow, self.layout = rollers, flow, layout

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.flow(time, y)
        speeds = (self.layout.view(y, name) for name in ("nu", "chi", "contact_omega", "axial"))
        return self.rollers.excess(self.rollers.spins(*speeds))

    def _missed(self, values: np.ndarray) -> np.ndarray:
        """A roller that has just begun to turn is as slow at first as its spin's polynomial is wrong."""
        starts = (self.rollers.modes.ravel() != 0) & (np.abs(values[0]) <= START * np.abs(values).max(axis=0))
        return np.where(starts, START * np.abs(values).max(axis=0), 0.0)


class MasslessRollerGuards(MotionGuards):
    """The guards of a phase, then of each massless roller in contact (N,) where wheels may slip how far it is beyond
    the end of its mode.

    guards   of the effects and of axles
    rollers  in their modes
    """

    def __init__(self, guards: Guards, rollers: MasslessRollers):
        super().__init__(guards, len(rollers.modes))
        self.rollers = rollers

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.rollers.excess(y)

    def _missed(self, values: np.ndarray) -> np.ndarray:
        """A roller whose mode has just begun is as near to its end at first as the polynomial is wrong."""
        most = START * np.abs(values).max(axis=0)
        return np.where(np.abs(values[0]) <= most, most, 0.0)


class BearingGuards(MotionGuards):
    """The guards of a phase, then what the bearings that stick can take where rollers stick: facets, and free rollers.

    guards    of the effects, and of bearings that turn
    bearings  in their modes
    flow      the rates of the phase
    """

    def __init__(self, guards: Guards, bearings: StickingBearings, flow: Flow):
        super().__init__(guards, len(bearings.facets.reach) + len(bearings.stuck_free))
        self.bearings, self.flow = bearings, flow

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.flow(time, y)
        return self.bearings.excess(self.flow.rows)
