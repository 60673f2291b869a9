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

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import TORQUE, AxleModes
from omniroll.engine.contact_modes import ContactModes
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import KEPT
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent

JUMPS = 1e-9  # of what a rate could be: it does not jump by less
TOGETHER = 1e-9  # of the larger one: times that differ by less are the same
REACHED = 1e-6  # of what an axle takes: it has been reached
GRAZES = 1e-6  # of the rate that it could have: what comes to its bound more slowly grazes it


class AxleDeviations:
    """The deviations of one run in P columns, where its axles come to rest and break away."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.deviations = motion, columns, motion.deviations
        self.axles: AxleModes = motion.axles
        self.contacts: ContactModes | None = motion.contacts
        self.rates = self.deviations.places["rates"]

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, N) deviations of the torques of axles that turn, and of the largest at rest."""
        own, place = self.columns.signals, self.axles.place
        zero = np.zeros((len(self.columns), self.motion.plain.wheels))
        sliding, most = (own.get((place, f"wheel_{what}"), zero) for what in ("coulomb", "break_away"))
        given = self.columns.effects[place].wheel_break_away is not None
        return sliding, most if given else sliding

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, N) of the bearings' torques in the steps from rows (S,), by the input's
        name."""
        moved = -self.axles.modes[rows][:, None] * self.torques[0]
        return {TORQUE: (moved, np.zeros_like(moved))}

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """What generated functions take of the axles in rows (k,), by name; and the same with the tangents of the Q
        numbers that these functions know, (Q, k, ...)."""
        return self.axles.at(rows), self.carried(rows, self.columns.numbered)

    def carried(self, rows: np.ndarray, columns: np.ndarray | slice = slice(None)) -> dict[str, np.ndarray]:
        """The same in rows (...), carrying the tangents of some columns; no number moves it."""
        return self.axles.at(rows)

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether axles change their modes between a row and the next, where no time passes and no wheel
        switches."""
        found = (self.axles.modes[:-1] != self.axles.modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]
        found[self.motion.switched - 1] = False
        return found

    @property
    def rests_at_switches(self) -> np.ndarray:
        """Rows behind which an axle comes to rest just as a wheel switches."""
        before = self.motion.switched - 1
        return before[((self.axles.modes[before] != 0) & (self.axles.modes[before + 1] == 0)).any(axis=1)]

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where an axle comes to rest just as a wheel switches, behind a row."""
        rests = np.flatnonzero((self.axles.modes[row] != 0) & (self.axles.modes[row + 1] == 0))
        if rests.size:
            raise self._none(row, "an axle comes to rest just as a wheel switches", rests)

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change the
        modes of axles."""
        if (self.axles.modes[row] != self.axles.modes[row + 1]).any():
            reason = "wheels switch together, and axles decide with them in more than one order"
            raise self._none(row, reason, wheels)

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts: a wheel whose axle sticks has no rate beside it either."""
        self._refuse_edges(0)
        found = np.array(moved)
        found[self.rates[self.axles.modes[0] == 0]] = 0.0
        return found

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after axles have changed their modes between a row and the next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.axles.modes[row : row + 2]
        changed = np.flatnonzero(before != after)
        if self.contacts is not None and (self.contacts.carries[row] != self.contacts.carries[row + 1]).any():
            raise self._none(row, "an axle changes its mode just as a load vanishes or comes back", changed)
        jump = self.motion.rates[row] - self.motion.rates[row + 1]
        if self.motion.drives_jump(row, (TORQUE, *KEPT, "carries")):
            return self._at_a_knot(row, moved, knot, changed, jump)
        times = np.zeros((len(changed), len(self.columns)))
        stops, jumps = before[changed] != 0, self._jumps(row, changed, jump)
        if stops.any():
            times[stops] = self.times_of_stops(row, moved, changed[stops])
        self._refuse_edges(row + 1)
        if (~stops & jumps).any():
            times[~stops] = self._times_of_release(row, moved, changed[~stops], inputs)
        own = self.rates[changed]
        found = np.array(moved)
        found[own] += jump[own][:, None] * times
        others = np.setdiff1d(np.arange(len(moved)), own)
        if np.abs(jump[others]).max() > JUMPS * np.abs(self.motion.rates[row : row + 2, others]).max():
            self._refuse_apart(row, times[stops | jumps], changed)
            found[others] += jump[others][:, None] * times[stops | jumps][0]
        return found

    def _at_a_knot(
        self, row: int, moved: np.ndarray, knot: np.ndarray | None, changed: np.ndarray, jump: np.ndarray
    ) -> np.ndarray:
        """The same where a drive jumps: axles that do not come to rest do so by this jump."""
        stops = changed[self.axles.modes[row, changed] != 0]
        times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        if stops.size:
            times = np.concatenate([times, self.times_of_stops(row, moved, stops)])
        self._refuse_edges(row + 1)
        self._refuse_apart(row, times, changed)
        return moved + jump[:, None] * times[0]

    def _possible(self, row: int, axles: np.ndarray) -> np.ndarray:
        """(k,) in rad/s^2, accelerations that axles could have: by what acts on them, and by what their bearings
        take."""
        inertia = self.motion.plain.vehicle.wheel_inertia
        rates = np.abs(self.motion.rates[row : row + 2, self.rates[axles]]).max(axis=0)
        return rates + (np.abs(self._asked(row)) + self.axles.holding)[axles] / inertia

    def _asked(self, row: int) -> np.ndarray:
        """(N,) in N m, what holds the axles that stick in a row."""
        motion = self.motion
        held = motion.held_at(np.array(row))
        known = self.deviations.known_of(motion.plain, motion.y[row], motion.inputs[row], held)
        return known["axle_holding"] * (self.axles.modes[row] == 0)

    def _jumps(self, row: int, axles: np.ndarray, jump: np.ndarray) -> np.ndarray:
        """(k,) bool: axles whose rates jump."""
        return np.abs(jump[self.rates[axles]]) > JUMPS * self._possible(row, axles)

    def times_of_stops(self, row: int, moved: np.ndarray, axles: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which the rates of turning axles come to zero."""
        slopes = self.motion.rates[row, self.rates[axles]]
        slow = axles[np.abs(slopes) <= GRAZES * self._possible(row, axles)]
        if slow.size:
            reason = "an axle only just comes to rest, so that a change however small lets it turn on"
            raise self._none(row, reason, slow)
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
        most = np.concatenate([np.zeros((1, len(self.axles.holding))), self.torques[1]])
        slopes = (np.sign(asked[0].real) * tangent_of(asked) - most)[:, axles].T
        bounds = self.axles.holding[axles]
        reached = np.abs(asked[0].real[axles]) >= (1 - REACHED) * bounds
        if not (reached & (slopes[:, 0] * self.motion.time_in_modes(self.axles.modes, row) > GRAZES * bounds)).all():
            reason = "what an axle holds only just comes to its bound, so that a change however small lets it stay"
            raise self._none(row, reason, axles)
        return -slopes[:, 1:] / slopes[:, :1]

    def _refuse_edges(self, row: int) -> None:
        """Raises NoDerivativeError where an axle sticks from a row on that is asked for all that it takes."""
        asked, most = np.abs(self._asked(row)), self.axles.holding
        edge = np.flatnonzero((self.axles.modes[row] == 0) & (asked >= (1 - REACHED) * most))
        if edge.size:
            raise self._none(row, "an axle sticks by all its friction, so that a change however small lets it go", edge)

    def _refuse_apart(self, row: int, times: np.ndarray, axles: np.ndarray) -> None:
        apart = np.ptp(times, axis=0) > TOGETHER * np.abs(times).max(axis=0)
        if apart.any():
            names = ", ".join(np.array(self.columns.names)[apart])
            reason = f"several axles stop or break away together, and apart where a number changes; by {names}"
            raise self._none(row, reason, axles)

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return NoDerivativeError(reason, t=float(self.motion.trajectory.t[row]), wheels=tuple(map(int, wheels)))
