"""Loads and support polygon against enumeration of active sets and closed forms."""

from itertools import combinations

import numpy as np
import pytest

from omniroll.errors import InvalidValueError
from omniroll.vehicles.loads import SupportPolygon, contact_loads, refuse_collinear


def least_norm_by_enumeration(matrix, sums):
    """Of all sets of wheels that may carry, the shortest loads that are not negative; None where there are none."""
    count, best = matrix.shape[1], None
    for size in range(1, count + 1):
        for chosen in map(list, combinations(range(count), size)):
            loads = np.zeros(count)
            loads[chosen] = np.linalg.lstsq(matrix[:, chosen], sums, rcond=None)[0]
            fits = np.abs(matrix @ loads - sums).max() < 1e-11 and loads.min() > -1e-13
            if fits and (best is None or loads @ loads < best @ best - 1e-13):
                best = loads
    return best


@pytest.mark.parametrize("wheels", [4, 5, 7])
def test_loads_are_the_shortest_that_pull_on_no_contact(wheels):
    rng = np.random.default_rng(wheels)
    places = rng.normal(size=(wheels, 2))
    matrix = np.vstack([np.ones(wheels), places.T])
    sums = np.array([matrix @ rng.exponential(size=wheels) ** 4 for _ in range(40)])
    loads = contact_loads(places, sums)
    plain = sums @ np.linalg.pinv(matrix).T
    assert (plain.min(axis=1) < 0).sum() >= 5, "the sign must matter somewhere"
    for found, given in zip(loads, sums, strict=True):
        assert found == pytest.approx(least_norm_by_enumeration(matrix, given), abs=1e-10 * given[0])
    assert loads.min() >= -1e-12 * sums[:, 0].max()


def test_loads_of_a_tipping_vehicle_keep_their_balance():
    places = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1.0)])
    sums = np.array([10.0, 13.0, 2.0])  # pressure 1.3 along x, outside
    assert least_norm_by_enumeration(np.vstack([np.ones(4), places.T]), sums) is None
    loads = contact_loads(places, sums)
    assert loads.min() < 0
    assert np.vstack([np.ones(4), places.T]) @ loads == pytest.approx(sums, rel=1e-13)


def test_three_contacts_determine_the_loads():
    rng = np.random.default_rng(3)
    places, loads = rng.normal(size=(3, 2)), rng.normal(size=(6, 2, 3))
    sums = loads @ np.vstack([np.ones(3), places.T]).T
    assert contact_loads(places, sums) == pytest.approx(loads, rel=1e-11)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_loads_do_not_depend_on_the_unit_of_length(unit):
    places = unit * np.array([(1, 0), (0, 1), (-1, 0), (0, -1.0)])
    loads = contact_loads(places, np.array([4.0, unit, 0.0]))
    assert loads == pytest.approx([1.5, 1, 0.5, 1], rel=1e-12)


@pytest.mark.parametrize("places, word", [
    ([(0, 0), (1, 0)], "three wheels or more"),
    ([(0, 0), (1, 1), (3, 3)], "one line"),
    ([(0, 0), (1, 1e-12), (3, 0), (5, 0)], "one line"),
    ([(1, 2), (1, 2), (1, 2)], "one line"),
])  # fmt: skip
def test_contacts_that_cannot_stand_are_refused(places, word):
    with pytest.raises(InvalidValueError, match=word):
        refuse_collinear(np.array(places, float))


def test_margin_is_the_distance_to_the_edge():
    square = SupportPolygon.of(np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (0.2, 0.1)]))
    points = np.array([[(0, 0), (0.5, 0), (1, 0.3)], [(2, 0), (4, 5), (-1, -3)]], float)
    assert square.margin(points) == pytest.approx(np.array([[1, 0.5, 0], [-1, -5, -2]]))
