"""Tables of collocation on [0, 1] for the compiled engine, in multiprecision: with the nodes of Gauss, and with those
of Radau, the last of which is 1, for motions with parts that decay far faster than the rest moves.

With nodes c_1 ... c_s (zeros of the Legendre polynomial P_s, or of P_s - P_(s-1), moved to [0, 1]) and weights b_m, a
polynomial of degree below s that has the values f_m at the nodes is sum_k a_k P_k(2x - 1) with
a_k = (2k + 1) sum_m b_m P_k(2c_m - 1) f_m; that gives its integrals and its values anywhere. (Hairer, Norsett, Wanner:
Solving Ordinary Differential Equations I, II.7; Hairer and Wanner, II, IV.5 and IV.8.)
"""

from dataclasses import dataclass, replace
from itertools import pairwise

from mpmath import cos, legendre, mp, mpf, nstr, pi, workdps

DIGITS = 60
SHOWN = 20  # digits of a table's number: more than any double keeps


@dataclass(frozen=True)
class Quadrature:
    """The tables, as text. A matrix is a list of columns: column m is what multiplies the value at node m.

    eigen  what makes the integrals to the nodes diagonal
    """

    nodes: list[str]
    weights: list[str]
    start: list[str]  # value at 0 from the values at the nodes
    end: list[str]  # value at 1
    end_slope: list[str]  # derivative at 1
    integral: list[list[str]]  # integral from 0 to node j
    legendre: list[list[str]]  # coefficients a_k
    slope: list[list[str]]  # derivative at node j
    last: list[list[str]]  # the rows of the last two coefficients
    eigen: "Eigen | None" = None


@dataclass(frozen=True)
class Eigen:
    """The integrals to the nodes are V diag(value) V^-1, in pairs of conjugates: of each pair one stands here.

    For values f at the nodes, w = V^-1 f of these has the real parts `to_real` f and `to_imaginary` f, and
    f = Re(2 sum of the columns of V times w) is `from_real` Re w + `from_imaginary` Im w. All matrices by columns.
    """

    real: list[str]
    imaginary: list[str]
    to_real: list[list[str]]
    to_imaginary: list[list[str]]
    from_real: list[list[str]]
    from_imaginary: list[list[str]]


def gauss(count: int) -> Quadrature:
    """The tables for `count` nodes of Gauss."""
    with workdps(DIGITS):
        roots = [_root(count, k) for k in range(count)][::-1]
        weights = [1 / ((1 - z * z) * _derivative(count, z) ** 2) for z in roots]
        return replace(_tables(roots, weights), eigen=_eigen(_integrals(roots, weights)))


def radau(count: int) -> Quadrature:
    """The tables for an even number of nodes of Radau."""
    with workdps(DIGITS):
        roots = [*_inner_radau_roots(count), mpf(1)]
        weights = [(1 + z) / (2 * (count * legendre(count - 1, z)) ** 2) for z in roots]
        return replace(_tables(roots, weights), eigen=_eigen(_integrals(roots, weights)))


def _columns(roots: list[mpf], weights: list[mpf]) -> list[list[mpf]]:
    """The coefficients a_k of the polynomials that are 1 at one node and 0 at the others."""
    count = len(roots)
    return [[(2 * k + 1) * b * legendre(k, z) for k in range(count)] for b, z in zip(weights, roots, strict=True)]


def _integrals(roots: list[mpf], weights: list[mpf]) -> list[list[mpf]]:
    """Of these polynomials from 0 to each node."""
    areas = [[_area(k, z) for k in range(len(roots))] for z in roots]
    return [[mp.fdot(column, area) for area in areas] for column in _columns(roots, weights)]


def _tables(roots: list[mpf], weights: list[mpf]) -> Quadrature:
    count, columns = len(roots), _columns(roots, weights)
    slope = [[mp.fdot(column, [2 * _derivative(k, z) for k in range(count)]) for z in roots] for column in columns]
    start = [mp.fdot(column, [(-1) ** k for k in range(count)]) for column in columns]
    end_slope = [mp.fdot(column, [k * (k + 1) for k in range(count)]) for column in columns]
    return Quadrature(
        nodes=_texts((1 + z) / 2 for z in roots),
        weights=_texts(weights),
        start=_texts(start),
        end=_texts(map(mp.fsum, columns)),
        end_slope=_texts(end_slope),
        integral=list(map(_texts, _integrals(roots, weights))),
        legendre=list(map(_texts, columns)),
        slope=list(map(_texts, slope)),
        last=list(map(_texts, list(zip(*columns, strict=True))[-2:])),
    )


def _eigen(integrals: list[list[mpf]]) -> Eigen:
    """Of the integrals by columns. Each eigenvector has the length 1 and is real and positive at the last node."""
    values, vectors = mp.eig(mp.matrix(integrals).T)
    count = len(values)
    for k in range(count):
        vector = vectors[:, k]
        vectors[:, k] = vector * (mp.conj(vector[count - 1]) / abs(vector[count - 1]) / mp.norm(vector))
    back = vectors**-1
    chosen = sorted((k for k in range(count) if mp.im(values[k]) > 0), key=lambda k: mp.im(values[k]))
    assert 2 * len(chosen) == count, "all values are in pairs"
    rows = [[back[k, m] for k in chosen] for m in range(count)]
    columns = [[2 * vectors[m, k] for m in range(count)] for k in chosen]
    return Eigen(
        real=_texts(mp.re(values[k]) for k in chosen),
        imaginary=_texts(mp.im(values[k]) for k in chosen),
        to_real=[_texts(map(mp.re, row)) for row in rows],
        to_imaginary=[_texts(map(mp.im, row)) for row in rows],
        from_real=[_texts(map(mp.re, column)) for column in columns],
        from_imaginary=[_texts(-mp.im(number) for number in column) for column in columns],
    )


def _inner_radau_roots(count: int) -> list[mpf]:
    """The zeros of P_count - P_(count-1) below 1: one between each two neighbouring zeros of P_count."""

    def value(z: mpf) -> mpf:
        return legendre(count, z) - legendre(count - 1, z)

    gauss_roots = [_root(count, k) for k in range(count)][::-1]
    pairs = pairwise(gauss_roots)
    return [mp.findroot(value, pair, solver="anderson", tol=mpf(10) ** (8 - 2 * DIGITS)) for pair in pairs]


def _root(count: int, k: int) -> mpf:
    """A zero of P_count, by Newton's rule from its asymptotic place."""
    z = cos(pi * (4 * k + 3) / (4 * count + 2))
    for _ in range(10):
        z -= legendre(count, z) / _derivative(count, z)
    return z


def _derivative(count: int, z: mpf) -> mpf:
    if z == 1:
        return mpf(count * (count + 1)) / 2
    return count * (z * legendre(count, z) - legendre(count - 1, z)) / (z * z - 1)


def _area(k: int, z: mpf) -> mpf:
    """The integral of P_k(2x - 1) from x = 0 to (1 + z)/2."""
    return (1 + z) / 2 if k == 0 else (legendre(k + 1, z) - legendre(k - 1, z)) / (2 * (2 * k + 1))


def _texts(numbers) -> list[str]:
    return [nstr(number, SHOWN, min_fixed=0, max_fixed=0, show_zero_exponent=True) for number in numbers]
