"""Columns of wheels in another order or with other signs than the model's: which arrangement a log fits better."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

from omniroll.errors import InvalidValueError, SimulationStopped
from omniroll.identification.log import Log
from omniroll.identification.model import Model
from omniroll.identification.prediction import Prediction

PER_WHEEL = ("wheel_angle", "encoder_count", "wheel_rate", "motor_current", "motor_voltage", "net_torque", "torque")
MOST_WHEELS = 4  # of which all orders are tried
BETTER = 0.5  # of what the order of the log leaves over, which a better one must not exceed


@dataclass(frozen=True)
class Arrangement:
    """An order of the columns of wheels: the model's wheel i is column order[i] of a log, from 0, times signs[i]."""

    order: tuple[int, ...]
    signs: tuple[int, ...]
    with_drive: bool

    def __str__(self) -> str:
        marks = ["-" if sign < 0 else "" for sign in self.signs]
        columns = ", ".join(f"{mark}{place + 1}" for mark, place in zip(marks, self.order, strict=True))
        return f"{columns} of readings{' and drive' if self.with_drive else ''}"

    def of(self, log: Log) -> Log:
        """The log in this arrangement."""
        data = dict(log.data)
        for name in PER_WHEEL:
            if name in data and (self.with_drive or name != log.drive):
                data[name] = data[name][:, list(self.order)] * np.array(self.signs)
        return replace(log, data=data)


def better_arrangement(model: Model, logs: Sequence[Log]) -> str | None:
    """A sentence on an arrangement in which the model, as it was before a fit, reads what the logs do; or None."""
    wheels = model.vehicle.wheels
    plain = Arrangement(tuple(range(wheels)), (1,) * wheels, False)
    base = _left(model, [plain.of(log) for log in logs])
    found = {one: _left(model, [one.of(log) for log in logs]) for one in _candidates(model, logs) if one != plain}
    best = min(found, key=found.__getitem__, default=plain)
    if found.get(best, base) > BETTER * base:
        return None
    return (
        f"with the wheels' columns {best} the model as it was leaves {percent(found[best])} of the readings, "
        f"and {percent(base)} as they are: are columns swapped?"
    )


def percent(share: float) -> str:
    """A share as text with two digits: 0.018 is 1.8 %, 4.83 is 480 %."""
    return f"{float(f'{100 * share:.2g}'):g} %"


def _candidates(model: Model, logs: Sequence[Log]) -> Iterator[Arrangement]:
    wheels = model.vehicle.wheels
    if (assigned := _assigned(model, logs)) is not None:
        yield assigned
    if wheels <= MOST_WHEELS and any(log.drive in PER_WHEEL for log in logs):
        for order in permutations(range(wheels)):
            for sign in (1, -1):
                yield Arrangement(order, (sign,) * wheels, True)


def _assigned(model: Model, logs: Sequence[Log]) -> Arrangement | None:
    """The columns of readings that are nearest to what the model reads of each wheel."""
    cost = np.zeros((2, model.vehicle.wheels, model.vehicle.wheels))  # of signs + and -, the model's wheels, columns
    for log, read in zip(logs, Prediction(model, logs).readings, strict=True):
        for name in set(PER_WHEEL) & set(read):
            given, wanted = log.data[name] / _size(log.data[name]), read[name] / _size(log.data[name])
            for k, sign in enumerate((1, -1)):
                cost[k] += np.mean((wanted[:, :, None] - sign * given[:, None, :]) ** 2, axis=0)
    if not cost.any():
        return None
    _, order = linear_sum_assignment(cost.min(axis=0))
    signs = tuple(1 if cost[0, i, j] <= cost[1, i, j] else -1 for i, j in enumerate(order))
    return Arrangement(tuple(order.tolist()), signs, False)


def _left(model: Model, logs: Sequence[Log]) -> float:
    """What the model leaves of the readings of wheels and the gyro, as a share of their size."""
    try:
        read = Prediction(model, logs).readings
    except (InvalidValueError, SimulationStopped):
        return np.inf
    shares = [
        np.mean((log.data[name] - values) ** 2) / _size(log.data[name]) ** 2
        for log, of_log in zip(logs, read, strict=True)
        for name, values in of_log.items()
    ]
    return float(np.sqrt(np.mean(shares)))


def _size(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) or 1.0
