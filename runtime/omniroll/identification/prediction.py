"""What a model says that a log should read, and how that changes with its numbers."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

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

ACCURACY = 1e-10
STEP = 1e-5  # of the central differences, in sizes of a number: truncation and the runs' errors are both 1e-5 of it
HALF_A_COUNT = 0.5  # whole counts are rounded down

Readings = dict[str, np.ndarray]


def readings(model: Model, log: Log) -> Readings:
    """(T, ...) what the log should read, by name."""
    return _read(model, log, run_of(model, log))


def run_of(model: Model, log: Log) -> Trajectory:
    """The run of a model over the time of a log."""
    options = dict(model.options) | dict(log.start)
    start = options.get("start_time", 0.0)
    late = LONGEST_DELAY if any(name.endswith("_delay") for name in model.corrections) else 0.0
    options |= {"duration": float(log.t[-1]) - start + late, "accuracy": ACCURACY, "control": False}
    return simulate(model.vehicle, **options | {"effects": _driven(options.get("effects", ()), log)})


def sweep(models: Sequence[Model], logs: Sequence[Log]) -> list[list[Readings]]:
    """The readings of each log by each model. Models that differ in their instruments alone share a run.

    Runs take place in C, in a thread for each core.
    """
    first = {_motion(model): model for model in models}

    def made(model: Model) -> list[Trajectory]:
        return [run_of(model, log) for log in logs]

    with ThreadPoolExecutor(_cores()) as pool:
        runs = dict(zip(first, pool.map(made, first.values()), strict=True))
    return [[_read(model, log, run) for log, run in zip(logs, runs[_motion(model)], strict=True)] for model in models]


def slopes(model: Model, names: Sequence[str], logs: Sequence[Log]) -> tuple[list[Readings], list[list[Readings]]]:
    """The readings of each log, and for each number their derivatives by it, by central differences."""
    steps = {name: STEP * model.size(name) for name in names}
    ahead_and_behind = [
        model.with_values({name: model.value(name) + side * step}) for name, step in steps.items() for side in (1, -1)
    ]
    base, *others = sweep([model, *ahead_and_behind], logs)
    found = []
    for (_, step), ahead, behind in zip(steps.items(), others[::2], others[1::2], strict=True):
        found.append([
            {name: (a[name] - b[name]) / (2 * step) for name in a} for a, b in zip(ahead, behind, strict=True)
        ])  # fmt: skip
    return base, found


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


def _read(model: Model, log: Log, run: Trajectory) -> Readings:
    found = {}
    for names, delay in _by_delay(model, log).items():
        times, back = np.unique(np.clip(log.t - delay, run.t[0], run.t[-1]), return_inverse=True)
        true = _true(run, times, model.instruments, names)
        found |= {name: _corrected(model, name, value[back]) for name, value in true.items()}
    return {name: found[name] for name in log.fitted}


def _by_delay(model: Model, log: Log) -> Mapping[tuple[str, ...], float]:
    """The readings that are late by the same time, together."""
    delays = {name: model.corrections.get(f"{name}_delay", 0.0) for name in log.fitted}
    return {tuple(name for name in delays if delays[name] == delay): delay for delay in set(delays.values())}


def _true(run: Trajectory, times: np.ndarray, instruments: Instruments, names: Sequence[str]) -> Readings:
    """What ideal instruments read; counts of encoders before they are made whole."""
    asked = {"wheel_angle" if name == "encoder_count" else name for name in names} - {"pose"}
    found = run.measure(times, instruments, tuple(asked)) if asked else {}
    if "encoder_count" in names:
        found["encoder_count"] = found["wheel_angle"] * (instruments.counts_per_turn / (2 * np.pi)) - HALF_A_COUNT
    if "pose" in names:
        found["pose"] = run.sample(times).pose
    return {name: found[name] for name in names}


def _corrected(model: Model, name: str, true: np.ndarray) -> np.ndarray:
    scale, bias = (model.corrections.get(f"{name}_{kind}", NEUTRAL[kind]) for kind in ("scale", "bias"))
    return scale * true + bias
