"""Free rollers that stick on their disks, in 40 digits, beside rollers in contact and axles that do, where wheels roll.

Of the generated formulas it takes the accelerations that given torques of all bearings make, and the impact. What holds
a bearing that sticks is an unknown torque that keeps its rate zero (hard.constrained); it breaks away where that comes
to its bound. Bearings that stick must be independent: at the rest of the whole vehicle they are not.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from flint import arb, arb_series

from hard.constrained import Row, Series, coefficient, coefficients, first_zero
from hard.moving import CONSTANTS, larger, split
from omniroll.engine.runs import Task
from omniroll.kernels import sets
from omniroll.studies.accuracy.acting import Acting
from omniroll.studies.accuracy.mechanics import elementary, flat, nested_numbers

ORDER, ERROR = 36, 1e-30  # of the series, and of a step, relative
STILL = 1e-25  # rad/s, of a rate that is not there
ROUNDED = 1e-14  # rad/s, of a spin that doubles say a start has, and is not there
ZERO = 1e-28  # of a margin
AT_ONCE = 1e-20  # rad/s^2, of an acceleration that is not there
LONGEST = 10_000  # steps
START = ("nu", "chi", "pose", "spins")
TORQUES = {
    "wheel_coulomb": ("axles", "sliding"),
    "wheel_break_away": ("axles", "holding"),
    "roller_coulomb": ("rollers", "sliding"),
    "roller_break_away": ("rollers", "holding"),
}


class Bearings:
    """The formulas of a task, with one of its numbers larger by `change`; bearings of axles, contacts, free rollers."""

    def __init__(self, task: Task, name: str, change: Any):
        number, place = split(name)
        bound, self.task = task.kernel, task
        self.kernel, self.module = bound, sets.python_module(bound.base, bound.effects)
        self.wheels, self.rollers = bound.wheels, bound.rollers_per_wheel
        values = (nested_numbers(value.tolist(), arb) for value in bound.constants)
        constants = dict(zip(bound.constant_names, values, strict=True))
        kernel_name = CONSTANTS.get(number, number)
        if kernel_name in constants:
            constants[kernel_name] = larger(constants[kernel_name], place, change)
        elif number not in (*START, *TORQUES, "height"):
            raise ValueError(f"{name} is no number of this reference")
        self.model = self.module.prepare(self.wheels, self.rollers, *constants.values())
        self.joint = elementary().circle_ratio(arb(1)) / self.rollers
        self.constants, self.start_number = constants, (number, place, change)
        self.acting = Acting(task, arb)
        own = next(effect for effect in task.effects.effects if getattr(effect, "rollers_stick", False))
        self.has_axles = own.sticks
        self.sliding, self.holding = self._torques(own, number, place, change)

    def _torques(self, own: Any, number: str, place: tuple[int, ...], change: Any) -> list[Row]:
        """Where bearings turn, and the largest at rest."""
        found = []
        for kind, instead in (("coulomb", None), ("break_away", "coulomb")):
            row: Row = []
            for body in ("wheel", "roller"):
                name = f"{body}_{kind}"
                if getattr(own, name) is None and instead is not None:
                    name = f"{body}_{instead}"
                if getattr(own, f"{body}_coulomb") is None or (body == "wheel" and not own.sticks):
                    continue
                torques = nested_numbers(np.broadcast_to(getattr(own, name), self.wheels).tolist(), arb)
                torques = larger(torques, place, change) if name == number else torques
                row += torques
                if body == "roller":
                    row += [torque for torque in torques for _ in range(self.rollers - 1)]
            found.append(row)
        return found

    def start(self) -> Row:
        """nu, chi, the pose and the spins."""
        state, (number, place, change) = self.task.state, self.start_number
        given = {name: nested_numbers(getattr(state, name).tolist(), arb) for name in ("nu", "chi", "pose")}
        axial = nested_numbers(state.free_axial().tolist(), arb)
        spins = self.module.spins_from_axial(self.model, given["nu"], given["chi"], axial)
        given["spins"] = [[arb(0) if abs(float(s)) < ROUNDED else s for s in wheel] for wheel in spins]
        if number in given:
            given[number] = larger(given[number], place, change)
        return list(flat([given[name] for name in START]))

    def shown(self, y: Row) -> Row:
        """nu, chi, the pose and the spins of a state."""
        return y

    def parts(self, y: Row) -> dict[str, Any]:
        n, each = self.wheels, self.rollers - 1
        spins = y[6 + n :]
        return {
            "nu": y[:3], "chi": y[3 : 3 + n], "pose": y[3 + n : 6 + n],
            "spins": [spins[i * each : (i + 1) * each] for i in range(n)],
        }  # fmt: skip

    def turning(self, y: Row) -> Row:
        """The rates of all bearings."""
        known = self.parts(y)
        wheels, contacts = self.module.wheel_rates(self.model, known["nu"], known["chi"])
        return [*(wheels if self.has_axles else []), *contacts, *flat(known["spins"])]

    def rates(self, y: Row, torques: Row, inputs: dict[str, Any]) -> Row:
        known, n = self.parts(y) | inputs, self.wheels
        if self.has_axles:
            known["bearing_torque"], torques = torques[:n], torques[n:]
        known["contact_bearing"], free, each = torques[:n], torques[n:], self.rollers - 1
        known["free_bearing"] = [free[i * each : (i + 1) * each] for i in range(n)]
        known["heading"] = known["pose"][2]
        arguments = (known[argument.name] for argument in self.kernel.signatures["accelerations"].inputs)
        nu_dot, spins_dot = getattr(self.module, self.kernel.form("accelerations"))(self.model, *arguments)
        chi_dot = self.module.wheel_speeds(self.model, known["nu"])
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        return [*nu_dot, *chi_dot, *pose_dot, *flat(spins_dot)]

    def switched(self, y: Row, i: int, direction: int) -> Row:
        """After wheel i has passed to its next roller. Axial speeds of free rollers stay; the one that comes into
        contact has what the contact demands, under `impact` of another nu."""
        known = self.parts(y)
        nu, chi, spins, m = known["nu"], known["chi"], known["spins"], self.module
        after = [-direction * self.joint if k == i else value for k, value in enumerate(chi)]
        axial, contact = m.axial_speeds(self.model, nu, chi, spins), m.contact_axial(self.model, nu, chi)
        entering = [arb(0)] * self.wheels
        spin = spins[i][-1] if direction > 0 else spins[i][0]
        entering[i] = spin - m.wheel_rates(self.model, nu, after)[1][i]
        axial[i] = [contact[i], *axial[i][:-1]] if direction > 0 else [*axial[i][1:], contact[i]]
        if self.task.switching == "impact":
            leaving = [arb(0)] * self.wheels
            nu = getattr(m, self.kernel.form("impact"))(self.model, nu, after, entering, leaving)
        spins = m.spins_from_axial(self.model, nu, after, axial)
        return [arb(value).mid() for value in flat([nu, after, known["pose"], spins])]


class Phase:
    """The motion in given modes of the bearings: 0 sticks, +-1 turns so."""

    def __init__(self, bearings: Bearings, modes: list[int], signals: dict[str, Any]):
        self.b, self.modes, self.signals = bearings, list(modes), signals
        self.stuck = [k for k, mode in enumerate(modes) if not mode]
        self.unknowns = len(self.stuck)

    def torques(self, z: Row) -> Row:
        found = [-mode * bound for mode, bound in zip(self.modes, self.b.sliding, strict=True)]
        for k, torque in zip(self.stuck, z, strict=True):
            found[k] = torque
        return found

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        inputs = {
            name: [value + slope * time for value, slope in zip(*pair, strict=True)]
            for name, pair in self.signals.items()
        }
        return self.b.rates(y, self.torques(z), inputs)

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        turning = self.b.turning(y)
        return [turning[k] for k in self.stuck]

    def balance(self, time: Any, y: Row, z: Row, rates: Row) -> Row:
        return []


class Run:
    """The motion from its start to the end; `log` says what happens."""

    def __init__(self, task: Task, name: str, change: Any):
        self.b = Bearings(task, name, change)
        self.now, self.end, self.log = arb(0), arb(task.duration), []
        self.y = self.b.start()
        self.modes = [sign_of(rate) for rate in self.b.turning(self.y)]
        self.resting = {k for k, mode in enumerate(self.modes) if not mode}
        self.released: dict[int, int] = {}  # with the sign of the rate that follows

    def to_the_end(self) -> Row:
        """nu, chi, pose and spins."""
        self._decide()
        for _ in range(LONGEST):
            if float(self.end - self.now) <= 0:
                return self.b.shown(self.y)
            self._step()
        raise ValueError("too many steps")

    def _phase(self) -> Phase:
        return Phase(self.b, self.modes, signals_at(self.b.acting, self.now, self.y[:3]))

    def _decide(self) -> None:
        """Bearings at rest stick if they can be held; those that cannot turn as what would hold them pushes."""
        before = list(self.modes)
        for k in self.resting:
            self.modes[k] = 0
        self.modes = [self.released.get(k, mode) for k, mode in enumerate(self.modes)]
        begun = set(self.released)
        while True:
            series = Series(self._phase(), self.y, 0)
            z = [c[0] for c in series.z]
            held = zip(series.motion.stuck, z, strict=False)
            beyond = {k: -sign_of(u) for k, u in held if float(abs(u) - self.b.holding[k]) > ZERO}
            if not beyond:
                break
            begun |= set(beyond)
            self.modes = [beyond.get(k, mode) for k, mode in enumerate(self.modes)]
        self._check(series.motion, z, begun)
        for k, (old, new) in enumerate(zip(before, self.modes, strict=True)):
            if old != new:
                self.log.append((float(self.now), k, old, new))
        self.resting.clear()
        self.released.clear()

    def _check(self, phase: Phase, z: Row, begun: set[int]) -> None:
        """What begins to turn does so against the torque that it has."""
        rates = phase.rates(arb(0), self.y, z)
        ahead = [arb_series([a, b], 2) for a, b in zip(self.y, rates, strict=True)]
        gains = [coefficient(rate, 1) for rate in self.b.turning(ahead)]
        for k in begun:
            if float(gains[k]) * self.modes[k] < -AT_ONCE:
                raise ValueError(f"bearing {k} neither sticks nor turns")

    def _step(self) -> None:
        series, known = Series(self._phase(), self.y, ORDER), self.b.acting.next_time()
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
        if found is None and not arrived:
            return
        for k in found[1] if found else []:
            margins[k][1]()
        self.resting |= {k for k, mode in enumerate(self.modes) if not mode} - set(self.released)
        self._decide()

    def _margins(self, series: Series) -> list[tuple[Row, Callable[[], None]]]:
        """Functions, by coefficients, that become positive, and what happens then."""
        count, found = ORDER + 1, []
        y = [arb_series(c, count) for c in series.y]
        chi, turning = self.b.parts(y)["chi"], self.b.turning(y)
        for i in range(self.b.wheels):
            for d in (1, -1):
                found.append((d * chi[i] - self.b.joint, lambda i=i, d=d: self._switch(i, d)))
        for k, mode in enumerate(self.modes):
            if mode:
                found.append((-mode * turning[k], lambda k=k: self.resting.add(k)))
        for k, c in zip(series.motion.stuck, series.z, strict=False):
            torque = arb_series(c, count)
            for sign in (1, -1):
                found.append((sign * torque - self.b.holding[k], lambda k=k, s=sign: self.released.update({k: -s})))
        return [(coefficients(margin, count), happens) for margin, happens in found]

    def _switch(self, i: int, direction: int) -> None:
        self.y = self.b.switched(self.y, i, direction)
        self.log.append((float(self.now), i, "switch", direction))
        self.modes = [sign_of(rate) for rate in self.b.turning(self.y)]


def signals_at(acting: Acting, now: Any, nu: Row) -> dict[str, Any]:
    """What drives give from a time on, when they have jumped as they do up to then."""
    while acting.next_time() <= float(now):
        acting.pass_time(acting.next_time(), None, nu, None)
    acting.begin(now)
    return acting.signals


def sign_of(value: Any) -> int:
    return 0 if abs(float(value)) < STILL else 1 if float(value) > 0 else -1
