"""How deviations pass where rollers come to rest on their disks, stick and break away where wheels may slip.

Under a smooth law of the ground the state goes on through all of that, and rates jump at times that deviate. What comes
to rest does so by its own bearing alone. So with what the torques of bearings do to the rates, R, and to the spins, W,

    d* = d- - R W^-1 ds                              (ds: of the spins that have come to rest)

whatever their order was. Where one turns back at once, or where others change their modes with it, that happens at a
time that deviates, dt = -ds/s', and with the rates f* of rollers that stick d+ = d* + (f* - f+) dt. One breaks away
where what holds it comes to its bound,

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess',

and where sliding and break-away torques are the same rates do not jump there, and neither do deviations. Rollers feel
each other: those that change their modes together, but to stick, must do so beside the run, too.

Axles that stick are bearings like these. They are told here where they change their modes together with rollers, and in
axle_deviations.py where they do alone.

There is no derivative where a spin only just comes to zero, and where what is asked of a bearing only just comes to its
bound, or is at it in what begins.
"""

import numpy as np

from omniroll.engine.axle_deviations import AxleDeviations
from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.bearing_deviations import BearingDeviations
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import KEPT
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent


class RollerDeviations(BearingDeviations):
    """The deviations of one run in P columns, where its rollers come to rest on their disks and break away."""

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns, motion.axles, motion.rollers)
        self.beside = None if motion.axles is None else AxleDeviations(motion, columns)

    # What happens

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts: what sticks has no spin beside it either."""
        moved = moved if self.beside is None else self.beside.began(moved)
        modes, moves = self.modes[0], self.moves(0, moved)
        self._refuse_edges(0, modes)
        self.refuse_loose(0, moves)
        rests = (modes == 0) & moves
        return self.rested(0, np.where(rests, 1, modes), moved, rests)

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after rollers, or rollers and axles, have changed their modes between a row and the
        next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.modes[row : row + 2]
        if (before != after)[self.of_axles :].any():
            return self._passed(row, before, after, moved, knot, inputs)
        return self.beside.passed(row, moved, knot, inputs)

    def _passed(
        self,
        row: int,
        before: np.ndarray,
        after: np.ndarray,
        moved: np.ndarray,
        knot: np.ndarray | None,
        inputs: np.ndarray,
    ) -> np.ndarray:
        """The same where rollers have."""
        self.refuse_lifts(row, before != after)
        if not self.motion.drives_jump(row, (TORQUE, *KEPT, "carries")):
            return self._after(row, before, after, moved, inputs)
        stops = (before != 0) & (before != after)
        times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        if stops.any():
            times = np.concatenate([times, self._times_of_stops(row, before, after, moved, stops)])
        self._refuse_edges(row + 1, after)
        self.refuse_apart(row, times, before != after)
        rates = self.motion.rates
        return moved + (rates[row] - rates[row + 1])[:, None] * times[0]

    def turned(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the same after they have in a row that ends one step and starts the next."""
        return self._after(row, self.modes_of_step(row), self.modes[row], moved, inputs)

    def _after(
        self, row: int, before: np.ndarray, after: np.ndarray, moved: np.ndarray, inputs: np.ndarray
    ) -> np.ndarray:
        """(m, P) the deviations after the modes (B,) have changed where no drive jumps."""
        stops = (before != 0) & (before != after)
        resting = np.where(stops, 0, before)
        others, times = resting != after, []
        if stops.any():
            times.append(self._times_of_stops(row, before, after, moved, stops))
        self._refuse_edges(row, after)
        found = self.rested(row, before, moved, stops)
        if not others.any():
            return found
        (f, dots), (later, dots_later) = self._rates(row, resting), self._rates(row, after)
        if not (np.abs(dots - dots_later) > JUMPS * self._possible(row, before, after))[others].any():
            return found
        gone = others & ~stops
        if gone.any():
            times += self._times_of_release(row, before, moved, gone, inputs, must=not stops.any())
        times = np.concatenate(times)
        self.refuse_apart(row, times, others)
        return found + (f - later)[:, None] * times[0]

    # In a row, where bearings have modes (B,)

    def _in_run(self, row: int, modes: np.ndarray) -> dict[str, np.ndarray]:
        motion = self.motion
        return self.known(row, modes, motion.plain, motion.y[row], motion.inputs[row])

    def _rates(self, row: int, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the rates, and (B,) what _dots gives."""
        known = self._in_run(row, modes)
        return self.deviations.rates_among(known), self.dots(known)

    # When it happens beside the run

    def _possible(self, row: int, *modes: np.ndarray) -> np.ndarray:
        """(B,) in rad/s^2, accelerations that bearings could have: by what acts on them in some modes, and by what they
        take."""
        known = [self._in_run(row, own) for own in modes]
        acting = [np.abs(self.dots(own)) + np.abs(self.asked(own)) / self.inertias for own in known]
        return np.max(acting, axis=0) + self.holding / self.inertias

    def _times_of_stops(
        self, row: int, before: np.ndarray, after: np.ndarray, moved: np.ndarray, stops: np.ndarray
    ) -> np.ndarray:
        """(k, P) by how much the times deviate at which the speeds of some bearings (B,) bool come to zero."""
        _, dots = self._rates(row, before)
        slow = stops & (np.abs(dots) <= GRAZES * self._possible(row, before, after))
        if slow.any():
            reason = "a bearing only just comes to rest, so that a change however small lets it turn on"
            raise self.none(row, reason, slow)
        return -self.turning(row, moved)[:, stops].T / dots[stops, None]

    def _times_of_release(
        self, row: int, before: np.ndarray, moved: np.ndarray, released: np.ndarray, inputs: np.ndarray, must: bool
    ) -> list[np.ndarray]:
        """[(k, P)] the same where what bearings are asked for comes to its bound, of those where it has.

        must  whether it has to: nothing else lets them go
        """
        motion, columns = self.motion, self.columns.behind_another(self.motion.trajectory)
        along = np.concatenate([self._rates(row, before)[0][:, None], moved], axis=1)  # the first is that of the time
        y, ahead = with_tangent(motion.y[row], motion.whole(along.T)), RollerDeviations(motion, columns)
        asked = self.asked(ahead.known(row, before, columns.kernel, y, with_tangent(motion.inputs[row], inputs.T)))
        slopes = (np.sign(asked[0].real) * tangent_of(asked) - ahead.torques[1]).T
        rises = slopes[:, 0] * self._time_in(before, row) > GRAZES * self.holding
        reached = released & (np.abs(asked[0].real) >= (1 - REACHED) * self.holding)
        slow = (reached & ~rises) | (released & ~reached & must)
        if slow.any():
            reason = "what a bearing holds only just comes to its bound, so that a change however small lets it stay"
            raise self.none(row, reason, slow)
        return [-slopes[reached, 1:] / slopes[reached, :1]] if reached.any() else []

    def _time_in(self, before: np.ndarray, row: int) -> float:
        """For how long the bearings have had the modes with which they come to a row."""
        last = row if (self.modes[row] == before).all() else row - 1
        elapsed = self.motion.trajectory.elapsed
        return self.motion.time_in_modes(self.modes, last) + float(elapsed[row] - elapsed[last])

    # What has no derivative

    def _refuse_edges(self, row: int, modes: np.ndarray) -> None:
        """Raises NoDerivativeError where a bearing sticks in these modes that is asked for all that it takes."""
        self.refuse_at_bound(row, modes == 0, self.asked(self._in_run(row, modes)))
