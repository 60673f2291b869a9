"""One phase: the motion from one switch up to the next, by DOP853 steps with located switches.

This is the readable reference. It knows the state only as y = (nu, chi, pose, ...) with y' = flow(time, y), where
a wheel switches (|chi_i| passes pi/n), what else ends a phase (effects/guards.py) and how large each component is; the
mechanics is in the kernel. Time is counted from the phase's start, so that it is fine near a switch whatever the clock
shows.

Each accepted step carries a polynomial. A wheel that leaves its roller inside the step shows in it, also one
that comes back before the step's end; the step is then made anew, straight onto the first such moment, by
Newton's rule on the full step (not on the polynomial, which is less exact).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from omniroll.effects.guards import NO_GUARDS, Guards
from omniroll.engine.dop853 import Step
from omniroll.engine.switching import EPS
from omniroll.kernels.kernel import Flow
from omniroll.results.dense import first_positive

OVERSHOOT = 1.05  # a step that would pass the joint aims this little beyond it,
SHORTEST_AIM = 0.05  # unless that is less than this part of the step: a wheel that slows down there takes for ever
LANDING_TRIALS = 100
NU = slice(3)
ROUNDING = 4 * EPS  # of an angle, relative
SAFETY, LEAST_FACTOR, MOST_FACTOR = 0.9, 0.2, 10.0  # of a step's length over the one before


class StepFailedError(ArithmeticError):
    """No step from here meets the tolerance."""


class StepTooSmallError(StepFailedError):
    """Not even the shortest one."""

    def __init__(self):
        super().__init__("the step became too small")


@dataclass
class Phase:
    """A piece of motion without a switch inside.

    flow        the rates, f(time, y)
    gap         gap(h): the time within which switches are one switch, where h is the phase's length
    guards      what ends it beside switches
    times       ends of the steps, counted from the phase's start
    ends        y at these times
    dense       Bernstein coefficients (8, d) of each step
    y           the last state
    directions  (N,) int: +1 or -1 for the wheels that switch at the end, all 0 at the end of the run
    passed      (m,) bool: the guards that have ended it
    """

    flow: Flow
    y: np.ndarray
    gap: Callable[[float], float]
    guards: Guards
    directions: np.ndarray
    passed: np.ndarray
    times: list[float] = field(default_factory=list)
    ends: list[np.ndarray] = field(default_factory=list)
    dense: list[np.ndarray] = field(default_factory=list)

    @property
    def duration(self) -> float:
        return self.times[-1] if self.times else 0.0

    def add_step(self, time: float, y: np.ndarray, dense: np.ndarray) -> None:
        self.times.append(time)
        self.ends.append(y)
        self.dense.append(dense)
        self.y = y


@dataclass
class Counts:
    """What a run has cost."""

    evaluations: int = 0
    steps: int = 0
    error: float = 0.0  # the sum of the steps' errors as the steps estimate them, in units of `scale`


class PhaseIntegrator:
    """Integrates phases with y' = flow(time, y).

    wheels     N; chi is y[3 : 3 + N]
    joint      pi/n in rad
    scale      (d,) the size of each component, in which errors are measured; nu's grows to the largest |nu| that was
    tolerance  the local error allowed in a step, in units of `scale`
    """

    def __init__(self, wheels: int, joint: float, scale: np.ndarray, tolerance: float):
        self.chi, self.pose = slice(3, 3 + wheels), slice(3 + wheels, 6 + wheels)
        self.wheels, self.joint, self.scale, self.tolerance = wheels, joint, scale.copy(), tolerance
        self.counts = Counts()
        self.next_step: float | None = None  # carried over a switch
        self.carry = np.zeros_like(scale)  # what the rounding of y has left over
        self.watch: Callable[[float], None] = lambda done: None  # may end a phase after each step

    def run(
        self, flow: Flow, y: np.ndarray, limit: float, gap: Callable[[float], float], guards: Guards = NO_GUARDS
    ) -> Phase:
        """Integrate from y to the next switch or guard, at most for the time `limit`; the others as of Phase. No guard
        is passed at y.

        Raises StepFailedError; its `phase` attribute is what was done until then. So does `watch`.
        """
        phase = Phase(flow, y, gap, guards, np.zeros(self.wheels, int), np.zeros(len(guards), bool))
        self.carry[: self.pose.start] = 0.0  # a switch has put wheels onto their joints, and may have changed nu
        with np.errstate(all="ignore"):  # a trial step may leave the number range; it is rejected
            if self.next_step is None:
                self.next_step = self._first_step(flow, y, limit)
            while phase.duration < limit:
                try:
                    finished = self._advance(phase, limit)
                except StepFailedError as error:
                    error.phase = phase  # type: ignore[attr-defined]
                    raise
                if finished:
                    break
        return phase

    def _advance(self, phase: Phase, limit: float) -> bool:
        """Add steps until a switch, a guard or the limit. False: a crossing proved to be none, so go on anew."""
        time, y = phase.duration, phase.y
        rates = phase.flow(time, y)
        self.counts.evaluations += 1
        while True:
            step, end = self._step(phase.flow, time, y, rates, limit)
            dense = step.polynomial()
            self.counts.evaluations += step.further
            crossing, directions = self._first_crossing(dense)
            if self._land_on_first_guard(phase, step, dense, crossing):
                return True
            if crossing is not None:
                if time + crossing * step.h == time:
                    self._end_on_joints(phase, directions)
                    return True
                return self._land(phase, step, crossing)
            phase.add_step(end, step.y_end, dense)
            time, y, rates, self.carry = end, step.y_end, step.rates_end, step.carry_end
            if time >= limit:
                self._end_on_joints(phase, self._due(phase, time, y))
                return True
            self.watch(time)

    def _step(self, flow: Flow, time: float, y: np.ndarray, rates: np.ndarray, limit: float) -> tuple[Step, float]:
        """One accepted step, short enough not to pass the next joint by far; and the time of its end."""
        waits, _ = self._waits(rates, y)
        wanted = self.next_step
        asked = min(wanted, max(OVERSHOOT * waits.min(), SHORTEST_AIM * wanted))
        shortest = 10 * np.spacing(time)
        h, rejected = max(asked, shortest), False
        while True:
            end = min(time + h, limit)
            step = Step(flow, time, y, rates, end - time, self.carry)
            self.counts.evaluations += step.evaluations
            scale = self._scale(y, rates, step.h)
            size = self.tolerance * scale + EPS * np.maximum(np.abs(y), np.abs(step.y_end))
            error = step.error(size)
            factor = SAFETY * error ** (-1 / step.order) if error != 0 else MOST_FACTOR  # none where a stage is none
            if error < 1:
                break
            h, rejected = step.h * max(LEAST_FACTOR, factor if np.isfinite(factor) else 0.0), True
            if h < shortest:
                raise StepTooSmallError
        if not np.isfinite(step.y_end).all():
            raise StepTooSmallError
        following = step.h * min(factor, 1.0 if rejected else MOST_FACTOR)
        # A step cut short by the joint says little about the length that the tolerance would allow.
        accepted = step.h >= 0.999 * asked
        self.next_step = max(wanted, following) if accepted and asked < wanted else following
        self.scale = self._scale(y, rates, 0.0)
        self.counts.steps += 1
        self.counts.error += step.error(scale)
        return step, end

    def _scale(self, y: np.ndarray, rates: np.ndarray, h: float) -> np.ndarray:
        """(d,) the sizes on a step of length h: a vehicle that starts from rest has the speeds that it will have."""
        scale = self.scale.copy()
        scale[NU] = np.max([scale[NU].max(), np.abs(y[NU]).max(), h * np.abs(rates[NU]).max()])
        return scale

    def _first_step(self, flow: Flow, y: np.ndarray, limit: float) -> float:
        fastest = np.max(np.abs(flow(0.0, y)) / self.scale)
        self.counts.evaluations += 1
        return min(limit, 0.05 / fastest) if fastest > 0 else limit

    def _waits(self, rates: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) times to each wheel's joint at its present speed, negative beyond it; and directions."""
        chi, chi_dot = y[self.chi], rates[self.chi]
        directions = np.sign(chi_dot)
        way = self.joint - directions * chi
        waits = np.where(chi_dot != 0, way / np.abs(chi_dot), np.inf)
        return waits, directions.astype(int)

    def _due(self, phase: Phase, time: float, y: np.ndarray) -> np.ndarray:
        """Directions of the wheels that reach their joint within the phase's gap, 0 for the others."""
        waits, directions = self._waits(phase.flow(time, y), y)
        self.counts.evaluations += 1
        return np.where(waits < phase.gap(time), directions, 0)

    def _first_crossing(self, dense: np.ndarray) -> tuple[float | None, np.ndarray]:
        """Where in the step, 0..1, a wheel first leaves its roller, and the directions; None if none does."""
        chi = dense[:, self.chi]
        if np.abs(chi).max() <= self.joint:  # the polynomials lie in the hull of their coefficients
            return None, np.zeros(self.wheels, int)
        bounds = self.joint + np.where(self._turning_back(chi), ROUNDING * self.joint, 0.0)
        first, passed = first_passed(np.concatenate([chi - bounds, -chi - bounds], axis=1))
        return first, passed[: self.wheels].astype(int) - passed[self.wheels :]

    def _turning_back(self, chi: np.ndarray) -> np.ndarray:
        """(N,) bool: wheels on their joints that turn back before they are beyond by the rounding of their angles.

        An impact may send a wheel back again and again, in less and less time: without this there is no last one.
        `chi` (8, N) are the Bernstein coefficients of a step.
        """
        degree, sign = len(chi) - 1, np.sign(chi[0])
        outwards = sign * degree * (chi[1] - chi[0])
        slowing = -sign * degree * (degree - 1) * (chi[2] - 2 * chi[1] + chi[0])
        small = (slowing > 0) & (outwards**2 < 2 * ROUNDING * self.joint * slowing)
        return small & (np.abs(chi[0]) >= self.joint)

    def _land_on_first_guard(self, phase: Phase, step: Step, dense: np.ndarray, crossing: float | None) -> bool:
        """Step onto the first guard that the step passes before `crossing`; False if it passes none. Its polynomial
        (8, d) is less exact than the motion, and may lead beyond a guard that the motion only comes near."""
        if not len(phase.guards):
            return False
        margins = phase.guards.margins(dense, step.time, step.h)
        while True:
            guard, passed = first_passed(margins, crossing)
            if guard is None:
                return False
            if self._land_on_guard(phase, step, guard, passed):
                return True
            margins[:, passed] = -1.0

    def _land(self, phase: Phase, step: Step, guess: float) -> bool:
        """Step onto the first joint, `guess` of the way of a step that passes it.

        Newton's rule between the last h inside and the first outside. False if no wheel passes after all.
        """
        h_most, h = step.h, guess * step.h
        inside, low, high, beyond = None, 0.0, h_most, None  # beyond: chi at `high`, once a step has been too long
        for _ in range(LANDING_TRIALS):
            part = self._single_step(step, h)
            chi = part.y_end[self.chi]
            waits, directions = self._waits(part.rates_end, part.y_end)
            first = np.argmin(waits)
            outside = not np.abs(chi).max() <= self.joint
            high, beyond = (h, chi) if outside else (high, beyond)
            low, inside = (low, inside) if outside else (h, part)
            noise = 2 * EPS * (h + self.joint / max(abs(part.rates_end[self.chi][first]), np.finfo(float).tiny))
            if abs(waits[first]) <= noise or (not outside and h == h_most):
                break
            following = h + waits[first]
            if not low < following < high:
                following = (low + high) / 2 if beyond is not None else h_most
            if following in (low, high) and beyond is not None:  # nothing between: the joint is here
                part = inside
                y = step.y if part is None else part.y_end
                waits, directions = self._waits(phase.flow(step.time + low, y), y)
                past = np.abs(beyond) > self.joint
                directions = np.where(past, np.sign(beyond).astype(int), directions)
                waits = np.where(past, 0.0, waits)
                break
            h = following
        else:
            raise StepFailedError("no landing on the joint")
        if part is not None:
            self._add(phase, part)
        self._end_on_joints(phase, np.where(waits < phase.gap(phase.duration), directions, 0))
        return bool(phase.directions.any())

    def _land_on_guard(self, phase: Phase, step: Step, guess: float, passed: np.ndarray) -> bool:
        """Step onto the first of the passed guards, `guess` of the way of a step that passes them. False, and no step,
        if the motion passes none after all.

        Newton's rule, and halving where it leaves the bracket. A guard on which the step starts is passed at once.
        """
        guards, low, high, h, is_passed = phase.guards, 0.0, step.h, guess * step.h, False
        waits, _ = guards.waits(step.time, step.y, step.rates)
        if (waits[passed] <= 0).any() or step.time + h == step.time:
            phase.passed = passed
            return True
        for _ in range(LANDING_TRIALS):
            part = self._single_step(step, h)
            time, y = step.time + h, part.y_end
            waits, noise = guards.waits(time, y, part.rates_end)
            waits[~passed] = np.inf
            first = np.argmin(waits)
            if abs(waits[first]) <= noise[first] + EPS * h:
                missed = guards.beyond(time, y) & ~passed
                if not missed.any():
                    is_passed = True
                    break
                passed = passed | missed  # no polynomial shows them: a function with kinks, like the least use
            beyond = (guards.values(time, y)[passed] > 0).any()
            is_passed |= bool(beyond)
            low, high = (low, h) if beyond else (h, high)
            following = h + waits[first]
            if not low < following < high:
                following = (low + high) / 2
            if following in (low, high):
                break
            h = following
        if not is_passed:
            return False
        self._add(phase, part)
        phase.passed = passed & (waits <= max(waits[first], 0.0) + noise + phase.gap(phase.duration))
        self._end_on_joints(phase, self._due(phase, phase.duration, y))
        return True

    def _single_step(self, step: Step, h: float) -> Step:
        """A step of exactly h from where `step` starts, whatever its error: it is part of a step that was accepted."""
        part = Step(step.flow, step.time, step.y, step.rates, h, step.carry)
        self.counts.evaluations += part.evaluations
        if not np.isfinite(part.y_end).all():
            raise StepFailedError("a step onto the joint is not finite")
        return part

    def _add(self, phase: Phase, part: Step) -> None:
        """The phase goes on to the end of this step."""
        phase.add_step(part.time + part.h, part.y_end, part.polynomial())
        self.counts.evaluations += part.further
        self.carry = part.carry_end

    def _end_on_joints(self, phase: Phase, directions: np.ndarray) -> None:
        """The phase ends with the switching wheels exactly on their joints, the others not beyond theirs."""
        y = phase.y.copy()
        y[self.chi] = np.where(directions != 0, directions * self.joint, np.clip(y[self.chi], -self.joint, self.joint))
        if phase.times:
            phase.ends[-1] = y
            phase.dense[-1][-1] = y
        phase.directions, phase.y = directions, y


def first_passed(margins: np.ndarray, before: float | None = None) -> tuple[float | None, np.ndarray]:
    """Where in a step, 0..1, polynomials (8, m) first become positive, and which, (m,) bool; None if none does, or not
    before `before`."""
    passed, earliest = np.zeros(margins.shape[1], bool), before
    for k in np.flatnonzero(margins.max(axis=0) > 0):
        found = first_positive(margins[:, k].tolist())
        if found is None or (earliest is not None and found > earliest):
            continue
        if earliest is None or found < earliest:
            earliest, passed = found, np.zeros(margins.shape[1], bool)
        passed[k] = True
    return (earliest if passed.any() else None), passed
