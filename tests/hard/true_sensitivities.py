"""The true derivatives of a run by one of its numbers: central differences of two runs in 40 digits.

The numbers of the run in doubles are taken as exact, and one of them is moved by 1e-13 of itself. What a difference
loses is the square of that times the motion's growth, and what the steps lose is 1e-14 of that growth a step. The
error of a step counts by the size of each number: under viscous friction spins are computed from what momenta have
changed by, over the rollers' inertia.

A run is followed over the generated Python formulas in python-flint's balls, whose midpoints are taken, by Gragg's
rule extrapolated to a part length of zero. Which wheel is the next to switch is read from the run in doubles and then
proved: the time at which it is there is solved for in 40 digits, and no other wheel may be beyond its joint. Runs with
other events are followed by Taylor series, which find all events by themselves: where axles stick by those of
omniroll.studies.accuracy.reference, where rollers do by hard.true_bearings, where wheels may slip by hard.true_ground.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from flint import arb

import omniroll
from hard import true_bearings, true_ground
from hard.moving import CONSTANTS, larger, split
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import Mechanics, flat, nested_numbers
from omniroll.studies.accuracy.reference import Taylor, digits, end_of

DIGITS = 42  # of computing: extrapolation loses some
COLUMNS = 12
ERROR = 1e-27  # of a step, relative
WAY = 0.3  # of a step: the fastest wheel turns by this part of the joint's angle
LANDING = 6  # most steps of Newton's rule
LANDED = 1e-33  # rad
FEW = 4  # columns for these: the steps are short
CHANGE = "1e-13"
ORDER, TAYLOR_ERROR = 36, 1e-30  # of the series, and of a step by them, relative
State = list[Any]


class Moved(Mechanics):
    """The mechanics of a task with one number larger by `change`: of its start or of its kernel's constants."""

    def __init__(self, task: Task, name: str, change: Any):
        super().__init__(task, arb)
        number, place = split(name)
        number = CONSTANTS.get(number, number)
        self.moved, self.place, self.change = number, place, change
        kernel = task.kernel
        if number in kernel.constant_names:
            constants = [nested_numbers(value.tolist(), arb) for value in kernel.constants]
            which = kernel.constant_names.index(number)
            constants[which] = larger(constants[which], self.place, change)
            self.without, self.model = self.model, self.module.prepare(self.wheels, self.rollers, *constants)
        else:
            self.without = self.model
        if number == "wheel_coulomb":  # without a break-away torque of its own
            self.axles.sliding = larger(self.axles.sliding, self.place, change)
            self.axles.holding = larger(self.axles.holding, self.place, change)

    def start(self) -> tuple[State, Any]:
        """The spins of free rollers stay where another number is moved."""
        y, axial = super().start()
        nu, chi = self.view(y, "nu"), self.view(y, "chi")
        for name in ("nu", "chi", "pose"):
            if name == self.moved:
                y[self.vector.slices[name]] = larger(y[self.vector.slices[name]], self.place, self.change)
        if not self.free:
            return y, None
        spins = self.module.spins_from_axial(self.without, nu, chi, axial)
        axial = self.module.axial_speeds(self.model, self.view(y, "nu"), self.view(y, "chi"), spins)
        return self.with_rollers(y, axial), axial


def step(rates: Callable[[State], State], y: State, h: Any, columns: int, sizes: list[float]) -> tuple[State, float]:
    """y after h by Gragg's rule in 2, 4, 6 ... parts, and how far the last two columns are apart, per size."""
    slope, table = rates(y), []
    for column in range(1, columns + 1):
        part = h / (2 * column)
        before, now = y, moved(y, part, slope)
        for _ in range(2 * column - 1):
            before, now = now, moved(before, 2 * part, rates(now))
        row = [[((a + b + part * c) / 2).mid() for a, b, c in zip(before, now, rates(now), strict=True)]]
        for known, other in enumerate(table, start=1):
            ratio = arb(column) / (column - known)
            gain = 1 / (ratio * ratio - 1)
            row.append([(a + (a - b) * gain).mid() for a, b in zip(row[-1], other, strict=True)])
        table = row
    gaps = zip(table[-1], table[-2], sizes, strict=True)
    return table[-1], max(abs(float(a - b)) / size for a, b, size in gaps)


def moved(y: State, by: Any, slope: State) -> State:
    return [(a + by * b).mid() for a, b in zip(y, slope, strict=True)]


