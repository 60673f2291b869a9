"""The true derivatives of a run by its numbers: differences of runs in 40 digits, of which one has the number moved.

The numbers of the run in doubles are taken as exact, and one of them is larger by 1e-13 of itself. What a difference
loses is as much of it times the motion's growth, and what the steps lose is 1e-15 of that growth a step. The error of a
step counts by the size of each number: under viscous friction spins are computed from what momenta have changed by,
over the rollers' inertia.

A run is followed over the generated Python formulas in python-flint's balls, whose midpoints are taken, by Gauss's
collocation (hard.collocated), iterated from where the run in doubles is. Which wheel is the next to switch is read from
that run and then proved: the time at which it is there is solved for in 40 digits, by Gragg's rule extrapolated, and no
other wheel may be beyond its joint. Runs with other events are followed by Taylor series, which find all events by
themselves, with the number larger and smaller: where axles stick by those of
omniroll.studies.accuracy.reference, where rollers do by hard.true_bearings, and where wheels may slip by
hard.true_ground.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb

import omniroll
from hard import collocated, true_bearings, true_ground
from hard.collocated import State, Step
from hard.moving import CONSTANTS, larger, split
from omniroll.effects.effect import Table
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import Mechanics, flat, nested_numbers
from omniroll.studies.accuracy.reference import Taylor, digits, end_of

DIGITS = 42  # of computing: what moves a number by little loses some
WAY = 0.7  # of a step: the fastest wheel turns by this part of the joint's angle
SHORTEST = 2.0**-10  # of that: shorter steps are not tried
LANDING = 6  # most steps of Newton's rule
LANDED = 1e-33  # rad
COLUMNS = 4  # of the extrapolation: the steps of a landing are short
CHANGE = "1e-13"  # of a number, relative
ORDER, TAYLOR_ERROR = 36, 1e-30  # of the series, and of a step by them, relative


class Moved(Mechanics):
    """The mechanics of a task with one number larger by `change`: of its start or of its kernel's constants."""

    def __init__(self, task: Task, name: str, change: Any):
        super().__init__(task, arb)
        number, place = split(name)
        number = CONSTANTS.get(number, number)
        self.moved, self.place, self.change = number, place, change
        self.follow = slice(3, 3 + self.wheels)  # chi
        kernel = task.kernel
        if number in kernel.constant_names:
            constants = [nested_numbers(value.tolist(), arb) for value in kernel.constants]
            which = kernel.constant_names.index(number)
            constants[which] = larger(constants[which], self.place, change)
            self.without, self.model = self.model, self.module.prepare(self.wheels, self.rollers, *constants)
        else:
            self.without = self.model
        if number in ("torque", "voltage"):
            own = self.acting.tables
            own[:] = [self._with_larger(table) if table.signal == number else table for table in own]
        if split(name)[0] == "wheel_coulomb" and self.axles is not None:  # without a break-away torque of its own
            self.axles.sliding = larger(self.axles.sliding, self.place, change)
            self.axles.holding = larger(self.axles.holding, self.place, change)

    def _with_larger(self, table: Table) -> Table:
        """A table whose values are larger, at `place` in each row."""
        values = np.array(table.curve.values, object)
        for row in values:
            row[:] = larger(nested_numbers(row.tolist(), arb), self.place, self.change)
        return replace(table, curve=replace(table.curve, values=values))

    def rates_of_followers(self, y: State) -> State:
        return self.wheel_speeds(y[:3])

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


def landing(rates: Callable[[State], State], y: State, h: Any) -> State:
    """y after a short time h by Gragg's rule in 2, 4, 6 ... parts."""
    slope, table = rates(y), []
    for column in range(1, COLUMNS + 1):
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
    return table[-1]


def moved(y: State, by: Any, slope: State) -> State:
    return [(a + by * b).mid() for a, b in zip(y, slope, strict=True)]


