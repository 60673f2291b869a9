"""What an evaluation of the equations of motion costs: operations, as counted, and time, as measured here."""

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from omniroll.effects import Effect
from omniroll.effects.bound_rates import PLAIN, dynamics_with
from omniroll.engine.compiled_engine import can_run
from omniroll.engine.control import made
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task
from omniroll.errors import InvalidValueError
from omniroll.kernels import sets
from omniroll.scenes.allowance import Allowance, limited
from omniroll.scenes.loading import Scene
from omniroll.scenes.variants import coulomb_ground
from omniroll.vehicles.vehicle import Vehicle

KINDS = ("add", "mul", "div", "sqrt", "sincos")
MANY = {"compiled": 20_000, "Python": 1000}  # with so many evaluations the work that a run does once hardly shows
SHORTEST = 0.5**10  # the first run that is timed simulates this part of the motion
DOUBLINGS = 20  # then the simulated time is doubled, at most this often, until there are MANY evaluations
REPEATS = 5  # the longest run is timed again at most this often,
ENOUGH = 1.0  # and no longer than so many s in all
LONGEST_RUN = 1.0  # s of work that a run may take whose time is measured


@dataclass(frozen=True)
class Cost:
    """Operations of one function: constant, per wheel, per free roller, and in all."""

    function: str
    constant: int
    per_wheel: int
    per_roller: int
    total: int


def operations(task: Task) -> list[Cost]:
    """What the functions that make the right-hand side cost; an operation is +, *, /, a root, a sine or cosine.

    They are those of the scene's set alone, whatever the engine runs on.
    """
    bound = task.kernel
    asked = task.effects.functions(bound.roller_model)
    # Where wheels may slip, one function gives all accelerations.
    always = ("pose_rates",) if bound.slips else (dynamics_with(asked), *PLAIN)
    loads = ("slip_load_balance",) if "contact_loads" in bound.effects else ()  # solved for with the accelerations
    forms = {name: bound.form(name) for name in always + asked + loads}
    counted = _counted(bound.base, bound.effects, frozenset(forms.values()))
    return [_cost(name, counted[form], bound.vehicle) for name, form in forms.items()]


@lru_cache(maxsize=64)
def _counted(base: str, effects: tuple[str, ...], names: frozenset[str]) -> dict[str, dict]:
    """The work that functions of a set are, by name, as in generated/data/kernels; no text of the set is made."""
    from omniroll.codegen.operations import count_operations
    from omniroll.codegen.sharing import share
    from omniroll.codegen.specialise import specialised

    programs = sets.programs()
    found = specialised(programs.base(base), effects, programs.registry, names={*names, "prepare"})
    return {f.name: count_operations(share(f)) for f in found.functions if f.name in names}


def _cost(name: str, counted: dict[str, dict[str, int]], vehicle: Vehicle) -> Cost:
    wheels, places = vehicle.wheels, vehicle.rollers_per_wheel - 1
    once, wheel, roller, slot = (
        sum(counted[part][kind] for kind in KINDS) for part in ("once", "wheel", "roller", "slot")
    )
    total = once + wheels * wheel + wheels * places * roller + places * slot
    return Cost(name, once, wheel, roller, total)


@dataclass(frozen=True)
class Price:
    """What an effect adds to an evaluation: operations, and per cent of those of the scene; None if not known.

    setting  of an effect that is off, and would be added: its numbers, in words
    """

    effect: str
    operations: int | None
    percent: float | None
    setting: str = ""


def prices(scene: Scene, allowance: Allowance | None = None) -> list[Price]:
    """The price of each effect that acts: the operations of an evaluation with all of them less those without this one;
    and of wheels that may slip, where they may not. None are known where there is no time left."""
    acting = tuple(scene.options.get("effects", ()))
    allowance = allowance or Allowance()
    ground = coulomb_ground(scene)
    if not (acting or ground) or not allowance.has_time("the price of each effect"):
        return []
    whole = _of_effects(scene, acting)
    without = [(type(effect).__name__, "", [other for other in acting if other is not effect]) for effect in acting]
    beside = [("Contact", f"friction {ground.friction:g}", [*acting, ground])] if ground else []
    found = []
    for name, setting, effects in [*without, *beside]:
        if not allowance.has_time(f"the price of {name}"):
            continue
        other = None if whole is None else _of_effects(scene, effects)
        if whole is None or other is None:
            found.append(Price(name, None, None, setting))
        else:
            added = other - whole if setting else whole - other
            found.append(Price(name, added, 100 * added / whole, setting))
    return found


def _of_effects(scene: Scene, effects: Sequence[Effect]) -> int | None:
    """Operations of an evaluation with these effects; None where they cannot stand so."""
    options = scene.options | {"effects": tuple(effects)}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # doubts about the scene are said elsewhere
            return sum(cost.total for cost in operations(checked_task(scene.vehicle, **options)))
    except InvalidValueError:
        return None


def nanoseconds(task: Task) -> dict[str, Any]:
    """Time per evaluation on this machine, ns: that of a run over the number of its evaluations, the least of a few.

    Steps, switches and what the engine does between them are in it. A long motion is timed at its beginning,
    and one with few evaluations runs on beyond its end.
    """
    took, evaluations = _least(_long_enough(task))
    return {"nanoseconds": 1e9 * took / max(evaluations, 1), "evaluations": evaluations, "engine": _engine(task)}


def _engine(task: Task) -> str:
    return "compiled" if can_run(task) else "Python"


def _long_enough(task: Task) -> Task:
    """The task for a time in which a run has MANY evaluations, or the longest time that can be simulated."""
    many = MANY[_engine(task)]
    task = replace(task, progress=None, duration=SHORTEST * task.duration)
    for _ in range(DOUBLINGS if task.duration > 0 else 0):
        longer = replace(task, duration=2 * task.duration)
        began = time.process_time()
        run = made(limited(longer, LONGEST_RUN), longer.accuracy)
        if not run.done:
            break
        task = longer
        if run.stats()["evaluations"] >= many or time.process_time() - began > ENOUGH:
            break
    return task


def _least(task: Task) -> tuple[float, int]:
    """The least time in s of some runs, and their evaluations."""
    took, evaluations = _timed(task)
    began = time.process_time()
    for _ in range(REPEATS):
        if time.process_time() - began + took > ENOUGH:
            break
        took = min(took, _timed(task)[0])
    return took, evaluations


def _timed(task: Task) -> tuple[float, int]:
    """Seconds of a run, as far as it came, and its evaluations."""
    start = time.process_time()
    run = made(limited(task, LONGEST_RUN), task.accuracy)
    took, evaluations = time.process_time() - start, run.stats()["evaluations"]
    run.release()
    return took, evaluations
