"""Condition of a function with respect to its inputs: cond = sum_k |df/dx_k| |x_k| / |f|."""

from .balls import exact, working_precision

EPS = 2.0**-52
STEP = "1e-20"  # central differences at 60 digits: the derivative is good to some 40 digits before cancellation


@working_precision
def slopes(f, x, which=None):
    """|df_m/dx_k| |x_k| for every output m, summed over the inputs k in `which` (all by default).

    f takes a list of balls and gives a list of balls.
    """
    x = [exact(v) for v in x]
    total = None
    for k in range(len(x)) if which is None else which:
        if x[k].is_zero():
            continue
        step = abs(x[k]) * exact(STEP)
        above = f([v + step if m == k else v for m, v in enumerate(x)])
        below = f([v - step if m == k else v for m, v in enumerate(x)])
        sizes = [float(abs((a - b).mid() / (2 * step))) * abs(float(x[k])) for a, b in zip(above, below, strict=True)]
        total = sizes if total is None else [t + s for t, s in zip(total, sizes, strict=True)]
    return total if total is not None else [0.0] * len(f(x))


def allowed(value, slope, relative=1e-12, units=100):
    """Allowed absolute error: `relative` of the value, or `units` eps of sum |df/dx_k| |x_k| where that is
    larger.
    """
    return max(relative * abs(value), units * EPS * slope)
