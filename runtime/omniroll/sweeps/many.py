"""simulate_many(): runs over parameters and starts, arrays in and arrays out, in threads or on any executor.

A run of the compiled engine takes place in C with the interpreter's lock released. What a run leaves is read off its
buffers; a trajectory is made only where samples are asked for.
"""

import math
import warnings
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.outlook import shown_bytes
from omniroll.engine.runs import MEMORY
from omniroll.engine.simulate import checked_task
from omniroll.errors import AccuracyWarning, InvalidValueError, SweepInterrupted
from omniroll.progress import Report, reporting
from omniroll.sweeps.ends import Many, gathered
from omniroll.sweeps.member import Run
from omniroll.sweeps.sweep import Sweep
from omniroll.vehicles import checks
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, RUN, STATE, SWITCHING, by_name, documented

MOST_AXES = 32  # of nested lists: what a list that holds itself exceeds
NUMBERS_BESIDE_WHEELS = 8  # of a sample: t, nu, pose, energy
BYTES_OF_A_RUN = 4000  # its arguments and what is kept of it, measured


@documented(*STATE, *RUN, ROLLER_MODEL, SWITCHING)
def simulate_many(
    vehicles: Vehicle | Sequence,
    *,
    nu: ArrayLike,
    chi: ArrayLike = 0,
    spins: ArrayLike = 0,
    pose: ArrayLike = (0, 0, 0),
    duration: ArrayLike,
    start_time: float = 0,
    roller_model: str = "free",
    switching: str = "impact",
    accuracy: float = 1e-9,
    engine: str = "compiled",
    memory: float = MEMORY,
    control: bool = True,
    effects: Sequence = (),
    times: ArrayLike | None = None,
    executor: Executor | None = None,
    progress: bool | Report | None = None,
) -> Many:
    """Simulate many vehicles from many starts; each run is what `simulate` makes of its numbers.

    vehicles      Vehicle, or nested lists of them, all with the same N and n
    {entries}
    effects       sequence of effects, as of simulate; or nested lists of such sequences, one for each run
    control       as of simulate
    times         (T,) in s, when to take samples of every run, within every run; None: no samples
    executor      any concurrent.futures.Executor: processes, or a Dask cluster's Client.get_executor(). It gets chunks
                  of runs, and is not shut down. None: threads, one for each core, since the compiled engine runs
                  without the lock of the interpreter
    progress      True: a bar, or lines where tqdm is not installed; or a function, called as
                  progress(runs done, of how many); None: nothing

    nu, chi, spins, pose and duration may have leading axes (...), which broadcast with each other and with the shapes
    of `vehicles` and `effects`; the other arguments are the same for all runs.

    `memory` is for the steps of each run, and for what is kept of all runs.

    Returns Many. Raises InvalidValueError before the first run starts where an array makes no sense, or the first
    run, or where what is kept of all runs does not fit into the memory. A run that stops or fails does not end the
    others: see Many.stopped. Raises SweepInterrupted, a KeyboardInterrupt whose `many` has what was done until then.
    Warns once with AccuracyWarning where estimates stay above the accuracy, and with UnstableControllerWarning.
    """
    common = {
        "start_time": start_time, "roller_model": roller_model, "switching": switching,
        "accuracy": accuracy, "engine": engine, "memory": memory,
    }  # fmt: skip
    validation.truth("control", control)
    if executor is not None and not isinstance(executor, Executor):
        raise InvalidValueError("executor", executor, "must be an executor of concurrent.futures, or None for threads")
    if progress is not None and not isinstance(progress, bool):
        validation.function("progress", progress, "done", "runs")
    start = {"nu": nu, "chi": chi, "spins": spins, "pose": pose, "duration": duration}
    shape, arrays = _arrays(vehicles, effects, roller_model, **start)
    _check_memory(shape, arrays["vehicle"][0].flat[0], roller_model, _size(times), memory)
    runs = [run | common for run in _all_runs(shape, arrays)]
    checked_task(**runs[0])
    _warn_of_effects(runs)
    times = None if times is None else _times(times, runs)
    sweep = Sweep(runs, times, control)
    try:
        with reporting(progress or False, len(runs), "runs") as report:
            sweep.in_threads(report) if executor is None else sweep.on(executor, report)
    except KeyboardInterrupt:
        raise SweepInterrupted(gathered(shape, sweep)) from None
    many = gathered(shape, sweep)
    _warn(many, accuracy)
    return many


# The runs


def _arrays(
    vehicles: Any, effects: Any, roller_model: str, *, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike,
    pose: ArrayLike, duration: ArrayLike,
) -> tuple[tuple[int, ...], dict[str, tuple[np.ndarray, int]]]:  # fmt: skip
    """The shape of the whole; of each argument that varies an array, and how many axes one run's value has."""
    vehicle_table, effect_table = _vehicles(vehicles), _effects(effects)
    first = vehicle_table.flat[0]
    wheels, places = first.wheels, first.rollers_per_wheel - 1
    arrays = {
        "vehicle": (vehicle_table, 0),
        "effects": (effect_table, 0),
        "nu": (checks.speeds(nu), 1),
        "chi": _number_or_trailing("chi", chi, (wheels,)),
        "spins": _number_or_trailing("spins", spins, (wheels, places)),
        "pose": (validation.trailing("pose", pose, (3,)), 1),
        "duration": (validation.real_array("duration", duration), 0),
    }
    checks.wheel_angles_in_contact(chi, first)
    checks.free_spins(spins, first, ROLLER_MODEL.checked(roller_model))
    for length in arrays["duration"][0].flat:
        by_name(RUN)["duration"].checked(float(length))
    shape: tuple[int, ...] = ()
    for name, (array, axes) in arrays.items():
        lead = array.shape[: array.ndim - axes]
        if 0 in lead:
            raise InvalidValueError(name, f"array of shape {array.shape}", "must hold at least one run")
        try:
            shape = np.broadcast_shapes(shape, lead)
        except ValueError:
            bound = f"leading axes do not broadcast with {shape}"
            raise InvalidValueError(name, f"array of shape {array.shape}", bound) from None
    return shape, arrays


