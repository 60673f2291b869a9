"""The true derivatives of a run by its numbers: differences of runs in 40 digits, of which one has the number moved.

The numbers of the run in doubles are taken as exact, and one of them is larger by 1e-13 of itself. What a difference
loses is as much of it times the motion's growth, and what the steps lose is 1e-15 of that growth a step. The error of a
step counts by the size of each number: under viscous friction spins are computed from what momenta have changed by,
over the rollers' inertia.

A run is followed over the generated Python formulas in python-flint's balls, whose midpoints are taken, by the Taylor
series of omniroll.studies.accuracy.reference, which find all events by themselves.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb

from hard.moving import CONSTANTS, larger, split
from omniroll.effects.effect import Table
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import Mechanics, flat, nested_numbers
from omniroll.studies.accuracy.reference import Taylor, digits, end_of

State = list[Any]
DIGITS = 42  # of computing: what moves a number by little loses some
CHANGE = "1e-13"  # of a number, relative
ORDER, TAYLOR_ERROR = 36, 1e-30  # of the series, and of a step by them, relative


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


def end(task: Task, mechanics: Mechanics) -> State:
    return shown(mechanics, *end_of(Taylor(task, mechanics, ORDER, TAYLOR_ERROR), task))


def shown(mechanics: Mechanics, y: State, axial: Any) -> State:
    nu, chi, pose = (mechanics.view(y, part) for part in ("nu", "chi", "pose"))
    spins = mechanics.module.spins_from_axial(mechanics.model, nu, chi, axial) if mechanics.free else []
    return [*nu, *chi, *pose, *flat(spins)]


def size(task: Task, name: str) -> float:
    """The magnitude of a number, 1 where it is 0."""
    number, place = split(name)
    constant, kernel = CONSTANTS.get(number, number), task.kernel
    holders = [task.state, *task.effects.effects]
    value = next((v for v in (getattr(holder, number, None) for holder in holders) if v is not None), 0.0)
    value = kernel.constant(constant) if constant in kernel.constant_names else value
    return float(np.abs(np.asarray(value)[place if np.ndim(value) else ()]).max()) or 1.0


def derivative(task: Task, name: str) -> np.ndarray:
    """The derivative of nu, chi, pose and spins at the end by a number."""
    with digits(DIGITS, ORDER):
        change = arb(CHANGE) * size(task, name)
        ends = [end(task, Moved(task, name, side * change)) for side in (1, -1)]
        return quotient(*ends, 2 * change)


def quotient(one: State, other: State, change: Any) -> np.ndarray:
    """How far the ends of two runs are apart, over a change of a number."""
    return np.array([float((a - b) / change) for a, b in zip(one, other, strict=True)])