class Flow:
    """One run."""

    def __init__(self, mechanics: Mechanics):
        self.m = mechanics
        self.y, self.axial = mechanics.start()
        self.now, self.part = arb(0), 1.0
        self.sizes = [1.0] * len(self.y)
        for quantity in mechanics.vector.quantities:  # momenta and energies of rollers, from which spins are computed
            if quantity.size in ("momentum", "energy"):
                place = mechanics.vector.slices[quantity.name]
                self.sizes[place] = [mechanics.task.vehicle.roller_inertia] * (place.stop - place.start)

    def to(self, goal: Any) -> None:
        """Within a phase, as far as elapsed time `goal`."""
        m = self.m
        while (left := goal - self.now) > 0:
            speed = max(abs(float(v)) for v in m.wheel_speeds(self.y[:3]))
            h = min(left, arb(self.part * WAY * float(m.joint) / max(speed, 1e-3)), key=float)
            end, apart = step(m.rates, self.y, h, COLUMNS, self.sizes)
            if apart > ERROR * max(1.0, *(abs(float(v)) for v in end)):
                self.part /= 2
                continue
            self.part = min(1.0, 1.3 * self.part)
            self.y, self.now = end, (self.now + h).mid()

    def land(self, wheel: int, direction: int) -> None:
        """At the time when a wheel is at its joint, which is near."""
        m = self.m
        for _ in range(LANDING):
            way = m.joint - direction * self.y[3 + wheel]
            if abs(float(way)) <= LANDED:
                return
            short = (way / (direction * m.wheel_speeds(self.y[:3])[wheel])).mid()
            self.y, _ = step(m.rates, self.y, short, FEW, self.sizes)
            self.now = (self.now + short).mid()
        raise ValueError(f"wheel {wheel} is not at its joint")

    def switch(self, moves: dict[int, int]) -> None:
        m = self.m
        beyond = [abs(float(self.y[3 + k])) - float(m.joint) for k in range(m.wheels) if k not in moves]
        if max(beyond, default=-1.0) > 0:
            raise ValueError("another wheel is beyond its joint")
        self.y, self.axial = m.switched(self.y, self.axial, moves)


def end(task: Task, run: omniroll.Trajectory, name: str, change: Any) -> State:
    """nu, chi, pose and spins at the end of a run with a number moved."""
    mechanics = Moved(task, name, change)
    if mechanics.axles is not None:
        return end_where_axles_stick(task, mechanics)
    flow = Flow(mechanics)
    flow.y = mechanics.begin(flow.y, flow.axial, flow.now)
    for time, wheel, direction in switches(run):
        flow.to(arb(time))
        flow.land(wheel, direction)
        flow.axial = mechanics.axial_at(flow.y, flow.axial)
        flow.switch({wheel: direction})
        flow.y = mechanics.begin(flow.y, flow.axial, flow.now)
    flow.to(arb(task.duration))
    flow.axial = mechanics.axial_at(flow.y, flow.axial)
    return shown(mechanics, flow.y, flow.axial)


def end_where_axles_stick(task: Task, mechanics: Mechanics) -> State:
    return shown(mechanics, *end_of(Taylor(task, mechanics, ORDER, TAYLOR_ERROR), task))


def shown(mechanics: Mechanics, y: State, axial: Any) -> State:
    nu, chi, pose = (mechanics.view(y, part) for part in ("nu", "chi", "pose"))
    spins = mechanics.module.spins_from_axial(mechanics.model, nu, chi, axial) if mechanics.free else []
    return [*nu, *chi, *pose, *flat(spins)]


def switches(run: omniroll.Trajectory) -> Sequence[tuple[float, int, int]]:
    """(elapsed time, wheel, direction) of each; wheels that switch together are not meant."""
    times = [float(t) for t in run.switches.t]
    if len(set(times)) < len(times):
        raise ValueError("wheels switch together")
    return list(zip(times, map(int, run.switches.wheel), map(int, run.switches.direction), strict=True))


def size(task: Task, name: str) -> float:
    """The magnitude of a number, 1 where it is 0."""
    number, place = split(name)
    constant, kernel = CONSTANTS.get(number, number), task.kernel
    holders = [task.state, *task.effects.effects]
    value = next((v for v in (getattr(holder, number, None) for holder in holders) if v is not None), 0.0)
    value = kernel.constant(constant) if constant in kernel.constant_names else value
    return float(np.abs(np.asarray(value)[place if np.ndim(value) else ()]).max()) or 1.0


def derivative(task: Task, run: omniroll.Trajectory, name: str) -> np.ndarray:
    """The derivative of nu, chi, pose and spins at the end by a number."""
    with digits(DIGITS, ORDER):
        change = arb(CHANGE) * size(task, name)
        return difference([end(task, run, name, side * change) for side in (1, -1)], change)


def derivative_over_events(task: Task, name: str) -> tuple[np.ndarray, list[tuple]]:
    """The same where rollers stick on their disks or wheels may slip; and what happens in these runs, as (time, ...).

    Raises ValueError where other things happen in the run beside.
    """
    reference = true_ground if task.kernel.slips else true_bearings
    with digits(DIGITS, ORDER):
        change = arb(CHANGE) * size(task, name)
        runs = [reference.Run(task, name, side * change) for side in (1, -1)]
        found = difference([run.to_the_end() for run in runs], change)
    one, other = (sorted((what for _, *what in run.log), key=lambda what: what[0]) for run in runs)
    if one != other:  # of each wheel by itself: what happens at one instant has no order
        raise ValueError(f"a change of {CHANGE} of {name} makes other events")
    return found, runs[0].log


def difference(ends: list[State], change: Any) -> np.ndarray:
    """Of the ends of runs with a number larger and smaller by a change."""
    return np.array([float((a - b) / (2 * change)) for a, b in zip(*ends, strict=True)])
