"""Reference solutions over the generated Python kernel, by methods that no integrator under test uses.

taylor        Taylor series in 28 digits (python-flint): each pass through the kernel gives one more coefficient
extrapolated  Gragg's rule extrapolated (Bulirsch and Stoer) in NumPy's long double; it confirms the first

Both follow the switching model (omniroll.engine.switching has the rules) with code of their own. `confirmed` makes the
first and says how far the second is from it. Results are kept in long double: in double their rounding alone would be
more.
"""

import importlib
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omniroll.engine.runs import SWITCHES_WITHOUT_PROGRESS, Task
from omniroll.engine.switching import tau
from omniroll.errors import OmnirollError, SimulationStopped
from omniroll.kernels import sets
from omniroll.studies.accuracy.deviation import deviation

DIGITS, ORDER = 28, 26
TAYLOR_ERROR = 1e-22  # relative error of a Taylor step
COLUMNS = 6  # columns of the extrapolation table; further ones would lose digits to rounding
EXTRAPOLATED_STEP = 0.05  # longest step: the fastest wheel turns by this part of the joint's angle
EXTRAPOLATION_ERROR = 1e-17  # relative error of the last column but one
LANDING = 7  # steps of Newton's rule that locate a joint, from a linear guess
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
    """The motion of `task` by Taylor series, compared with the extrapolated one at all `times`."""
    with digits():
        reference = follow(Taylor(task), task, times)
    gaps = deviation(follow(Extrapolated(task), task, times), reference, task).values()
    reference.confirmed = math.inf if any(math.isnan(gap) for gap in gaps) else max(gaps)
    return reference


class Mechanics:
    """The generated Python kernel in a number type; numbers are made from floats, exactly, by `number`."""

    def __init__(self, task: Task, number: Callable[[float], Any]):
        bound = task.kernel
        self.task, self.number = task, number
        self.module = sets.python_module(bound.base, bound.effects)
        self.wheels, self.rollers = bound.wheels, bound.rollers_per_wheel
        constants = [_numbers(value.tolist(), number) for value in bound.constants]
        self.model = self.module.prepare(self.wheels, self.rollers, *constants)
        self.joint = elementary().circle_ratio(number(1.0)) / self.rollers
        self.free = bound.has_spins

    def form(self, name: str) -> Callable:
        """The generated function for the rollers' tips."""
        return getattr(self.module, self.task.kernel.form(name))

    def momenta(self, axial: Any) -> tuple:
        return (self.module.momenta(self.model, axial),) if self.free else ()

    def rates(self, y: list, momenta: tuple) -> list:
        """y' of y = (nu, chi, x, y, theta)."""
        nu, chi = y[:3], y[3 : 3 + self.wheels]
        nu_dot = self.form("forward_dynamics")(self.model, nu, chi, *momenta)
        return [*nu_dot, *self.module.wheel_speeds(self.model, nu), *self.module.pose_rates(self.model, nu, y[-1])]

    def energy(self, y: list, axial: Any) -> Any:
        nu, chi = y[:3], y[3 : 3 + self.wheels]
        if not self.free:
            return self.module.energy(self.model, nu, chi)
        return self.module.energy(self.model, nu, chi, self.module.spins_from_axial(self.model, nu, chi, axial))

    def switched(self, y: list, axial: Any, moves: dict[int, int]) -> tuple[list, Any]:
        """y and the free rollers' axial speeds [N][n-1] after the wheels in `moves` have switched together."""
        nu, chi = y[:3], y[3 : 3 + self.wheels]
        after = [-moves[i] * self.joint if i in moves else chi[i] for i in range(self.wheels)]
        zero = self.number(0.0)
        _, left_with = self.module.wheel_rates(self.model, nu, chi)
        _, demanded = self.module.wheel_rates(self.model, nu, after)
        entering, leaving = [zero] * self.wheels, [zero] * self.wheels
        if self.free:
            spins = self.module.spins_from_axial(self.model, nu, chi, axial)
            contact = self.module.contact_axial(self.model, nu, chi)
            axial = [list(wheel) for wheel in axial]
        for i, direction in moves.items():
            spin = zero
            if self.free:
                spin = spins[i][-1] if direction > 0 else spins[i][0]
                axial[i] = [contact[i], *axial[i][:-1]] if direction > 0 else [*axial[i][1:], contact[i]]
            else:
                leaving[i] = left_with[i]
            entering[i] = spin - demanded[i]
        if self.task.switching == "impact" and hasattr(self.module, "impact"):
            nu = self.form("impact")(self.model, nu, after, entering, leaving)
        return [*nu, *after, *y[-3:]], axial


