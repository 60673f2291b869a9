"""Kernels of mecanum wheels and of wheels with two rows of rollers, in the phases of a run.

The row that carries is that of the roller in contact: even numbers stand in the outer row. A wheel that stands on its
joint does not turn. Both are constants of a phase, so that each phase has a kernel of its own; one that was made
without them knows wheels that turn, of two rows their middle (kernel.IN_THE_MIDDLE). Other wheels have one kernel for
all phases.
"""

import copy
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omniroll.kernels.by_state import call_by_patterns
from omniroll.kernels.kernel import Kernel


class Carry(NamedTuple):
    """What carries a vehicle whose wheels may stand on their joint.

    contact  (..., N) int, the physical rollers in contact
    pivots   (..., N) 1 for a wheel that stands on its joint, else 0; None of other vehicles
    """

    contact: np.ndarray
    pivots: np.ndarray | None

    @classmethod
    def of_numbers(cls, numbers: np.ndarray, rollers_per_wheel: int) -> "Carry":
        """From the contacts' numbers as the compiled engine has them: the roller's, n more of wheels that stand, and
        2 n more for each piece before the one that carries."""
        return cls(numbers % rollers_per_wheel, numbers // rollers_per_wheel % 2)

    def at(self, some: Any) -> "Carry":
        """Some of the states."""
        return Carry(self.contact[some], None if self.pivots is None else self.pivots[some])


def kernel_in_phase(bound: Kernel, carry: Carry) -> Kernel:
    """The kernel with what carries in one state."""
    if not bound.has_phases:
        return bound
    sides, turns = np.where(carry.contact % 2, -1.0, 1.0), np.where(carry.pivots, 0.0, 1.0)
    return _in_phase(bound, tuple(sides.tolist()) if "rows" in bound.effects else (), tuple(turns.tolist()))


@lru_cache(maxsize=512)
def _in_phase(bound: Kernel, sides: tuple[float, ...], turns: tuple[float, ...]) -> Kernel:
    return bound.with_constants(({"sides": sides} if sides else {}) | {"turns": turns})


def call_in_phases(bound: Kernel, name: str, *values: ArrayLike, carry: Carry) -> Any:
    """A generated function of states each with what carries in it; `values` have its leading axes, or none."""
    if not bound.has_phases:
        return bound.call(name, *values)
    wheels = bound.wheels
    sides = carry.contact % 2 if "rows" in bound.effects else np.zeros_like(carry.contact)
    numbers = np.concatenate([sides, carry.pivots], axis=-1)
    return call_by_patterns(
        bound, name, values, numbers, lambda own: kernel_in_phase(bound, Carry(own[:wheels], own[wheels:]))
    )


def in_phases(bound: Kernel, carry: Carry) -> Kernel:
    """The kernel for states each with what carries in it: its functions take values with the leading axes of these."""
    if not bound.has_phases:
        return bound
    found = copy.copy(bound)
    found.call = partial(call_in_phases, bound, carry=carry)  # type: ignore[method-assign]
    return found
