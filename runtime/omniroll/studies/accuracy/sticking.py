"""Axles that stick, in the number type of a reference solution: the set-valued law of Coulomb's friction.

Which axles stick is found by trying: each set of modes of the axles at rest (sticks, or slides one way or the other)
gives accelerations and torques, and one set obeys the law. The engines go other ways: they look for the nearest force
that the bearings can give, and for the facets of these forces. Rules 1 to 5 of omniroll.effects.sticking say what is
wanted.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from omniroll.effects.sticking import Axles
from omniroll.engine.switching import EPS
from omniroll.errors import OmnirollError
from omniroll.studies.accuracy.acting import Event

AT_REST = 16  # a rate of the start, or after an impact, is zero within this many roundings of a double
KEPT = 1e-13  # a torque is within its bound up to this part of it, which is more than the landing on an event leaves


@dataclass(frozen=True)
class Release:
    """An axle that cannot be held any longer: its wheel, and the sign of the rate that follows."""

    wheel: int
    follows: int


class Sticking:
    """The axles in one run.

    modes  [N] 0: sticks; +-1: the sign of the rate
    """

    def __init__(self, axles: Axles, number: Callable[[float], Any]):
        self.number = number
        self.rows = [[number(value) for value in row] for row in axles.rows.tolist()]
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
        return float(np.linalg.norm([float(v) for v in self.rows[i]]) * np.linalg.norm([float(v) for v in nu]))

    def torques(self) -> list[Any]:
        """[N] of the bearings of the axles that turn."""
        return [-int(mode) * bound for mode, bound in zip(self.modes, self.sliding, strict=True)]

    def held(self, mass_matrix: list, force: list[Any], stuck: list[int]) -> tuple[list[Any], list[Any]]:
        """nu' from M* nu' = force + rows^T torques, where the axles that stick do not turn; and their torques.

        Raises OmnirollError where the torques are not unique.
        """
        rows = [self.rows[i] for i in stuck]
        if rows and np.linalg.matrix_rank([[float(v) for v in row] for row in rows]) < len(rows):
            raise OmnirollError(f"no reference solution where {len(rows)} axles stick whose torques are not unique")
        zero = self.number(0.0)
        nu_dot, torques = self._solved(mass_matrix, rows, force, [zero] * len(rows))
        return nu_dot if len(rows) < 3 else [zero] * 3, torques

    def at_rest(self, mass_matrix: list, nu: list[Any]) -> list[Any]:
        """nu without the rates of the axles that stick, which are there but for rounding."""
        rows = [self.rows[i] for i in self.stuck]
        zero = [self.number(0.0)] * 3
        if len(rows) >= 3:
            return zero
        rest, _ = self._solved(mass_matrix, rows, zero, [dot(row, nu) for row in rows])
        return [value - part for value, part in zip(nu, rest, strict=True)]

    def _solved(self, mass_matrix: list, rows: list, force: list[Any], rates: list[Any]) -> tuple[list, list]:
        """x and torques with M* x = force + rows^T torques and rows x = rates."""
        top = [[*line, *(-row[k] for row in rows), force[k]] for k, line in enumerate(mass_matrix)]
        below = [[*row, *([self.number(0.0)] * len(rows)), rate] for row, rate in zip(rows, rates, strict=True)]
        found = eliminated(top + below)
        return found[:3], found[3:]

    def decide(self, mass_matrix: list, force: list[Any]) -> None:
        """The modes of the axles at rest; `force` is that of all but their bearings."""
        resting = self.stuck
        _, torques = self.held(mass_matrix, force, resting)
        if not any(map(self._overdone, resting, torques)):
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

    def _overdone(self, i: int, torque: Any) -> bool:
        return abs(float(torque)) > float(self.holding[i]) * (1 + KEPT)

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
            nu_dot, torques = self.held(mass_matrix, pushed, stuck)
            within = all(
                abs(float(torque)) <= float(bounds[i]) * (1 + KEPT) for i, torque in zip(stuck, torques, strict=True)
            )
            if within and all(mode * float(dot(self.rows[i], nu_dot)) > 0 for i, mode in modes.items() if mode):
                yield modes

    def events(self, nu: list[Any]) -> list[tuple[Event, np.ndarray]]:
        """Where the rate of an axle that turns passes zero."""
        zero = self.number(0.0)
        return [
            (Event(zero, zero, [-int(mode) * w for w in self.rows[i]], self._size(i, nu), i, 0), self.modes)
            for i, mode in enumerate(self.modes)
            if mode
        ]


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
