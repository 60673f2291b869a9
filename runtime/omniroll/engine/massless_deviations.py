"""How deviations pass where massless rollers stick on their disks and break away, and wheels may slip.

The force along a wheel's axle goes through its roller's bearing. It follows from the state and from the roller's own
mode, so that each roller has its own instant, and several together need no order. Where one breaks away that force
falls from what the bearing holds at most to its sliding torque, at a time that deviates,

    d+ = d- + sum (f- - f+) dt,   dt = -d excess / excess',

with what each roller alone does to the rates. A roller comes to rest where the ground asks for no more than its sliding
torque: there no rate jumps, and neither does one where break-away and sliding torques are the same. A roller that comes
into contact is at rest on its disk, at the time of the switch, which is told there.

There is no derivative where what the ground asks of a roller only just comes to its bound, or is at it in what begins.
"""

from functools import cached_property

import numpy as np

from omniroll.engine.axle_deviations import AxleDeviations
from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.bearing_deviations import BearingDeviations
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED
from omniroll.engine.massless_modes import MasslessModes, StripModes
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import IN_CONTACT
from omniroll.errors import NoDerivativeError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.accelerations import call_named


class MasslessDeviations(BearingDeviations):
    """The deviations of one run in P columns, where its rollers break away, and axles beside them stop and do."""

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns, motion.axles, StripModes(motion.massless))
        self.massless: MasslessModes = motion.massless
        self.beside = None if motion.axles is None else AxleDeviations(motion, columns)

    @cached_property
    def jumps(self) -> np.ndarray:
        """(N,) bool: rollers whose torques jump where they break away."""
        return self.massless.holding > (1 + JUMPS) * self.massless.sliding

    # When something happens

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where an axle comes to rest just as a wheel switches, behind a row."""
        if self.beside is not None:
            self.beside.refuse_rests(row)

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change the
        modes of bearings."""
        changed = np.flatnonzero(self.massless.modes[row] != self.massless.modes[row + 1])
        if changed.size:
            reason = "wheels switch together, and rollers decide with them in more than one order"
            raise self._none(row, reason, changed)
        if self.beside is not None:
            self.beside.refuse_orders(row, wheels)

    # What happens

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts."""
        at_bound = self._excess(0)[0].real >= -REACHED * self.massless.holding
        edge = np.flatnonzero((self.massless.modes[0] == 0) & at_bound)
        if edge.size:
            reason = "a roller sticks by all its friction, so that a change however small lets it go"
            raise self._none(0, reason, edge)
        return moved if self.beside is None else self.beside.began(moved)

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after bearings have changed their modes between a row and the next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.massless.modes[row : row + 2]
        changed = np.flatnonzero(before != after)
        if not changed.size:
            return self.beside.passed(row, moved, knot, inputs)
        if self.beside is not None and self.beside.changes[row]:
            raise self._none(row, "a roller changes its mode just as an axle does", changed)
        if self.motion.drives_jump(row, (IN_CONTACT, TORQUE)):
            raise self._none(row, "a roller changes its mode just as a drive jumps", changed)
        gone = changed[(before[changed] == 0) & self.jumps[changed]]
        if not gone.size:
            return moved
        times, found = self._times_of_release(row, moved, gone), np.array(moved)
        f = self._rates(row, before)
        for roller, time in zip(gone, times, strict=True):
            later = self._rates(row, np.where(np.arange(len(before)) == roller, after, before))
            found += (f - later)[:, None] * time
        return found

    def _rates(self, row: int, modes: np.ndarray) -> np.ndarray:
        """(m,) the rates in a row where rollers have modes (N,)."""
        given, motion = self._given(row, modes), self.motion
        inputs = np.array(motion.inputs[row])
        self.deviations.views(inputs)[IN_CONTACT][...] = given.pop(IN_CONTACT)
        return self.deviations.rates_of(motion.plain, motion.y[row], inputs, motion.held_at(np.array(row)) | given)

    def _given(self, row: int, modes: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of rollers in modes (N,), by name."""
        return self.massless.where(modes, -modes * self.massless.sliding)

    def _excess(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(N,) by how much more the ground asks of rollers than they hold, if they all stuck, and its sign."""
        return self._beyond(row, self.motion.plain, self.motion.y[row])

    def _beyond(self, row: int, kernel: Kernel, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same in states y (..., size) which may carry tangents."""
        known = self.deviations.known_in(y, self.motion.inputs[row])
        known |= self._given(row, np.zeros(len(self.massless.sliding), int))
        _, asked = call_named(kernel, "slip_spins", known)
        sign = np.sign(np.asarray(asked).real)
        return asked * sign - self.massless.holding, sign

    def _times_of_release(self, row: int, moved: np.ndarray, gone: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which what rollers are asked for comes to its bound."""
        columns = self.columns.behind_another(self.motion.trajectory)  # the first is that of the time
        along = np.concatenate([self._rates(row, self.massless.modes[row])[:, None], moved], axis=1)
        beyond, _ = self._beyond(row, columns.kernel, with_tangent(self.motion.y[row], self.motion.whole(along.T)))
        slopes = tangent_of(beyond)
        slopes[1:] -= self.torques[1][:, self.of_axles :]
        slopes, bounds = slopes[:, gone].T, self.massless.holding[gone]
        reached = np.abs(beyond[0].real[gone]) <= REACHED * bounds
        if not (reached & (slopes[:, 0] * self.motion.time_in_modes(self.massless.modes, row) > GRAZES * bounds)).all():
            reason = "what a roller holds only just comes to its bound, so that a change however small lets it stay"
            raise self._none(row, reason, gone)
        return -slopes[:, 1:] / slopes[:, :1]

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        """The error, where this happens to the rollers of some wheels."""
        return self.none(row, reason, self.of_axles + wheels)