def _numbers(value: Any, number: Callable[[float], Any]) -> Any:
    """Nested lists of floats as such lists of numbers."""
    return [_numbers(inner, number) for inner in value] if isinstance(value, list) else number(value)


def elementary() -> Any:
    return importlib.import_module("omniroll.generated.python.elementary")


def flint_module() -> Any:
    """python-flint. Raises OmnirollError where it is missing."""
    try:
        return importlib.import_module("flint")
    except ImportError:
        raise OmnirollError(
            "the reference solution needs python-flint, which is missing: pip install 'omniroll[accuracy]'"
        ) from None


@contextmanager
def digits() -> Iterator[None]:
    """The working precision of python-flint, which is global to it; put back afterwards."""
    context = flint_module().ctx
    before = context.prec, context.cap
    context.dps, context.cap = DIGITS, ORDER + 1
    try:
        yield
    finally:
        context.prec, context.cap = before


class Taylor:
    """Steps by Taylor series of python-flint's balls, whose midpoints are taken. Use it inside digits()."""

    probes = 12

    def __init__(self, task: Task):
        self.flint = flint = flint_module()
        self.mechanics = Mechanics(task, flint.arb)

    def step(self, y: list, momenta: tuple, limit: Any) -> tuple[Any, Callable[[Any], list]]:
        """A step's length, at most `limit`, and y at any time within it."""
        series = self.flint.arb_series
        coefficients = [[value] for value in y]
        for k in range(ORDER):
            now = [series(c, k + 1) for c in coefficients]
            for c, rate in zip(coefficients, self.mechanics.rates(now, momenta), strict=True):
                c.append(series(rate)[k].mid() / (k + 1))
        h = float(limit)
        size = max(abs(float(value)) for value in y)
        for c in coefficients:
            for order in (ORDER - 1, ORDER):
                last = abs(float(c[order]))
                if last > 0:
                    h = min(h, 0.9 * (TAYLOR_ERROR * size / last) ** (1 / order))

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

    def step(self, y: list, momenta: tuple, limit: Any) -> tuple[Any, Callable[[Any], list]]:
        m = self.mechanics
        y = np.array(y, np.longdouble)

        def rates(values: np.ndarray) -> np.ndarray:
            return np.array(m.rates(list(values), momenta), np.longdouble)

        slope = rates(y)
        fastest = np.abs(slope[3 : 3 + m.wheels]).max()
        most = EXTRAPOLATED_STEP * m.joint / fastest if fastest > 0 else limit
        h = min(limit, most * self.part)
        while True:
            end, missed = self._extrapolate(rates, y, slope, h)
            if missed <= EXTRAPOLATION_ERROR or self.part < 1e-3:
                break
            self.part, h = self.part / 2, h / 2
        self.part = min(1.0, 1.1 * self.part)
        return h, lambda time: list(end if time == h else self._extrapolate(rates, y, slope, time)[0])

    @staticmethod
    def _extrapolate(rates: Callable, y: np.ndarray, slope: np.ndarray, h: Any) -> tuple[np.ndarray, float]:
        """y after h, and how far the last two columns are apart, relative to y."""
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
        apart = np.abs(table[-1] - table[-2]).max()
        return table[-1], float(apart / np.abs(y).max()) if apart > 0 else 0.0


