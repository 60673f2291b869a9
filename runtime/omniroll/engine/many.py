"""simulate_many(): runs over parameters and starts, arrays in and arrays out, in threads or on any executor.

A run of the compiled engine takes place in C with the interpreter's lock released. What a run leaves is read off its
buffers; a trajectory is made only where samples are asked for.
"""

import math
import os
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_EXCEPTION,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.control import Controlled, controlling, making, sensitivity
from omniroll.engine.outlook import shown_bytes
from omniroll.engine.runs import MEMORY
from omniroll.engine.simulate import checked_task
from omniroll.engine.works import NOBODY_ELSE, Work, result_of, side_by_side
from omniroll.errors import AccuracyWarning, InvalidValueError, SweepInterrupted
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.progress import Report, reporting
from omniroll.results.on_demand import MadeOnDemand, Maker, OnDemand
from omniroll.results.slipping import Contacts
from omniroll.results.trajectory import Samples, Trajectory
from omniroll.vehicles import checks
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, RUN, STATE, SWITCHING, by_name, documented

CHUNKS_PER_WORKER = 8  # of runs: a progress bar moves, and fast workers take more of them
GLANCE = 0.1  # s between two looks at what threads have done: each look takes the interpreter from them
TOGETHER = 0.02  # s in which a group of runs is done, so that an interruption loses little
MOST_TOGETHER = 4  # runs of a group: what they write should stay in the cache of a core
ON_DEMAND = ("contact_spin", "spins", "energy")  # of Samples
SAMPLED = ("t", "nu", "chi", "contact", "pose", *ON_DEMAND)
COUNTS = ("switches", "steps", "evaluations")
MOST_AXES = 32  # of nested lists: what a list that holds itself exceeds
NUMBERS_BESIDE_WHEELS = 8  # of a sample: t, nu, pose, energy
BYTES_OF_A_RUN = 4000  # its arguments and what is kept of it, measured
NOT_RUN = "interrupted before it was run"

Run = dict[str, Any]  # the arguments of simulate for one run
Found = dict[str, Any]  # what is kept of one run


@dataclass(frozen=True, eq=False, repr=False)
class Ends(MadeOnDemand):
    """The states at the ends of many runs: the fields of Samples, each with the shape (...) of the runs in front.

    made  how contact_spin, spins and energy are computed when they are first read
    """

    t: np.ndarray
    nu: np.ndarray
    chi: np.ndarray
    contact: np.ndarray
    pose: np.ndarray
    made: dict[str, Maker]

    contact_spin = OnDemand()
    spins = OnDemand()
    energy = OnDemand()


