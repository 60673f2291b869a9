"""The solver of all elements of friction at an instant: its forces obey the law, by formulas that are not its own."""

import numpy as np
import pytest
from scipy.optimize import linprog

from .mixtures import in_series, mixture, rolling
from .solver import ELLIPSE, INTERVAL, SLIPS, Element, Problem, law, library, solve

PUSHES = 10.0 ** np.linspace(-1.5, 0.5, 12)
KINDS = {
    "light rollers": lambda seed: mixture(seed, 3 + seed % 4, 1e-5, push=PUSHES[seed % 12]),
    "lighter rollers": lambda seed: mixture(seed, 3 + seed % 4, 1e-7, push=PUSHES[seed % 12]),
    "lightest rollers": lambda seed: mixture(seed, 3 + seed % 4, 1e-9, push=PUSHES[seed % 12]),
    "symmetric": lambda seed: mixture(seed, 3 + seed % 4, symmetric=True, all_at_rest=True, push=PUSHES[seed % 12]),
    "in series": lambda seed: in_series(seed, 3 + seed % 4, push=PUSHES[seed % 12]),
    "in series, symmetric": lambda seed: in_series(seed, 3 + seed % 4, symmetric=True, push=PUSHES[seed % 12]),
    "rolling": lambda seed: rolling(seed, 3 + seed % 4),
    "rolling, held": lambda seed: rolling(seed, 3 + seed % 4, fixed=True),
}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return library(tmp_path_factory.mktemp("friction"))


def broken_laws(built, make, count):
    """By how much the forces of problems break the law, and how many rounds they have taken."""
    laws, rounds = [], []
    for seed in range(count):
        problem = make(seed)
        found = solve(built, problem)
        assert found.status == 1 and np.isfinite(found.force).all() and np.isfinite(found.acceleration).all()
        laws.append(law(problem, found.force))
        rounds.append(found.iterations)
    return np.array(laws), max(rounds)


@pytest.mark.parametrize("kind", KINDS)
def test_forces_obey_the_law(built, kind):
    laws, rounds = broken_laws(built, KINDS[kind], 120)
    assert np.median(laws) < 2e-16 and laws.max() < 2e-14 and rounds <= 60


@pytest.mark.parametrize("beyond", [-1e-9, -1e-13, 0.0, 1e-13, 1e-9])
@pytest.mark.parametrize("seed", range(6))
def test_what_is_next_to_its_bound(built, seed, beyond):
    """All that is at rest comes to its bounds together: the push that it just holds, and next to it."""
    problem = mixture(seed, 3 + seed % 4, symmetric=True, all_at_rest=True, push=0.05)
    whole, given, _ = problem.whole()
    held = np.linalg.lstsq(whole, -given, rcond=None)[0]
    use, first = 0.0, 0
    for element in problem.whole()[2]:
        use = max(use, np.linalg.norm(held[first : first + element.rows] / np.array(element.size)))
        first += element.rows
    problem.given *= (1 + beyond) / use
    problem.apart_given *= (1 + beyond) / use
    found = solve(built, problem)
    assert law(problem, found.force) < 2e-14


def test_what_is_found_is_told(built):
    """States, accelerations and pulls say what the forces do."""
    for seed in range(40):
        problem = mixture(seed, push=PUSHES[seed % 12])
        matrix, given, elements = problem.whole()
        found = solve(built, problem)
        terms = np.abs(matrix) @ np.abs(found.force) + np.abs(given)
        assert (np.abs(found.acceleration - matrix @ found.force - given) <= 1e-14 * terms).all()
        first, count = 0, len(problem.elements)
        for i, element in enumerate(elements):
            rows = slice(first, first + element.rows)
            first += element.rows
            pull = found.pull[2 * i if i < count else count + i]
            if found.state[i] & SLIPS:
                assert np.linalg.norm(found.force[rows] / np.array(element.size)) == pytest.approx(1, abs=1e-15)
                power = -(found.acceleration[rows] @ found.force[rows])
                assert pull == pytest.approx(power, abs=1e-13 * terms[rows] @ np.abs(found.force[rows]))
            else:
                assert (np.abs(found.acceleration[rows]) <= 1e-13 * terms[rows].max()).all() and pull == 0


