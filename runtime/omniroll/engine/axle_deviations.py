"""How deviations pass where axles come to rest, stick and break away beside wheels that may slip.

There a wheel's rate is a speed of its own, and rates jump where its axle changes its mode, at a time that deviates:

    d+ = d- + (f- - f+) dt,

dt from the wheel's rate where it comes to rest, and from what its axle is asked for where that comes to its bound.
Under static loads nothing but the rate of that wheel has a jump, so that each axle has its own instant and several
together need no order. Where loads follow the motion they feel each axle: there axles that change together must do so
beside the run, too. With equal sliding and break-away torques rates do not jump where an axle breaks away, and neither
do deviations.

There is no derivative where a rate only just comes to zero, and where what is asked of an axle only just comes to its
bound, or is at it in what begins.
"""

import numpy as np

from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.bearing_deviations import BearingDeviations
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import KEPT
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent


class AxleDeviations(BearingDeviations):
    """The deviations of one run in P columns, where its axles come to rest and break away."""

    name = "axle"

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns, motion.axles, None)
        self.rates = self.deviations.places["rates"]

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts: a wheel whose axle sticks has no rate beside it either."""
        self.refuse_edges(0)
        found, rests = np.array(moved), self.modes[0] == 0
        if self.contacts is not None:  # loads that follow feel what takes its rate away
            found = self.rested(0, np.where(rests, 1, self.modes[0]), found, rests)
        found[self.rates[rests]] = 0.0
        return found

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after axles have changed their modes between a row and the next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.modes[row : row + 2]
        changed = np.flatnonzero(before != after)
        self.refuse_lifts(row, changed)
        jump = self.motion.rates[row] - self.motion.rates[row + 1]
        if self.motion.drives_jump(row, (TORQUE, *KEPT, "carries")):
            return self._at_a_knot(row, moved, knot, changed, jump)
        times = np.zeros((len(changed), len(self.columns)))
        stops, jumps = before[changed] != 0, self._jumps(row, changed, jump)
        if stops.any():
            times[stops] = self.times_of_stops(row, moved, changed[stops])
        self.refuse_edges(row + 1)
        if (~stops & jumps).any():
            times[~stops] = self._times_of_release(row, moved, changed[~stops], inputs)
        own = self.rates[changed]
        found = np.array(moved)
        found[own] += jump[own][:, None] * times
        others = np.setdiff1d(np.arange(len(moved)), own)
        if np.abs(jump[others]).max() > JUMPS * np.abs(self.motion.rates[row : row + 2, others]).max():
            self.refuse_apart(row, times[stops | jumps], changed)
            found[others] += jump[others][:, None] * times[stops | jumps][0]
        return found

    def _at_a_knot(
        self, row: int, moved: np.ndarray, knot: np.ndarray | None, changed: np.ndarray, jump: np.ndarray
    ) -> np.ndarray:
        """The same where a drive jumps: axles that do not come to rest do so by this jump."""
        stops = changed[self.modes[row, changed] != 0]
        times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        if stops.size:
            times = np.concatenate([times, self.times_of_stops(row, moved, stops)])
        self.refuse_edges(row + 1)
        self.refuse_apart(row, times, changed)
        return moved + jump[:, None] * times[0]

    def _possible(self, row: int, axles: np.ndarray) -> np.ndarray:
        """(k,) in rad/s^2, accelerations that axles could have: by what acts on them, and by what their bearings
        take."""
        inertia = self.motion.plain.vehicle.wheel_inertia
        rates = np.abs(self.motion.rates[row : row + 2, self.rates[axles]]).max(axis=0)
        return rates + (np.abs(self._asked(row)) + self.holding)[axles] / inertia

    def _asked(self, row: int) -> np.ndarray:
        """(N,) in N m, what holds the axles that stick in a row."""
        motion = self.motion
        held = motion.held_at(np.array(row))
        known = self.deviations.known_of(motion.plain, motion.y[row], motion.inputs[row], held)
        return known["axle_holding"] * (self.modes[row] == 0)

    def _jumps(self, row: int, axles: np.ndarray, jump: np.ndarray) -> np.ndarray:
        """(k,) bool: axles whose rates jump."""
        return np.abs(jump[self.rates[axles]]) > JUMPS * self._possible(row, axles)

    def times_of_stops(self, row: int, moved: np.ndarray, axles: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which the rates of turning axles come to zero."""
        slopes = self.motion.rates[row, self.rates[axles]]
        slow = axles[np.abs(slopes) <= GRAZES * self._possible(row, axles)]
        if slow.size:
            reason = "an axle only just comes to rest, so that a change however small lets it turn on"
            raise self.none(row, reason, slow)
        return -moved[self.rates[axles]] / slopes[:, None]

    def _times_of_release(self, row: int, moved: np.ndarray, axles: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(k, P) the same where what axles are asked for comes to its bound."""
        columns = self.columns.behind_another(self.motion.trajectory)  # the first is that of the time
        along = np.concatenate([self.motion.rates[row][:, None], moved], axis=1)
        y = with_tangent(self.motion.y[row], self.motion.whole(along.T))
        given = with_tangent(self.motion.inputs[row], inputs.T)
        held = self.motion.held_at(np.array(row))
        if self.contacts is not None:
            held = self.contacts.moved(held, columns.constants, 0)
        asked = self.deviations.known_of(columns.kernel, y, given, held)["axle_holding"]
        most = np.concatenate([np.zeros((1, len(self.holding))), self.torques[1]])
        slopes = (np.sign(asked[0].real) * tangent_of(asked) - most)[:, axles].T
        bounds = self.holding[axles]
        reached = np.abs(asked[0].real[axles]) >= (1 - REACHED) * bounds
        if not (reached & (slopes[:, 0] * self.motion.time_in_modes(self.modes, row) > GRAZES * bounds)).all():
            reason = "what an axle holds only just comes to its bound, so that a change however small lets it stay"
            raise self.none(row, reason, axles)
        return -slopes[:, 1:] / slopes[:, :1]

    def refuse_edges(self, row: int) -> None:
        """Raises NoDerivativeError where an axle sticks from a row on that is asked for all that it takes."""
        self.refuse_at_bound(row, self.modes[row] == 0, self._asked(row))
