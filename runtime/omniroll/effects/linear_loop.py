"""The linear tests of a sampled controller: whether the errors that it sees grow from sample to sample.

The vehicle is taken at rest, with massless rollers, and its speeds are small: nu' = M^-1 W^T (b u - d W nu), with the
wheels' speeds W nu, the torque b of an output u that is held for a time, and what the torques lose per wheel rate, d.
A wheel that slips does not carry the vehicle: J w' = b u - d w of its rate w alone, with the inertia J about its axle.
"""

import math

import numpy as np

from omniroll.kernels.kernel import kernel
from omniroll.vehicles.vehicle import Vehicle


def growth(
    vehicle: Vehicle,
    per_output: np.ndarray,
    damping: np.ndarray,
    proportional: np.ndarray,
    integral: np.ndarray,
    sample_time: float,
) -> float:
    """The factor by which the errors grow in the long run from one sample to the next; up to 1 they do not. It is
    infinite where the test leaves the number range.

    per_output    (N,) in N m, the torque at the axle of an output of 1
    damping       (N,) in N m s, what the torque at the axle loses per rate of the wheel
    proportional  (N,) output per error of the wheel's rate, which is s times the output's unit
    integral      (N,) output per sum of the errors over time
    """
    bound = kernel(vehicle, "massless", "python")
    wheels, per_torque = bound.wheel_rows, bound.nu_dot_per_torque
    free, forced = held(-(per_torque * damping) @ wheels, per_torque * per_output, sample_time)
    # With the target 0: errors -W nu; their sums W s with s after the sample s - T nu.
    of_sums = integral[:, None] * wheels
    of_nu = -proportional[:, None] * wheels - sample_time * of_sums
    loop = free + forced @ of_nu
    if integral.any():
        loop = np.block([[loop, forced @ of_sums], [-sample_time * np.eye(3), np.eye(3)]])
    return float(np.abs(np.linalg.eigvals(loop)).max()) if np.isfinite(loop).all() else math.inf


def excess_alone(
    inertia: float,
    per_output: np.ndarray,
    damping: np.ndarray,
    proportional: np.ndarray,
    integral: np.ndarray,
    sample_time: float,
) -> np.ndarray:
    """(N,) how many times the gains are those at which the errors of a wheel alone begin to grow; up to 1 they fade.

    inertia  J in kg m^2; the others as in `growth`

    A sample takes w to a w + g u, with a = exp(-d T/J) and g = (1 - a) b/d. With the sums of the errors the loop's
    polynomial is z^2 - (1 + a - g (p + i T)) z + a - g p. Of its roots the first to leave the unit circle is -1, where
    g (p + i T/2) = 1 + a.
    """
    with np.errstate(over="ignore"):
        free = np.full(len(damping), sample_time / (2 * inertia))  # g/b/(1 + a) without damping
        rate = np.divide(np.tanh(damping * free), damping, out=free, where=damping > 0)
        return per_output * rate * (proportional + integral * sample_time / 2)


def held(rates: np.ndarray, inputs: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """x after a time, of x before it (..., S, S) and of inputs that are held (..., S, U): x' = rates x + inputs u.

    Exact: the exponential of [rates inputs; 0 0].
    """
    size, width = inputs.shape[-2:]
    if not rates.any():
        return np.broadcast_to(np.eye(size), rates.shape), time * inputs
    from scipy.linalg import expm  # SciPy is large; a controller of torques does without it

    whole = np.zeros((*rates.shape[:-2], size + width, size + width))
    whole[..., :size, :size], whole[..., :size, size:] = rates, inputs
    after = expm(time * whole)
    return after[..., :size, :size], after[..., :size, size:]
