"""simulate_many(): runs over parameters and starts, arrays in and arrays out, on any executor."""

import math
import os
import warnings
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects import Effect
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task, controlled_run, one_run
from omniroll.errors import AccuracyWarning, InvalidValueError, SimulationStopped
from omniroll.progress import Report, reporting
from omniroll.results.trajectory import Samples, Trajectory
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, RUN, STATE, SWITCHING, documented

TASKS_PER_WORKER = 8  # chunks of runs for each worker: a progress bar moves, and fast workers take more of them
SAMPLED = tuple(field.name for field in fields(Samples))
COUNTS = ("switches", "steps", "evaluations")


@dataclass(frozen=True, eq=False, repr=False)
class Many:
    """The ends of many runs; `...` is the shape to which vehicles and starts broadcast.

    end             Samples, the state at each run's end: t (...), nu (..., 3), chi (..., N), and so on
    energy_start    (...) in J
    switches        (...) int, how many wheels switched; steps, evaluations (...) int likewise
    error_estimate  (...) as in Trajectory.stats, nan where there is none; sensitivity (...) likewise
    stopped         (...) bool: the run could not go on; `end` is where it stopped
    reasons         {index: message} of the stopped runs
    samples         Samples at `times`, shapes (..., T, ...), or None; nan, or -1 for contact, beyond the end of
                    a stopped run
    """

    end: Samples
    energy_start: np.ndarray
    switches: np.ndarray
    steps: np.ndarray
    evaluations: np.ndarray
    error_estimate: np.ndarray
    sensitivity: np.ndarray
    stopped: np.ndarray
    reasons: dict[tuple[int, ...], str]
    samples: Samples | None

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape (...) of the runs."""
        return self.stopped.shape

    def __repr__(self) -> str:
        return f"<Many: {self.stopped.size} runs {self.shape}, {np.count_nonzero(self.stopped)} stopped>"


@dataclass(frozen=True)
class Chunk:
    """Some runs, as they go to a worker: plain data that pickles."""

    runs: tuple[dict[str, Any], ...]
    times: np.ndarray | None
    control: bool


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
    control: bool = True,
    effects: Sequence[Effect] = (),
    times: ArrayLike | None = None,
    executor: Executor | None = None,
    progress: bool | Report | None = None,
) -> Many:
    """Simulate many vehicles from many starts; each run is what `simulate` makes of its numbers.

    vehicles      Vehicle, or nested lists of them, all with the same N and n
    {entries}
    effects       sequence of effects, as of simulate
    control       as of simulate
    times         (T,) in s, when to take samples of every run, within every run; None: no samples
    executor      any concurrent.futures.Executor: processes, or a Dask cluster's Client.get_executor(). It is not
                  shut down. None: threads, one for each core, since the compiled engine runs without the lock of
                  the interpreter
    progress      True: a bar, or lines where tqdm is not installed; or a function, called as
                  progress(runs done, of how many); None: nothing

    nu, chi, spins, pose and duration may have leading axes (...), which broadcast with each other and with the shape
    of `vehicles`; the other arguments are the same for all runs.

    Returns Many. Raises InvalidValueError before the first run starts. A run that stops does not end the others: see
    Many.stopped. Warns once with AccuracyWarning where estimates stay above the accuracy, and with
    UnstableControllerWarning.
    """
    shape, runs = _all_runs(vehicles, nu, chi, spins, pose, duration)
    common = {
        "start_time": start_time, "roller_model": roller_model, "switching": switching,
        "accuracy": accuracy, "engine": engine, "effects": effects,
    }  # fmt: skip
    runs = [run | common for run in runs]
    tasks = [checked_task(**run) for run in runs]
    for doubt in {str(doubt): doubt for task in tasks for doubt in task.effects.doubts(task.vehicle)}.values():
        warnings.warn(doubt, stacklevel=2)
    times = None if times is None else _times(times, tasks)
    results = _scattered(runs, times, control, executor, progress)
    many = _gathered(shape, results, times)
    _warn(many, accuracy)
    return many


# The runs


def _all_runs(
    vehicles: Any, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike, pose: ArrayLike, duration: ArrayLike
) -> tuple[tuple[int, ...], list[dict[str, Any]]]:
    """The shape of the whole, and the arguments of each run in C order."""
    table = _vehicles(vehicles)
    first = table.flat[0]
    wheels, places = first.wheels, first.rollers_per_wheel - 1
    arrays = {
        "nu": (validation.trailing("nu", nu, (3,)), 1),
        "chi": _number_or_trailing("chi", chi, (wheels,)),
        "spins": _number_or_trailing("spins", spins, (wheels, places)),
        "pose": (validation.trailing("pose", pose, (3,)), 1),
        "duration": (validation.real_array("duration", duration), 0),
    }
    shape = table.shape
    for name, (array, axes) in arrays.items():
        lead = array.shape[: array.ndim - axes]
        try:
            shape = np.broadcast_shapes(shape, lead)
        except ValueError:
            raise InvalidValueError(
                name, f"array of shape {array.shape}", f"leading axes do not broadcast with {shape}"
            ) from None
    spread = {
        name: np.broadcast_to(array, shape + array.shape[array.ndim - axes :]) for name, (array, axes) in arrays.items()
    }
    table = np.broadcast_to(table, shape)
    return shape, [
        {"vehicle": table[index], **{name: array[index] for name, array in spread.items()}}
        for index in np.ndindex(shape)
    ]


def _vehicles(vehicles: Any) -> np.ndarray:
    table = np.array(vehicles, dtype=object)
    if table.size == 0 or not all(isinstance(vehicle, Vehicle) for vehicle in table.flat):
        raise InvalidValueError("vehicles", vehicles, "must be a Vehicle or nested lists of Vehicles")
    sizes = {(vehicle.wheels, vehicle.rollers_per_wheel) for vehicle in table.flat}
    if len(sizes) > 1:
        raise InvalidValueError("vehicles", sorted(sizes), "must have the same (wheels, rollers_per_wheel)")
    return table


def _number_or_trailing(name: str, value: ArrayLike, shape: tuple[int, ...]) -> tuple[np.ndarray, int]:
    array = validation.real_array(name, value)
    return (array, 0) if array.ndim == 0 else (validation.trailing(name, value, shape), len(shape))


def _times(times: ArrayLike, tasks: list[Task]) -> np.ndarray:
    wanted = validation.real_array("times", times)
    if wanted.ndim != 1:
        raise InvalidValueError("times", wanted.tolist(), "must have one axis")
    for task in tasks:
        last = task.start_time + task.duration
        if wanted.size and not task.start_time <= wanted.min() <= wanted.max() <= last:
            bound = f"must lie within every run, {task.start_time!r} to {last!r}"
            raise InvalidValueError("times", wanted.tolist(), bound)
    return wanted


# Out to the workers and back


def _scattered(
    runs: list[dict[str, Any]],
    times: np.ndarray | None,
    control: bool,
    executor: Executor | None,
    progress: bool | Report | None,
) -> list[dict[str, Any]]:
    """The results of the runs, in their order."""
    cores = os.cpu_count() or 1
    size = max(1, math.ceil(len(runs) / (TASKS_PER_WORKER * cores)))
    own = ThreadPoolExecutor(cores) if executor is None else nullcontext(executor)
    results: list[Any] = [None] * len(runs)
    with own as pool, reporting(progress or False, len(runs), "runs") as report:
        starts = {
            pool.submit(run_chunk, Chunk(tuple(runs[k : k + size]), times, control)): k
            for k in range(0, len(runs), size)
        }
        try:
            done = 0
            for future in as_completed(starts):
                of_chunk, k = future.result(), starts[future]
                results[k : k + len(of_chunk)] = of_chunk
                done += len(of_chunk)
                report(done, len(runs))
        except BaseException:
            for future in starts:
                future.cancel()
            raise
    return results


def run_chunk(chunk: Chunk) -> list[dict[str, Any]]:
    """The work of one worker: do the runs of a chunk and keep of each what Many shows."""
    return [_one(run, chunk.times, chunk.control) for run in chunk.runs]


def _one(run: dict[str, Any], times: np.ndarray | None, control: bool) -> dict[str, Any]:
    task, reason = checked_task(**run), None
    try:
        wanted = control and task.duration > 0
        trajectory = controlled_run(task) if wanted else one_run(task, task.accuracy)
    except SimulationStopped as error:
        trajectory, reason = error.trajectory, str(error)
    rows = {name: getattr(trajectory, name) for name in SAMPLED}
    kept = {name: None if array is None else array[-1] for name, array in rows.items()}
    kept |= {name: trajectory.stats[name] for name in (*COUNTS, "error_estimate", "sensitivity")}
    kept |= {"reason": reason, "energy_start": trajectory.energy[0]}
    kept["samples"] = None if times is None else _samples(trajectory, times)
    return kept


def _samples(trajectory: Trajectory, times: np.ndarray) -> dict[str, np.ndarray | None]:
    """Samples at the times; beyond the trajectory's end nan, or -1 where whole numbers stand."""
    within = times <= trajectory.t[-1]
    samples = trajectory.sample(times[within])
    result: dict[str, np.ndarray | None] = {}
    for name in SAMPLED:
        values = getattr(samples, name)
        if values is None:
            result[name] = None
            continue
        whole = values.dtype.kind in "iu"
        result[name] = np.full((len(times), *values.shape[1:]), -1 if whole else np.nan, values.dtype)
        result[name][within] = values
    return result


