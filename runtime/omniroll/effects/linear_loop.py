"""The linear test of a sampled controller: whether the errors that it sees grow from sample to sample.

The vehicle is taken at rest, with massless rollers, and its speeds are small: nu' = M^-1 W^T (b u - d W nu), with the
wheels' speeds W nu, the torque b of an output u that is held for a time, and what the torques lose per wheel rate, d.
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
    wheels = bound.wheel_speeds(np.eye(3)).T  # (N, 3)
    per_torque = np.linalg.solve(bound.mass_matrix(np.zeros(vehicle.wheels)), wheels.T)
    free, forced = _held(-(per_torque * damping) @ wheels, per_torque * per_output, sample_time)
    # With the target 0: errors -W nu; their sums W s with s after the sample s - T nu.
    of_sums = integral[:, None] * wheels
    of_nu = -proportional[:, None] * wheels - sample_time * of_sums
    loop = free + forced @ of_nu
    if integral.any():
        loop = np.block([[loop, forced @ of_sums], [-sample_time * np.eye(3), np.eye(3)]])
    return float(np.abs(np.linalg.eigvals(loop)).max()) if np.isfinite(loop).all() else math.inf


def _held(rates: np.ndarray, inputs: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """nu after a time, of nu before it (3, 3) and of inputs that are held (3, N), where nu' = rates nu + inputs u."""
    if not rates.any():
        return np.eye(3), time * inputs
    from scipy.linalg import expm  # SciPy is large; a controller of torques does without it

    size = 3 + inputs.shape[1]
    whole = np.zeros((size, size))
    whole[:3] = np.hstack([rates, inputs])
    after = expm(time * whole)
    return after[:3, :3], after[:3, 3:]