@dataclass(frozen=True, eq=False, repr=False)
class Many(MadeOnDemand):
    """The ends of many runs; `...` is the shape to which vehicles, starts and effects broadcast.

    end             the state at each run's end, with the fields of Samples: t (...), nu (..., 3), chi (..., N), ...
    energy_start    (...) in J
    switches        (...) int, how many wheels switched; steps, evaluations (...) int likewise
    error_estimate  (...) as in Trajectory.stats, nan where there is none
    sensitivity     (...) likewise; two further runs each measure it when it is first read
    stopped         (...) bool: the run could not go on, and `end` is where it stopped; or it failed, and `end` is nan
                    (contact -1)
    reasons         {index: message} of these runs
    samples         Samples at `times`, shapes (..., T, ...), or None; nan, or -1 for contact, beyond the end of
                    a stopped run
    made            how energy_start and sensitivity are computed when they are first read
    """

    end: Ends
    switches: np.ndarray
    steps: np.ndarray
    evaluations: np.ndarray
    error_estimate: np.ndarray
    stopped: np.ndarray
    reasons: dict[tuple[int, ...], str]
    samples: Samples | None
    made: dict[str, Maker]

    energy_start = OnDemand()
    sensitivity = OnDemand()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape (...) of the runs."""
        return self.stopped.shape

    def __repr__(self) -> str:
        return f"<Many: {self.stopped.size} runs {self.shape}, {np.count_nonzero(self.stopped)} stopped>"


@dataclass(frozen=True)
class Chunk:
    """Some runs, as they go to a worker of an executor: plain data that pickles."""

    runs: tuple[Run, ...]
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
    shape, arrays = _arrays(vehicles, effects, nu, chi, spins, pose, duration, roller_model)
    _check_memory(shape, arrays["vehicle"][0].flat[0], roller_model, _size(times), memory)
    runs = [run | common for run in _all_runs(shape, arrays)]
    checked_task(**runs[0])
    _warn_of_effects(runs)
    times = None if times is None else _times(times, runs)
    sweep = _Sweep(runs, times, control)
    try:
        with reporting(progress or False, len(runs), "runs") as report:
            sweep.in_threads(report) if executor is None else sweep.on(executor, report)
    except KeyboardInterrupt:
        raise SweepInterrupted(_gathered(shape, sweep)) from None
    many = _gathered(shape, sweep)
    _warn(many, accuracy)
    return many


# The runs


def _arrays(
    vehicles: Any,
    effects: Any,
    nu: ArrayLike,
    chi: ArrayLike,
    spins: ArrayLike,
    pose: ArrayLike,
    duration: ArrayLike,
    roller_model: str,
) -> tuple[tuple[int, ...], dict[str, tuple[np.ndarray, int]]]:
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
            raise InvalidValueError(
                name, f"array of shape {array.shape}", f"leading axes do not broadcast with {shape}"
            ) from None
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


# Out to the workers and back


class _Sweep:
    """Runs, and what was found of each in the same order; None of those that have not been done."""

    def __init__(self, runs: list[Run], times: np.ndarray | None, control: bool):
        self.runs, self.times, self.control = runs, times, control
        self.found: list[Found | None] = [None] * len(runs)

    def in_threads(self, report: Report) -> None:
        """In a thread for each core. What is done stays where the work is interrupted; no run is begun after that."""
        cores = min(_cores(), len(self.runs))
        left, done, turn = deque(range(len(self.runs))), deque((0,)), threading.Lock()

        def work() -> None:
            for places, found in _in_groups(left, cores, self._begun, turn):
                for k, of_run in zip(places, found, strict=True):
                    self.found[k] = of_run
                done.append(len(places))

        with ThreadPoolExecutor(cores) as pool:
            working = {pool.submit(work) for _ in range(cores)}
            try:
                while working:
                    ended, working = wait(working, GLANCE, FIRST_EXCEPTION)
                    report(sum(done), len(self.runs))
                    for future in ended:
                        future.result()
            finally:
                left.clear()

    def _begun(self, k: int) -> Work[Found]:
        return _finding(self.runs[k], self.times, self.control)

    def on(self, executor: Executor, report: Report) -> None:
        """On an executor: each of its workers gets chunks. What comes back of a chunk that failed is its error.

        A pool of processes breaks as a whole where one of them dies. What it did not do is done apart.
        """
        lost: list[range] = []

        def keep(places: range, future: Future) -> None:
            try:
                of_chunk = future.result()
            except BrokenExecutor:
                lost.append(places)
                return
            except Exception as error:
                of_chunk = [{"reason": f"its worker failed: {_shown(error)}"} for _ in places]
            self.found[places.start : places.stop] = of_chunk

        futures: dict[Future, range] = {}
        for places in self._chunks(_cores()):
            try:
                futures[executor.submit(run_chunk, self._chunk(places))] = places
            except BrokenExecutor:
                lost.append(places)
        try:
            self._collect(futures, report, keep)
        except BaseException:
            for future, places in futures.items():
                if not future.cancel() and future.done():
                    keep(places, future)
            raise
        self._apart(lost)

    def _apart(self, lost: list[range]) -> None:
        """Runs in a process beside this one, a new one where it dies; a chunk that ends it is done run by run."""
        pool = None
        while lost:
            places = lost.pop(0)
            pool = pool or ProcessPoolExecutor(1)
            try:
                self.found[places.start : places.stop] = pool.submit(run_chunk, self._chunk(places)).result()
            except BrokenExecutor as error:
                pool.shutdown()
                pool = None
                if len(places) > 1:
                    lost[:0] = [range(k, k + 1) for k in places]
                else:
                    self.found[places.start] = {"reason": f"its worker died: {_shown(error)}"}
        if pool is not None:
            pool.shutdown()

    def _chunk(self, places: range) -> Chunk:
        return Chunk(tuple(self.runs[k] for k in places), self.times, self.control)

    def _chunks(self, workers: int) -> list[range]:
        count = len(self.runs)
        size = max(1, math.ceil(count / (CHUNKS_PER_WORKER * workers)))
        return [range(k, min(k + size, count)) for k in range(0, count, size)]

    def _collect(self, futures: dict[Future, range], report: Report, keep: Callable[[range, Future], None]) -> None:
        done = 0
        for future in as_completed(futures):
            keep(futures[future], future)
            done += len(futures[future])
            report(done, len(self.runs))


def _cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_chunk(chunk: Chunk) -> list[Found]:
    """The work of one worker: do the runs of a chunk and keep of each what Many shows."""
    left = deque(range(len(chunk.runs)))
    groups = _in_groups(left, 1, lambda k: _finding(chunk.runs[k], chunk.times, chunk.control))
    return [found for _, of_group in groups for found in of_group]


def _in_groups(
    left: deque[int], workers: int, begun: Callable[[int], Work[Found]], turn: AbstractContextManager = NOBODY_ELSE
) -> Iterator[tuple[list[int], list[Found]]]:
    """Take numbers of runs that are left, as many at a time as end within TOGETHER; what is kept of each.

    workers  how many take them: the last groups are small, so that they end together
    turn     as of result_of
    """
    size = 1
    while places := _taken(left, min(size, math.ceil(len(left) / (2 * workers)))):
        began = time.perf_counter()
        yield places, result_of(side_by_side([begun(k) for k in places]), turn)
        pace = (time.perf_counter() - began) / len(places)
        size = max(1, min(MOST_TOGETHER, int(TOGETHER / pace)))


def _taken(left: deque[int], count: int) -> list[int]:
    """The next ones; fewer, or none, where others have taken them."""
    places = []
    with suppress(IndexError):
        for _ in range(count):
            places.append(left.popleft())
    return places


def _finding(run: Run, times: np.ndarray | None, control: bool) -> Work[Found]:
    """What is kept of one run: where it ended, or how it failed."""
    try:
        task = checked_task(**run)
        if control and task.duration > 0:
            done = yield from controlling(task)
        else:
            done = Controlled((yield from making(task, task.accuracy)), None, lambda: None)
        stats, stopped = done.run.stats(), done.run.stop
        found = done.run.end() | {name: stats[name] for name in COUNTS}
        found |= {"reason": None if stopped is None else str(stopped), "start_axial": task.state.free_axial()}
        found["start_speeds"] = task.effects.own_speeds(task.kernel, task.state)
        found["error_estimate"] = None if stopped is not None else done.error_estimate
        found["samples"] = None if times is None else _samples(done.run.recorded(), times)
        done.run.release()
    except Exception as error:  # whatever it is, it must not take the others along
        return {"reason": _shown(error)}
    return found


def _shown(error: Exception) -> str:
    return str(error) if isinstance(error, InvalidValueError) else f"{type(error).__name__}: {error}"


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
        result[name] = _nothing((len(times), *values.shape[1:]), values.dtype)
        result[name][within] = values
    return result


def _nothing(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """What stands where there is no number: nan, or -1."""
    dtype = np.dtype(dtype)
    return np.full(shape, -1 if dtype.kind in "iu" else np.nan, dtype)


# Arrays


def _gathered(shape: tuple[int, ...], sweep: _Sweep) -> Many:
    found = [{"reason": NOT_RUN} if one is None else one for one in sweep.found]

    def of(name: str, kind: Any = float, default: Any = None) -> np.ndarray:
        return _stacked(shape, [one.get(name, default) for one in found], kind)

    samples = None
    if sweep.times is not None:
        parts = [one.get("samples") or {} for one in found]
        stacked = {name: _stacked(shape, [p.get(name) for p in parts], _kind(name)) for name in SAMPLED}
        made = {name: partial(stacked.get, name) for name in ON_DEMAND}
        samples = Samples(**{name: stacked[name] for name in SAMPLED if name not in made}, made=made)
    states = _States(shape, sweep.runs, found)
    wheels = sweep.runs[0]["vehicle"].wheels
    missing = {"t": np.nan, "nu": np.full(3, np.nan), "pose": np.full(3, np.nan), "chi": np.full(wheels, np.nan)}
    return Many(
        end=Ends(
            **{name: of(name, default=value) for name, value in missing.items()},
            contact=of("contact", int, np.full(wheels, -1)),
            made={
                "contact_spin": lambda: states.of_vehicles(_contact_spins),
                "spins": lambda: states.of_vehicles(lambda k, nu, chi, spins, contacts: spins),
                "energy": lambda: states.of_vehicles(_energy),
            },
        ),
        **{name: of(name, int, 0) for name in COUNTS},
        error_estimate=np.array([_number(one.get("error_estimate")) for one in found]).reshape(shape),
        stopped=np.array([one["reason"] is not None for one in found], bool).reshape(shape),
        reasons={k: one["reason"] for k, one in zip(np.ndindex(shape), found, strict=True) if one["reason"]},
        samples=samples,
        made={
            "energy_start": lambda: states.of_vehicles(_energy, start=True),
            "sensitivity": lambda: _sensitivities(shape, sweep, found),
        },
    )


def _stacked(shape: tuple[int, ...], values: list[Any], kind: type = float) -> np.ndarray | None:
    """(..., ...) of one array from each run, nan or -1 where a run has none; None where no run has one."""
    sizes = {np.shape(value) for value in values if value is not None}
    if not sizes:
        return None
    (size,) = sizes
    return np.array([_nothing(size, kind) if value is None else value for value in values], kind).reshape(shape + size)


def _kind(name: str) -> type:
    return int if name == "contact" else float


def _number(value: float | None) -> float:
    return np.nan if value is None else value


def _contact_spins(
    bound: Kernel, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None, contacts: Contacts | None
) -> np.ndarray:
    return bound.wheel_rates(nu, chi)[1] if contacts is None else contacts.spins(nu, chi)


def _energy(
    bound: Kernel, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None, contacts: Contacts | None
) -> np.ndarray:
    if contacts is not None:
        return contacts.energy(nu, chi, spins)
    return bound.energy(nu, chi, *bound.spins_or_nothing(spins))


class _States:
    """What follows from the states at the starts and ends of runs, by the kernels of their vehicles."""

    def __init__(self, shape: tuple[int, ...], runs: list[Run], found: list[Found]):
        self.shape, self.runs, self.found = shape, runs, found

    def of_vehicles(self, function: Callable, *, start: bool = False) -> np.ndarray | None:
        """(..., ...) function(kernel, nu, chi, spins, contacts) of the states at the ends or starts, all of a vehicle
        at once; contacts are Contacts where wheels may slip, else None."""
        values: list[Any] = [None] * len(self.runs)
        for bound, effects, places in self._by_kernel():
            nu, chi, axial = (self._of(name, places, start) for name in ("nu", "chi", "axial"))
            spins = bound.spins_from_axial(nu, chi, axial) if bound.has_spins else None
            contacts = self._contacts(effects, places, start) if effects.slips else None
            for k, value in zip(places, _each(function(bound, nu, chi, spins, contacts), len(places)), strict=True):
                values[k] = value
        return _stacked(self.shape, values)

    def _contacts(self, effects: EffectSet, places: list[int], start: bool) -> Contacts:
        """Those of some runs. Their spins and energies do not depend on the law of the ground."""
        run, name = self.runs[places[0]], "start_speeds" if start else "speeds"
        of_runs = [self.found[k][name] for k in places]
        speeds = {each: np.array([one[each] for one in of_runs]) for each in of_runs[0]}
        return Contacts(effects.kernel(run["vehicle"], run["roller_model"], "python"), speeds)

    def _of(self, name: str, places: list[int], start: bool) -> np.ndarray | None:
        if not start:
            values = [self.found[k][name] for k in places]
        elif name == "axial":
            values = [self.found[k]["start_axial"] for k in places]
        else:
            values = [self.runs[k][name] for k in places]
        if start and name == "chi":
            values = [
                checks.wheel_angles_in_contact(chi, self.runs[k]["vehicle"])
                for k, chi in zip(places, values, strict=True)
            ]
        return None if values[0] is None else np.array(values, float)

    def _by_kernel(self) -> Iterator[tuple[Kernel, EffectSet, list[int]]]:
        """Each Python kernel, which works on all states at once, with effects of one of its runs, and the runs."""
        groups: dict[tuple[Vehicle, bool], list[int]] = {}
        acting: dict[tuple[Vehicle, bool], EffectSet] = {}
        for k, (run, one) in enumerate(zip(self.runs, self.found, strict=True)):
            if "nu" in one:
                effects = EffectSet.checked(run["effects"], run["vehicle"])
                key = effects.equipped(run["vehicle"]), effects.slips
                groups.setdefault(key, []).append(k)
                acting.setdefault(key, effects)
        for key, places in groups.items():
            yield kernel(key[0], self.runs[0]["roller_model"], "python"), acting[key], places


def _each(values: np.ndarray | None, count: int) -> Iterable[Any]:
    return [None] * count if values is None else values


def _sensitivities(shape: tuple[int, ...], sweep: _Sweep, found: list[Found]) -> np.ndarray:
    """(...) of the runs that have an error estimate; nan for the others."""

    def of_run(run: Run, one: Found) -> float:
        if one.get("error_estimate") is None:
            return np.nan
        value = sensitivity(checked_task(**run))
        return np.nan if value is None else value

    with ThreadPoolExecutor(_cores()) as pool:
        return np.array(list(pool.map(of_run, sweep.runs, found)), float).reshape(shape)


def _warn(many: Many, accuracy: float) -> None:
    above = np.count_nonzero(many.error_estimate > accuracy)
    if above:
        warnings.warn(
            f"{above} of {many.stopped.size} runs: the error may be above the accuracy {accuracy:g}; "
            f"largest estimate {np.nanmax(many.error_estimate):.2g}",
            AccuracyWarning,
            stacklevel=3,
        )
