"""Sums that keep what their rounding leaves over, so that a million terms have the error of one."""

from typing import TypeVar

import numpy as np

Number = TypeVar("Number", float, np.ndarray)


def compensated_sum(start: Number, carry: Number, term: Number) -> tuple[Number, Number]:
    """start + carry + term rounded, and the rounding error (Knuth's two-sum)."""
    term = term + carry
    total = start + term
    part = total - start
    return total, (start - (total - part)) + (term - part)
