"""Polynomials in Bernstein form, and the first moment at which one becomes positive."""

import numpy as np
import pytest
from scipy.integrate import DOP853
from scipy.interpolate import BPoly, PPoly

from omniroll.results.dense import bernstein_of_dop853, first_positive, value, values_at


def bernstein(power_coefficients):
    """Bernstein coefficients on [0, 1] of sum c_k x^k."""
    power_form = PPoly(np.array(power_coefficients[::-1])[:, None], [0, 1])
    return BPoly.from_power_basis(power_form).c[:, 0].tolist()


def from_roots(*roots, sign=1):
    return bernstein((sign * np.polynomial.Polynomial.fromroots(roots).coef).tolist())


def test_dop853_polynomial_is_the_solver_s_own():
    solver = DOP853(lambda t, y: np.array([y[1], -np.sin(y[0]) + 0.1 * t]), 0.0, [1.0, 0.3], 10.0, rtol=1e-6)
    for _ in range(3):
        solver.step()
    own = solver.dense_output()
    coefficients = bernstein_of_dop853(own.y_old, solver.y, own.F)
    times = np.linspace(solver.t_old, solver.t, 13)
    ours = BPoly(coefficients[:, None, :], [solver.t_old, solver.t])(times)
    np.testing.assert_allclose(ours, own(times).T, rtol=4e-15)
    assert (coefficients[0] == own.y_old).all() and (coefficients[-1] == solver.y).all()
    assert value(coefficients[:, 0].tolist(), 0.25) == pytest.approx(ours[3, 0], rel=1e-15)


@pytest.mark.parametrize(
    "coefficients, expected",
    [
        (from_roots(0.3), 0.3),
        (from_roots(0.3, sign=-1), 0.0),  # positive from the start
        (from_roots(-0.2, sign=-1), None),  # never
        (from_roots(0.3, 0.4, sign=-1), 0.3),  # out and in again: negative at both ends
        (from_roots(0.3, 0.3000001, sign=-1), 0.3),
        (from_roots(0.1, 0.5, 0.9), 0.1),  # three crossings
        (from_roots(0.0, 0.7), 0.7),  # starts on the bound, moving inwards
        (from_roots(0.0, 0.7, sign=-1), 0.0),  # starts on the bound, moving outwards
        (from_roots(0.0, 0.0, 0.5), 0.5),  # starts on it at rest, and stays inside
        (from_roots(0.5, 0.5, 2.0, sign=1), None),  # touches from inside
        (from_roots(1.0), None),  # arrives on the bound at the end
        ([0.0] * 8, None),
    ],
)
def test_first_positive(coefficients, expected):
    found = first_positive(coefficients)
    assert found == (expected if expected is None else pytest.approx(expected, abs=1e-7))


def test_first_positive_finds_random_first_roots():
    random = np.random.default_rng(1)
    for _ in range(200):
        roots = np.sort(random.uniform(-0.5, 1.5, 7))
        ahead = roots[roots > 0]
        # The leading coefficient is positive: the sign turns at every root.
        expected = 0.0 if len(ahead) % 2 == 0 else ahead[0] if ahead[0] < 1 else None
        found = first_positive(from_roots(*roots))
        assert found == (expected if expected is None else pytest.approx(expected, abs=1e-7))


def test_values_of_many_polynomials_are_those_one_by_one():
    random = np.random.default_rng(5)
    coefficients, x = random.normal(size=(40, 17, 3)), np.concatenate([[0.0, 1.0], random.uniform(size=38)])
    wanted = [[value(row[:, c], at) for c in range(3)] for row, at in zip(coefficients, x, strict=True)]
    found = values_at(coefficients, x)
    np.testing.assert_allclose(found, wanted, atol=1e-14)
    assert (found[0] == coefficients[0, 0]).all() and (found[1] == coefficients[1, -1]).all()
