"""Numbers of a file that should be alike: those of a wheel's rollers, and those of a vehicle's wheels."""

from collections.abc import Sequence

import numpy as np

from omniroll.errors import InvalidValueError

ALIKE = 0.02  # of the mean that such numbers may lie apart
SAID = 1e-6  # of the mean, beyond which it is said that they do


def mean_of(what: str, values: Sequence[float], path: object, notes: list[str], instead: str = "") -> float:
    """The mean of numbers that should be alike. It is noted where they differ a little.

    what     the numbers, as the subject of a sentence
    path     of the file, for a message
    notes    where a note is added
    instead  what may be given in their place

    Raises InvalidValueError where they differ by more than 2 %.
    """
    mean, low, high = float(np.mean(values)), float(np.min(values)), float(np.max(values))
    if high - low > ALIKE * abs(mean):
        bound = f"has {what} from {low:.6g} to {high:.6g}: up to {100 * ALIKE:g} % apart they would be averaged"
        bound += f"; make them alike in the file{f', or give {instead}' if instead else ''}"
        raise InvalidValueError("path", str(path), bound)
    if high - low > SAID * abs(mean):
        apart = 100 * (high - low) / abs(mean)
        notes.append(f"{what} from {low:.6g} to {high:.6g}, {apart:.2g} % apart, count as {mean:.6g}, their mean")
    return mean
