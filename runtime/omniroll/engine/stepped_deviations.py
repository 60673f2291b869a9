"""The deviations of a session, followed through what each call of the engine has left, on from where the last ended.

What goes on from piece to piece is the state's deviations, those of the rollers' axial speeds, and what the drives
remember. A piece begins inside a phase; for its deviations that is a phase of its own.
"""

import copy
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from omniroll import validation
from omniroll.engine.columns import columns_of, start_shapes
from omniroll.engine.drive_deviations import DriveDeviations
from omniroll.engine.motion import Columns, Motion, columns_beside
from omniroll.engine.runs import Task
from omniroll.engine.sensitivities import Sweep
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.trajectory import Sensitivity, Trajectory
from omniroll.vehicles.state import State, by_place

PARTS = ("nu", "chi", "pose")  # of what deviates, in this order first


@dataclass(frozen=True)
class Reached:
    """Where the deviations of a session have come.

    moved     (m, P)
    axial     (P, N, n) of the rollers' axial speeds, by physical roller; None but for free rollers
    samplers  what each controller remembers, with its deviations
    none      why there are none any more; None: there are
    """

    moved: np.ndarray
    axial: np.ndarray | None
    samplers: tuple
    none: NoDerivativeError | None = None


class SteppedDeviations:
    """The deviations of a session by the numbers of these names.

    reached  None before the first piece
    """

    def __init__(self, names: tuple[str, ...]):
        self.names = names
        self.reached: Reached | None = None
        self.columns: Columns | None = None
        self.drives: DriveDeviations | None = None

    def follow(self, piece: Trajectory, held: Mapping[str, list[np.ndarray]]) -> None:
        """Go on along a piece, in which these values have been held that steps give."""
        if self.columns is None:
            self.columns = columns_beside(piece, self.names)
        if self.reached is not None and self.reached.none is not None:
            return
        drives = None if self.reached is None else self.drives
        sweep = _PieceSweep(Motion(piece), self.columns, self.reached, drives)
        self.drives = sweep.drives
        if self.reached is not None:
            self.drives.recall(self.reached.samplers)
        self.drives.hold(held)
        try:
            sweep.run()
        except NoDerivativeError as none:
            start = np.zeros_like(sweep.rows[0])
            self.reached = Reached(start, None, (), none)
            return
        self.reached = Reached(sweep.rows[-1].copy(), sweep.axial_at_end(), self.drives.remembered())

    def at(self, task: Task, name: str, time: float, state: State) -> Sensitivity:
        """The derivatives by one of the numbers at this time, up to which they have been followed, in this state.

        Raises InvalidValueError for another name, NoDerivativeError where there has been none on the way.
        """
        column = self.names.index(validation.choice("name", name, self.names))
        if self.reached is None:
            found = columns_of((name,), task.kernel, task.effects.effects)[0].start
            shapes = start_shapes(task.kernel)
            parts = {part: np.array(found.get(part, np.zeros(shape))) for part, shape in shapes.items()}
            return Sensitivity(name, np.array(time), **({"spins": None} | parts))
        if self.reached.none is not None:
            raise copy.copy(self.reached.none)
        parts = dict(zip(PARTS, np.split(self.reached.moved[: state.nu.size + state.chi.size + 3, column],
                                         np.cumsum([state.nu.size, state.chi.size])), strict=True))  # fmt: skip
        spins = None
        if self.reached.axial is not None:
            nu, chi = (with_tangent(getattr(state, part), parts[part]) for part in ("nu", "chi"))
            moved = by_place(self.reached.axial[column], state.contact)[..., 1:]
            free = with_tangent(state.free_axial(), moved)
            spins = tangent_of(self.columns.single(column).spins_from_axial(nu, chi, free))
        return Sensitivity(name, np.array(time), **parts, spins=spins)


class _PieceSweep(Sweep):
    """The walk along a piece, which goes on from what has been reached; None: from the start."""

    def __init__(self, motion: Motion, columns: Columns, reached: Reached | None, drives: DriveDeviations | None):
        super().__init__(motion, columns)
        self.reached = reached
        if drives is not None:
            self.drives = drives

    def _put_start(self) -> None:
        if self.reached is None:
            super()._put_start()
            return
        self.rows[0] = self.reached.moved
        if self.axial is not None:
            self.axial[0] = self.reached.axial.reshape(len(self.columns), -1).T

    def axial_at_end(self) -> np.ndarray | None:
        """(P, N, n) deviations of the axial speeds in the last row."""
        if self.axial is None:
            return None
        first, last = int(self.motion.phases[-1]), len(self.trajectory) - 1
        self.phase, self.began = len(self.motion.phases) - 1, self.rows[first]
        phase, at = self._phase_from(first), self._instant(last)
        y = self.passage.carrying(at.y, self.rows[last].T)
        return tangent_of(self.passage.later(phase, y, at.elapsed - phase.elapsed))
