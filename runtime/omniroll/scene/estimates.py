"""How much an effect that a scene leaves out would change its motion.

The scene runs for a short time as it is and once more with the effect, the coefficient a typical one. The
estimate is the largest distance of the two in the norm of `accuracy`, ((x, y)/R, theta, nu/|nu(0)|). For effects with
a coefficient, the coefficient of one per cent follows by proportion.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll.comparison import distance_at
from omniroll.errors import AccuracyWarning, OmnirollError
from omniroll.kernels import ROLLER_MODELS
from omniroll.scene.loading import Scene, run
from omniroll.switching import LAWS
from omniroll.trajectory import Trajectory

PROBE = 2.0  # s, the time over which motions are compared
TIMES = 101
ACCURACY = 1e-8


@dataclass(frozen=True)
class Estimate:
    """How far an effect takes the motion away.

    effect    its name in the registry
    setting   the coefficients that were taken, in words
    distance  in the norm of `accuracy`; None where the motion with the effect could not be run
    percent   the coefficient that would make it 0.01, by proportion, in words; empty where there is none
    """

    effect: str
    setting: str
    distance: float | None
    percent: str = ""


def estimates(scene: Scene) -> tuple[float, list[Estimate]]:
    """The time compared, in s, and an estimate for every effect that is off and has one."""
    duration = min(PROBE, scene.options["duration"])
    base = _motion(scene, duration, {})
    if base is None or duration == 0:
        return duration, []
    return duration, [
        Estimate(effect, setting, _distance(base, _motion(scene, duration, changes)))
        for effect, setting, changes in _variants(scene)
    ]


def _variants(scene: Scene) -> Iterator[tuple[str, str, dict[str, Any]]]:
    model, law = scene.options.get("roller_model", "free"), scene.options.get("switching", "impact")
    for other in ROLLER_MODELS:
        if other != model:
            at_rest = {} if other == "free" else {"spins": 0}
            yield other, "in place of " + model, {"roller_model": other} | at_rest
    for other in LAWS:
        if other != law:
            yield other, "in place of " + law, {"switching": other}


def _motion(scene: Scene, duration: float, changes: dict[str, Any]) -> Trajectory | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        try:
            return run(scene, **{"duration": duration, "accuracy": ACCURACY, "control": False} | changes)
        except OmnirollError:
            return None


def _distance(base: Trajectory, other: Trajectory | None) -> float | None:
    if other is None:
        return None
    return distance_at(other, base, np.linspace(base.t[0], base.t[-1], TIMES))
