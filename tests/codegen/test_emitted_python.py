"""The emitted Python runs on every number type that it names, and rounds no constant in a lesser one."""

import importlib
from fractions import Fraction

import flint
import mpmath
import numpy
import pytest

N, n = 3, 4
ANGLES, NU, CHI = [0.5, 2.5, 4.5], [0.25, -0.5, 1.5], [0.125, -0.25, 0.5]
SPINS = [[0.5, 0.25, -1.0], [2.0, -0.75, 0.125], [0.0, 1.0, -0.5]]


@pytest.fixture(scope="module")
def toy(toy_folder):
    return importlib.import_module("toy_generated.python.toy")


def everything(toy, number):
    """All results of `everything` as one list, computed in the number type."""

    def convert(values):
        return [convert(v) if isinstance(v, list) else number(v) for v in values]

    model = toy.prepare(N, n, number(2.5), number(8.0), convert(ANGLES))
    return flat(toy.everything(model, convert(NU), convert(CHI), convert(SPINS)))


def flat(values):
    return [x for v in values for x in flat(v)] if isinstance(values, list | tuple) else [values]


def test_multiprecision_and_balls_agree_far_beyond_doubles(toy):
    with mpmath.workdps(60):
        precise = everything(toy, mpmath.mpf)
        flint.ctx.prec = 220
        balls = everything(toy, flint.arb)
        doubles = everything(toy, float)
        assert all(isinstance(x, mpmath.mpf | int) for x in precise)
        for p, b, d in zip(precise, map(flint.arb, balls), doubles, strict=True):
            scale = 1 + abs(p)
            assert abs(mpmath.mpf(str(b.str(60, radius=False))) - p) < scale * mpmath.mpf(10) ** -50
            assert float(b.rad()) < 1e-60
            assert abs(d - float(p)) < 1e-13 * scale


def test_arrays_broadcast_and_inputs_stay(toy):
    model = toy.prepare(N, n, 2.5, 8.0, ANGLES)
    shift = numpy.linspace(0.0, 0.4, 5)
    nu = [x + shift for x in NU]
    kept = [x.copy() for x in nu]
    many = flat(toy.everything(model, nu, CHI, SPINS))
    for k in range(5):
        one = flat(toy.everything(model, [float(x[k]) for x in nu], CHI, SPINS))
        numpy.testing.assert_allclose([numpy.broadcast_to(m, 5)[k] for m in many], one, rtol=1e-14, atol=1e-14)
    for before, after in zip(kept, nu, strict=True):
        numpy.testing.assert_array_equal(before, after)


@pytest.mark.parametrize("number", [numpy.float32, numpy.longdouble, float])
def test_the_number_type_is_kept(toy, number):
    model = toy.prepare(N, n, number(2.5), number(8.0), [number(a) for a in ANGLES])
    assert {type(model.gain), type(model.l), type(model.cos_alpha[0]), type(model.cos_kappa[2])} <= {
        number,
        numpy.float64,
    }
    if number is not float:
        assert type(model.cos_kappa[0]) is number


def test_rationals_are_exact(toy_folder):
    parts = importlib.import_module("toy_generated.python.parts")
    sizes = [Fraction(1, 3), Fraction(2, 7), Fraction(5)]
    assert parts.share_of(N, n, Fraction(3), sizes) == (4 * sum(sizes) * 3, sum(sizes) * 3 * Fraction(2, 9))
