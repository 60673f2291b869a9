"""Reference solutions over the generated Python kernel, by methods that no integrator under test uses.

taylor        Taylor series in 28 digits (python-flint): each pass through the kernel gives one more coefficient
extrapolated  Gragg's rule extrapolated (Bulirsch and Stoer) in NumPy's long double; it confirms the first

Both follow the switching model (omniroll.engine.switching has the rules) with code of their own. `confirmed` makes the
first and says how far the second is from it. Results are kept in long double: in double their rounding alone would be
more.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omniroll import extras
from omniroll.engine.runs import SWITCHES_WITHOUT_PROGRESS, Task
from omniroll.engine.switching import tau
from omniroll.errors import SimulationStopped
from omniroll.studies.accuracy.acting import is_beyond
from omniroll.studies.accuracy.deviation import deviation
from omniroll.studies.accuracy.mechanics import Mechanics, middle
from omniroll.vehicles.state import State

DIGITS, ORDER = 28, 26
TAYLOR_ERROR = 1e-22  # relative error of a Taylor step
COLUMNS = 6  # columns of the extrapolation table; further ones would lose digits to rounding
EXTRAPOLATED_STEP = 0.05  # longest step: the fastest wheel turns by this part of the joint's angle
EXTRAPOLATION_ERROR = 1e-17  # relative error of the last column but one
LANDING = 7  # steps of Newton's rule that locate a joint, from a linear guess
HALVINGS = 10  # before secants locate where an axle breaks away
FINER = 100.0  # no error is shown that is smaller than this many times the reference's own
LEAST = 1e-18  # the reference's own error is never taken as smaller
LONGEST = 100_000  # steps before a run is given up


@dataclass
class Reference:
    """The motion in long double: samples y (T, 6 + N) = nu, chi, pose and energy (T,) at `times`, contact (T, N).

    switches   [(t, wheel, direction)], in order
    confirmed  how far a second solution is from this one: the largest of the distances of deviation.py
    """

    times: np.ndarray
    y: np.ndarray
    contact: np.ndarray
    energy: np.ndarray
    switches: list[tuple[Any, int, int]] = field(default_factory=list)
    confirmed: float = math.inf

    @property
    def floor(self) -> float:
        """The smallest error that is shown."""
        return FINER * max(self.confirmed, LEAST)


def confirmed(task: Task, times: np.ndarray) -> Reference:
    """The motion of `task` by Taylor series, compared with the extrapolated one at all `times`. Of both the task's
    `progress` is told."""
    with digits():
        reference = follow(Taylor(task), task, times)
    gaps = deviation(follow(Extrapolated(task), task, times), reference, task).values()
    reference.confirmed = math.inf if any(math.isnan(gap) for gap in gaps) else max(gaps)
    return reference


def flint_module() -> Any:
    """python-flint. Raises MissingPackageError where it is missing."""
    return extras.needed("flint", "accuracy", "the reference solution")


@contextmanager
def digits(count: int = DIGITS, order: int = ORDER) -> Iterator[None]:
    """The working precision of python-flint, which is global to it; put back afterwards."""
    context = flint_module().ctx
    before = context.prec, context.cap
    context.dps, context.cap = count, order + 1
    try:
        yield
    finally:
        context.prec, context.cap = before


class Taylor:
    """Steps by Taylor series of python-flint's balls, whose midpoints are taken. Use it inside digits().

    mechanics  other than those of the task
    order      of the series
    error      of a step, relative; None: TAYLOR_ERROR
    """

    probes = 12

    def __init__(self, task: Task, mechanics: Mechanics | None = None, order: int = ORDER, error: float | None = None):
        self.flint = flint = flint_module()
        self.mechanics = Mechanics(task, flint.arb) if mechanics is None else mechanics
        self.order, self.error = order, TAYLOR_ERROR if error is None else error

    def step(self, y: list, limit: Any) -> tuple[Any, Callable[[Any], list]]:
        """A step's length, at most `limit`, and y at any time within it."""
        series = self.flint.arb_series
        coefficients = [[value] for value in y]
        for k in range(self.order):
            now = [series(c, k + 1) for c in coefficients]
            for c, rate in zip(coefficients, self.mechanics.rates(now), strict=True):
                c.append(series(rate)[k].mid() / (k + 1))
        h = float(limit)
        size = max(float(self.mechanics.joint), *(abs(float(value)) for value in y))  # a vehicle may start from rest
        for c in coefficients:
            for order in (self.order - 1, self.order):
                last = abs(float(c[order]))
                if last > 0:
                    h = min(h, 0.9 * (self.error * size / last) ** (1 / order))

        def at(time: Any) -> list:
            return [horner(c, time).mid() for c in coefficients]

        return (limit if h == float(limit) else self.flint.arb(h)), at


