"""One step of Dormand and Prince's method of order 8, with a polynomial of degree 7: the coefficients are SciPy's."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np
from scipy.integrate import DOP853

from omniroll.results.dense import bernstein_of_dop853

STAGES = 12  # evaluations of a step
FURTHER = 3  # evaluations of its polynomial
Number = TypeVar("Number", float, np.ndarray)


@dataclass
class Step:
    """A step of length h from (time, y), where the rates are `rates`, to y_end, where they are rates_end.

    carry is what the rounding of y has left over, and carry_end that of y_end.
    """

    flow: Callable[[float, np.ndarray], np.ndarray]
    time: float
    y: np.ndarray
    rates: np.ndarray
    h: float
    carry: np.ndarray
    order: ClassVar[int] = 8
    evaluations: ClassVar[int] = STAGES
    further: ClassVar[int] = FURTHER  # of the polynomial

    def __post_init__(self) -> None:
        self.stages = np.empty((STAGES + 1, len(self.y)))
        self.stages[0] = self.rates
        for k in range(1, STAGES):
            self.stages[k] = self._rates_at(DOP853.C[k], DOP853.A[k, :k], self.stages)
        gained = self.h * (DOP853.B @ self.stages[:STAGES])
        self.y_end, self.carry_end = compensated_sum(self.y, self.carry, gained)
        self.rates_end = self.stages[STAGES] = self.flow(self.time + self.h, self.y_end)

    def _rates_at(self, part: float, weights: np.ndarray, stages: np.ndarray) -> np.ndarray:
        return self.flow(self.time + part * self.h, self.y + self.h * (weights @ stages[: len(weights)]))

    def error(self, scale: np.ndarray) -> float:
        """The size of the local error in units of `scale` (d,), from those of the embedded methods of order 5 and 3."""
        of_five = np.sum((DOP853.E5 @ self.stages / scale) ** 2)
        of_three = np.sum((DOP853.E3 @ self.stages / scale) ** 2)
        both = of_five + 0.01 * of_three
        return float(self.h * of_five / np.sqrt(both * len(scale))) if both != 0 else 0.0

    def polynomial(self) -> np.ndarray:
        """Bernstein coefficients (8, d)."""
        stages = np.concatenate([self.stages, np.empty((FURTHER, len(self.y)))])
        for k in range(FURTHER):
            place = STAGES + 1 + k
            stages[place] = self._rates_at(DOP853.C_EXTRA[k], DOP853.A_EXTRA[k, :place], stages)
        moved = self.y_end - self.y
        nested = [moved, self.h * self.rates - moved, 2 * moved - self.h * (self.rates_end + self.rates)]
        return bernstein_of_dop853(self.y, self.y_end, np.array([*nested, *(self.h * (DOP853.D @ stages))]))


def compensated_sum(start: Number, carry: Number, term: Number) -> tuple[Number, Number]:
    """start + carry + term rounded, and the rounding error (Knuth's two-sum): a sum of a million terms that carries it
    on has the error of one."""
    term = term + carry
    total = start + term
    part = total - start
    return total, (start - (total - part)) + (term - part)
