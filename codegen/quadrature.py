"""Tables of Gauss collocation on [0, 1] for the compiled engine, in multiprecision.

With nodes c_1 ... c_s (zeros of the Legendre polynomial P_s, moved to [0, 1]) and weights b_m, a polynomial of
degree below s that has the values f_m at the nodes is sum_k a_k P_k(2x - 1) with a_k = (2k + 1) sum_m b_m P_k(2c_m - 1)
f_m; that gives its integrals and its values anywhere. (Hairer, Norsett, Wanner: Solving Ordinary Differential
Equations I, II.7.)
"""

from dataclasses import dataclass

from mpmath import cos, legendre, mp, mpf, nstr, pi, workdps

DIGITS = 60
SHOWN = 20  # digits of a table's number: more than any double keeps


@dataclass(frozen=True)
class Gauss:
    """The tables, as text. A matrix is a list of columns: column m is what multiplies the value at node m."""

    nodes: list[str]
    weights: list[str]
    start: list[str]  # value at 0 from the values at the nodes
    end: list[str]  # value at 1
    end_slope: list[str]  # derivative at 1
    integral: list[list[str]]  # integral from 0 to node j
    legendre: list[list[str]]  # coefficients a_k
    slope: list[list[str]]  # derivative at node j
    last: list[list[str]]  # the rows of the last two coefficients


def gauss(count: int) -> Gauss:
    """The tables for `count` nodes."""
    with workdps(DIGITS):
        roots = [_root(count, k) for k in range(count)][::-1]
        weights = [1 / ((1 - z * z) * _derivative(count, z) ** 2) for z in roots]
        rows = [[(2 * k + 1) * b * legendre(k, z) for b, z in zip(weights, roots, strict=True)] for k in range(count)]
        columns = list(map(list, zip(*rows, strict=True)))
        integral = [[mp.fdot(column, [_area(k, z) for k in range(count)]) for z in roots] for column in columns]
        slope = [[mp.fdot(column, [2 * _derivative(k, z) for k in range(count)]) for z in roots] for column in columns]
        start = [mp.fdot(column, [(-1) ** k for k in range(count)]) for column in columns]
        end_slope = [mp.fdot(column, [k * (k + 1) for k in range(count)]) for column in columns]
        return Gauss(
            nodes=_texts((1 + z) / 2 for z in roots),
            weights=_texts(weights),
            start=_texts(start),
            end=_texts(map(mp.fsum, columns)),
            end_slope=_texts(end_slope),
            integral=list(map(_texts, integral)),
            legendre=list(map(_texts, columns)),
            slope=list(map(_texts, slope)),
            last=list(map(_texts, rows[-2:])),
        )


def _root(count: int, k: int) -> mpf:
    """A zero of P_count, by Newton's rule from its asymptotic place."""
    z = cos(pi * (4 * k + 3) / (4 * count + 2))
    for _ in range(10):
        z -= legendre(count, z) / _derivative(count, z)
    return z


def _derivative(count: int, z: mpf) -> mpf:
    return count * (z * legendre(count, z) - legendre(count - 1, z)) / (z * z - 1)


def _area(k: int, z: mpf) -> mpf:
    """The integral of P_k(2x - 1) from x = 0 to (1 + z)/2."""
    return (1 + z) / 2 if k == 0 else (legendre(k + 1, z) - legendre(k - 1, z)) / (2 * (2 * k + 1))


def _texts(numbers) -> list[str]:
    return [nstr(number, SHOWN, min_fixed=0, max_fixed=0, show_zero_exponent=True) for number in numbers]
