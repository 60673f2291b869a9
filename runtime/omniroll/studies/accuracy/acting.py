"""What acts on a vehicle, in the number type of a reference solution: curves, samples and modes of the effects.

The doubles that the effects are made of are the problem's data, and are taken as exact. All that a run computes from
them (signals, samples, events) is computed here anew; no code is shared with the engines.
"""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll.effects.effect import Called, Modal, Process, Sampler, Table
from omniroll.effects.numbers import Curve
from omniroll.engine.runs import Task
from omniroll.engine.switching import EPS
from omniroll.errors import OmnirollError
from omniroll.generated.python import parts
from omniroll.vehicles.state import State

Number = Callable[[float], Any]


@dataclass(frozen=True)
class Event:
    """Where constant + slope t + weights . nu becomes positive, a wheel's mode changes; size: of its largest terms."""

    constant: Any
    slope: Any
    weights: list[Any]
    size: float
    wheel: int
    follows: int

    def value(self, time: Any, nu: list[Any]) -> Any:
        return self.constant + self.slope * time + self._weighted(nu)

    def change(self, modes: np.ndarray) -> None:
        modes[self.wheel] = self.follows

    def rate(self, nu_dot: list[Any]) -> Any:
        return self.slope + self._weighted(nu_dot)

    def _weighted(self, nu: list[Any]) -> Any:
        """The sum over the first three numbers of a state or of its rates."""
        return sum(weight * value for weight, value in zip(self.weights, nu, strict=False))


class Sampling:
    """A sampled controller: its sums, and the output that it holds."""

    def __init__(self, form: Sampler, wheels: int, number: Number):
        self.form, self.samples, self.number = form, 0, number
        self.sums = self.output = [number(0.0)] * wheels

    def next_time(self) -> float:
        return self.samples * self.form.sample_time

    def take(self, state: State, nu: list[Any], wheel_speeds: Callable[[list[Any]], list[Any]]) -> None:
        """Rules of the controller: where the output is cut off, the sum waits."""
        number, form = self.number, self.form
        wanted, _ = after(form.target, self.next_time(), number(self.next_time()), number)
        errors = wheel_speeds([w - v for w, v in zip(wanted, nu, strict=True)])
        gains = [[number(g) for g in gain.tolist()] for gain in (form.proportional, form.integral)]
        sums, outputs = parts.controller_sample(len(errors), 0, errors, self.sums, *gains, number(form.sample_time))
        kept = [abs(float(output)) <= form.limit for output in outputs]
        self.output = [
            output if within else number(float(np.copysign(form.limit, float(output))))
            for output, within in zip(outputs, kept, strict=True)
        ]
        self.sums = [s if within else old for s, old, within in zip(sums, self.sums, kept, strict=True)]
        self.samples += 1


class Calling:
    """A Python function as a controller, which computes in doubles: its process, and the output that it holds."""

    def __init__(self, process: Process, wheels: int, number: Number):
        self.process, self.number = process, number
        self.output = [number(0.0)] * wheels

    def next_time(self) -> float:
        return self.process.next_time()

    def take(self, state: State, nu: list[Any], wheel_speeds: Callable[[list[Any]], list[Any]]) -> None:
        self.process.pass_time(state)
        self.output = [self.number(output) for output in self.process.output.tolist()]


