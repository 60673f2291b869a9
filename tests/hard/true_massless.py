"""Massless rollers that stick on their disks where wheels slip under a smooth law, in 40 digits.

Of the generated formulas it takes the accelerations in given modes of the rollers, and what the ground would ask of one
that sticks. When rollers break away, and come to rest, it finds by itself, as it does what happens at a switch.
"""

from typing import Any

import numpy as np
from flint import arb, arb_series

from hard.constrained import Row, Series, coefficients, first_zero
from hard.true_bearings import ERROR, LONGEST, ORDER, ZERO, Bearings, sign_of, signals_at
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.mechanics import nested_numbers

NUMBERS = ("nu", "chi", "pose")


class Rollers(Bearings):
    """The formulas of a task, with one of its numbers larger by `change`; the bearings of rollers in contact (N,)."""

    def _torques(self, own: Any, number: str, place: tuple[int, ...], change: Any) -> list[Row]:
        rows = super()._torques(own, number, place, change)
        return [row[-self.wheels * self.rollers :][: self.wheels] for row in rows]

    def start(self) -> Row:
        """nu, chi, the pose and the wheels' rates."""
        given = {name: nested_numbers(getattr(self.task.state, name).tolist(), arb) for name in NUMBERS}
        number, place, change = self.start_number
        if number in given:
            values, (k,) = given[number], place
            given[number] = [*values[:k], values[k] + change, *values[k + 1 :]]
        rates, _ = self.module.wheel_rates(self.model, given["nu"], given["chi"])
        return [*given["nu"], *given["chi"], *given["pose"], *rates]

    def parts(self, y: Row) -> dict[str, Any]:
        n = self.wheels
        return {"nu": y[:3], "chi": y[3 : 3 + n], "pose": y[3 + n : 6 + n], "rates": y[6 + n :]}

    def asked(self, y: Row) -> Row:
        """What would hold each roller, if it stuck."""
        known = self.parts(y) | {"contact_bearing": [arb(0)] * self.wheels, "contact_sticks": [arb(1)] * self.wheels}
        return self._called("slip_spins", known)[1]

    def in_modes(self, y: Row, modes: list[int], inputs: dict[str, Any]) -> Row:
        """y' where rollers have modes (N,): 0 sticks, +-1 turns so."""
        known = self.parts(y) | inputs
        known["contact_bearing"] = [-mode * bound for mode, bound in zip(modes, self.sliding, strict=True)]
        known["contact_sticks"] = [arb(int(not mode)) for mode in modes]
        nu_dot, chi_dot, rates_dot = self._called("slip_dynamics", known)
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        return [*nu_dot, *chi_dot, *pose_dot, *rates_dot]

    def _called(self, name: str, known: dict[str, Any]) -> Any:
        arguments = (known[argument.name] for argument in self.kernel.signatures[name].inputs)
        return getattr(self.module, self.kernel.form(name))(self.model, *arguments)


class Phase:
    """The motion in given modes of the rollers; nothing is unknown."""

    unknowns = 0

    def __init__(self, rollers: Rollers, modes: list[int], signals: dict[str, Any]):
        self.b, self.modes, self.signals = rollers, list(modes), signals

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        pairs = {name: zip(*pair, strict=True) for name, pair in self.signals.items()}
        inputs = {name: [value + slope * time for value, slope in pair] for name, pair in pairs.items()}
        return self.b.in_modes(y, self.modes, inputs)

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        return []

    def balance(self, time: Any, y: Row, z: Row, rates: Row) -> Row:
        return []


class Run:
    """The motion from its start to the end; `log` says what happens."""

    formulas = Rollers

    def __init__(self, task: Task, name: str, change: Any):
        self.b = self.formulas(task, name, change)
        self.now, self.end, self.log = arb(0), arb(task.duration), []
        self.y, self.modes = self.b.start(), [0] * self.b.wheels
        self._began()

    def _began(self) -> None:
        self._decide(set(range(self.b.wheels)), set())

    def to_the_end(self) -> Row:
        """nu, chi and pose."""
        for _ in range(LONGEST):
            if float(self.end - self.now) <= 0:
                return self.y[: 6 + self.b.wheels]
            self._step()
        raise ValueError("too many steps")

    def _decide(self, resting: set[int], released: set[int]) -> None:
        """Rollers at rest stick if they can; those that are let go turn against what held them."""
        asked = self.b.asked(self.y)
        for k in resting | released:
            goes = k in released or float(abs(asked[k]) - self.b.holding[k]) > ZERO
            mode = -sign_of(asked[k]) if goes else 0
            if mode != self.modes[k]:
                self.log.append((float(self.now), k, self.modes[k], mode))
            self.modes[k] = mode

    def _phase(self) -> Phase:
        return Phase(self.b, self.modes, signals_at(self.b.acting, self.now, self.y[:3]))

    def _series(self, order: int) -> Series:
        return Series(self._phase(), self.y, order)

    def _step(self) -> None:
        series, known = self._series(ORDER), self.b.acting.next_time()
        goal = min(self.end, arb(known), key=float) if known < np.inf else self.end
        left = goal - self.now
        h = min(left, arb(series.length(ERROR)), key=float)
        margins = self._margins(series)
        found = first_zero([margin for margin, _, _ in margins], h, ZERO)
        h = h if found is None else found[0]
        self.y, _ = series.at(h)
        arrived = found is None and float(left - h) <= 0
        self.now = goal if arrived else (self.now + h).mid()
        if found is not None:
            self._pass([margins[place][1:] for place in found[1]])
        elif arrived:
            self._drives_change()

    def _drives_change(self) -> None:
        """A drive may have jumped, which no roller feels at once."""

    def _pass(self, events: list[tuple[int, Any]]) -> None:
        """What has happened to wheels, as _margins says."""
        resting, released = set(), set()
        for k, what in events:
            if what == "let go":
                released.add(k)
            else:
                resting.add(k)
            if isinstance(what, int):
                self.y[3 + k] = (-what * self.b.joint).mid()
                self.log.append((float(self.now), k, "switch", what))
        self._decide(resting, released)

    def _margins(self, series: Series) -> list[tuple[Row, int, Any]]:
        """Functions, by coefficients, that become positive, of which wheel, and what happens then: a switch in a
        direction, a roller that is let go, or one that comes to rest."""
        count, found = ORDER + 1, []
        y = [arb_series(c, count) for c in series.y]
        chi, asked = self.b.parts(y)["chi"], self.b.asked(y)
        for k, mode in enumerate(self.modes):
            found += [(d * chi[k] - self.b.joint, k, d) for d in (1, -1)]
            if mode:
                found.append((self.b.sliding[k] + mode * asked[k], k, "rests"))
            else:
                found += [(side * asked[k] - self.b.holding[k], k, "let go") for side in (1, -1)]
        return [(coefficients(margin, count), k, what) for margin, k, what in found]
