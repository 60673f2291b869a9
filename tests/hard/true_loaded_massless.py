"""Massless rollers that stick on their disks where wheels slip under a smooth law and loads follow the motion, in 40
digits.

Of the generated formulas it takes the accelerations in given modes of the rollers under given loads, the balance of the
loads, and what the ground would ask of a roller that sticks. The loads are three unknown numbers (hard.on_springs),
in which the friction beside a roller that turns is not linear. Which rollers turn and which contacts carry it finds by
itself: at an instant whatever is furthest beyond the end of its mode changes first, until nothing is.
"""

from typing import Any

from flint import arb, arb_series

import omniroll
from hard import true_massless
from hard.constrained import Row, Series, coefficients
from hard.on_springs import UNKNOWN, OnSprings
from hard.true_bearings import ORDER, ZERO, sign_of, signals_at
from hard.true_massless import Rollers
from omniroll.engine.runs import Task

CHANGES = 40  # of modes at an instant, at most
OFF = "off"
LET_GO = 1e6  # of its bound: a roller that has been let go is beyond it by so much more


class LoadedRollers(OnSprings, Rollers):
    """The formulas of a task, with one of its numbers larger by `change`."""

    def __init__(self, task: Task, name: str, change: Any):
        super().__init__(task, name, change)
        contact = next(e for e in task.effects.effects if isinstance(e, omniroll.Contact))
        self.stand_on_springs(contact, name, change)
        self.is_viscous = contact.law == "viscous"

    def factors(self, loads: Row, carries: list[bool]) -> Row:
        """What forces of the ground are in proportion to: loads (N,), or whether a contact carries."""
        return [arb(int(on)) if self.is_viscous else load if on else arb(0) for load, on in zip(loads, carries,
                                                                                              strict=True)]  # fmt: skip

    def asked_under(self, y: Row, loads: Row, carries: list[bool]) -> Row:
        """What would hold each roller, if it stuck."""
        one, none = [arb(1)] * self.wheels, [arb(0)] * self.wheels
        known = self.parts(y) | {"contact_bearing": none, "contact_sticks": one, "bearing_factor": one}
        return self._called("slip_spins", known | {"load_factor": self.factors(loads, carries)})[1]

    def known(self, y: Row, modes: list[int], loads: Row, carries: list[bool], inputs: dict[str, Any]) -> dict:
        """What functions of the accelerations take."""
        turns = [bool(mode) and on for mode, on in zip(modes, carries, strict=True)]
        factors = [
            load if turning and not self.is_viscous else arb(1) for load, turning in zip(loads, turns, strict=True)
        ]
        pairs = zip(modes, turns, self.sliding, strict=True)
        return self.parts(y) | inputs | self.balance_numbers | {
            "contact_bearing": [-mode * bound if turning else arb(0) for mode, turning, bound in pairs],
            "contact_sticks": [arb(int(not turning)) for turning in turns],
            "load_factor": self.factors(loads, carries),
            "bearing_factor": [1 / factor for factor in factors],
        }  # fmt: skip

    def moving(self, known: dict[str, Any]) -> Row:
        """y'."""
        nu_dot, chi_dot, rates_dot = self._called("slip_dynamics", known)
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        return [*nu_dot, *chi_dot, *pose_dot, *rates_dot]

    def unbalanced(self, known: dict[str, Any], rates: Row, loads: Row) -> Row:
        own = self.parts(rates)
        sums, _ = self._called("slip_load_balance", known | {"nu_dot": own["nu"], "rates_dot": own["rates"]})
        return self.beyond(sums, loads)


class Phase:
    """The motion in given modes of rollers and contacts. Unknown are the springs."""

    unknowns = UNKNOWN

    def __init__(self, rollers: LoadedRollers, modes: list[int], carries: list[bool], signals: dict[str, Any]):
        self.b, self.modes, self.carries, self.signals = rollers, list(modes), list(carries), signals

    def loads(self, z: Row) -> Row:
        own = self.b.loads(z)
        return [load if on else arb(0) for load, on in zip(own, self.carries, strict=True)]

    def _known(self, time: Any, y: Row, z: Row) -> dict[str, Any]:
        pairs = {name: zip(*pair, strict=True) for name, pair in self.signals.items()}
        inputs = {name: [value + slope * time for value, slope in pair] for name, pair in pairs.items()}
        return self.b.known(y, self.modes, self.loads(z), self.carries, inputs)

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        return self.b.moving(self._known(time, y, z))

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        return []

    def balance(self, time: Any, y: Row, z: Row, rates: Row) -> Row:
        return self.b.unbalanced(self._known(time, y, z), rates, self.loads(z))

    def asked(self, y: Row, z: Row) -> Row:
        return self.b.asked_under(y, self.loads(z), self.carries)