def test_a_strip_alone(built):
    """One contact whose roller lets go at a quarter of what the ground takes: closed forms."""
    element = Element(ELLIPSE, (1.0, 1.0), 0.25)
    for push, force, state in (
        ((0.1, 0.2), (-0.1, -0.2), 0),
        ((0.5, 0.2), (-0.25, -0.2), 2),
        ((0.1, 5.0), None, 1),
        ((5.0, 5.0), (-0.25, -np.sqrt(15) / 4), 3),
    ):
        found = solve(built, Problem([element], np.eye(2), np.array(push)))
        assert found.state[0] == state
        assert found.pull.sum() == pytest.approx(-found.acceleration @ found.force, rel=1e-15)
        if force is not None:
            assert np.allclose(found.force, force, rtol=0, atol=1e-15)
        else:
            assert np.allclose(found.force, -np.array(push) / np.hypot(*push), rtol=0, atol=1e-15)


def test_a_light_bearing_is_decided_in_few_rounds(built):
    """Pulled 2000 times as hard as it holds, beside a contact that sticks: a corrector behind a predictor's step that
    was cut short swung its force from bound to bound, for 60 rounds."""
    matrix = np.array([[244.0, -0.007, -0.035], [-0.007, 9.56, 3.85], [-0.035, 3.85, 2.49e7]])
    elements = [Element(ELLIPSE, (1.3, 1.3)), Element(INTERVAL, (1.8e-6,))]
    problem = Problem(elements, matrix, np.array([-2.45, 6.13, -9.54e4]))
    found = solve(built, problem)
    assert found.iterations <= 12 and law(problem, found.force) < 2e-14


def test_numbers_that_are_none_are_refused(built):
    for value in (np.nan, np.inf, -np.inf):
        for name in ("matrix", "given", "apart_given", "mobility"):
            problem = mixture(3)
            getattr(problem, name).flat[0] = value
            found = solve(built, problem)
            assert found.status == 0 and not found.force.any() and not found.acceleration.any()


def test_nothing_to_decide(built):
    """No element at all; elements that take no force; no push."""
    found = solve(built, Problem([], np.zeros((0, 0)), np.zeros(0)))
    assert found.status == 1 and found.residual == 0
    nothing = [Element(INTERVAL, (0.0,)), Element(ELLIPSE, (0.0, 0.0)), Element(ELLIPSE, (1.0, 1.0), 0.0)]
    problem = Problem(nothing, np.eye(5), np.array([1.0, 2.0, 3.0, 4.0, 0.5]))
    found = solve(built, problem)
    assert np.allclose(found.force, [0, 0, 0, 0, -0.5]) and np.allclose(found.acceleration, [1, 2, 3, 4, 0])
    still = mixture(5)
    still.given *= 0
    still.apart_given *= 0
    assert not solve(built, still).force.any()


def held_together(seed, boxes):
    """Elements that hold a load of three components, in more ways than one."""
    rng = np.random.default_rng(seed)
    elements = [
        Element(INTERVAL, (10 ** rng.uniform(-2, 0),))
        if boxes or rng.random() < 0.5
        else Element(ELLIPSE, tuple(10 ** rng.uniform(-1, 0, 2)))
        for _ in range(6)
    ]
    rows = sum(element.rows for element in elements)
    return elements, rng.standard_normal((3, rows)), rng.standard_normal(3)


def gauges(elements, force):
    starts = np.cumsum([0, *(element.rows for element in elements)])
    return [
        np.linalg.norm(force[first : first + element.rows] / np.array(element.size))
        for first, element in zip(starts, elements, strict=False)
    ]


def least_use_of_polygons(elements, equality, wanted, sides):
    """The least use where polygons around the ellipses take their places: a linear program."""
    rows, first = [], 0
    for element in elements:
        for angle in 2 * np.pi * np.arange(sides) / sides if element.rows == 2 else (0, np.pi):
            row = np.zeros(equality.shape[1] + 1)
            row[first : first + element.rows] = np.array([np.cos(angle), np.sin(angle)])[: element.rows] / element.size
            row[-1] = -1
            rows.append(row)
        first += element.rows
    cost = np.append(np.zeros(first), 1.0)
    equalities = np.hstack([equality, np.zeros((len(equality), 1))])
    return linprog(cost, np.array(rows), np.zeros(len(rows)), equalities, wanted, bounds=(None, None)).fun


@pytest.mark.parametrize("boxes", [True, False])
def test_least_use(built, boxes):
    for seed in range(30):
        elements, equality, wanted = held_together(seed, boxes)
        size = equality.shape[1]
        found = solve(built, Problem(elements, np.eye(size), np.zeros(size), equality, wanted), "friction_least_use")
        assert max(gauges(elements, found.force)) <= found.status * (1 + 1e-14)
        assert np.allclose(equality @ found.force, wanted, rtol=0, atol=1e-13)
        least = least_use_of_polygons(elements, equality, wanted, 400)
        assert least * (1 - 1e-9) <= found.status <= least * (1 + (1e-9 if boxes else 4e-5))