def horner(coefficients: list, time: Any) -> Any:
    total = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        total = total * time + c
    return total


class Extrapolated:
    """Steps by Gragg's rule with 2, 4, 6 ... parts, extrapolated to a part length of zero, in long double."""

    probes = 2

    def __init__(self, task: Task):
        self.mechanics = Mechanics(task, np.longdouble)
        self.part = 1.0  # the last step's length over the longest step's

    def step(self, y: list, limit: Any) -> tuple[Any, Callable[[Any], list]]:
        m = self.mechanics
        y = np.array(y, np.longdouble)

        def rates(values: np.ndarray) -> np.ndarray:
            return np.array(m.rates(list(values)), np.longdouble)

        slope = rates(y)
        speed = np.abs(slope[3 : 3 + m.wheels]).max()
        gain = np.abs(np.array(m.wheel_speeds(list(slope[:3])), np.longdouble)).max()
        way, most = EXTRAPOLATED_STEP * m.joint, limit
        if speed > 0:
            most = min(most, way / speed)
        if gain > 0:
            most = min(most, np.sqrt(2 * way / gain))
        h = min(limit, most * self.part)
        while True:
            end, apart = self._extrapolate(rates, y, slope, h)
            missed = apart / max(float(m.joint), float(np.abs(y).max()))
            if missed <= EXTRAPOLATION_ERROR or self.part < 1e-3:
                break
            self.part, h = self.part / 2, h / 2
        self.part = min(1.0, 1.1 * self.part)
        return h, lambda time: list(end if time == h else self._extrapolate(rates, y, slope, time)[0])

    @staticmethod
    def _extrapolate(rates: Callable, y: np.ndarray, slope: np.ndarray, h: Any) -> tuple[np.ndarray, float]:
        """y after h, and how far the last two columns are apart."""
        table: list[np.ndarray] = []
        parts = [2 * (k + 1) for k in range(COLUMNS)]
        for k, count in enumerate(parts):
            part = h / count
            before, now = y, y + part * slope
            for _ in range(count - 1):
                before, now = now, before + 2 * part * rates(now)
            row = [(before + now + part * rates(now)) / 2]
            for j in range(1, k + 1):
                ratio = np.longdouble(count) / parts[k - j]
                row.append(row[j - 1] + (row[j - 1] - table[j - 1]) / (ratio * ratio - 1))
            table = row
        return table[-1], float(np.abs(table[-1] - table[-2]).max())


def follow(method: Taylor | Extrapolated, task: Task, times: np.ndarray) -> Reference:
    """The motion of `task` from its start, by a method; samples at `times` counted from there, which rise."""
    return _Following(method, task, times).reference()


def end_of(method: Taylor | Extrapolated, task: Task) -> tuple[list, Any]:
    """y and the free rollers' axial speeds at the end of the motion of `task`, in the method's own numbers."""
    following = _Following(method, task, np.zeros(0))
    following.reference()
    return following.y, following.axial


