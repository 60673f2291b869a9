"""What ends a phase in which axles stick: the guards of the effects, and the facets of what the bearings can hold.

A facet's excess is no linear function of time and state as a guard is. On a step it is taken as the polynomial through
as many places as the step has coefficients, so that its first zero is found as that of a guard; then it is located on
the motion itself.
"""

import numpy as np

from omniroll.effects.guards import LANDED, PASSED, Guards
from omniroll.effects.sticking import Axles
from omniroll.kernels.kernel import Flow
from omniroll.results.dense import bernstein_through, values_at

PROBE = 1e-4  # of a step: over this time the rate of an excess is measured


class HoldingGuards:
    """The guards (m,) of a phase, then its facets (K,); what the integrator asks of Guards.

    guards      of the effects
    axles       in their modes
    flow        the rates of the phase
    held_force  (3,) where flow leaves the force that holds what sticks
    """

    def __init__(self, guards: Guards, axles: Axles, flow: Flow, held_force: np.ndarray):
        self.guards, self.axles, self.flow, self.held_force = guards, axles, flow, held_force
        self.probe = 1.0

    def __len__(self) -> int:
        return len(self.guards) + len(self.axles.facets.reach)

    def _facets(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(K,) excess of the facets, and its rounding."""
        self.flow(time, y)
        return self.axles.facets.excess(self.held_force), self.axles.facet_rounding(self.held_force)

    def values(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m + K,) values."""
        return np.concatenate([self.guards.values(time, y), self._facets(time, y)[0]])

    def beyond(self, time: float, y: np.ndarray) -> np.ndarray:
        """(m + K,) bool: passed."""
        excess, rounding = self._facets(time, y)
        return np.concatenate([self.guards.beyond(time, y), excess > PASSED * rounding])

    def waits(self, time: float, y: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m + K,) times until each becomes positive at its present rate, negative beyond; and their rounding."""
        waits, noise = self.guards.waits(time, y, rates)
        excess, rounding = self._facets(time, y)
        later, _ = self._facets(time + self.probe, y + self.probe * rates)
        rising = (later - excess) / self.probe
        with np.errstate(all="ignore"):
            own_waits = np.where(rising > 0, -excess / rising, np.inf)
            own_noise = np.where(rising > 0, LANDED * rounding / rising, 0.0)
        return np.concatenate([waits, own_waits]), np.concatenate([noise, own_noise])

    def margins(self, dense: np.ndarray, start: float, h: float) -> np.ndarray:
        """(d + 1, m + K) Bernstein coefficients on a step of the values less what counts as rounding."""
        self.probe = PROBE * h
        places = (1 - np.cos(np.pi * np.linspace(0, 1, len(dense)))) / 2
        states = values_at(np.broadcast_to(dense, (len(places), *dense.shape)), places)
        found = [self._facets(start + h * x, y) for x, y in zip(places, states, strict=True)]
        facets = np.array([excess - PASSED * rounding for excess, rounding in found])
        return np.concatenate([self.guards.margins(dense, start, h), bernstein_through(places, facets)], axis=1)
