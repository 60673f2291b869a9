"""What a model says that a log should read, and how that changes with its numbers."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from omniroll.effects.bearings import Bearings
from omniroll.effects.effect import Effect
from omniroll.effects.motor import Motor
from omniroll.effects.torque import Drive, TorqueTable
from omniroll.engine.simulate import simulate
from omniroll.identification.log import Log
from omniroll.identification.model import LONGEST_DELAY, NEUTRAL, Model
from omniroll.results.measurements import Instruments
from omniroll.results.trajectory import Trajectory

ACCURACY = 1e-11
STEP = 1e-6  # of the central differences, in sizes of a number: the errors of runs are 1e-5 of the differences
HALF_A_COUNT = 0.5  # whole counts are rounded down

Readings = dict[str, np.ndarray]


def run_of(model: Model, log: Log) -> Trajectory:
    """The run of a model over the time of a log."""
    options = dict(model.options) | dict(log.start)
    start = options.get("start_time", 0.0)
    late = LONGEST_DELAY if any(name.endswith("_delay") for name in model.corrections) else 0.0
    options |= {"duration": float(log.t[-1]) - start + late, "accuracy": ACCURACY, "control": False}
    return simulate(model.vehicle, **options | {"effects": _driven(options.get("effects", ()), log)})


@dataclass(frozen=True)
class Read:
    """What a model reads at the times of a log.

    values    (T, ...) by name
    contacts  (T, N) the rollers in contact when each was read, by name
    order     (K, N) the rollers in contact after each switch
    """

    values: Readings
    contacts: Readings
    order: np.ndarray


def sweep(models: Sequence[Model], logs: Sequence[Log]) -> list[list[Read]]:
    """What each model reads at the times of each log. Models that differ in their instruments alone share a run.

    Runs take place in C, in a thread for each core.
    """
    first = {_motion(model): model for model in models}

    def made(model: Model) -> list[Trajectory]:
        return [run_of(model, log) for log in logs]

    with ThreadPoolExecutor(_cores()) as pool:
        runs = dict(zip(first, pool.map(made, first.values()), strict=True))
    return [[_read(model, log, run) for log, run in zip(logs, runs[_motion(model)], strict=True)] for model in models]


def slopes(model: Model, names: Sequence[str], sizes: Sequence[float], logs: Sequence[Log]) -> list[list[Readings]]:
    """For each number the derivatives of the readings of each log by it, by differences of runs.

    sizes  of the numbers, in which their changes are counted
    """
    steps = [STEP * size for size in sizes]
    middles = [max(model.value(name), model.least(name) + step) for name, step in zip(names, steps, strict=True)]
    beside = [
        model.with_values({name: middle + side * step})
        for name, middle, step in zip(names, middles, steps, strict=True)
        for side in (1, -1)
    ]
    base, *others = sweep([model, *beside], logs)
    return [
        [_slopes(*of_log, step) for of_log in zip(behind, base, ahead, strict=True)]
        for step, ahead, behind in zip(steps, others[::2], others[1::2], strict=True)
    ]


def _slopes(behind: Read, base: Read, ahead: Read, step: float) -> Readings:
    """Central differences; from one side where two wheels change the order of their switches on the other.

    Under impact the motion jumps there and has no derivative: a difference over the jump would be none.
    """
    same = [np.array_equal(read.order, base.order) for read in (behind, ahead)]
    low, high, width = behind, ahead, 2 * step
    if same == [True, False]:
        high, width = base, step
    elif same == [False, True]:
        low, width = base, step
    return {
        name: _between_switches((high.values[name] - value) / width, low.contacts[name] == high.contacts[name])
        for name, value in low.values.items()
    }


def _between_switches(slope: np.ndarray, alike: np.ndarray) -> np.ndarray:
    """Derivatives (T, ...) where the contacts (T, N) of two runs are alike; the last such row in the place of others.

    A reading between the two times of one switch has the switch's jump in its difference.
    """
    rows = np.flatnonzero(alike.all(axis=1))
    if len(rows) in (0, len(slope)):
        return slope
    return slope[rows[np.maximum(np.searchsorted(rows, np.arange(len(slope)), side="right") - 1, 0)]]


def _driven(effects: Sequence[Effect], log: Log) -> tuple[Effect, ...]:
    """The effects, driven by what the log says where it drives."""
    if log.drive is None:
        return tuple(effects)
    rows = {"times": log.t, "interpolation": "linear"}
    if log.drive == "motor_voltage":
        return tuple(replace(e, voltage=log.data[log.drive], **rows) if isinstance(e, Motor) else e for e in effects)
    table = TorqueTable(log.t, log.data[log.drive])
    return (table, *(effect for effect in effects if not isinstance(effect, Drive | Bearings)))


def _motion(model: Model) -> tuple[int, int]:
    """The same for models whose runs are the same."""
    return id(model.vehicle), id(model.options)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _read(model: Model, log: Log, run: Trajectory) -> Read:
    values, contacts = {}, {}
    for names, delay in _by_delay(model, log).items():
        times, back = np.unique(np.clip(log.t - delay, run.t[0], run.t[-1]), return_inverse=True)
        true = _true(run, times, model.instruments, names)
        for name in names:
            values[name], contacts[name] = _corrected(model, name, true[name][back]), true["contact_roller"][back]
    order = run.contact[1:][(run.contact[1:] != run.contact[:-1]).any(axis=1)]
    return Read({name: values[name] for name in log.fitted}, contacts, order)


def _by_delay(model: Model, log: Log) -> Mapping[tuple[str, ...], float]:
    """The readings that are late by the same time, together."""
    delays = {name: model.corrections.get(f"{name}_delay", 0.0) for name in log.fitted}
    return {tuple(name for name in delays if delays[name] == delay): delay for delay in set(delays.values())}


def _true(run: Trajectory, times: np.ndarray, instruments: Instruments, names: Sequence[str]) -> Readings:
    """What ideal instruments read, and the rollers in contact; counts of encoders before they are made whole."""
    asked = {"wheel_angle" if name == "encoder_count" else name for name in names} - {"pose"}
    found = run.measure(times, Instruments(place=instruments.place), (*asked, "contact_roller"))
    if "encoder_count" in names:
        found["encoder_count"] = found["wheel_angle"] * (instruments.counts_per_turn / (2 * np.pi)) - HALF_A_COUNT
    if "pose" in names:
        found["pose"] = run.sample(times).pose
    return found


def _corrected(model: Model, name: str, true: np.ndarray) -> np.ndarray:
    scale, bias = (model.corrections.get(f"{name}_{kind}", NEUTRAL[kind]) for kind in ("scale", "bias"))
    return scale * true + bias