class _Following:
    """One run: phases by the method, and what happens between them."""

    def __init__(self, method: Taylor | Extrapolated, task: Task, times: np.ndarray):
        self.method, self.m, self.task, self.times = method, method.mechanics, task, times
        self.y, self.axial = self.m.start()
        if self.m.axles is not None:
            self.m.axles.see(self.y[:3])
        self.contact = np.zeros(self.m.wheels, int)
        self.now = self.phase_start = self.m.number(0.0)
        self.end = self.m.number(task.duration)
        self.sampled: list[tuple[list, np.ndarray, Any]] = []
        self.switches: list[tuple[Any, int, int]] = []
        self.idle = 0

    def reference(self) -> Reference:
        self._switch(self._due_at_start())
        for _ in range(LONGEST):
            self._begin()
            if not self.end > self.now:
                return self._result()
            self._step()
            if self.task.progress is not None:
                self.task.progress(float(self.now), self.task.duration)
            if self.idle > SWITCHES_WITHOUT_PROGRESS * self.m.wheels:
                raise self._stopped("switches without progress in time")
        raise self._stopped(f"the reference solution needs more than {LONGEST} steps")

    def _begin(self) -> None:
        """Known times that have come, events that are passed at once; then what acts from now on."""
        m, acting = self.m, self.m.acting
        while True:
            if acting is not None and acting.next_time() <= float(self.now):
                acting.pass_time(acting.next_time(), self._in_doubles(), m.view(self.y, "nu"), m.wheel_speeds)
                continue
            self.y = m.begin(self.y, self.axial, self.now)
            passed = [] if acting is None else acting.passed(self.y)
            if not passed:
                return
            self._change_modes(passed)

    def _in_doubles(self) -> State:
        nu, chi, pose = (np.array([float(v) for v in self.m.view(self.y, name)]) for name in ("nu", "chi", "pose"))
        return State(nu, chi, pose, self.contact.copy())

    def _step(self) -> None:
        """One step, up to a switch, an event, a known time or the end."""
        m = self.m
        known = np.inf if m.acting is None else m.acting.next_time()
        goal = min(self.end, m.number(known), key=float) if known < np.inf else self.end
        h, at = self.method.step(self.y, goal - self.now)
        exits = exits_in(m, at, h, self.method.probes)
        if exits:
            h = min((exit_.time for exit_ in exits), key=float)
        arrived = not exits and float(goal - self.now - h) <= 0
        while len(self.sampled) < len(self.times) and self.now + h > m.number(self.times[len(self.sampled)]):
            self._sample(at(m.number(self.times[len(self.sampled)]) - self.now))
        self.y, self.now = at(h), goal if arrived else self.now + h
        self.axial = m.axial_at(self.y, self.axial)
        together = tau(float(self.now) + self.task.start_time, float(self.now - self.phase_start))
        reached = [exit_ for exit_ in exits if float(exit_.time - h) < together]
        self._change_modes([exit_.of for exit_ in reached if exit_.wheel is None])
        self._switch({exit_.wheel: exit_.of for exit_ in reached if exit_.wheel is not None})
        if reached:
            self.idle = self.idle + 1 if float(self.now - self.phase_start) <= together else 0
            self.phase_start = self.now

    def _switch(self, moves: dict[int, int]) -> None:
        if not moves:
            return
        self.y, self.axial = self.m.switched(self.y, self.axial, moves)
        if self.m.axles is not None:
            self.m.axles.see(self.y[:3])
        for i, direction in moves.items():
            self.contact[i] = (self.contact[i] - direction) % self.m.rollers
            self.switches.append((extended(self.now), i, direction))

    @staticmethod
    def _change_modes(passed: list) -> None:
        for event, modes in passed:
            event.change(modes)

    def _due_at_start(self) -> dict[int, int]:
        """Wheels that start at their joints and move outwards, or rest there and will."""
        m = self.m
        self.y = m.begin(self.y, self.axial, self.now)
        rates = m.rates(self.y)
        speeds, gains = m.wheel_speeds(self.y[:3]), m.wheel_speeds(rates[:3])
        outward = [float(speed) or float(gain) for speed, gain in zip(speeds, gains, strict=True)]
        edge = float(m.joint)
        return {
            i: int(np.sign(float(self.y[3 + i])))
            for i in range(m.wheels)
            if abs(float(self.y[3 + i])) >= edge and float(self.y[3 + i]) * outward[i] > 0
        }

    def _sample(self, y: list) -> None:
        self.sampled.append((y, self.contact.copy(), self.m.axial_at(y, self.axial)))

    def _result(self) -> Reference:
        while len(self.sampled) < len(self.times):
            self._sample(self.y)
        shown = 6 + self.m.wheels
        rows = np.array([[extended(v) for v in one[:shown]] for one, _, _ in self.sampled])
        energy = np.array([extended(self.m.energy(one, its)) for one, _, its in self.sampled])
        return Reference(np.array(self.times), rows, np.array([c for _, c, _ in self.sampled]), energy, self.switches)

    def _stopped(self, reason: str) -> SimulationStopped:
        numbers, end = [float(v) for v in self.y], 3 + self.m.wheels
        state = {"nu": numbers[:3], "chi": numbers[3:end], "pose": numbers[end : end + 3]}
        state["contact"] = self.contact.tolist()
        return SimulationStopped(reason, t=self.task.start_time + float(self.now), wheel=None, state=state)


