"""One step of a Radau IIA method with seven stages, with a polynomial of degree 7: for motions with parts that decay
far faster than the rest moves, such as the slip on a ground whose friction is strong.

The polynomial through the start has the rates' values at the nodes of Radau, the last of which is the step's end
(Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5). At the end the order is 13. Steps can be as long
as the slow motion allows, since what decays fast is damped however long the step is. SciPy's Radau has three stages and
order 5.

The stages are found by Newton's rule with the slopes of the rates at the start, and with those at the nodes where these
do not serve.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from omniroll.engine import directed
from omniroll.engine.compensated_sum import compensated_sum
from omniroll.engine.differences import slopes
from omniroll.engine.nodes import AT_REST, CONTRACTS, ITERATIONS, NODES, RENEWALS, ROUNDED, STAGES, WEIGHTS, RadauStep

MOVED = 1e-7  # of a component, for the slopes by differences


@dataclass
class Slopes:
    """The slopes (d, d) of the rates in y, by differences."""

    time: float
    y: np.ndarray
    matrix: np.ndarray

    @classmethod
    def at(cls, flow: Callable, time: float, y: np.ndarray, rates: np.ndarray) -> "Slopes":
        return cls(time, y, slopes(flow, time, y, rates, MOVED * np.maximum(1.0, np.abs(y))))


class Steps:
    """Makes steps; the slopes at a start serve all steps that are tried from there.

    Where forces have directions that slips must follow (flow.turning of omniroll.effects.ground_flow), the steps are
    of directed.py.
    """

    def __init__(self) -> None:
        self.slopes: Slopes | None = None
        self.flow: Callable | None = None

    def __call__(
        self, flow: Callable, time: float, y: np.ndarray, rates: np.ndarray, h: float, carry: np.ndarray
    ) -> "Step":
        if len(getattr(flow, "turning", ())):
            return directed.Step(flow, time, y, rates, h, carry)
        spent = 0
        if self.flow is not flow or self.slopes is None or self.slopes.y is not y or self.slopes.time != time:
            self.flow, self.slopes = flow, Slopes.at(flow, time, y, rates)
            spent = len(y)
        return Step(flow, time, y, rates, h, carry, self.slopes.matrix, spent)


@dataclass
class Step(RadauStep):
    """A step of length h from (time, y), where the rates are `rates`, to y_end, where they are rates_end.

    carry is what the rounding of y has left over, and carry_end that of y_end. matrix (d, d) are slopes of the rates.
    """

    flow: Callable[[float, np.ndarray], np.ndarray]
    time: float
    y: np.ndarray
    rates: np.ndarray
    h: float
    carry: np.ndarray
    matrix: np.ndarray
    evaluations: int

    def __post_init__(self) -> None:
        self.converged = self._solve()
        self.y_end, self.carry_end = compensated_sum(self.y, self.carry, self.h * (WEIGHTS[-1] @ self.stages))
        self.rates_end = self.flow(self.time + self.h, self.y_end)
        self.evaluations += 1

    def _solve(self) -> bool:
        """The rates at the nodes; whether the iteration has come to rest."""
        self.stages = np.tile(self.rates, (STAGES, 1))
        solve = self._linear([self.matrix] * STAGES)
        scale, last, renewed = np.abs(self.y) + self.h * np.abs(self.rates) + 1.0, np.inf, 0
        for _ in range(ITERATIONS):
            places = self.y + self.h * (WEIGHTS @ self.stages)
            found = self._rates_at_nodes(places)
            if solve is None or not np.isfinite(found).all():
                return False
            correction = solve(found - self.stages)
            self.stages += correction
            moved = float((np.abs(self.h * (WEIGHTS @ correction)) / scale).max())
            if moved <= AT_REST:
                return True
            if moved > CONTRACTS * last:
                if renewed == RENEWALS or moved <= ROUNDED:
                    return moved <= ROUNDED
                # The slopes change along the step: those at the nodes serve.
                solve, renewed = self._linear(self._slopes_at_nodes(places, found)), renewed + 1
            last = moved
        return last <= ROUNDED

    def _rates_at_nodes(self, places: np.ndarray) -> np.ndarray:
        self.evaluations += STAGES
        return np.array([self.flow(self.time + c * self.h, p) for c, p in zip(NODES, places, strict=True)])

    def _slopes_at_nodes(self, places: np.ndarray, rates: np.ndarray) -> list[np.ndarray]:
        self.evaluations += STAGES * len(self.y)
        nodes = zip(NODES, places, rates, strict=True)
        return [Slopes.at(self.flow, self.time + c * self.h, y, rate).matrix for c, y, rate in nodes]

    def _linear(self, slopes: list[np.ndarray]) -> Callable[[np.ndarray], np.ndarray] | None:
        """Newton's correction (s, d) of the rates for what is missing of them (s, d), by the slopes at the nodes."""
        size = len(self.y)
        blocks = -self.h * np.einsum("ij,jab->iajb", WEIGHTS, np.array(slopes))
        system = np.eye(STAGES * size) + blocks.reshape(STAGES * size, STAGES * size)
        if not np.isfinite(system).all():
            return None
        factors = lu_factor(system, check_finite=False)
        return lambda missing: lu_solve(factors, missing.ravel(), check_finite=False).reshape(STAGES, size)

    @cached_property
    def _error(self) -> np.ndarray:
        """(d,) the defect, damped as the step is."""
        return np.linalg.solve(np.eye(len(self.y)) - self.h * NODES[0] * self.matrix, self._defect)
