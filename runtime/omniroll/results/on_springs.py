"""The energy of a platform on springs, as far as it follows from heave and tilt."""

import numpy as np

from omniroll.effects.state_vector import StateVector
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named

WORK, SPRINGS, DAMPERS = "support_work", "spring_energy", "damper_loss"  # what is integrated, and its two parts


def in_two(kernel: Kernel, vector: StateVector, work: np.ndarray, start: np.ndarray, y: np.ndarray) -> dict:
    """(K,) in J by name, what springs and weight have given back since the start, and what the dampers have taken.

    work   (K,) what loads and weight have done on the platform
    start  (size,) the state at the start
    y      (K, size) the states
    """
    given = stored(kernel, vector, start) - stored(kernel, vector, y)
    return {SPRINGS: given, DAMPERS: work - given}


def stored(kernel: Kernel, vector: StateVector, y: np.ndarray) -> np.ndarray:
    """(...) in J, of springs that are shorter than without load, and of the weight."""
    tilt = vector.view(y, "tilt")
    values = {"tilt": tilt, "tilt_rate": np.zeros_like(tilt), "heading": vector.view(y, "pose")[..., 2]}
    values["presses"] = np.ones((*tilt.shape[:-1], kernel.wheels))
    _, margins, _ = call_named(kernel, "support_state", values)
    return call_named(kernel, "support_energy", values | {"compressed": (margins > 0).astype(float)})