def extended(value: Any) -> np.longdouble:
    """A number in long double."""
    near = float(value)
    return np.longdouble(near) + np.longdouble(float(value - near))


@dataclass(frozen=True)
class Exit:
    """What ends a phase inside a step: a wheel at its joint (of: its direction), or an event (of: it and the modes)."""

    time: Any
    wheel: int | None
    of: Any


def exits_in(m: Mechanics, at: Callable, h: Any, probes: int) -> list[Exit]:
    """All that is first seen beyond its bound at one of the probes of a step, each at its own time."""
    margins = _margins(m)
    for k in range(1, probes + 1):
        time = h * k / probes
        y = at(time)
        beyond = [margin for margin in margins if is_beyond(margin.value(y), margin.size)]
        if beyond:
            before = h * (k - 1) / probes
            return [Exit(_landed(m, at, before, time, margin), margin.wheel, margin.of) for margin in beyond]
    return []


@dataclass(frozen=True)
class Margin:
    """A function of y whose zero ends the phase, and its rate from y and y', or None."""

    value: Callable[[list], Any]
    rate: Callable[[list], Any] | None
    size: float
    wheel: int | None
    of: Any


def _margins(m: Mechanics) -> list[Margin]:
    of_wheels = [
        Margin(
            lambda y, i=i, d=d: d * y[3 + i] - m.joint,
            lambda rates, i=i, d=d: d * rates[3 + i],
            float(m.joint), i, d,
        )
        for i in range(m.wheels)
        for d in (1, -1)
    ]  # fmt: skip
    of_events = [
        Margin(
            lambda y, e=event: e.value(y[-1], y), lambda rates, e=event: e.rate(rates), event.size, None, (event, modes)
        )
        for event, modes in (() if m.acting is None else m.acting.events)
    ]
    of_axles = [
        Margin(lambda y, k=k: m.excesses(y)[k].value, None, float(excess.reach), None, (excess.release, m.axles.modes))
        for k, excess in enumerate(m.excesses(m.before))
    ]
    return of_wheels + of_events + of_axles


def _landed(m: Mechanics, at: Callable, before: Any, time: Any, margin: Margin) -> Any:
    """The time of the margin's zero: by Newton's rule, or without a rate by halving from `before` and secants."""
    if margin.rate is None:
        return _enclosed(lambda t: middle(margin.value(at(t))), before, time)
    for _ in range(LANDING):
        y = at(time)
        time = middle(time - margin.value(y) / margin.rate(m.rates(y)))
    return time


def _enclosed(value: Callable[[Any], Any], low: Any, high: Any) -> Any:
    """Where a function that is positive at `high` and not at `low` is zero: halved, then by secants."""
    for _ in range(HALVINGS):
        half = middle((low + high) / 2)
        low, high = (low, half) if float(value(half)) > 0 else (half, high)
    before, after = value(low), value(high)
    if abs(float(before)) < abs(float(after)):
        low, before, high, after = high, after, low, before
    while abs(float(after)) < abs(float(before)):  # until rounding is all that is left
        following = middle(high - after * (high - low) / (after - before))
        low, before, high, after = high, after, following, value(following)
    return low