class Acting:
    """What acts in one run. `signals` {name: (values, slopes)} and `events` are those of the phase that `begin` starts.

    Raises OmnirollError for an effect that gives its process in no such form.
    """

    def __init__(self, task: Task, number: Number):
        self.number, self.wheels = number, task.kernel.wheels
        forms: list[Any] = []
        self.samplers: list[tuple[str, Sampling | Calling]] = []
        for effect in task.effects.effects:
            process = effect.process(task.kernel, task.start_time)
            given = process.compiled()
            if given is None:
                raise OmnirollError(f"no reference solution with {type(effect).__name__}: it acts through Python code")
            forms += given
            for form in given:
                if isinstance(form, Sampler):
                    self.samplers.append((form.signal, Sampling(form, self.wheels, number)))
                elif isinstance(form, Called):
                    self.samplers.append((form.signal, Calling(process, self.wheels, number)))
        self.tables = [form for form in forms if isinstance(form, Table)]
        self.drives = [(form, np.zeros(self.wheels, int)) for form in forms if isinstance(form, Modal)]
        self.last_known = 0.0  # the last known time that has come
        self.signals: dict[str, tuple[list[Any], list[Any]]] = {}
        self.events: list[tuple[Event, np.ndarray]] = []

    def next_time(self) -> float:
        """The first time known beforehand that has not come; a sample may stand at 0."""
        knots = [knot for table in self.tables for knot in table.curve.knots.tolist() if knot > self.last_known]
        return min([*knots, *(sampling.next_time() for _, sampling in self.samplers)], default=np.inf)

    def pass_time(
        self, time: float, state: State, nu: list[Any], wheel_speeds: Callable[[list[Any]], list[Any]]
    ) -> None:
        """A known time has come, in the state with these numbers nu; `state` has it in doubles."""
        for _, sampling in self.samplers:
            if sampling.next_time() <= time:
                sampling.take(state, nu, wheel_speeds)
        self.last_known = max(time, self.last_known)

    def begin(self, now: Any) -> None:
        """A phase starts at `now`, after the last known time that has come and before the next one."""
        self.signals, self.events = {}, []
        for table in self.tables:
            self._add(table.signal, *after(table.curve, self.last_known, now, self.number))
        for signal, sampling in self.samplers:
            self._add(signal, sampling.output, [self.number(0.0)] * self.wheels)
        for drive, modes in self.drives:
            self._drive(drive, modes)

    def passed(self, y: list[Any]) -> list[tuple[Event, np.ndarray]]:
        """Events that are passed in a state y, whose first numbers are nu and whose last is the phase's time."""
        return [(event, modes) for event, modes in self.events if is_beyond(event.value(y[-1], y), event.size)]

    def at(self, time: Any) -> dict[str, list[Any]]:
        """The signals at a time that counts from the phase's start."""
        return {
            name: [value + slope * time for value, slope in zip(values, slopes, strict=True)]
            for name, (values, slopes) in self.signals.items()
        }

    def _add(self, name: str, values: list[Any], slopes: list[Any]) -> None:
        zero = [self.number(0.0)] * self.wheels
        before = self.signals.get(name, (zero, zero))
        self.signals[name] = tuple(
            [a + b for a, b in zip(one, other, strict=True)]
            for one, other in zip(before, (values, slopes), strict=True)
        )

    def _drive(self, drive: Modal, modes: np.ndarray) -> None:
        """The torques and the damping of a drive with modes, and the events that end the modes."""
        number, torques, dampings = self.number, [], []
        zero = [number(0.0)] * self.wheels
        values, slopes = self.signals.get(drive.signal, (zero, zero))
        for wheel, mode in enumerate(modes):
            law = [[number(n) for n in row] for row in drive.laws[mode, wheel].tolist()]
            torques.append((law[0][0] + law[0][1] * values[wheel], law[0][1] * slopes[wheel]))
            dampings.append(-law[0][2])
            for here, event, follows in drive.transitions.tolist():
                if here == mode:
                    at_zero, per_signal, per_rate = law[1 + event]
                    weights = [per_rate * number(w) for w in drive.wheel_rows[wheel].tolist()]
                    constant = at_zero + per_signal * values[wheel]
                    size = abs(float(at_zero)) + abs(float(per_signal * values[wheel]))
                    self.events.append(
                        (Event(constant, per_signal * slopes[wheel], weights, size, wheel, follows), modes)
                    )
        self._add("torque", [t for t, _ in torques], [s for _, s in torques])
        self._add("damping", dampings, zero)


def is_beyond(value: Any, size: float) -> bool:
    """More than what doubles tell from zero: what has just been landed on is not passed again."""
    return float(value) > EPS * size


def after(curve: Curve, known: float, now: Any, number: Number) -> tuple[list[Any], list[Any]]:
    """Values and slopes of a curve at `now`, which lies in the segment that starts at the known time or before it."""
    place = bisect_right(curve.knots.tolist(), known) - 1
    held = [number(v) for v in curve.values[max(place, 0)].tolist()]
    if place < 0 or place == len(curve.knots) - 1 or curve.interpolation == "hold":
        return held, [number(0.0)] * len(held)
    start, end = (number(knot) for knot in curve.knots[place : place + 2].tolist())
    following = [number(v) for v in curve.values[place + 1].tolist()]
    slopes = [(b - a) / (end - start) for a, b in zip(held, following, strict=True)]
    return [a + slope * (now - start) for a, slope in zip(held, slopes, strict=True)], slopes