# Arrays


def _gathered(shape: tuple[int, ...], results: list[dict[str, Any]], times: np.ndarray | None) -> Many:
    def stacked(values: list[Any], dtype: Any = None) -> np.ndarray | None:
        if values and values[0] is None and dtype is None:
            return None
        array = np.array(values, dtype)
        return array.reshape(shape + array.shape[1:])

    def numbers(name: str) -> np.ndarray:
        return stacked([np.nan if run[name] is None else run[name] for run in results], float)

    samples = None
    if times is not None:
        samples = Samples(**{name: stacked([run["samples"][name] for run in results]) for name in SAMPLED})
    indices = np.ndindex(shape)
    return Many(
        end=Samples(**{name: stacked([run[name] for run in results]) for name in SAMPLED}),
        energy_start=numbers("energy_start"),
        **{name: stacked([run[name] for run in results], int) for name in COUNTS},
        error_estimate=numbers("error_estimate"),
        sensitivity=numbers("sensitivity"),
        stopped=stacked([run["reason"] is not None for run in results], bool),
        reasons={k: run["reason"] for k, run in zip(indices, results, strict=True) if run["reason"]},
        samples=samples,
    )


def _warn(many: Many, accuracy: float) -> None:
    above = np.count_nonzero(many.error_estimate > accuracy)
    if above:
        warnings.warn(
            f"{above} of {many.stopped.size} runs: the error may be above the accuracy {accuracy:g}; "
            f"largest estimate {np.nanmax(many.error_estimate):.2g}",
            AccuracyWarning,
            stacklevel=3,
        )
