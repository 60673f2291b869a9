"""What logs do not determine, in words, from Jacobians whose null directions are known."""

import numpy as np
import pytest

from omniroll.identification.determination import in_words, vague_directions

NAMES, SIZES = ("mass", "wheel_inertia", "roller_viscous"), (2.0, 1e-3, 1e-6)


def said(*known):
    """What is said where only the given combinations of relative changes are determined."""
    jacobian = np.concatenate([1e3 * np.array(known, float).reshape(-1, 3), 1e-6 * np.eye(3)])
    return [in_words(row, NAMES, SIZES) for row in vague_directions(jacobian)]


@pytest.mark.parametrize("known, words", [
    ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], []),
    ([[1, 0, 0], [0, 0, 1]], ["wheel_inertia: not determined"]),
    ([[1, 0, 0], [0, 1, -1]], ["wheel_inertia and roller_viscous only as their ratio"]),
    ([[1, 0, 0], [0, 1, 1]], ["wheel_inertia and roller_viscous only as their product"]),
    ([[1, -1, 0], [0, 1, -1]], ["mass, wheel_inertia and roller_viscous only as their ratios"]),
    # 2 m + 500 (1000 J): with the sizes 4 a + 0.5 b in relative changes a of m and b of J
    ([[4, 0.5, 0], [0, 0, 1]], ["mass and wheel_inertia only as mass + 250 wheel_inertia"]),
    ([[4, -0.5, 0], [0, 0, 1]], ["mass and wheel_inertia only as mass - 250 wheel_inertia"]),
])  # fmt: skip
def test_words(known, words):
    assert said(*known) == words


def test_two_directions_are_told_apart():
    """Mass alone, and the ratio of the other two; the SVD itself mixes them."""
    assert sorted(said([0, 1, -1])) == ["mass: not determined", "wheel_inertia and roller_viscous only as their ratio"]
