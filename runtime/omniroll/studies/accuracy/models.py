"""What a simpler model costs in accuracy: the roller models, and each effect of the scene left out in turn, against the
fullest model: free rollers with every effect of the scene.

The fullest model's motion is a reference solution as any other.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from omniroll.effects import Effect
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task, one_run
from omniroll.errors import InvalidValueError, SimulationStopped
from omniroll.scenes import Scene
from omniroll.studies.accuracy.peers import TOLERANCES, Outcome, Peer, compiled_before, outcome_of
from omniroll.studies.accuracy.reference import Reference, confirmed
from omniroll.vocabulary import ROLLER_MODELS

# The error of a model stays however fine the tolerance is, and these tolerances are enough to show it. Runs with
# effects take longer, and have fewer.
SETTINGS, SETTINGS_WITH_EFFECTS = TOLERANCES[::2][:6], TOLERANCES[1:8:3]

Rung = tuple[str, Task]
Measure = Callable[[Peer, float, Task, Reference], Any]


def _run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
    return outcome_of(one_run(task, tolerance), task, times)


@dataclass
class Ladder:
    """What was measured of all models, which are the rungs.

    points     a Point for each rung and tolerance
    failed     why rungs are missing, in words
    confirmed  the largest distance between two computations of the reference
    stopped    the error of a run that stopped, or None
    """

    points: list[Any] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    confirmed: float = math.inf
    stopped: SimulationStopped | None = None


def ladder(
    scene: Scene, options: dict[str, Any], duration: float, times: np.ndarray, measure: Measure,
    known: Reference | None = None,
) -> Ladder:  # fmt: skip
    """Measure every rung.

    options  arguments of simulate without duration, accuracy and engine
    known    the reference solution of free rollers without effects, where there is one
    """
    some = bool(options.get("effects"))
    result, rungs = Ladder(), []
    for name, vehicle, arguments in _rungs(scene, options):
        try:
            rungs.append((name, checked_task(vehicle, **arguments, duration=duration)))
        except InvalidValueError as error:  # a controller that gives voltages needs motors
            result.failed.append(f"{name}: {error}")
    fullest = next(task for name, task in rungs if name == "free")
    peer = Peer("compiled", _run, SETTINGS_WITH_EFFECTS if some else SETTINGS, prepare=compiled_before)
    try:
        exact = known or confirmed(fullest, times)
        result.confirmed = exact.confirmed
        for name, task in rungs:
            result.points += [replace(measure(peer, setting, task, exact), series=name) for setting in peer.settings]
    except SimulationStopped as error:
        result.failed.append(f"models: {error}")
        result.stopped = error
    return result


def _rungs(scene: Scene, options: dict[str, Any]) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Name, vehicle and arguments of each rung."""
    for model in ROLLER_MODELS:
        own = options if model == "free" else {k: v for k, v in options.items() if k != "spins"}
        yield model, scene.vehicle, own | {"roller_model": model}
    fullest = options | {"roller_model": "free"}
    effects: tuple[Effect, ...] = options.get("effects", ())
    for effect in effects:
        rest = tuple(other for other in effects if other is not effect)
        yield f"without {type(effect).__name__}", scene.vehicle, fullest | {"effects": rest}
    if scene.vehicle.has_layout:
        plain = scene.vehicle.replace(wheel_places=None, center_of_mass=(0.0, 0.0))
        yield "without layout", plain, fullest
