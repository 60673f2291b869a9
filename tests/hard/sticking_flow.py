"""The true motion of a vehicle whose axles stick, in 28 digits: Taylor series phase by phase.

At each instant the law of friction is tried out for every choice of axles at rest that might stick, and of directions
for the others. There are three wheels, so that the torques of the axles that stick are unique.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import Mechanics
from omniroll.studies.accuracy.reference import Taylor, digits, flint_module

PROBES = 12  # of a step, at which it is asked whether something has passed
HALVINGS = 90
TOGETHER = 1e-18  # s: times that are closer are one
NOTHING = 1e-18  # of a torque, an acceleration or a rate: less is zero
STEPS = 10_000


@dataclass
class Motion:
    """y at the end, switches (t, wheel, direction), and the modes (t, (N,)) that phases began with: 0 sticks."""

    y: np.ndarray
    switches: list[tuple[float, int, int]] = field(default_factory=list)
    modes: list[tuple[float, tuple[int, ...]]] = field(default_factory=list)


def follow(task: Task, sliding: np.ndarray, holding: np.ndarray) -> Motion:
    """The motion of a task with friction in its axles; the torques are (N,) floats, taken as exact.

    The task has a Torque, and no such friction among its effects. Raises AssertionError where the law has no solution.
    """
    with digits():
        return _Following(task, sliding, holding).motion()


def solved(matrix: list[list], right: list[list]) -> list[list]:
    """The solution of a symmetric positive system with several right sides (columns), by elimination."""
    size = len(matrix)
    rows = [[*row, *sides] for row, sides in zip(matrix, right, strict=True)]
    for k in range(size):
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for j in range(size):
            if j != k:
                rows[j] = [a - rows[j][k] * b for a, b in zip(rows[j], rows[k], strict=True)]
    return [row[size:] for row in rows]


class Held(Mechanics):
    """The mechanics of a task with the torques of bearings. modes (N,): 0 sticks, +-1 is the direction of the rate."""

    def __init__(self, task: Task, sliding: np.ndarray):
        super().__init__(task, flint_module().arb)
        self.sliding, self.modes = [self.number(float(torque)) for torque in sliding], [1] * self.wheels
        unit = [self.wheel_speeds([self.number(float(j == k)) for j in range(3)]) for k in range(3)]
        self.rows = [[unit[k][i] for k in range(3)] for i in range(self.wheels)]
        self.taken: dict[int, Any] = {}  # torques of the axles that stick, at the last rates

    def begin(self, y: list, axial: Any, now: Any) -> list:
        y = super().begin(y, axial, now)
        values, slopes = self.acting.signals["torque"]
        bearings = [-mode * torque for mode, torque in zip(self.modes, self.sliding, strict=True)]
        self.acting.signals["torque"] = ([a + b for a, b in zip(values, bearings, strict=True)], slopes)
        return y

    def rates(self, y: list) -> list:
        """With torques that leave the rates of axles that stick as they are."""
        rates = super().rates(y)
        stuck = [i for i, mode in enumerate(self.modes) if mode == 0]
        if not stuck:
            return rates
        matrix = self.module.mass_matrix(self.model, self.view(y, "chi"))
        across = [[self.rows[i][k] for i in stuck] for k in range(3)]
        gained = solved(matrix, across)  # nu' for torques of 1
        response = [[_dot(self.rows[i], [row[j] for row in gained]) for j in range(len(stuck))] for i in stuck]
        torques = solved(response, [[-_dot(self.rows[i], rates[:3])] for i in stuck])
        self.taken = {i: torque for i, (torque,) in zip(stuck, torques, strict=True)}
        moved = [sum((row[j] * torques[j][0] for j in range(len(stuck))), self.number(0.0)) for row in gained]
        return [a + b for a, b in zip(rates[:3], moved, strict=True)] + rates[3:]


def _dot(one: list, other: list) -> Any:
    return sum((a * b for a, b in zip(one[1:], other[1:], strict=True)), one[0] * other[0])


class _Following:
    def __init__(self, task: Task, sliding: np.ndarray, holding: np.ndarray):
        self.method, self.m = Taylor(task), Held(task, sliding)
        self.method.mechanics = self.m
        self.holding = [self.m.number(float(torque)) for torque in holding]
        self.y, self.axial = self.m.start()
        self.now, self.end = self.m.number(0.0), self.m.number(task.duration)
        self.resting: set[int] = {i for i, rate in enumerate(self._rates()) if abs(float(rate)) < NOTHING}
        self.released: dict[int, int] = {}
        self.found = Motion(np.zeros(0))

    def _rates(self) -> list:
        return self.m.wheel_speeds(self.y[:3])

    def motion(self) -> Motion:
        m = self.m
        for _ in range(STEPS):
            while m.acting.next_time() <= float(self.now):
                m.acting.pass_time(m.acting.next_time(), m.view(self.y, "nu"), m.wheel_speeds)
            self._decide()
            if not self.end > self.now:
                self.found.y = np.array([float(value) for value in self.y[: 6 + m.wheels]])
                return self.found
            self._step()
        raise AssertionError("too many steps")

    def _decide(self) -> None:
        """The modes of the phase that starts now: the choice with the most axles that stick."""
        m, rates, resting = self.m, self._rates(), sorted(self.resting)
        m.modes = [0 if i in self.resting else int(np.sign(float(rate))) for i, rate in enumerate(rates)]
        for choice in sorted(product((0, 1, -1), repeat=len(resting)), key=lambda modes: np.count_nonzero(modes)):
            for i, mode in zip(resting, choice, strict=True):
                m.modes[i] = mode
            self.y = m.begin(self.y, self.axial, self.now)
            if self._is_lawful(m.wheel_speeds(m.rates(self.y)[:3])):
                if not self.found.modes or self.found.modes[-1][1] != tuple(m.modes):
                    self.found.modes.append((float(self.now), tuple(m.modes)))
                return
        raise AssertionError(f"the law has no solution at {float(self.now)}")

    def _is_lawful(self, accelerations: list) -> bool:
        for i in self.resting:
            mode, released = self.m.modes[i], self.released.get(i)
            if released is not None and mode != released:
                return False
            if mode == 0 and abs(float(self.m.taken[i])) > float(self.holding[i]) * (1 + NOTHING):
                return False
            least = -NOTHING if released is not None else NOTHING
            if mode != 0 and not float(mode * accelerations[i]) > least:
                return False
        return True

    def _step(self) -> None:
        m, known = self.m, self.m.acting.next_time()
        goal = m.number(known) if known < float(self.end) else self.end
        h, at = self.method.step(self.y, goal - self.now)
        passed = self._first_passed(at, h)
        time = min((when for when, _ in passed), key=float, default=h)
        self.now = goal if not passed and float(goal - self.now - h) <= 0 else self.now + time
        self.y, self.resting, self.released = at(time), {i for i in range(m.wheels) if m.modes[i] == 0}, {}
        self.axial = m.axial_at(self.y, self.axial)
        moves: dict[int, int] = {}
        for what, wheel, direction in (of for when, of in passed if float(when - time) < TOGETHER):
            if what == "joint":
                moves[wheel] = direction
            elif what == "stops":
                self.resting.add(wheel)
            else:
                self.m.rates(self.y)
                self.released[wheel] = -int(np.sign(float(self.m.taken[wheel])))
        if moves:
            self.y, self.axial = m.switched(self.y, self.axial, moves)
            self.resting = {i for i in self.resting if abs(float(self._rates()[i])) < NOTHING}
            self.found.switches += [(float(self.now), i, direction) for i, direction in sorted(moves.items())]

    def _margins(self) -> list[tuple[Callable[[list], Any], tuple[str, int, int]]]:
        """Functions of y whose passing zero ends the phase."""
        m = self.m
        found: list[Any] = [
            (lambda y, i=i, d=d: d * y[3 + i] - m.joint, ("joint", i, d)) for i in range(m.wheels) for d in (1, -1)
        ]
        for i, mode in enumerate(m.modes):
            if mode:
                found.append((lambda y, i=i, mode=mode: -mode * m.wheel_speeds(y[:3])[i], ("stops", i, mode)))
            else:
                found.append((lambda y, i=i: self._excess(y, i), ("breaks away", i, 0)))
        return found

    def _excess(self, y: list, wheel: int) -> Any:
        """How much more torque an axle needs than it can take."""
        self.m.rates(y)
        return abs(self.m.taken[wheel]) - self.holding[wheel]

    def _first_passed(self, at: Callable, h: Any) -> list[tuple[Any, tuple[str, int, int]]]:
        """All that has passed at the first probe at which something has, each with its own time."""
        margins = self._margins()
        for k in range(1, PROBES + 1):
            y = at(h * k / PROBES)
            beyond = [margin for margin in margins if float(margin[0](y)) > 0]
            if beyond:
                return [(_halved(at, value, h * (k - 1) / PROBES, h * k / PROBES), of) for value, of in beyond]
        return []


def _halved(at: Callable, value: Callable[[list], Any], early: Any, late: Any) -> Any:
    for _ in range(HALVINGS):
        middle = ((early + late) / 2).mid()
        early, late = (early, middle) if float(value(at(middle))) > 0 else (middle, late)
    return late
