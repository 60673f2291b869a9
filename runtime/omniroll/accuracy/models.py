"""What a simpler model costs in accuracy: the roller models, and each effect of the scene left out in turn, against the
fullest model: free rollers with every effect of the scene.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from omniroll.accuracy.peers import TOLERANCES, Outcome, Peer, outcome_of
from omniroll.accuracy.reference import Reference
from omniroll.effects import Effect
from omniroll.errors import InvalidValueError
from omniroll.kernels import ROLLER_MODELS
from omniroll.runs import Task
from omniroll.scene import Scene
from omniroll.simulate import checked_task, one_run

# Errors of models are large: these tolerances show where they end. Effects run on the Python engine, which is slower.
SETTINGS, SETTINGS_WITH_EFFECTS = TOLERANCES[::2][:6], TOLERANCES[1:8:3]
FINEST, FINEST_WITH_EFFECTS = 1e-14, 1e-11

Rung = tuple[str, Task]
Measure = Callable[[Peer, float, Task, Reference, float], Any]


def _run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
    return outcome_of(one_run(task, tolerance), task, times)


def ladder(
    scene: Scene, options: dict[str, Any], duration: float, times: np.ndarray, measure: Measure
) -> tuple[list, list[str]]:
    """(points of each rung at some tolerances, the rungs that make no sense and why).

    options  arguments of simulate without duration, accuracy and engine
    """
    some = bool(options.get("effects"))
    settings, finest = (SETTINGS_WITH_EFFECTS, FINEST_WITH_EFFECTS) if some else (SETTINGS, FINEST)
    rungs, refused = [], []
    for name, vehicle, arguments in _rungs(scene, options):
        try:
            rungs.append((name, checked_task(vehicle, **arguments, duration=duration)))
        except InvalidValueError as error:  # a controller of motors cannot do without them
            refused.append(f"{name}: {error}")
    fullest = next(task for name, task in rungs if name == "free")
    exact = _reference(fullest, times, finest)
    peer = Peer("compiled", _run, settings)
    points = [
        replace(measure(peer, tolerance, task, exact, finest), series=name)
        for name, task in rungs
        for tolerance in settings
    ]
    return points, refused


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


def _reference(fullest: Task, times: np.ndarray, tolerance: float) -> Reference:
    found = _run(fullest, times, tolerance)
    return Reference(times, found.y, found.contact, found.energy, found.switches)
