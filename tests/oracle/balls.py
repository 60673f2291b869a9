"""Numbers of the oracle: arb balls at a fixed working precision."""

import functools

from flint import arb, arb_series, ctx

PRECISION = 200  # bits: 60 digits
LONGEST_SERIES = 200


def working_precision(function):
    """Run a function of the oracle at PRECISION bits; what the caller had set comes back."""

    @functools.wraps(function)
    def at_precision(*args, **kwargs):
        cap = ctx.cap
        ctx.cap = max(cap, LONGEST_SERIES)
        try:
            with ctx.workprec(max(PRECISION, ctx.prec)):
                return function(*args, **kwargs)
        finally:
            ctx.cap = cap

    return at_precision


def exact(value):
    """A float, int, fraction string, NumPy scalar or ball as a ball; floats are taken exactly."""
    if isinstance(value, (arb, arb_series)):
        return value
    if isinstance(value, (int, str)):
        return arb(value)
    return arb(float(value))


def square(value):
    """value * value; the power x**2 of a ball around zero is not a number."""
    return value * value


def coefficient(value, order):
    """Coefficient of t^order of a number that may be a constant."""
    if isinstance(value, arb_series):
        return value[order]
    return value if order == 0 else arb(0)


def line(value, rate):
    """The series value + rate t, known to first order."""
    return arb_series([value, rate], 2)


def sharp(value):
    """The midpoint of a ball, as an exact number."""
    return arb(value).mid()
