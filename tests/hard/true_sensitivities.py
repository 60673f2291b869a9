"""The true derivatives of a run by its numbers: differences of two runs in many digits, of which one has the number a
little larger and one a little smaller.

The numbers of the run in doubles are taken as exact. What a difference loses is the square of the change, and the
errors of the runs over it. The runs are followed by Taylor series, which find all switches and events by themselves:
where wheels roll by those of omniroll.studies.accuracy.reference, where rollers stick on their disks by
hard.true_bearings, and where wheels may slip by hard.true_ground.
"""

from typing import Any

import numpy as np
from flint import arb

import omniroll
from hard import true_bearings, true_ground
from hard.constrained import Row
from hard.moving import CONSTANTS, larger, split
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import Mechanics, flat, nested_numbers
from omniroll.studies.accuracy.reference import Taylor, digits, end_of

CHANGE_ROLLING = "1e-9"  # of a number, relative, beside runs in 28 digits
DIGITS, ORDER = 42, 36  # of runs with other events, and of their series
CHANGE = "1e-13"  # of a number, relative, beside these


class Moved(Mechanics):
    """The mechanics of a task with one number larger by `change`: of its start or of its kernel's constants."""

    def __init__(self, task: Task, name: str, change: Any):
        super().__init__(task, arb)
        number, place = split(name)
        number = CONSTANTS.get(number, number)
        self.moved, self.place, self.change, self.switches = number, place, change, 0
        kernel = task.kernel
        if number in kernel.constant_names:
            constants = [nested_numbers(value.tolist(), arb) for value in kernel.constants]
            which = kernel.constant_names.index(number)
            constants[which] = larger(constants[which], self.place, change)
            self.without, self.model = self.model, self.module.prepare(self.wheels, self.rollers, *constants)
        else:
            self.without = self.model
        if split(name)[0] == "wheel_coulomb" and self.axles is not None:  # without a break-away torque of its own
            self.axles.sliding = larger(self.axles.sliding, self.place, change)
            self.axles.holding = larger(self.axles.holding, self.place, change)

    def start(self) -> tuple[Row, Any]:
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

    def switched(self, y: Row, axial: Any, moves: dict[int, int]) -> tuple[Row, Any]:
        self.switches += len(moves)
        return super().switched(y, axial, moves)

    def to_the_end(self) -> Row:
        """nu, chi, pose and spins at the end of the task."""
        y, axial = end_of(Taylor(self.task, self), self.task)
        nu, chi, pose = (self.view(y, part) for part in ("nu", "chi", "pose"))
        spins = self.module.spins_from_axial(self.model, nu, chi, axial) if self.free else []
        return [*nu, *chi, *pose, *flat(spins)]


def size(task: Task, name: str) -> float:
    """The magnitude of a number, 1 where it is 0."""
    number, place = split(name)
    constant, kernel = CONSTANTS.get(number, number), task.kernel
    holders = [task.state, *task.effects.effects]
    value = next((v for v in (getattr(holder, number, None) for holder in holders) if v is not None), 0.0)
    value = kernel.constant(constant) if constant in kernel.constant_names else value
    return float(np.abs(np.asarray(value)[place if np.ndim(value) else ()]).max()) or 1.0


def derivative(task: Task, run: omniroll.Trajectory, name: str) -> np.ndarray:
    """The derivative of nu, chi, pose and spins at the end by a number.

    Raises ValueError where the true runs do not have as many switches as this one in doubles.
    """
    with digits():
        change = arb(CHANGE_ROLLING) * size(task, name)
        beside = [Moved(task, name, side * change) for side in (1, -1)]
        found = quotient(*(one.to_the_end() for one in beside), 2 * change)
    if any(one.switches != len(run.switches) for one in beside):
        raise ValueError(f"a change of {CHANGE_ROLLING} of {name} makes other switches")
    return found


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


def quotient(one: Row, other: Row, change: Any) -> np.ndarray:
    """How far the ends of two runs are apart, over a change of a number."""
    return np.array([float((a - b) / change) for a, b in zip(one, other, strict=True)])
