"""Polynomials for the sine and the cosine of short angles, in exact fractions.

A kernel needs them at half a wheel angle, |chi/2| <= pi/(2 n) <= pi/6, where no range reduction is called for:
    sin x = x (1 + z S(z)),  cos x = 1 + z C(z),  z = x^2.
Each polynomial interpolates at Chebyshev's points, moved so that the first of them is z = 0: of all polynomials that
are exact there it is close to the best. (L. N. Trefethen: Approximation Theory and Approximation Practice, 4 and 10.)
"""

from dataclasses import dataclass
from decimal import Context
from fractions import Fraction
from functools import cache
from math import factorial, prod

LARGEST = "0.28"  # of z; pi^2/36 = 0.2742 is the joint of three rollers
TERMS = {"float": (3, 3), "double": (5, 6)}  # of S and C: errors below a third of an ulp
SERIES = 30  # terms of a Taylor series: errors far below those of the polynomials
PI = Fraction("3.14159265358979323846264338327950288419716939937510582")
SHOWN = Context(prec=20)  # digits of a coefficient: more than any double keeps


@dataclass(frozen=True)
class ShortAngles:
    """Coefficients of S and C from the constant up, as text."""

    sine: list[str]
    cosine: list[str]


@cache
def short_angles() -> dict[str, ShortAngles]:
    """{number type: its coefficients}."""
    return {
        number_type: ShortAngles(interpolated(3, in_sine), interpolated(2, in_cosine))
        for number_type, (in_sine, in_cosine) in TERMS.items()
    }


def series(first: int, z: Fraction) -> Fraction:
    """-1/first! + z/(first + 2)! - ...: S(z) for first = 3, C(z) for first = 2."""
    return sum(((-1) ** (k + 1) * z**k / factorial(2 * k + first) for k in range(SERIES)), Fraction(0))


def interpolated(first: int, terms: int) -> list[str]:
    """Coefficients of the polynomial that agrees with the series at the points but z = 0; by Newton's differences."""
    waves = [cosine(PI * (2 * k + 1) / (2 * terms + 2)) for k in range(terms + 1)]
    points = [Fraction(LARGEST) * (waves[0] - wave) / (waves[0] + 1) for wave in waves[1:]]
    values = [series(first, z) for z in points]
    total = [Fraction(0)] * terms
    for k in range(terms):
        difference = sum(values[i] / prod(points[i] - points[j] for j in range(k + 1) if j != i) for i in range(k + 1))
        factors = [Fraction(1)]  # of (z - points[0]) ... (z - points[k - 1])
        for z in points[:k]:
            factors = [a - z * b for a, b in zip([0, *factors], [*factors, 0], strict=True)]
        total = [t + difference * f for t, f in zip(total, [*factors, *[0] * terms], strict=False)]
    return [str(SHOWN.divide(c.numerator, c.denominator)).lower() for c in total]


def cosine(angle: Fraction) -> Fraction:
    """The cosine in 30 digits."""
    return round(1 + angle**2 * series(2, angle**2), 30)
