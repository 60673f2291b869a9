"""Axles that stick, in the number type of a reference solution: the set-valued law of Coulomb's friction.

Which axles stick is found by trying: each set of modes of the axles at rest (sticks, or slides one way or the other)
gives accelerations and a force that holds what sticks, and one set obeys the law. The compiled engine looks for the
nearest force instead that the bearings can give.

Bearings can give a force F, the sum of their rows times torques within bounds, where no motion n that leaves as many of
them at rest as it can takes more power from them than they have: n . F <= sum of bounds times |n . row|.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from omniroll.effects.friction import Bearing
from omniroll.effects.kept import kept
from omniroll.engine.switching import EPS
from omniroll.errors import OmnirollError
from omniroll.studies.accuracy.acting import Event

AT_REST = 16  # a rate of the start, or after an impact, is zero within this many roundings of a double
# Bearings are taken to give what is beyond their bounds by this part: landing on an event leaves less.
BEYOND = 1e-13
PARALLEL = 1e-12  # sine of the angle below which directions are parallel


@dataclass(frozen=True)
class Release:
    """Axles that cannot be held any longer: the signs of the rates that follow, by their wheels."""

    follows: dict[int, int]

    def change(self, modes: np.ndarray) -> None:
        for wheel, follows in self.follows.items():
            modes[wheel] = follows


@dataclass(frozen=True)
class Excess:
    """How much more power a motion takes from bearings than the `reach` that they have, and what then follows."""

    value: Any
    reach: Any
    release: Release

    @property
    def is_positive(self) -> bool:
        return float(self.value) > BEYOND * float(self.reach)


class Sticking:
    """The axles in one run.

    modes  [N] 0: sticks; +-1: the sign of the rate
    """

    def __init__(self, rows: np.ndarray, axles: Bearing, number: Callable[[float], Any]):
        self.number = number
        self.rows = [[number(value) for value in row] for row in rows.tolist()]
        self.sliding, self.holding = ([number(v) for v in bounds.tolist()] for bounds in (axles.sliding, axles.holding))
        self.modes = np.zeros(len(self.rows), int)

    @property
    def stuck(self) -> list[int]:
        return np.flatnonzero(self.modes == 0).tolist()

    def see(self, nu: list[Any]) -> None:
        """The modes of axles with these speeds, at the start or after an impact; those without a rate are at rest."""
        for i, row in enumerate(self.rows):
            rate = float(dot(row, nu))
            self.modes[i] = 0 if abs(rate) <= AT_REST * EPS * self._size(i, nu) else int(np.sign(rate))

    def _size(self, i: int, nu: list[Any]) -> float:
        return length(self.rows[i]) * length(nu)

    def torques(self) -> list[Any]:
        """[N] of the bearings of the axles that turn."""
        return [-int(mode) * bound for mode, bound in zip(self.modes, self.sliding, strict=True)]

    def held(self, mass_matrix: list, force: list[Any], stuck: list[int]) -> tuple[list[Any], list[Any]]:
        """nu', where the axles that stick do not turn, and the force that holds these: M* nu' is the sum of both."""
        rows = self._independent(stuck)
        zero = self.number(0.0)
        if len(rows) == 3:
            return [zero] * 3, [-value for value in force]
        nu_dot, torques = self._solved(mass_matrix, rows, force, [zero] * len(rows))
        return nu_dot, [sum((u * row[k] for u, row in zip(torques, rows, strict=True)), zero) for k in range(3)]

    def at_rest(self, mass_matrix: list, nu: list[Any]) -> list[Any]:
        """nu without the rates of the axles that stick, which are there but for rounding."""
        rows, zero = self._independent(self.stuck), [self.number(0.0)] * 3
        if len(rows) == 3:
            return zero
        rest, _ = self._solved(mass_matrix, rows, zero, [dot(row, nu) for row in rows])
        return [value - part for value, part in zip(nu, rest, strict=True)]

    def _independent(self, stuck: Sequence[int]) -> list[list[Any]]:
        """Rows of some of these axles, which hold them all."""
        found: list[list[Any]] = []
        for i in stuck:
            if rank([*found, self.rows[i]]) > len(found):
                found.append(self.rows[i])
        return found

    def excesses(self, force: list[Any], stuck: list[int], bounds: dict[int, Any] | None = None) -> list[Excess]:
        """Of the motions that show whether bearings that stick can give a force; bounds: of their torques, by wheel."""
        found = []
        for motion, moved in self.motions(tuple(stuck)):
            reach = sum(abs(rate) * (bounds or self.holding)[i] for i, rate in moved.items())
            power = dot(motion, force)
            for sign in (1, -1):
                follows = {i: -sign * int(np.sign(float(rate))) for i, rate in moved.items()}
                found.append(Excess(sign * power - reach, reach, Release(follows)))
        return found

    @kept
    def motions(self, stuck: tuple[int, ...]) -> list[tuple[list[Any], dict[int, Any]]]:
        """The motions that can show it, each with the rates of the axles that turn in it."""
        found = []
        for motion in self._motions(stuck):
            rates = {i: dot(motion, self.rows[i]) for i in stuck}
            sizes = {i: length(motion) * length(self.rows[i]) for i in stuck}
            found.append((motion, {i: r for i, r in rates.items() if abs(float(r)) > PARALLEL * sizes[i]}))
        return found

    def _motions(self, stuck: Sequence[int]) -> list[list[Any]]:
        """Within the span of the rows, each motion in which rows that span all of it but one direction are at rest."""
        rows, basis = [self.rows[i] for i in stuck], self._independent(stuck)
        if len(basis) < 2:
            return basis
        if len(basis) == 2:
            return [cross(row, cross(*basis)) for row in rows]
        return [cross(one, other) for one, other in combinations(rows, 2) if rank([one, other]) == 2]

    def _solved(self, mass_matrix: list, rows: list, force: list[Any], rates: list[Any]) -> tuple[list, list]:
        """x and torques with M* x = force + rows^T torques and rows x = rates."""
        top = [[*line, *(-row[k] for row in rows), force[k]] for k, line in enumerate(mass_matrix)]
        below = [[*row, *([self.number(0.0)] * len(rows)), rate] for row, rate in zip(rows, rates, strict=True)]
        found = eliminated(top + below)
        return found[:3], found[3:]

    def decide(self, mass_matrix: list, force: list[Any]) -> None:
        """The modes of the axles at rest; `force` is that of all but their bearings."""
        resting = self.stuck
        _, holding = self.held(mass_matrix, force, resting)
        if not any(excess.is_positive for excess in self.excesses(holding, resting)):
            return
        broken: set[int] = set()
        while True:
            modes = next(self._lawful(mass_matrix, force, resting, broken), None)
            if modes is None:
                raise OmnirollError("no reference solution: no modes of the axles at rest obey the law of friction")
            moving = {i for i, mode in modes.items() if mode}
            if moving <= broken:
                break
            broken |= moving
        for i, mode in modes.items():
            self.modes[i] = mode

    def _lawful(
        self, mass_matrix: list, force: list[Any], resting: list[int], broken: set[int]
    ) -> Iterator[dict[int, int]]:
        """Modes under which each axle at rest obeys the law; those that are broken away have the sliding torque."""
        bounds = {i: self.sliding[i] if i in broken else self.holding[i] for i in resting}
        for signs in product((0, 1, -1), repeat=len(resting)):
            modes = dict(zip(resting, signs, strict=True))
            pushed = list(force)
            for i, mode in modes.items():
                pushed = [f - mode * bounds[i] * w for f, w in zip(pushed, self.rows[i], strict=True)]
            stuck = [i for i in resting if modes[i] == 0]
            nu_dot, holding = self.held(mass_matrix, pushed, stuck)
            if all(mode * float(dot(self.rows[i], nu_dot)) > 0 for i, mode in modes.items() if mode) and not any(
                excess.is_positive for excess in self.excesses(holding, stuck, bounds)
            ):
                yield modes

    def events(self, nu: list[Any]) -> list[tuple[Event, np.ndarray]]:
        """Where the rate of an axle that turns passes zero."""
        zero = self.number(0.0)
        return [
            (Event(zero, zero, [-int(mode) * w for w in self.rows[i]], self._size(i, nu), i, 0), self.modes)
            for i, mode in enumerate(self.modes)
            if mode
        ]


def cross(one: list[Any], other: list[Any]) -> list[Any]:
    return [one[k - 2] * other[k - 1] - one[k - 1] * other[k - 2] for k in range(3)]


def length(vector: list[Any]) -> float:
    return float(np.linalg.norm([float(value) for value in vector]))


def rank(rows: list[list[Any]]) -> int:
    """Of rows of three numbers."""
    return int(np.linalg.matrix_rank([[float(v) / length(row) for v in row] for row in rows], tol=PARALLEL))


def dot(one: list[Any], other: list[Any]) -> Any:
    return sum(a * b for a, b in zip(one, other, strict=True))


def eliminated(system: list[list[Any]]) -> list[Any]:
    """The solution of a linear system, rows with the right side last, by elimination without exchange of rows.

    The first block is positive definite and so, with the opposite sign, is what is left of the others: no pivot is 0.
    """
    rows = [list(row) for row in system]
    for k, pivot in enumerate(rows):
        for row in rows[k + 1 :]:
            factor = row[k] / pivot[k]
            row[k + 1 :] = [a - factor * b for a, b in zip(row[k + 1 :], pivot[k + 1 :], strict=True)]
    found: list[Any] = []
    for k in reversed(range(len(rows))):
        known = dot(rows[k][k + 1 : -1], found)
        found.insert(0, (rows[k][-1] - known) / rows[k][k])
    return found
