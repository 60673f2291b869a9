"""The runs of hard.true_strips, whose bearings have viscous friction, too.

What a bearing takes goes with the spin, which is what the slip leaves of the speed along the axle. Where a contact
slips and its roller turns, the angle of its direction is an unknown number: there the ellipse has what the bearing
takes. Where a bearing would take more than that at no slip, the contact slips along its axle, and its slip along the
rolling direction may pass zero.
"""

import math
from typing import Any

from flint import arb

from hard import true_strips
from hard.constrained import Row
from hard.true_ground import BEGINS, SLIPS, STILL, sign_of

HALVINGS = 200  # of an interval of doubles


class Damped(true_strips.Rigid):
    """The formulas; bearings of rollers have viscous friction."""

    damps = True

    def dampers(self, y: Row) -> Row:
        """In N s/m, along the axles."""
        return [c / arm**2 for c, arm in zip(self.bearings.damping, self.arms(y), strict=True)]

    def pulls(self, y: Row, spins: list[int]) -> Row:
        """In N, what bearings of rollers that turn would take if their contacts did not slip along their axles."""
        torques = self.bearings.sliding[self.bearings.axles :]
        parts = zip(spins, torques, self.arms(y), self.dampers(y), self.slip(y), strict=True)
        return [damper * slip[0] + spin * torque / arm for spin, torque, arm, damper, slip in parts]


class DampedPhase(true_strips.StripPhase):
    """Unknown are also, by contact (`ways`), the angles of the directions of those that slip and whose rollers turn.

    alone  of these, those whose bearings take more than the ground gives
    """

    v: Damped

    def __init__(self, *given: Any):
        super().__init__(*given)
        both = [i for i, spin in enumerate(self.spins) if spin and self.modes[i] in (SLIPS, BEGINS)]
        self.ways = {i: self.unknowns + k for k, i in enumerate(both)}
        self.unknowns += len(both)
        self.alone: set[int] = set()

    def forces(self, y: Row, z: Row) -> list[Row]:
        found, loads, pulls = super().forces(y, z), self.loads(z), self.v.pulls(y, self.spins)
        for i, spin in enumerate(self.spins):
            if i in self.ways:
                way = z[self.ways[i]]
                found[i] = [loads[i] * f for f in self.v.ground.sliding([way.cos(), way.sin()], True)]
            elif spin:
                found[i] = [-pulls[i], found[i][1]]
        return found

    def balance(self, time: Any, y: Row, z: Row, rates: Row) -> Row:
        """Also the slips across these directions, times what their bearings do."""
        found = super().balance(time, y, z, rates)
        if not self.ways:
            return found
        forces, slip = self.forces(y, z), self.v.slip(y)
        pulls, dampers = self.v.pulls(y, self.spins), self.v.dampers(y)
        for i, k in self.ways.items():
            left = pulls[i] + forces[i][0]
            found.append(dampers[i] * slip[i][1] * z[k].cos() - left * z[k].sin())
        return found

    def slips_along(self, y: Row, z: Row) -> dict[int, Any]:
        """What their bearings take less than they would at no slip, over their dampers; without one as in a corner."""
        forces, pulls, dampers = self.forces(y, z), self.v.pulls(y, self.spins), self.v.dampers(y)
        slip, found = self.v.slip(y), {}
        for i, k in self.ways.items():
            damps = float(self.v.bearings.damping[i]) > 0
            found[i] = (pulls[i] + forces[i][0]) / dampers[i] if damps else slip[i][1] * z[k].cos() / z[k].sin()
        return found

    def goes_back(self, i: int, slip: Row) -> Any:
        return None if i in self.alone else super().goes_back(i, slip)


class Run(true_strips.Run):
    """The same of such a vehicle."""

    v: Damped
    formulas, in_modes = Damped, DampedPhase

    def _phase(self) -> DampedPhase:
        slip = self.v.slip(self.y)
        for i, spin in enumerate(self.turning[self.v.bearings.axles :]):
            if spin and self.modes[i] == SLIPS and abs(float(slip[i][1])) >= STILL:
                self.towards[i] = sign_of(slip[i][1])
        phase = super()._phase()
        loads = phase.loads([arb(0)] * phase.unknowns)
        pulls, first = self.v.pulls(self.y, phase.spins), self.v.ground.numbers["friction"][0]
        phase.alone = {i for i in phase.ways if abs(float(pulls[i])) >= float(first * loads[i])}
        return phase

    def _guess_at(self, phase: DampedPhase) -> Row:
        guess = super()._guess_at(phase)
        loads, slip = phase.loads(guess), self.v.slip(self.y)
        pulls, dampers = self.v.pulls(self.y, phase.spins), self.v.dampers(self.y)
        first, second = (float(mu) for mu in self.v.ground.numbers["friction"])
        for i, k in phase.ways.items():
            most = first * float(loads[i])
            drag = float(dampers[i]) * second * abs(float(slip[i][1])) / (first * most)
            tangent = root(abs(float(pulls[i])) / most, drag)
            way = math.atan2(self.towards[i] * first, math.copysign(second * tangent, float(pulls[i])))
            guess[k] = arb(way)
        return guess

    def _step(self) -> None:
        before, phase = list(self.towards), self._phase()
        super()._step()
        slip, pulls = self.v.slip(self.y), self.v.pulls(self.y, phase.spins)
        for i in phase.alone:
            most = self.v.ground.numbers["friction"][0] * phase.loads([arb(0)] * phase.unknowns)[i]
            turned = abs(float(slip[i][1])) >= STILL and sign_of(slip[i][1]) != before[i]
            if turned and abs(float(pulls[i])) < float(most):
                raise ValueError(f"contact {i} may have come to rest within a step")


def root(pull: float, drag: float) -> float:
    """t of t/sqrt(1 + t^2) + drag t = pull."""
    if drag == 0:
        return pull / math.sqrt((1 - pull) * (1 + pull)) if pull < 1 else math.inf
    low, high = 0.0, pull / drag
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if middle / math.hypot(1, middle) + drag * middle > pull else (middle, high)
    return low
