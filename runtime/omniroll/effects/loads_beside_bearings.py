"""Loads beside massless rollers that turn: of a load their bearings leave what goes with it in no proportion, but for
the root of N^2 - b^2, where b is the load whose whole friction along the axle the bearing takes.

So loads, which are solved together with accelerations, are found by Newton's rule: about some loads the friction is
linear in the loads (maxima, contact_loads). Below b, where the rule may lead on its way, nothing is left.

A bearing with viscous friction takes what goes with the load as well, by the slip along the axle, and leaves something
of each load.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from omniroll.effects.ground_loads import Carried
from omniroll.kernels.kernel import Kernel

TIP = 1e-12  # of b: nearer to it hardly anything is left
LEAST = 1e-9  # N, about which friction is linear at least; where a bearing takes nothing
ROUNDS = 50
SETTLED = 1e-14  # of the weight
ROUNDED = 1e-11  # of the weight: steps below this that do not fall any more are rounding
SURE = 0.1  # of SETTLED: where the next step would be, if steps go on falling as their squares
# Functions that say what bearings leave; a kernel has one at most.
LEFT = ("left_loads", "damped_loads", "corner_loads")


def left_function(kernel: Kernel) -> str | None:
    """The name of the one that a kernel has."""
    return next((name for name in LEFT if name in kernel.signatures), None)


def at_loads(loads: np.ndarray) -> dict[str, np.ndarray]:
    """What these functions take of loads (..., N), by name."""
    return {"load_about": loads, "bearing_factor": 1 / np.maximum(loads, LEAST)}


def left_of(kernel: Kernel, values: Mapping[str, Any], loads: np.ndarray) -> dict[str, np.ndarray]:
    """What this function gives of loads (..., N), by name; `values` has what else it takes, and more."""
    function = left_function(kernel)
    assert function is not None
    signature, known = kernel.signatures[function], {**values, **at_loads(loads)}
    found = kernel.call(function, *(np.real(known[argument.name]) for argument in signature.inputs))
    outputs = [argument.name for argument in signature.outputs]
    return dict(zip(outputs, found if len(outputs) > 1 else (found,), strict=True))


def taken_and_gain(found: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """From what it gives: b (..., N) and the gain. Beside viscous friction there is no b."""
    gain = found["load_gain"]
    return found.get("bearing_load", np.zeros_like(gain)), gain


@dataclass(frozen=True)
class BesideBearings:
    """The friction of contacts, linear in their loads.

    turns  (..., N) bool: contacts whose massless rollers turn
    about  (..., N) in N, loads about which it is linear; 1 of other contacts
    gain   (..., N) part of the change of friction across the axle per part of that of the load; 1 of other contacts
    """

    turns: np.ndarray
    about: np.ndarray
    gain: np.ndarray

    @classmethod
    def at(cls, found: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], turns: np.ndarray, loads: np.ndarray):
        """About `loads` (..., N) in N; `found` gives b (..., N) and the gain at loads (..., N)."""
        with np.errstate(divide="ignore", invalid="ignore"):  # of what does not turn
            taken, gain = found(loads)
        return cls.with_gain(gain, turns, cls.about_of(taken, turns, loads), loads)

    @staticmethod
    def about_of(taken: np.ndarray, turns: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """(..., N) in N, loads about which it is linear: the `loads`, or just above those that bearings take whole."""
        with np.errstate(invalid="ignore"):
            return np.where(turns, np.maximum(loads, np.maximum((1 + TIP) * np.abs(taken), LEAST)), 1.0)

    @classmethod
    def with_gain(cls, gain: np.ndarray, turns: np.ndarray, about: np.ndarray, loads: np.ndarray):
        """The same with these gains at about_of()."""
        return cls(turns, about, np.where(turns, np.where(about > loads, 0.0, gain), 1.0))

    def factor(self, loads: np.ndarray) -> np.ndarray:
        """(..., N) what the kernels take as load_factor under loads (..., N)."""
        return np.where(self.turns, self.about + self.gain * (loads - self.about), loads)


def settled(solve: Callable[[np.ndarray], Carried], loads: np.ndarray, weight: float) -> Carried:
    """The loads about which what `solve` finds are these, in each state (...) for itself; not a number where that does
    not end.

    loads   (..., N) in N, where it begins
    weight  in N, of the vehicle
    """
    last: np.ndarray | float = np.inf
    is_found: np.ndarray | bool = False
    for _ in range(ROUNDS):
        found = solve(loads)
        step, loads = np.abs(found.loads - loads).max(axis=-1), found.loads
        with np.errstate(divide="ignore", invalid="ignore"):
            falls = (last < np.inf) & (step * (step / last) ** 2 <= SURE * SETTLED * weight)
        rounded = (last <= step) & (step <= ROUNDED * weight)
        is_found = is_found | ~(step > SETTLED * weight) | falls | rounded
        if np.all(is_found):
            return found
        last = step
    return replace(found, compression=np.full_like(loads, np.nan), determinant=np.full(loads.shape[:-1], np.nan))