def _all_runs(shape: tuple[int, ...], arrays: dict[str, tuple[np.ndarray, int]]) -> list[Run]:
    """The arguments of each run in C order."""
    count, columns = math.prod(shape), {}
    for name, (array, axes) in arrays.items():
        of_runs = np.broadcast_to(array, shape + array.shape[array.ndim - axes :])
        of_runs = of_runs.reshape(count, *of_runs.shape[len(shape) :])
        # A number by itself is checked as one, which costs less than an array of it.
        columns[name] = list(of_runs) if axes else of_runs.tolist()
    return [dict(zip(columns, run, strict=True)) for run in zip(*columns.values(), strict=True)]


def _check_memory(shape: tuple[int, ...], vehicle: Vehicle, roller_model: str, times: int, memory: float) -> None:
    """Refuse a sweep whose runs and samples would not have room, before anything is made of it."""
    memory, runs = by_name(RUN)["memory"].checked(memory), math.prod(shape)
    free = vehicle.wheels * (vehicle.rollers_per_wheel + 1) if roller_model == "free" else 0
    state = 8 * (NUMBERS_BESIDE_WHEELS + 2 * vehicle.wheels + free)
    least = runs * (BYTES_OF_A_RUN + (1 + times) * state)
    if least > memory:
        kept = f"{runs} runs" + (f" of {times} samples" if times else "")
        bound = f"must be at least {least:.3g} for {kept}: {shown_bytes(least)}; or make several sweeps"
        raise InvalidValueError("memory", memory, bound)


def _vehicles(vehicles: Any) -> np.ndarray:
    try:
        table = np.array(vehicles, dtype=object)
    except Exception:  # an object whose own code fails
        table = np.empty(0)
    if table.size == 0 or table.ndim > MOST_AXES or not all(isinstance(vehicle, Vehicle) for vehicle in table.flat):
        raise InvalidValueError("vehicles", vehicles, "must be a Vehicle or nested lists of Vehicles")
    sizes = {(vehicle.wheels, vehicle.rollers_per_wheel) for vehicle in table.flat}
    if len(sizes) > 1:
        raise InvalidValueError("vehicles", sorted(sizes), "must have the same (wheels, rollers_per_wheel)")
    return table


def _effects(effects: Any, depth: int = 0) -> np.ndarray:
    """Nested lists of sequences of effects as an array (...) of tuples; one sequence by itself has the shape ()."""
    if isinstance(effects, (str, Effect)) or not isinstance(effects, Sequence) or depth > MOST_AXES:
        raise InvalidValueError("effects", effects, "must be a sequence of effects, or nested lists of such sequences")
    if not effects or any(not isinstance(entry, Sequence) for entry in effects):
        table = np.empty((), object)
        table[()] = tuple(effects)
        return table
    parts = [_effects(entry, depth + 1) for entry in effects]
    if len({part.shape for part in parts}) > 1:
        raise InvalidValueError("effects", effects, "nested lists must have one length in each depth")
    table = np.empty((len(parts), *parts[0].shape), object)
    for row, part in zip(table, parts, strict=True) if parts[0].shape else ():
        row[...] = part
    if not parts[0].shape:
        for k, part in enumerate(parts):
            table[k] = part[()]
    return table


def _number_or_trailing(name: str, value: ArrayLike, shape: tuple[int, ...]) -> tuple[np.ndarray, int]:
    array = validation.real_array(name, value)
    return (array, 0) if array.ndim == 0 else (validation.trailing(name, value, shape), len(shape))


def _size(times: ArrayLike | None) -> int:
    """How many samples of a run are kept; 0 where nobody can say: such times are refused where they are read."""
    try:
        return 0 if times is None else np.size(times)
    except Exception:  # ragged or nested too deep, or an object whose own code fails
        return 0


def _times(times: ArrayLike, runs: list[Run]) -> np.ndarray:
    wanted = validation.real_array("times", times)
    if wanted.ndim != 1:
        raise InvalidValueError("times", wanted.tolist(), "must have one axis")
    for run in runs:
        first, last = run["start_time"], run["start_time"] + run["duration"]
        if wanted.size and not first <= wanted.min() <= wanted.max() <= last:
            bound = f"must lie within every run, {float(first)!r} to {float(last)!r}"
            raise InvalidValueError("times", wanted.tolist(), bound)
    return wanted


def _warn_of_effects(runs: list[Run]) -> None:
    """Once for each doubt about the effects of a vehicle."""
    pairs = {(run["vehicle"], id(run["effects"])): run["effects"] for run in runs if run["effects"]}
    acting = ((vehicle, tuple(e for e in effects if isinstance(e, Effect))) for (vehicle, _), effects in pairs.items())
    doubts = (doubt for vehicle, effects in acting for doubt in EffectSet(effects).doubts(vehicle))
    for doubt in {str(doubt): doubt for doubt in doubts}.values():
        warnings.warn(doubt, stacklevel=3)


def _warn(many: Many, accuracy: float) -> None:
    above = np.count_nonzero(many.error_estimate > accuracy)
    if above:
        said = f"{above} of {many.stopped.size} runs: the error may be above the accuracy {accuracy:g}"
        largest = f"largest estimate {np.nanmax(many.error_estimate):.2g}"
        warnings.warn(f"{said}; {largest}", AccuracyWarning, stacklevel=3)