@pytest.mark.parametrize("boxes", [True, False])
def test_the_rate_of_the_least_use_is_that_of_a_little_later(built, boxes):
    for seed in range(30):
        elements, equality, wanted = held_together(seed, boxes)
        problem = Problem(elements, np.eye(equality.shape[1]), np.zeros(equality.shape[1]), equality, wanted)
        random, uses = np.random.default_rng(seed), []
        of_equality, of_wanted = random.normal(size=equality.shape), random.normal(size=len(wanted))
        found = solve(built, problem, "friction_least_use")
        rate = solve(built, problem, "friction_least_use", of_wanted - of_equality @ found.force).rate
        for time in (-1e-6, 1e-6):
            problem.equality, problem.wanted = equality + time * of_equality, wanted + time * of_wanted
            uses.append(solve(built, problem, "friction_least_use").status)
        assert rate == pytest.approx((uses[1] - uses[0]) / 2e-6, rel=1e-5, abs=1e-6)


def test_least_use_where_one_element_decides_alone(built):
    """Four wheels: the given part of a contact's force uses most, and what nothing pulls is rounding alone."""
    contacts, along = [Element(ELLIPSE, (0.54, 0.86))] * 4, (0.168, 0.85, -0.123, 0.005)
    bearings = [Element(INTERVAL, (size,)) for size in (0.71, 0.23, 0.74, 0.15)]
    equality, wanted = np.zeros((10, 12)), np.array([-0.042, -0.068, *along, 0.367, 0.0, -0.115, 0.0])
    equality[0, [1, 2, 5, 6]], equality[1, [1, 5]] = (0.15, 0.15, -0.15, -0.15), 0.08
    for k, (held, given) in enumerate([(1, 0), (2, 3), (5, 4), (6, 7)]):
        equality[2 + k, given] = equality[6 + k, 8 + k] = 1
        equality[6 + k, held] = -1
    problem = Problem(contacts + bearings, np.eye(12), np.zeros(12), equality, wanted)
    found = solve(built, problem, "friction_least_use")
    assert found.status == pytest.approx(0.85 / 0.86, rel=1e-14) and found.residual < 1e-14
    assert np.allclose(equality @ found.force, wanted, rtol=0, atol=1e-14)


def test_least_use_of_nothing(built):
    elements, equality, wanted = held_together(0, boxes=True)
    size = equality.shape[1]
    for asked, use in ((0 * wanted, 0.0), (np.nan * wanted, np.inf)):
        found = solve(built, Problem(elements, np.eye(size), np.zeros(size), equality, asked), "friction_least_use")
        assert found.status == use and not found.force.any()


@pytest.mark.parametrize("boxes", [True, False])
def test_least_norm(built, boxes):
    """Forces of least norm lie along the equalities, but where their sets hold them."""
    for seed in range(30):
        elements, equality, wanted = held_together(seed, boxes)
        size = equality.shape[1]
        problem = Problem(elements, np.eye(size), np.zeros(size), equality, wanted)
        problem.wanted = wanted * 0.9 / solve(built, problem, "friction_least_use").status
        found = solve(built, problem)
        assert found.status == 1 and max(gauges(elements, found.force)) <= 1 + 1e-14
        assert np.allclose(equality @ found.force, problem.wanted, rtol=0, atol=1e-13)
        inside = np.repeat([use < 1 - 1e-9 for use in gauges(elements, found.force)], [e.rows for e in elements])
        if inside.sum() >= 3:
            along = np.linalg.lstsq(equality.T[inside], -found.force[inside], rcond=None)[0]
            assert law(Problem(elements, np.eye(size), equality.T @ along), found.force) < 1e-11


def test_forces_that_are_not_unique_are_those_of_least_norm(built):
    for seed in range(40):
        problem = rolling(seed, 4)
        found = solve(built, problem)
        rests = found.state == 0
        rank = np.linalg.matrix_rank(problem.matrix[np.ix_(rests, rests)], tol=1e-10 * np.abs(problem.matrix).max())
        if rests.sum() == rank:
            continue
        assert not found.unique
        basis = np.linalg.svd(problem.matrix[np.ix_(rests, rests)])[0][:, :rank].T
        inside = rests & (np.abs(found.force) < np.array([e.size[0] for e in problem.elements]) * (1 - 1e-9))
        free = basis[:, inside[rests]]
        if inside.sum() < rank:
            continue
        along = np.linalg.lstsq(free.T, -found.force[inside], rcond=None)[0]
        elements = [element for element, rest in zip(problem.elements, rests, strict=True) if rest]
        assert law(Problem(elements, np.eye(rests.sum()), basis.T @ along), found.force[rests]) < 1e-10
