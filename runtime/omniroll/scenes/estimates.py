"""How much an effect that a scene leaves out would change its motion.

The scene runs for a short time as it is and once more with the effect, the coefficient a typical one. The
estimate is the largest distance of the two in the norm of `accuracy`, ((x, y)/R, theta, nu/|nu(0)|). For effects with
a coefficient, the coefficient of one per cent follows by proportion.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll.engine.simulate import checked_task, one_run
from omniroll.errors import OmnirollError, SimulationStopped
from omniroll.results.comparison import distance_at
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.allowance import Allowance, limited
from omniroll.scenes.loading import Scene
from omniroll.scenes.variants import Variant, variants
from omniroll.vocabulary import LAWS

PROBE = 2.0  # s, the simulated time over which two motions are compared, at most
TIMES = 101  # the number of times at which they are compared
ACCURACY = 1e-8  # of the runs
FELT = 1e-7  # a smaller distance may be the error of the two runs


@dataclass(frozen=True)
class Estimate:
    """How far an effect takes the motion away.

    effect    its name in the registry
    setting   the coefficients that were taken, in words
    distance  in the norm of `accuracy`; None where the motion with the effect could not be run, or not within LONGEST.
              Below FELT it is zero as far as the runs can tell
    percent   the coefficient that would make it 0.01, by proportion, in words; empty where there is none
    why       there is no distance, in words
    """

    effect: str
    setting: str
    distance: float | None
    percent: str = ""
    why: str = ""


def estimates(scene: Scene, allowance: Allowance | None = None) -> tuple[float, list[Estimate]]:
    """The time compared, in s, and an estimate for every effect that is off and has one, as far as there is time."""
    allowance = allowance or Allowance()
    duration = min(PROBE, scene.options["duration"])
    try:
        base = _simulated(scene, duration, {})
    except OmnirollError as error:
        allowance.left_out.append(f"all estimates, since the motion itself {_why(error)}")
        base = None
    if base is None or duration == 0:
        return duration, []
    made = [
        _estimate(scene, duration, base, variant)
        for variant in variants(scene, base)
        if allowance.has_time(f"the estimate of {variant.effect}")
    ]
    if "reactions" not in scene.tables:
        made.append(Estimate("reactions", "an output, which changes no motion", 0.0))
    if scene.slips:
        made += [Estimate(law, "", None, why="wheels that may slip ask for no law") for law in LAWS]
    elif all(estimate.effect != "contact" for estimate in made):
        made.append(Estimate("contact", "", None, why="each law of the ground has its own estimate"))
    return duration, made


def _why(error: OmnirollError) -> str:
    return f"stopped: {error.reason}" if isinstance(error, SimulationStopped) else str(error)


def _simulated(scene: Scene, duration: float, changes: dict[str, Any]) -> Trajectory:
    arguments = scene.options | {"duration": duration} | changes
    layout = arguments.pop("layout", {})
    return one_run(limited(checked_task(scene.vehicle.replace(**layout), **arguments)), ACCURACY)


def _estimate(scene: Scene, duration: float, base: Trajectory, variant: Variant) -> Estimate:
    try:
        other = _simulated(scene, duration, variant.changes)
    except OmnirollError as error:
        return Estimate(variant.effect, variant.setting, None, why=_why(error))
    distance = distance_at(other, base, np.linspace(base.t[0], base.t[-1], TIMES))
    if not np.isfinite(distance):
        return Estimate(variant.effect, variant.setting, None, why="it is not finite")
    percent = ""
    if variant.coefficient is not None and distance > FELT:
        percent = f"{variant.coefficient * 0.01 / distance:.2g} {variant.unit}"
    return Estimate(variant.effect, variant.setting, distance, percent)