class Flow:
    """One run, of which `run` is nearly the motion: in doubles, or in 40 digits the steps of a flow beside this one."""

    def __init__(self, mechanics: Moved, run: "omniroll.Trajectory | Sequence[Step]"):
        self.m, self.run = mechanics, run
        self.y, self.axial = mechanics.start()
        self.now, self.part = arb(0), 1.0
        self.steps: list[Step] = []
        self.sizes = [1.0] * len(self.y)
        for quantity in mechanics.vector.quantities:  # momenta and energies of rollers, from which spins are computed
            if quantity.size in ("momentum", "energy"):
                place = mechanics.vector.slices[quantity.name]
                self.sizes[place] = [mechanics.task.vehicle.roller_inertia] * (place.stop - place.start)

    def to_the_end(self, switches: "Sequence[tuple[float, int, int]]") -> State:
        """nu, chi, pose and spins at the end; switches are (elapsed time, wheel, direction)."""
        self._begin()
        for time, wheel, direction in switches:
            self._to(arb(time))
            self._land(wheel, direction)
            self._switch(wheel, direction)
        self._to(arb(self.m.task.duration))
        return shown(self.m, self.y, self.m.axial_at(self.y, self.axial))

    def _begin(self) -> None:
        """A phase starts, after samples that are due."""
        m = self.m
        while m.acting is not None and m.acting.next_time() <= float(self.now):
            m.acting.pass_time(m.acting.next_time(), None, m.view(self.y, "nu"), m.wheel_speeds)
        self.y = m.begin(self.y, self.axial, self.now)

    def _to(self, goal: Any) -> None:
        """As far as elapsed time `goal`, at which a wheel switches or the run ends."""
        m = self.m
        while m.acting is not None and m.acting.next_time() < float(goal):
            self._within_phase(arb(m.acting.next_time()))
            self.axial = m.axial_at(self.y, self.axial)
            self._begin()
        self._within_phase(goal)

    def _within_phase(self, goal: Any) -> None:
        if isinstance(self.run, list):
            self._beside(goal)
            return
        m = self.m
        while float(left := goal - self.now) > 0:
            speed = max(abs(float(v)) for v in m.wheel_speeds(self.y[:3]))
            count = math.ceil(float(left) * max(speed, 1e-3) / (self.part * WAY * float(m.joint)))
            made = collocated.step(m, self.y, left / count, self._near(left / count), self.sizes)
            if made is None:
                self.part /= 2
                if self.part < SHORTEST:
                    raise ValueError("the iteration does not end")
                continue
            self.part = min(1.0, 1.2 * self.part)
            self._take(made, goal if count == 1 else (self.now + left / count).mid())

    def _near(self, h: Any) -> list[State]:
        """Where the run in doubles is at the nodes of a step; what rollers integrate, and time, as at its start."""
        shown = 6 + self.m.wheels
        times = self.run.start_time + np.array([float(self.now + h * place) for place in collocated.nodes().places])
        found, _ = self.run.state_and_row(times)
        return [[*map(arb, row[:shown].tolist()), *self.y[shown:]] for row in found]

    def _beside(self, goal: Any) -> None:
        """By the steps that the flow beside has from here on, up to a time at which it was, too."""
        while float(goal - self.now) > 0:
            other = self.run[len(self.steps)]
            apart = [a - b for a, b in zip(self.y, other.y, strict=True)]
            near = [[a + b for a, b in zip(row, apart, strict=True)] for row in other.inside]
            last = other.reached == goal
            h = goal - self.now if last else other.h
            made = collocated.step(self.m, self.y, h, near, self.sizes)
            if made is None:
                raise ValueError("the iteration does not end beside another flow")
            self._take(made, goal if last else (self.now + h).mid())

    def _take(self, made: Step, reached: Any) -> None:
        self.y, self.now = made.end, reached
        self.steps.append(replace(made, reached=reached))

    def _land(self, wheel: int, direction: int) -> None:
        """At the time when a wheel is at its joint, which is near."""
        m = self.m
        for _ in range(LANDING):
            way = m.joint - direction * self.y[3 + wheel]
            if abs(float(way)) <= LANDED:
                return
            short = (way / (direction * m.wheel_speeds(self.y[:3])[wheel])).mid()
            self.y = landing(m.rates, self.y, short)
            self.now = (self.now + short).mid()
        raise ValueError(f"wheel {wheel} is not at its joint")

    def _switch(self, wheel: int, direction: int) -> None:
        m = self.m
        beyond = [abs(float(self.y[3 + k])) - float(m.joint) for k in range(m.wheels) if k != wheel]
        if max(beyond, default=-1.0) > 0:
            raise ValueError("another wheel is beyond its joint")
        self.y, self.axial = m.switched(self.y, m.axial_at(self.y, self.axial), {wheel: direction})
        self._begin()


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
    return next(derivatives(task, run, (name,)))


def derivatives(task: Task, run: omniroll.Trajectory, names: Sequence[str]) -> Iterator[np.ndarray]:
    """The derivatives of nu, chi, pose and spins at the end by some numbers, one after the other."""
    with digits(DIGITS, ORDER):
        if Mechanics(task, arb).axles is not None:
            for name in names:
                change = arb(CHANGE) * size(task, name)
                ends = [end_where_axles_stick(task, Moved(task, name, side * change)) for side in (1, -1)]
                yield quotient(*ends, 2 * change)
            return
        known = switches(run)
        base = Flow(Moved(task, names[0], arb(0)), run)
        end = base.to_the_end(known)
        for name in names:
            change = arb(CHANGE) * size(task, name)
            yield quotient(Flow(Moved(task, name, change), base.steps).to_the_end(known), end, change)


def derivative_over_events(task: Task, name: str) -> tuple[np.ndarray, list[tuple]]:
    """The same where rollers stick on their disks or wheels may slip; and what happens in these runs, as (time, ...).

    Raises ValueError where other things happen in the run beside.
    """
    reference = true_ground if task.kernel.slips else true_bearings
    with digits(DIGITS, ORDER):
        change = arb(CHANGE) * size(task, name)
        runs = [reference.Run(task, name, side * change) for side in (1, -1)]
        found = quotient(*(run.to_the_end() for run in runs), 2 * change)
    one, other = (sorted((what for _, *what in run.log), key=lambda what: what[0]) for run in runs)
    if one != other:  # of each wheel by itself: what happens at one instant has no order
        raise ValueError(f"a change of {CHANGE} of {name} makes other events")
    return found, runs[0].log


def quotient(one: State, other: State, change: Any) -> np.ndarray:
    """How far the ends of two runs are apart, over a change of a number."""
    return np.array([float((a - b) / change) for a, b in zip(one, other, strict=True)])