def follow(method: Taylor | Extrapolated, task: Task, times: np.ndarray) -> Reference:
    """The motion of `task` from its start, by a method; samples at `times` counted from there, which rise."""
    m = method.mechanics
    state = task.state
    y = [m.number(float(value)) for value in (*state.nu, *state.chi, *state.pose)]
    free = state.free_axial()
    axial = None if free is None else [[m.number(float(v)) for v in wheel] for wheel in free]
    contact = np.zeros(m.wheels, int)
    now, phase_start, end = m.number(0.0), m.number(0.0), m.number(task.duration)
    sampled, wanted, switches = [], list(times), []
    idle = 0
    y, axial = _due_at_start(m, y, axial, contact, switches)
    for _ in range(LONGEST):
        h, at = method.step(y, m.momenta(axial), end - now)
        crossings = _crossings(m, at, h, method.probes)
        if crossings:
            h = min((time for time, _ in crossings.values()), key=float)
        while wanted and now + h > m.number(wanted[0]):
            sampled.append((at(m.number(wanted.pop(0)) - now), contact.copy(), axial))
        y, now = at(h), now + h
        if crossings:
            together = tau(float(now) + task.start_time, float(now - phase_start))
            moves = {i: d for i, (time, d) in crossings.items() if float(time - h) < together}
            y, axial = m.switched(y, axial, moves)
            for i, direction in moves.items():
                contact[i] = (contact[i] - direction) % m.rollers
                switches.append((extended(now), i, direction))
            idle = idle + 1 if float(now - phase_start) <= together else 0
            phase_start = now
        if not end > now:
            break
        if idle > SWITCHES_WITHOUT_PROGRESS * m.wheels:
            raise _stopped(task, "switches without progress in time", now, y, contact)
    else:
        raise _stopped(task, f"the reference solution needs more than {LONGEST} steps", now, y, contact)
    sampled += [(y, contact.copy(), axial) for _ in wanted]
    rows = np.array([[extended(v) for v in one] for one, _, _ in sampled])
    energy = np.array([extended(m.energy(one, its)) for one, _, its in sampled])
    return Reference(np.array(times), rows, np.array([c for _, c, _ in sampled]), energy, switches)


def extended(value: Any) -> np.longdouble:
    """A number in long double."""
    near = float(value)
    return np.longdouble(near) + np.longdouble(float(value - near))


def _stopped(task: Task, reason: str, now: Any, y: list, contact: np.ndarray) -> SimulationStopped:
    numbers = [float(v) for v in y]
    state = {"nu": numbers[:3], "chi": numbers[3:-3], "pose": numbers[-3:], "contact": contact.tolist()}
    return SimulationStopped(reason, t=task.start_time + float(now), wheel=None, state=state)


def _due_at_start(m: Mechanics, y: list, axial: Any, contact: np.ndarray, switches: list) -> tuple[list, Any]:
    """Wheels that start at their joints and move outwards switch at once."""
    speeds = m.module.wheel_speeds(m.model, y[:3])
    edge = float(m.joint)
    moves = {
        i: int(np.sign(float(y[3 + i])))
        for i in range(m.wheels)
        if abs(float(y[3 + i])) >= edge and float(y[3 + i]) * float(speeds[i]) > 0
    }
    for i, direction in moves.items():
        contact[i] = (contact[i] - direction) % m.rollers
        switches.append((np.longdouble(0.0), i, direction))
    return m.switched(y, axial, moves) if moves else (y, axial)


def _crossings(m: Mechanics, at: Callable, h: Any, probes: int) -> dict[int, tuple[Any, int]]:
    """{wheel: (time in the step, direction)} of the wheels that leave their rollers in the step."""
    left: dict[int, tuple[Any, int]] = {}
    for k in range(1, probes + 1):
        y = at(h * k / probes)
        for i in range(m.wheels):
            if i not in left and abs(float(y[3 + i])) > float(m.joint):
                left[i] = (h * k / probes, 1 if float(y[3 + i]) > 0 else -1)
        if left:
            break
    exits = {}
    for i, (time, direction) in left.items():
        for _ in range(LANDING):
            y = at(time)
            speed = m.module.wheel_speeds(m.model, y[:3])[i]
            time = time - (y[3 + i] - direction * m.joint) / speed
            time = time.mid() if hasattr(time, "mid") else time
        exits[i] = (time, direction)
    return exits
