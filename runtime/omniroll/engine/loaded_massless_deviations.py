"""How deviations pass where massless rollers stick on their disks and break away under loads that follow the motion.

Under the law `viscous` no force of the ground goes with a load, but for the whole of it where one vanishes or comes
back: what is told in massless_deviations.py holds as long as the same contacts carry. Under `regularised` a roller that
breaks away moves all loads, and these what the ground asks of others. What one of them does may so let others go, or
stop them, at the same instant: nothing keeps a roller without inertia turning. All of that happens at the time of what
has come about by itself: an axle that comes to rest, a drive that jumps, what holds an axle or a roller and has come to
its bound, or a load that vanishes or comes back,

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess',

with the rates before and after all of it. Several that come about by themselves must do so together beside the run,
too. What by itself makes no rate jump has no part in that: a roller that comes to rest, one whose break-away and
sliding torques are the same, and under `regularised` a load that vanishes.

There is no derivative where an axle only just comes to rest, and where what is asked of a bearing, or a load, only just
comes to its bound, or is at it in what begins.
"""

from dataclasses import dataclass

import numpy as np

from omniroll.engine.axle_modes import TORQUE, AxleModes
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED, apart
from omniroll.engine.massless_deviations import MasslessDeviations
from omniroll.engine.massless_modes import MasslessModes
from omniroll.engine.roller_modes import KEPT
from omniroll.errors import NoDerivativeError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.accelerations import call_named


@dataclass(frozen=True)
class Margins:
    """How far something of each wheel (N,) is beyond the end of its mode, per what it can take; 0 where that ends.

    beyond  (N,)
    slopes  (1 + P, N) by the time, and in the columns
    jumps   (N,) bool: of which rates jump there by themselves
    what    it is, in words
    """

    beyond: np.ndarray
    slopes: np.ndarray
    jumps: np.ndarray
    what: str


