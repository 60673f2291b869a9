"""An effect costs what its operations cost: by instructions, which no other program on the machine moves."""

import pytest

from .counting import missing
from .prices import prices, prices_of_events

pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(missing()), reason=f"counting needs {missing()}")]


DIFFERENT = ("motor", "axles that stick")  # `python -m costs.prices` has all


def test_effects_cost_what_their_operations_cost():
    """An evaluation at most 1.5 times the ratio of the operations, a phase at most three bare ones."""
    found = prices(DIFFERENT)
    over = {price.effect: price.of_evaluation / price.operations for price in found}
    assert {name: value for name, value in over.items() if value > 1.5} == {}
    assert {price.effect: price.of_phase for price in found if price.of_phase > 3} == {}


def test_knots_samples_and_limits_cost_at_most_one_and_a_half_phases():
    assert {name: price for name, price in prices_of_events().items() if price > 1.5} == {}
