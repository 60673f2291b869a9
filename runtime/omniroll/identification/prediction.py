"""What a model says that a log should read, and how that changes with its numbers."""

import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from omniroll.effects.bearings import Bearings
from omniroll.effects.effect import Effect
from omniroll.effects.motor import Motor
from omniroll.effects.torque import Drive, TorqueTable
from omniroll.engine.simulate import simulate
from omniroll.errors import InvalidValueError
from omniroll.identification.exact import exact_slopes
from omniroll.identification.late import by_delay, read_times
from omniroll.identification.log import Log
from omniroll.identification.model import LONGEST_DELAY, Model
from omniroll.results.measurements import ANGLE_OF, Instruments, counts_per_rad
from omniroll.results.trajectory import Trajectory

ACCURACY = 1e-11
STEP = 1e-6  # of central differences, in sizes of a number: the errors of runs are 1e-5 of the differences
HALF_A_COUNT = 0.5  # whole counts are rounded down

OF_MOTORS: dict[str, dict[str, float | None]] = {  # drives by the name of a reading, and what motors are for them
    "motor_voltage": {},
    # A motor of 1 ohm that induces nothing takes as many amperes as it is given volts.
    "motor_current": {"resistance": 1.0, "back_emf": 0.0, "current_limit": None},
}

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
    true      (T, ...) the same before scale and bias, by name
    contacts  (T, N) the rollers in contact when each was read, by name
    order     (K, N) the rollers in contact after each switch
    """

    values: Readings
    true: Readings
    contacts: Readings
    order: np.ndarray


@dataclass(frozen=True)
class Slopes:
    """How what a model reads depends on its numbers.

    by_number    for each number the derivatives of the readings of each log
    differenced  names of the numbers for which they are differences of runs; the others are exact
    """

    by_number: list[list[Readings]]
    differenced: tuple[str, ...]


class Prediction:
    """What a model reads at the times of logs.

    runs  of the model, where there are such already; otherwise they are made when they are needed
    """

    def __init__(self, model: Model, logs: Sequence[Log], runs: Sequence[Trajectory] | None = None):
        self.model, self.logs = model, logs
        if runs is not None:
            self.runs = runs

    @cached_property
    def runs(self) -> Sequence[Trajectory]:
        return [run_of(self.model, log) for log in self.logs]

    @cached_property
    def reads(self) -> list[Read]:
        """For each log."""
        return [_read(self.model, log, run) for log, run in zip(self.logs, self.runs, strict=True)]

    @property
    def readings(self) -> list[Readings]:
        """For each log, by name."""
        return [read.values for read in self.reads]

    def slopes(self, names: Sequence[str], sizes: Sequence[float]) -> Slopes:
        """The derivatives by these numbers: by the sensitivities of the runs, and by differences where there are none.

        sizes  of the numbers, in which the changes are counted that make differences
        """
        of_logs = [
            exact_slopes(self.model, log, run, read.true, names)
            for log, run, read in zip(self.logs, self.runs, self.reads, strict=True)
        ]
        rest = {name: size for name, size in zip(names, sizes, strict=True) if not all(name in own for own in of_logs)}
        differences = dict(zip(rest, self._differences(rest), strict=True))
        by_number = [differences[name] if name in rest else [own[name] for own in of_logs] for name in names]
        return Slopes(by_number, tuple(rest))

    def _differences(self, sizes: Mapping[str, float]) -> Iterator[list[Readings]]:
        """For each of these numbers the derivatives of the readings of each log, by differences of runs.

        Runs take place in C, in a thread for each core.
        """
        steps = [STEP * size for size in sizes.values()]
        beside = [self._beside(name, step) for name, step in zip(sizes, steps, strict=True)]
        with ThreadPoolExecutor(_cores()) as pool:
            reads = pool.map(lambda prediction: prediction.reads, [side for sides in beside for side in sides])
        for step in steps:
            behind, ahead = next(reads), next(reads)
            yield [_slopes(*of_log, step) for of_log in zip(behind, self.reads, ahead, strict=True)]

    def _beside(self, name: str, step: float) -> list["Prediction"]:
        """What two models read whose number of this name is smaller and larger."""
        middle = max(self.model.value(name), self.model.least(name) + step)
        runs = None if self.model.sensitivities(name) else self.runs
        models = (self.model.with_values({name: middle + side * step}) for side in (-1, 1))
        return [Prediction(model, self.logs, runs) for model in models]


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
    if log.drive in OF_MOTORS:
        if not any(isinstance(effect, Motor) for effect in effects):
            raise InvalidValueError("drive", log.drive, "needs a Motor, [drive] with voltage, whose numbers it takes")
        rows |= {"voltage": log.data[log.drive]} | OF_MOTORS[log.drive]
        return tuple(replace(e, **rows) if isinstance(e, Motor) else e for e in effects)
    if log.drive == "torque" and any(isinstance(effect, Motor) for effect in effects):
        return tuple(_giving(e, log) if isinstance(e, Motor) else e for e in effects)
    table = TorqueTable(log.t, log.data[log.drive])
    replaced = Drive | Bearings if log.drive == "net_torque" else Drive
    return (table, *(effect for effect in effects if not isinstance(effect, replaced)))


def _giving(motor: Motor, log: Log) -> Motor:
    """A motor that gives the torques of a log at the axles; its rotor turns with the wheel all the same."""
    ratio = motor.gear_ratio
    volts = np.sign(ratio) * log.data["torque"]
    rows = {"times": log.t, "interpolation": "linear", "voltage": volts, "torque_constant": 1 / abs(ratio)}
    return replace(motor, **rows | OF_MOTORS["motor_current"])


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _read(model: Model, log: Log, run: Trajectory) -> Read:
    true, contacts = {}, {}
    for names, delay in by_delay(model, log).items():
        times, back = np.unique(read_times(log, delay, run), return_inverse=True)
        found = _true(run, times, model.instruments, names)
        for name in names:
            true[name], contacts[name] = found[name][back], found["contact_roller"][back]
    order = run.contact[1:][(run.contact[1:] != run.contact[:-1]).any(axis=1)]
    true = {name: true[name] for name in log.fitted}
    return Read({name: _corrected(model, name, value) for name, value in true.items()}, true, contacts, order)


def _true(run: Trajectory, times: np.ndarray, instruments: Instruments, names: Sequence[str]) -> Readings:
    """What ideal instruments read, and the rollers in contact; counts of encoders before they are made whole."""
    asked = {ANGLE_OF.get(name, name) for name in names} - {"pose"}
    ideal = replace(instruments, resolution={}, noise={}, bias={})
    found = run.measure(times, ideal, (*asked, "contact_roller"))
    for name in asked - found.keys():
        needed = "a Motor as the only drive" if name.startswith("motor") else "tracking_places of the instruments"
        raise InvalidValueError("readings", name, f"needs {needed}; `readings` leaves columns alone")
    for name in ANGLE_OF.keys() & set(names):
        found[name] = found[ANGLE_OF[name]] * counts_per_rad(instruments, name) - HALF_A_COUNT
    if "pose" in names:
        found["pose"] = run.sample(times).pose
    return found


def _corrected(model: Model, name: str, true: np.ndarray) -> np.ndarray:
    return model.correction(name, "scale") * true + model.correction(name, "bias")