class LoadedMasslessDeviations(MasslessDeviations):
    """The deviations of one run in P columns, where its rollers break away, and axles beside them stop and do."""

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after bearings, and with them contacts, have changed their modes between a row and the
        next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        carries = self.contacts.carries[row : row + 2]
        if not self.deviations.coupled and (carries[0] == carries[1]).all():
            return super().passed(row, moved, knot, inputs)
        jump = self.motion.rates[row] - self.motion.rates[row + 1]
        stops = self._axles_that_stop(row)
        core = self.deviations.core
        if not stops.size and np.abs(jump[core]).max() <= JUMPS * np.abs(self.motion.rates[row : row + 2, core]).max():
            return moved
        times, wheels = self._times(row, moved, knot, inputs, stops)
        self._refuse_edges(row + 1)
        names = apart(self.columns.names, times)
        if names:
            reason = f"rollers, axles or loads change their modes together, and apart where a number does; by {names}"
            raise self._none(row, reason, wheels)
        return moved + jump[:, None] * times[0]

    def _axles_that_stop(self, row: int) -> np.ndarray:
        """Those that come to rest between a row and the next, or turn back there."""
        if self.axles is None:
            return np.zeros(0, int)
        before, after = self.axles.modes[row : row + 2]
        return np.flatnonzero((before != 0) & (before != after))

    def _times(
        self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray, stops: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(k, P) by how much the times deviate of all that comes about by itself, and to which wheels it does."""
        times, wheels = [], [stops]
        if self.motion.drives_jump(row, (TORQUE, *KEPT, "carries")):
            times.append(np.zeros((1, len(self.columns))) if knot is None else knot[None])
        if stops.size:
            times.append(self.beside.times_of_stops(row, moved, stops))
        ends = self._ends(row, moved, inputs)
        for own, changed in ends:
            reached = np.flatnonzero(changed & own.jumps & (np.abs(own.beyond) <= REACHED))
            if not (own.slopes[0, reached] * self._time_in_modes(row) > GRAZES).all():
                raise self._just(row, own.what, reached)
            if reached.size:
                times.append(-own.slopes[1:, reached].T / own.slopes[0, reached, None])
                wheels.append(reached)
        if not times:
            raise self._just(row, "what a bearing holds", np.flatnonzero(np.any([own for _, own in ends], axis=0)))
        return np.concatenate(times), np.concatenate(wheels)

    def _just(self, row: int, what: str, wheels: np.ndarray) -> NoDerivativeError:
        reason = f"{what} only just comes to its bound, so that a change however small lets it stay"
        return self._none(row, reason, wheels)

    def _ends(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> list[tuple[Margins, np.ndarray]]:
        """What may have come to its bound in a row, and which of it (N,) bool changes its mode behind the row."""
        columns = self.columns.behind_another(self.motion.trajectory)  # the first is that of the time
        along = np.concatenate([self.motion.rates[row][:, None], moved], axis=1)
        y = with_tangent(self.motion.y[row], self.motion.whole(along.T))
        given = with_tangent(self.motion.inputs[row], inputs.T)
        held = self.contacts.moved(self.motion.held_at(np.array(row)), columns.constants, 0)
        known = self.deviations.known_of(columns.kernel, y, given, held)
        if "compression" not in known:
            known |= self.deviations.loads_among(columns.kernel, known)
        lifts = np.diff(self.contacts.carries[row : row + 2], axis=0)[0]
        asked = self._asked(columns.kernel, known)
        first, (sliding, most) = self.of_axles, self.torques
        found = [
            (self._of_loads(row, known), lifts),
            self._of_bearings(row, "a roller", self.massless, asked, (sliding[:, first:], most[:, first:])),
        ]
        if self.axles is not None:
            torques = sliding[:, :first], most[:, :first]
            found.append(self._of_bearings(row, "an axle", self.axles, known["axle_holding"], torques))
        return found

    @staticmethod
    def _of_bearings(
        row: int, name: str, own: MasslessModes | AxleModes, asked: np.ndarray, torques: tuple[np.ndarray, np.ndarray]
    ) -> tuple[Margins, np.ndarray]:
        """Bearings (N,) that stick, asked for (1 + P, N), whose torques have deviations as BearingDeviations says; and
        which of them break away behind a row."""
        slopes = np.sign(asked[0].real) * tangent_of(asked)
        slopes[1:] -= torques[1]
        holding, jumps = np.where(own.holding > 0, own.holding, 1.0), own.holding > (1 + JUMPS) * own.sliding
        margins = Margins((np.abs(asked[0].real) - holding) / holding, slopes / holding, jumps, f"what {name} holds")
        return margins, (own.modes[row] == 0) & (own.modes[row + 1] != 0)

    def _of_loads(self, row: int, known: dict[str, np.ndarray]) -> Margins:
        """Loads below zero, and springs of contacts that are off above it, per the weight."""
        sign = np.where(self.contacts.carries[row], -1, 1) / self.contacts.grip.loads.sum()
        compression = known["compression"]
        jumps = np.full(len(sign), not self.deviations.coupled)
        return Margins(sign * compression[0].real, sign * tangent_of(compression), jumps, "a load")

    def _time_in_modes(self, row: int) -> float:
        """For how long bearings and contacts have had the modes of a row."""
        modes = [self.massless.modes, self.contacts.carries] + ([] if self.axles is None else [self.axles.modes])
        return self.motion.time_in_modes(np.concatenate(modes, axis=1), row)

    # What rollers are asked for

    def _asked(self, kernel: Kernel, known: dict[str, np.ndarray]) -> np.ndarray:
        """(..., N) in N m, what would hold rollers if they stuck, by what the functions of the rates take and give."""
        loads = known["loads"] if self.deviations.coupled else known["carries"]
        stuck = self._given(0, np.zeros(len(self.massless.sliding), int))
        return call_named(kernel, "slip_spins", known | stuck | {"load_factor": loads})[1]

    def _beyond(self, row: int, kernel: Kernel, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(..., N) by how much more the ground asks of rollers than they hold, if they all stuck, and its sign, in
        states y (..., size), which may carry tangents where no force goes with a load."""
        held = self.motion.held_at(np.array(row))
        asked = self._asked(kernel, self.deviations.known_of(kernel, y, self.motion.inputs[row], held))
        sign = np.sign(np.asarray(asked).real)
        return asked * sign - self.massless.holding, sign

    # What has no derivative

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where an axle comes to rest just as a wheel switches behind a row, or what is asked
        of a roller that breaks away comes to its bound by itself."""
        super().refuse_rests(row)
        before, after = self.massless.modes[row : row + 2]
        gone = (before == 0) & (after != 0) & (self.motion.directions[row + 1] == 0) & self.jumps
        if gone.any() and (gone & self._at_bound(row)).any():
            raise self._none(row, "a roller breaks away just as a wheel switches", np.flatnonzero(gone))

    def _at_bound(self, row: int) -> np.ndarray:
        """(N,) bool: rollers that are asked for what they hold, within what counts as that."""
        return np.abs(self._excess(row)[0].real) <= REACHED * self.massless.holding

    def _refuse_edges(self, row: int) -> None:
        """Raises NoDerivativeError where a bearing sticks from a row on that is asked for all that it takes."""
        edge = (self.massless.modes[row] == 0) & self.jumps & self.contacts.carries[row] & self._at_bound(row)
        if edge.any():
            reason = "a roller sticks by all its friction, so that a change however small lets it go"
            raise self._none(row, reason, np.flatnonzero(edge))
        if self.beside is not None:
            self.beside.refuse_edges(row)
