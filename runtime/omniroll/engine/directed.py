"""A step of the Radau IIA method of radau.py for contacts that slip under Coulomb's friction, in polar form.

The force of such a contact depends on the direction of its slip alone, which turns the faster the slower the slip is,
and where the slip begins or ends has no derivative. So the directions at the nodes are unknowns beside the rates:

  y' = f(t, y, directions),   0 = the slips across their directions.

The second equation is as regular where the slip is zero as elsewhere: through the first the slips follow the
directions. It is an equation of index 2, for which the method is made (Hairer and Wanner, Solving Ordinary
Differential Equations II, VII.4). Where nothing is at rest the solution is that of radau.Step.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from omniroll.effects.ground_flow import GroundFlow
from omniroll.engine.compensated_sum import compensated_sum
from omniroll.engine.nodes import AT_REST, CONTRACTS, ITERATIONS, NODES, RENEWALS, ROUNDED, STAGES, WEIGHTS, RadauStep


@dataclass
class Step(RadauStep):
    """A step of length h from (time, y), where the rates are `rates`, to y_end, where they are rates_end.

    carry is what the rounding of y has left over, and carry_end that of y_end.
    """

    flow: GroundFlow
    time: float
    y: np.ndarray
    rates: np.ndarray
    h: float
    carry: np.ndarray
    evaluations: int = 0

    def __post_init__(self) -> None:
        self.stages = np.tile(self.rates, (STAGES, 1))
        self.angles = np.tile(self.flow.angles(self.y), (STAGES, 1))
        self.converged = self._solve()
        self.y_end, self.carry_end = compensated_sum(self.y, self.carry, self.h * (WEIGHTS[-1] @ self.stages))
        self.rates_end = self.flow.directed(self.time + self.h, self.y_end, self.angles[-1])
        self.evaluations += 1

    def _solve(self) -> bool:
        """The rates and the directions at the nodes; whether the iteration has come to rest."""
        scale, last, renewed, solve = np.abs(self.y) + self.h * np.abs(self.rates) + 1.0, np.inf, 0, None
        for _ in range(ITERATIONS):
            places = self.y + self.h * (WEIGHTS @ self.stages)
            missing, across, along = self._missing(places)
            if solve is None:
                solve = self._linear(places, along)
            if solve is None or not np.isfinite(missing).all():
                return False
            correction, turn = solve(missing, across)
            self.stages += correction
            self.angles += turn
            moved = float((np.abs(self.h * (WEIGHTS @ correction)) / scale).max())
            if moved <= AT_REST:
                return self.flow.are_ahead(places, self.angles, along)
            if moved > CONTRACTS * last:
                if renewed == RENEWALS or moved <= ROUNDED:
                    return moved <= ROUNDED and self.flow.are_ahead(places, self.angles, along)
                solve, renewed = None, renewed + 1
            last = moved
        return last <= ROUNDED and self.flow.are_ahead(places, self.angles, along)

    def _times(self) -> np.ndarray:
        return self.time + NODES * self.h

    def _missing(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(s, d) of the rates, and (s, m) the slips across and along the directions."""
        self.evaluations += STAGES
        nodes = list(zip(self._times(), places, self.angles, strict=True))
        rates = np.array([self.flow.directed(time, y, angles) for time, y, angles in nodes])
        slips = np.array([self.flow.along_and_across(y, angles) for _, y, angles in nodes])
        return rates - self.stages, slips[:, 1], slips[:, 0]

    def _linear(self, places: np.ndarray, along: np.ndarray):
        """Newton's correction of the rates (s, d) and the directions (s, m), by the slopes in the middle of the step
        and by the slips at the nodes. A slip that has not begun says nothing about the direction of a contact that all
        others keep from going across: it counts as its rounding."""
        least = self.flow.rounding()[self.flow.turning]
        along = np.where(np.abs(along) < least, least, along)
        size, turning = len(self.y), self.angles.shape[1]
        middle = STAGES // 2
        self.evaluations += size + turning + 1
        by_state, by_angle, across = self.flow.slopes(self._times()[middle], places[middle], self.angles[middle])
        whole = STAGES * (size + turning)
        system = np.zeros((whole, whole))
        rates, angles = slice(0, STAGES * size), slice(STAGES * size, whole)
        system[rates, rates] = np.eye(STAGES * size) - self.h * np.kron(WEIGHTS, by_state)
        system[rates, angles] = -np.kron(np.eye(STAGES), by_angle)
        system[angles, rates] = np.kron(WEIGHTS, across)
        system[angles, angles] = -np.diag(along.ravel()) / self.h
        if not np.isfinite(system).all():
            return None
        factors = lu_factor(system, check_finite=False)

        def solve(missing: np.ndarray, slips: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            found = lu_solve(factors, np.concatenate([missing.ravel(), -slips.ravel() / self.h]), check_finite=False)
            return found[rates].reshape(STAGES, size), found[angles].reshape(STAGES, turning)

        return solve