class Run(true_massless.Run):
    """The motion from its start to the end; `log` says what happens."""

    formulas = LoadedRollers
    b: LoadedRollers

    def _began(self) -> None:
        n = self.b.wheels
        self.carries = [True] * n
        self.springs = [self.b.constants["mass"] * self.b.balance_numbers["normal_gravity"] / n, arb(0), arb(0)]
        self._decide(set(range(n)), set())

    def _phase(self) -> Phase:
        return Phase(self.b, self.modes, self.carries, signals_at(self.b.acting, self.now, self.y[:3]))

    def _series(self, order: int) -> Series:
        """From the springs that were found last."""
        found = Series(self._phase(), self.y, order, self.springs)
        self.springs = [c[0] for c in found.z]
        return found

    def _drives_change(self) -> None:
        """Loads do."""
        self._decide(set(), set())

    def _pass(self, events: list[tuple[int, Any]]) -> None:
        lifts = {k for k, what in events if what == OFF}
        for k in lifts:
            self.carries[k], self.modes[k] = not self.carries[k], 0
            self.log.append((float(self.now), k, OFF))
        super()._pass([(k, what) for k, what in events if what != OFF])

    def _decide(self, resting: set[int], released: set[int]) -> None:
        """Rollers at rest stick if they can, and what is beyond the end of its mode changes, one after the other; those
        that are let go have been beyond it."""
        before = list(self.modes), list(self.carries)
        for k in resting:
            self.modes[k] = 0
        for _ in range(CHANGES):
            series = self._series(0)
            z, phase = self.springs, series.motion
            asked, own = phase.asked(self.y, z), self.b.loads(z)
            wrong = self._wrong(asked, own, released)
            if not wrong:
                break
            _, k, lifts = max(wrong, key=lambda entry: entry[0])
            self.carries[k] ^= lifts
            self.modes[k] = 0 if lifts or self.modes[k] else -sign_of(asked[k])
            released = released - {k}
        else:
            raise ValueError("rollers and loads do not find each other")
        for k, (old, new) in enumerate(zip(before[0], self.modes, strict=True)):
            if old != new:
                self.log.append((float(self.now), k, old, new))
        for k, (old, new) in enumerate(zip(before[1], self.carries, strict=True)):
            if old != new:
                self.log.append((float(self.now), k, OFF))

    def _wrong(self, asked: Row, loads: Row, released: set[int]) -> list[tuple[float, int, bool]]:
        """How far what is beyond the end of its mode is, of which wheel, and whether it is a load and not a roller;
        what has been let go comes first."""
        weight = self.b.constants["mass"] * self.b.balance_numbers["normal_gravity"]
        found = []
        for k, (mode, torque, load, on) in enumerate(zip(self.modes, asked, loads, self.carries, strict=True)):
            off_by = float((-load if on else load) / weight)
            if off_by > ZERO:
                found.append((off_by, k, True))
            beyond = float(self.b.sliding[k] + mode * torque if mode else abs(torque) - self.b.holding[k])
            if on and (beyond > ZERO or k in released):
                found.append((beyond / float(self.b.holding[k]) + LET_GO * (k in released), k, False))
        return found

    def _margins(self, series: Series) -> list[tuple[Row, int, Any]]:
        count, phase, found = ORDER + 1, series.motion, []
        y, z = [arb_series(c, count) for c in series.y], [arb_series([*c, 0], count) for c in series.z]
        asked, loads, chi = phase.asked(y, z), self.b.loads(z), self.b.parts(y)["chi"]
        for k, mode in enumerate(self.modes):
            found += [(d * chi[k] - self.b.joint, k, d) for d in (1, -1)]
            found.append(((-1 if self.carries[k] else 1) * loads[k], k, OFF))
            if mode:
                found.append((self.b.sliding[k] + mode * asked[k], k, "rests"))
            elif self.carries[k]:
                found += [(side * asked[k] - self.b.holding[k], k, "let go") for side in (1, -1)]
        return [(coefficients(margin, count), k, what) for margin, k, what in found]
