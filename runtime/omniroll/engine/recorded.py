"""What a run of the compiled engine leaves, read when somebody asks: rows, switches, polynomials of the steps."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import comb
from typing import Any

import numpy as np

from omniroll.engine.runs import Places, Task
from omniroll.engine.workspace import NODES, Columns, Workspace
from omniroll.kernels.kernel import JOINTS
from omniroll.kernels.phases import Carry


def wheels_switched(space: Workspace, switches: int) -> int:
    """How many wheels have switched in the first so many switches."""
    return int(np.count_nonzero(space.switches[:switches, 2:]))


@dataclass(frozen=True)
class Forgotten:
    """What must be known of rows that memory does not hold any more.

    switches  how many wheels switched in them
    axial     the free rollers' axial speeds after the last switch, None: those of the start
    row       that they belong to, None: the first one that memory holds
    """

    switches: int = 0
    axial: np.ndarray | None = None
    row: np.ndarray | None = None

    def and_of(self, task: Task, space: Workspace, switches: int) -> "Forgotten":
        """The same with the rows that memory holds now, among which there were so many switches."""
        count = self.switches + wheels_switched(space, switches)
        if task.kernel.has_spins and switches:
            row = int(space.switches[switches - 1, 1])
            return Forgotten(count, space.switch_axial[switches - 1].copy(), space.rows[row].copy())
        return Forgotten(count, self.axial, space.rows[0].copy() if self.row is None else self.row)


class Recorded:
    """What a run has left from row `first` on, as omniroll.engine.runs.Rows; each part is made of the engine's numbers
    when it is read.

    run  CompiledRun
    """

    def __init__(self, run: Any, first: int = 0):
        self.task, self.columns, self.acts, space = run.task, run.columns, run.acts, run.space
        rows, switches = run.run.record.row_count, run.run.record.switch_count
        before = int(np.searchsorted(space.switches[:switches, 1], first, side="right")) if first else 0
        self.has_spins, self.first = run.kernel.has_spins, first
        self.rows, self.steps = _kept(space, "rows", first, rows), _kept(space, "steps", first, rows)
        self.switches = _kept(space, "switches", before, switches)
        if self.has_spins:  # what the free rollers had after the last switch before these rows, and where that was
            self.later_axial = _kept(space, "switch_axial", before, switches)
            known = run.forgotten.and_of(run.task, space, before)
            self.axial_before = run.task.state.free_axial() if known.axial is None else known.axial
            self.row_before = known.row

    @cached_property
    def elapsed(self) -> np.ndarray:
        return self.rows[:, 0].copy()

    @cached_property
    def y(self) -> np.ndarray:
        return self.columns.state(self.rows[:, 1 : self.columns.end])

    @property
    def _numbers(self) -> np.ndarray:
        """(T, N) as the engine has them (phases.py)."""
        return self.rows[:, self.columns.end : self.columns.end + self.task.vehicle.wheels].astype(int)

    @property
    def contact(self) -> np.ndarray:
        return self._numbers % self.task.vehicle.rollers_per_wheel

    @property
    def pivots(self) -> np.ndarray | None:
        if JOINTS not in self.task.kernel.effects:
            return None
        return Carry.of_numbers(self._numbers, self.task.vehicle.rollers_per_wheel).pivots

    @property
    def modes(self) -> np.ndarray | None:
        places = [] if self.acts is None else self.acts.places_of_modes()
        return self.rows[:, np.add(self.columns.modes_at, places)].astype(int) if len(places) else None

    @property
    def drive(self) -> np.ndarray | None:
        places = [self.columns.inputs.index(name) for name in self.task.effects.drives()]
        if not places:
            return None
        return self.rows[:, self.columns.inputs_at :].reshape(len(self.rows), -1, self.task.vehicle.wheels)[:, places]

    @cached_property
    def step_rows(self) -> np.ndarray:
        return np.flatnonzero(self.steps[:-1, 0] > 0)

    @property
    def directions(self) -> np.ndarray:
        return self.switches[:, 2:].astype(int)

    @cached_property
    def switch_rows(self) -> np.ndarray:
        return self.switches[:, 1].astype(int) - self.first

    def axial(self, some: Places) -> np.ndarray:
        """(..., N, n-1) in some rows: those after the last switch, and what has become of them."""
        table = np.concatenate([np.asarray(self.axial_before)[None], self.later_axial])
        switched = np.searchsorted(self.switch_rows, np.arange(len(self.rows))[some], side="right")
        axial, effects = table[switched], self.task.effects
        if not effects:
            return axial
        since = np.concatenate([self.row_before[None], self.rows[self.switch_rows]])[switched]
        bound = effects.kernel(self.task.vehicle, self.task.kernel.roller_model, "python")  # works on all rows at once
        start = self.columns.state(since[..., 1 : self.columns.end])
        before, after = self.columns.state_vector.views(start), self.columns.state_vector.views(self.y[some])
        found = effects.axial_later(bound, axial, before, after, self.elapsed[some] - since[..., 0])
        return np.array(np.broadcast_to(found, axial.shape))

    def dense(self, some: Places) -> np.ndarray:
        return dense_polynomials(self.rows[:, 1 : self.columns.end], self.steps, self.step_rows[some], self.columns)


def _kept(space: Workspace, name: str, first: int, end: int) -> np.ndarray:
    """Entries of a buffer that is used again; or of one that a long run has made large, and that is not."""
    buffer = getattr(space, name)
    return buffer[first:end].copy() if len(buffer) == space.first else buffer[first:end]


def dense_polynomials(y: np.ndarray, steps: np.ndarray, starts: np.ndarray, columns: Columns) -> np.ndarray:
    """Bernstein coefficients (S, 17, 6 + N + E) of the steps, from the Legendre coefficients of their rates.

    A polynomial over [0, h] becomes one over [0, h + late], where late is tiny: p(x (1 + e)) = p(x) + e x p'(x).
    """
    h, late = steps[starts, 0], steps[starts, 1]
    rates = steps[starts, 2:].reshape(len(starts), -1, NODES)
    coefficients = np.swapaxes(rates @ integral_to_bernstein().T, 1, 2) * h[:, None, None]
    coefficients += y[starts, None, :]
    landed = np.flatnonzero(late)
    slopes = np.diff(coefficients[landed], axis=1)
    coefficients[landed, 1:] += (late / h)[landed, None, None] * np.arange(1, NODES + 1)[:, None] * slopes
    coefficients[:, 0], coefficients[:, -1] = y[starts], y[starts + 1]
    return columns.state(coefficients)


@lru_cache(maxsize=1)
def integral_to_bernstein() -> np.ndarray:
    """(17, 16): Bernstein coefficients of degree 16 of the integrals from 0 to x of P_k(2x - 1), k = 0 ... 15.

    P_k(2x - 1) = sum_j (-1)^(k - j) C(k, j) B_j^k(x) in the Bernstein basis of degree k; an integral has the running
    sums of the coefficients over k + 1; the degree is raised to 16 exactly.
    """
    matrix = np.zeros((NODES + 1, NODES))
    for k in range(NODES):
        signed = [(-1) ** (k - j) * comb(k, j) for j in range(k + 1)]
        running = [sum(signed[:j]) for j in range(k + 2)]
        degree, raised = k + 1, NODES - k - 1
        for i in range(NODES + 1):
            total = sum(
                running[j] * comb(degree, j) * comb(raised, i - j)
                for j in range(max(0, i - raised), min(degree, i) + 1)
            )
            matrix[i, k] = total / comb(NODES, i) / degree
    return matrix
