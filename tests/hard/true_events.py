"""Motions with events in 40 digits: contacts with the ground and bearings that stick, let go and come to rest.

The laws of friction, which contacts and bearings stick, and what holds them are solved for here: unknown forces and
torques that keep slips and rates zero (hard.constrained). The formulas are those of hard.true_ground, where wheels may
slip, and of hard.true_bearings, where they roll.

A slip on its way to rest has a direction that turns ever faster, so that the steps of the series shrink with it. What
is left of it at RESTS, a force of this contact takes away at once: the square of that is left out.
"""

from typing import Any

import numpy as np
from flint import arb, arb_series

from hard.constrained import Row, Series, coefficients, first_zero, solved
from omniroll.engine.runs import Task

ORDER, ERROR = 36, 1e-30  # of the series, and of a step, relative
RESTS = 1e-14  # m/s
STILL = 1e-25  # m/s or rad/s, of a slip or a rate that is not there
ROUNDED = 1e-14  # rad/s, of a spin that doubles say a start has, and is not there
ZERO = 1e-28  # of a margin
EDGE = 1e-20  # N^2 or N m: friction has been used up where it has just been found so
AT_ONCE = 1e-20  # m/s^2, of an acceleration that is not there
LONGEST = 10_000  # steps
STICKS, SLIPS, BEGINS = "sticks", "slips", "begins"


class Phase:
    """The motion in given modes of the contacts and bearings; unknown are what holds contacts, where slips begin to go,
    and what holds bearings.

    towards  (N,) signs of the slips of massless rollers
    turning  (B,) signs of the rates of bearings, 0 where one sticks
    """

    def __init__(self, formulas: Any, modes: list[str], towards: list[int], turning: list[int], axial: list[Row]):
        self.v, self.modes, self.towards, self.turning = formulas, list(modes), list(towards), list(turning)
        self.momenta = {"momenta": formulas.module.momenta(formulas.model, axial)} if axial else {}
        self.drives = formulas.acting.signals
        self.places: dict[tuple[int, int], int] = {}
        for i, mode in enumerate(modes):
            if mode == STICKS or (mode == BEGINS and formulas.heavy):
                for c in (0, 1) if formulas.heavy else (1,):  # directions in which contacts may slip
                    self.places[i, c] = len(self.places)
        stuck = [i for i, sign in enumerate(turning) if not sign]
        self.bearings = {i: len(self.places) + k for k, i in enumerate(stuck)}
        self.unknowns = len(self.places) + len(stuck)
        self.loads = formulas.loads_at_rest()

    def inputs(self, time: Any, z: Row) -> dict[str, Any]:
        """What drives, and the torques of all bearings."""
        found = {"torque": [arb(0)] * self.v.wheels} | self.momenta
        for name, pair in self.drives.items():
            found[name] = [value + slope * time for value, slope in zip(*pair, strict=True)]
        if self.v.bearings is None:
            return found
        signs = enumerate(zip(self.turning, self.v.bearings.sliding, strict=True))
        own = [z[self.bearings[i]] if i in self.bearings else -sign * s for i, (sign, s) in signs]
        return self.v.with_bearings(found, own)

    def goes_back(self, slip: Row) -> Any:
        """How far a contact slips against where it did at the start, by that."""
        first = [s[0].mid() for s in map(arb_series, slip)]
        return -sum(a * b for a, b in zip(first, slip, strict=True)) / sum(a * a for a in first)

    def asked(self, z: Row) -> dict[int, Any]:
        """What holds bearings that stick."""
        return {i: z[k] for i, k in self.bearings.items()}

    def forces(self, y: Row, z: Row) -> list[Row]:
        slip = self.v.slip(y) if SLIPS in self.modes else None
        found = []
        for i, mode in enumerate(self.modes):
            if mode == STICKS:
                found.append([z[self.places[i, c]] if (i, c) in self.places else arb(0) for c in (0, 1)])
            else:
                load = arb(1) if self.v.ground.law == "viscous" else self.loads[i]
                found.append([load * f for f in self.v.ground.sliding(self.direction(i, slip, z), self.v.heavy)])
        return found

    def direction(self, i: int, slip: Any, z: Row) -> Row:
        """In which a contact slips."""
        if self.v.ground.law == "coulomb" and not self.v.heavy:
            return [arb(0), arb(self.towards[i])]
        return slip[i] if self.modes[i] == SLIPS else [z[self.places[i, c]] for c in (0, 1)]

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        return self.v.rates(y, self.forces(y, z), self.inputs(time, z))

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        """The slips of contacts that stick; of those that begin to slip, less what the unknown direction makes; the
        rates of bearings that stick."""
        turning, slip = self.v.turning(y) if self.bearings else [], self.v.slip(y) if self.places else []
        kept = [slip[i][c] - (time * z[k] if self.modes[i] == BEGINS else 0) for (i, c), k in self.places.items()]
        return kept + [turning[i] for i in self.bearings]


