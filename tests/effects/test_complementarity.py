"""The complementarity problem of bearings at rest, against linear programming and the conditions of its optimum."""

import numpy as np
import pytest
from scipy.optimize import linprog

from omniroll.effects.complementarity import (
    Facets,
    allowed_by,
    directions_allowed,
    facet_normals,
    least_torques,
    nearest_force,
    span,
)

CASES = range(20)


def case(seed):
    """Rows (m, 3), bounds (m,), a mass matrix and a force; every third has rows that depend on each other."""
    rng = np.random.default_rng(seed)
    bearings = int(rng.integers(1, 9))
    rows = rng.normal(size=(bearings, 3))
    if seed % 3 == 0:
        rows = np.round(rows)
        rows = rows[np.abs(rows).max(axis=1) > 0] if rows.any() else np.eye(3)
    bounds = np.ones(len(rows)) if seed % 5 == 0 else rng.uniform(0.3, 2, len(rows))
    root = rng.normal(size=(3, 3))
    force = rng.normal(size=3) * rng.choice([0.3, 1.0, 3.0, 10.0])
    return rows, bounds, root @ root.T + 0.1 * np.eye(3), force


def load(force, rows, bounds):
    """The least part of their bounds with which torques give the force, by linear programming; inf where none do."""
    count = len(rows)
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_eq=np.column_stack([rows.T, np.zeros(3)]),
        b_eq=force,
        A_ub=np.block([[np.eye(count), -bounds[:, None]], [-np.eye(count), -bounds[:, None]]]),
        b_ub=np.zeros(2 * count),
        bounds=[(None, None)] * count + [(0, None)],
    )
    return found.fun if found.status == 0 else np.inf


@pytest.mark.parametrize("seed", CASES)
def test_the_accelerations_obey_the_law(seed):
    """M nu' - f is what the torques make; each is within its bound, and all of it against what moves."""
    rows, bounds, mass_matrix, force = case(seed)
    nu_dot, torques = nearest_force(mass_matrix, force, rows, bounds)
    np.testing.assert_allclose(mass_matrix @ nu_dot - force, rows.T @ torques, atol=1e-12 * np.abs(force).max())
    assert (np.abs(torques) <= bounds).all()
    rates = rows @ nu_dot
    missed = bounds * np.abs(rates) + torques * rates
    assert np.abs(missed).max() <= 1e-12 * np.abs(force).max() * max(1, np.abs(nu_dot).max())


@pytest.mark.parametrize("seed", CASES)
def test_rest_is_held_exactly_if_admissible_torques_exist(seed):
    """The facets against linear programming, which looks for the torques themselves."""
    rows, bounds, _, force = case(seed)
    force = span(rows).T @ span(rows) @ force  # bearings of few directions hold no other force
    wanted = load(force, rows, bounds)
    facets = Facets.of(rows, bounds)
    found = (facets.normals @ force / facets.reach).max()
    assert found == pytest.approx(wanted, rel=1e-8)
    assert (facets.excess(force).max() > 0) == (wanted > 1)


@pytest.mark.parametrize("seed", CASES)
def test_the_least_torques_are_the_least(seed):
    """The condition of the optimum: torques are rows . z, cut off at the bounds, for one z (3,)."""
    rows, bounds, _, force = case(seed)
    force = span(rows).T @ span(rows) @ force
    force *= 0.9 / max(load(force, rows, bounds), 1e-3)
    torques = least_torques(force, rows, bounds)
    np.testing.assert_allclose(rows.T @ torques, force, atol=1e-10 * np.abs(rows).max() * bounds.max())
    assert (np.abs(torques) <= bounds).all()
    inside = np.abs(torques) < bounds * (1 - 1e-12)
    # z is not unique where the rows inside do not span all three: then any of linear programming's will do
    count = len(rows)
    side = -np.sign(torques)[:, None] * rows
    found = linprog(
        np.zeros(3),
        A_eq=rows[inside] if inside.any() else None,
        b_eq=torques[inside] if inside.any() else None,
        A_ub=side[~inside] if (~inside).any() else None,
        b_ub=-bounds[~inside] * (1 - 1e-8) if (~inside).any() else None,
        bounds=[(None, None)] * 3,
    )
    assert count == 0 or found.status == 0


def test_what_is_allowed_leaves_the_rates_at_zero():
    rows = np.array([[1.0, 2.0, 0.5], [2.0, 4.0, 1.0]])  # parallel
    allowed = allowed_by(rows)
    np.testing.assert_allclose(allowed @ allowed, allowed, atol=1e-15)
    assert np.abs(rows @ allowed).max() < 1e-14 and np.trace(allowed) == pytest.approx(2)
    assert (allowed_by(np.eye(3)) == 0).all() and (allowed_by(rows[:0]) == np.eye(3)).all()


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_directions_span_what_is_allowed(count):
    rows, _, mass_matrix, _ = case(1)
    columns = directions_allowed(rows[:count], mass_matrix)
    assert np.abs(rows[:count] @ columns).max(initial=0) < 1e-14
    wanted = np.diag((np.arange(3) < 3 - count).astype(float))
    np.testing.assert_allclose(columns.T @ mass_matrix @ columns, wanted, atol=1e-13)


@pytest.mark.parametrize("count", [0, 1])
def test_directions_where_rounding_has_made_the_matrix_indefinite(count):
    rows, _, mass_matrix, _ = case(1)
    heavy = 1e20 * np.outer(rows[0] + rows[1], rows[0] + rows[1]) + mass_matrix - 1e5 * np.eye(3)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(heavy)
    columns = directions_allowed(rows[:count], heavy)
    assert np.isfinite(columns).all() and np.linalg.matrix_rank(columns) == 3 - count
    assert np.abs(rows[:count] @ columns).max(initial=0) < 1e-14 * np.abs(columns).max()


def test_one_facet_for_each_pair_of_directions():
    angles = np.linspace(0, 2 * np.pi, 5)[:-1] + 0.3
    rows = np.column_stack([np.sin(angles), -np.cos(angles), np.ones(4)])
    normals = facet_normals(rows)
    assert len(normals) == 2 * 6
    assert (np.count_nonzero(np.abs(rows @ normals.T) < 1e-14, axis=0) >= 2).all()