class Run:
    """The motion from its start to the end; `log` says what happens: (time, contact, mode), (time, bearing, "bearing",
    "sticks" or "slips"), (time, wheel, "switch").

    formulas  a class of the formulas of a task
    modes     of the contacts
    towards   signs of the slips of massless rollers
    turning   signs of the rates of bearings, 0 where one sticks
    resting   contacts whose slip has come to zero at this instant, and bearings whose rate has
    released  contacts and bearings that have used their friction up at this instant
    """

    formulas: type

    def __init__(self, task: Task, name: str, change: Any):
        self.v, self.now, self.end, self.log = self.formulas(task, name, change), arb(0), arb(task.duration), []
        self.y, self.axial = self.v.start()
        self.modes, self.towards = [SLIPS] * self.v.contacts, [0] * self.v.contacts
        self.turning = [] if self.v.bearings is None else [sign_of(rate, ROUNDED) for rate in self.v.turning(self.y)]
        self.decided = list(self.modes), list(self.turning)  # when they were decided last
        self.resting: set[int] = set()
        self.resting_bearings = {i for i, sign in enumerate(self.turning) if not sign}
        self.released: set[int] = set()
        self.released_bearings: set[int] = set()
        self.begun: dict[int, Row] = {}  # first guesses of where slips go
        self.sticks_on_ground = self.v.ground is not None and self.v.ground.law == "coulomb"
        self._see()

    def to_the_end(self) -> Row:
        """nu, chi, pose and spins."""
        self._decide()
        for _ in range(LONGEST):
            if float(self.end - self.now) <= 0:
                return self.v.shown(self.y, self.axial)
            self._step()
        raise ValueError("too many steps")

    def _phase(self) -> Phase:
        acting = self.v.acting
        while acting.next_time() <= float(self.now):
            acting.pass_time(acting.next_time(), None, self.v.parts(self.y)["nu"], None)
        acting.begin(self.now)
        return Phase(self.v, self.modes, self.towards, self.turning, self.axial)

    def _series(self, order: int) -> Series:
        phase = self._phase()
        guess = [arb(0)] * phase.unknowns
        for (i, c), k in phase.places.items():
            if self.modes[i] == BEGINS:
                guess[k] = self.begun[i][c]
        return Series(phase, self.y, order, guess)

    def _see(self) -> None:
        """Which contacts rest, of those that may."""
        for i, slip in enumerate(self.v.slip(self.y) if self.sticks_on_ground else []):
            if self.modes[i] == SLIPS:
                if max(abs(float(s)) for s in slip) < STILL:
                    self.resting.add(i)
                elif not self.towards[i]:
                    self.towards[i] = 1 if float(slip[1]) > 0 else -1

    def _decide(self) -> None:
        """What rests sticks if friction can hold it; else one after the other begins to slip or turn, against what
        would hold it, the one that asks for most first."""
        for i in self.resting:
            self.modes[i] = STICKS
        for i in self.resting_bearings:
            self.turning[i] = 0
        for _ in range(len(self.modes) + len(self.turning) + 1):
            series = self._series(0)
            phase, z = series.motion, [c[0] for c in series.z]
            if not self._lets_a_bearing_go(phase, z) and not self._lets_a_contact_go(phase, z):
                break
        self._check_directions(series)
        now = [SLIPS if mode == BEGINS else mode for mode in self.modes], list(self.turning)
        self.log += [(float(self.now), i, mode) for i, mode in enumerate(now[0]) if mode != self.decided[0][i]]
        changes = ((i, new) for i, new in enumerate(now[1]) if new != self.decided[1][i])
        self.log += [(float(self.now), i, "bearing", SLIPS if new else STICKS) for i, new in changes]
        self.decided = now
        for settled in (self.resting, self.resting_bearings, self.released, self.released_bearings):
            settled.clear()

    def _lets_a_bearing_go(self, phase: Phase, z: Row) -> bool:
        """Whether a bearing is asked for more than it holds; it turns."""
        asked = phase.asked(z)
        beyond = {
            i: float(abs(torque) - self.v.bearings.holding[i]) + (EDGE if i in self.released_bearings else 0)
            for i, torque in asked.items()
        }
        first = max(beyond, key=lambda i: beyond[i], default=None)
        if first is None or beyond[first] <= ZERO:
            return False
        self.turning[first] = -sign_of(asked[first])
        return True

    def _lets_a_contact_go(self, phase: Phase, z: Row) -> bool:
        """Whether a contact is asked for more than static friction; it begins to slip."""
        forces = phase.forces(self.y, z)
        used = {
            i: float(self.v.ground.used_up(forces[i], phase.loads[i], self.v.heavy)) + EDGE * (i in self.released)
            for i, mode in enumerate(self.modes) if mode == STICKS
        }  # fmt: skip
        first = max(used, key=lambda i: used[i], default=None)
        if first is None or used[first] <= ZERO:
            return False
        self.modes[first] = BEGINS
        self.towards[first] = -1 if float(forces[first][1]) > 0 else 1
        self.begun[first] = [-force / self.v.mass for force in forces[first]]
        return True

    def _check_directions(self, series: Series) -> None:
        """A contact that begins to slip goes where its slip grows; with one friction it has no acceleration yet."""
        if self.v.heavy or BEGINS not in self.modes:
            return
        rates = series.motion.rates(arb(0), self.y, [c[0] for c in series.z])
        grown = [arb_series([value, rate], 2) for value, rate in zip(self.y, rates, strict=True)]
        for i, slip in enumerate(self.v.slip(grown)):
            if self.modes[i] == BEGINS and float(slip[1][1]) * self.towards[i] < -AT_ONCE:
                raise ValueError(f"contact {i} neither sticks nor slips")

    def _step(self) -> None:
        series, known = self._series(ORDER), self.v.acting.next_time()
        goal = min(self.end, arb(known), key=float) if known < np.inf else self.end
        left = goal - self.now
        h = min(left, arb(series.length(ERROR)), key=float)
        margins = self._margins(series)
        found = first_zero([margin for margin, _ in margins], h, ZERO)
        if found is not None:
            h = found[0]
        self.y, _ = series.at(h)
        arrived = found is None and float(left - h) <= 0
        self.now = goal if arrived else (self.now + h).mid()
        self.modes = [SLIPS if mode == BEGINS else mode for mode in self.modes]
        if found is not None:
            for k in found[1]:
                margins[k][1]()
        self._rest_where_little_is_left()
        if found is not None or self.resting or arrived:
            self._settle()

    def _margins(self, series: Series) -> list[tuple[Row, Any]]:
        """Functions, by coefficients, that become positive, and what happens then."""
        count = ORDER + 1
        y, z = ([arb_series(c, count) for c in rows] for rows in (series.y, [[*c, 0] for c in series.z]))
        phase, found, chi = series.motion, [], self.v.parts(y)["chi"]
        for i in range(self.v.wheels):
            for d in (1, -1):
                found.append((d * chi[i] - self.v.joint, lambda i=i, d=d: self._switch(i, d)))
        rates = self.v.turning(y) if self.turning else []
        for i, sign in enumerate(self.turning):
            if sign:
                found.append((-sign * rates[i], lambda i=i: self.resting_bearings.add(i)))
        for i, torque in phase.asked(z).items():
            for side in (1, -1):
                excess = side * torque - self.v.bearings.holding[i]
                found.append((excess, lambda i=i: self.released_bearings.add(i)))
        if self.sticks_on_ground:
            forces, slip = phase.forces(y, z), self.v.slip(y)
            for i, mode in enumerate(self.modes):
                if mode == STICKS:
                    excess = self.v.ground.used_up(forces[i], phase.loads[i], self.v.heavy)
                    found.append((excess, lambda i=i: self.released.add(i)))
                elif mode == SLIPS:
                    found.append((phase.goes_back(slip[i]), lambda i=i: self.resting.add(i)))
        return [(coefficients(margin, count), happens) for margin, happens in found]

    def _switch(self, i: int, direction: int) -> None:
        self.y, self.axial = self.v.switched(self.y, self.axial, i, direction)
        self.log.append((float(self.now), i, "switch"))
        if self.turning:
            self.turning = [sign_of(rate) for rate in self.v.turning(self.y)]
        if self.v.heavy and self.modes and self.modes[i] == STICKS:
            self.modes[i] = SLIPS
            self._see()

    def _rest_where_little_is_left(self) -> None:
        """A slip of two components comes near zero and not there: a contact rests whose slip is all but gone."""
        if self.sticks_on_ground and self.v.heavy:
            for i, (mode, slip) in enumerate(zip(self.modes, self.v.slip(self.y), strict=True)):
                if mode == SLIPS and max(abs(float(s)) for s in slip) < RESTS:
                    self.resting.add(i)  # `_take_away` brings the rest of it to zero

    def _settle(self) -> None:
        rests = [i for i in self.resting if self.modes[i] == SLIPS]
        for i in rests:
            self.modes[i] = STICKS
        if rests:
            self._take_away()
        self.resting |= {i for i, mode in enumerate(self.modes) if mode == STICKS}
        self.resting_bearings |= {i for i, sign in enumerate(self.turning) if not sign}
        self._decide()

    def _take_away(self) -> None:
        """Forces of the contacts that stick bring their slips to zero at once."""
        series, slip = self._series(0), self.v.slip(self.y)
        phase = series.motion
        left = [slip[i][c] for i, c in phase.places] + [arb(0)] * len(phase.bearings)
        impulse = solved(series.matrix, [-value for value in left])
        for value, response in zip(impulse, series.response, strict=True):
            self.y = [(y + value * r).mid() for y, r in zip(self.y, response, strict=True)]


def sign_of(value: Any, still: float = STILL) -> int:
    return 0 if abs(float(value)) < still else 1 if float(value) > 0 else -1
