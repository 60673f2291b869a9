"""The compiled engine: runtime/csrc/phase.c does phases and switches; here its buffers are filled and read.

A call runs until a buffer is full. Between calls progress is reported and the rows are copied out.
"""

import importlib
import importlib.util
from functools import cache, lru_cache
from math import comb
from typing import Any

import numpy as np

from omniroll.errors import SimulationStopped
from omniroll.kernels import KernelsMissingError
from omniroll.runs import SWITCHES_WITHOUT_PROGRESS, Rows, Task, assembled
from omniroll.shared_kernels import has_shared_engine, shared_engine
from omniroll.trajectory import Trajectory

NODES = 16  # of a step; phase.c
MOST_WHEELS = 64  # kernel_in_lanes.h
ROWS = 4096  # a buffer's length
ALIGNMENT = 128  # bytes
MOST_BYTES = 2**30  # of rows and steps; their trajectory takes some four times that
DONE, FULL, STUCK, NO_STEP = range(4)  # engine.h
TOO_LONG = 4
REASONS = {
    STUCK: "switches without progress in time",
    NO_STEP: "the step became too small",
    TOO_LONG: "more rows than memory should hold; go on in another run from the state that this one ends with",
}

# A step's error is that inside it; at its end, collocation is far better. What the iterations of all steps leave adds
# up to at most this part of the tolerance, if the vehicle goes on as it starts.
SWEEP = 0.1
FINEST_STEP, FINEST_SWEEP = 1e-15, 1e-16


def can_run(task: Task) -> bool:
    """Whether the compiled engine takes this task; the Python engine over compiled kernels takes all."""
    return task.kernel.wheels <= MOST_WHEELS and task.kernel.backend == "compiled" and not task.kernel.effects


@cache
def engine_module() -> Any:
    """The module of the engine, `ffi` and `lib`. Raises KernelsMissingError where it was not built."""
    if importlib.util.find_spec("omniroll._engine") is None and has_shared_engine():
        return shared_engine()
    try:
        return importlib.import_module("omniroll._engine")
    except ImportError as error:
        raise KernelsMissingError(
            f"omniroll._engine is not there ({error}): install omniroll with a C compiler, or choose the Python engine"
        ) from error


class CompiledRun:
    """One simulation with one tolerance."""

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.tolerance = task, task.kernel, tolerance
        self.module = engine_module()
        self.wheels, self.places = self.kernel.wheels, self.kernel.rollers_per_wheel - 1
        self._allocate()
        self._fill()

    def trajectory(self) -> Trajectory:
        """Simulate, and return the result. Raises SimulationStopped."""
        step = getattr(self.module.lib, f"omniroll_{self.kernel.engine_name}_run")
        model = self.kernel.model
        parts, status, size = [], FULL, 0
        while status == FULL:
            self.run.row_count = self.run.switch_count = 0
            status = step(self.struct, self._pointer(model), len(model))
            parts.append(self._copied())
            size += sum(array.nbytes for array in parts[-1].values())
            if status == FULL and size > MOST_BYTES:
                status = TOO_LONG
            if self.task.progress is not None:
                self.task.progress(self.run.elapsed, self.task.duration)
        result = assembled(self.task, joined(parts, self.task), self._stats())
        if status != DONE:
            raise self._stopped(status, result)
        return result

    # Buffers

    def _allocate(self) -> None:
        wheels, places = self.wheels, self.places
        self.rows = np.empty((ROWS, 7 + 2 * wheels))
        self.steps = np.empty((ROWS, 2 + NODES * (6 + wheels)))
        self.switches = np.empty((ROWS, 2 + wheels))
        has_spins = self.kernel.has_spins
        self.switch_axial = np.empty((ROWS, wheels, places) if has_spins else (1, 1, 1))
        state = self.task.state
        self.nu, self.chi, self.pose = state.nu.copy(), state.chi.copy(), state.pose.copy()
        self.axial = np.array(state.free_axial()) if has_spins else np.zeros((1, 1))
        self.contact = state.contact.astype(np.int64)
        size = getattr(self.module.lib, f"omniroll_{self.kernel.engine_name}_run_work_size")
        self.work = aligned(size(wheels, self.kernel.rollers_per_wheel, len(self.kernel.model)))

    def _fill(self) -> None:
        task, step = self.task, max(self.tolerance, FINEST_STEP)
        self.struct = self.module.ffi.new("omniroll_run_t *")
        self.run = run = self.struct[0]
        run.wheels, run.rollers_per_wheel = self.wheels, self.kernel.rollers_per_wheel
        run.impact = int(task.switching == "impact")
        run.start_time, run.duration = task.start_time, task.duration
        run.joint = np.pi / self.kernel.rollers_per_wheel
        run.tolerance = step
        run.sweep_tolerance = max(SWEEP * self.tolerance / self._phases_expected(), FINEST_SWEEP)
        run.patience = SWITCHES_WITHOUT_PROGRESS * self.wheels
        run.row_capacity = run.switch_capacity = ROWS
        for name in ("nu", "chi", "pose", "axial", "work", "rows", "steps", "switches", "switch_axial"):
            setattr(run, name, self._pointer(getattr(self, name)))
        run.contact = self.module.ffi.from_buffer("long long[]", self.contact)

    def _phases_expected(self) -> float:
        speeds = np.abs(self.kernel.wheel_speeds(self.nu)).sum()
        return 1 + float(speeds) * self.task.duration / (2 * self.run.joint)

    def _pointer(self, array: np.ndarray):
        return self.module.ffi.from_buffer("double[]", array)

    # What a call left

    def _copied(self) -> dict[str, np.ndarray]:
        rows, switches = self.run.row_count, self.run.switch_count
        return {
            "rows": self.rows[:rows].copy(),
            "steps": self.steps[:rows].copy(),
            "switches": self.switches[:switches].copy(),
            "axial": self.switch_axial[:switches].copy() if self.kernel.has_spins else np.empty(0),
        }

    def _stats(self) -> dict[str, Any]:
        run = self.run
        return {
            "steps": int(run.step_count),
            "rejected_steps": int(run.rejected_count),
            "evaluations": int(run.sweep_count) * NODES,
            "tolerance": self.tolerance,
            "step_error": self._step_error(),
        }

    def _step_error(self) -> float:
        """What steps leave by themselves, over |nu|: inside the worst of them, and in the iterations of all.

        Two runs of the same steps agree about the first. The polynomials' last terms overstate it by more than ten.
        """
        return self.run.step_error / 10 + self.run.step_count * self.run.sweep_tolerance

    def _stopped(self, status: int, result: Trajectory) -> SimulationStopped:
        state = {name: getattr(self, name).tolist() for name in ("nu", "chi", "pose", "contact")}
        wheel = int(result.switches.wheel[-1]) if status == STUCK and len(result.switches) else None
        time = self.task.start_time + self.run.elapsed
        return SimulationStopped(REASONS[status], t=time, wheel=wheel, state=state, trajectory=result)


def aligned(size: int) -> np.ndarray:
    """`size` doubles at an address that vectors can be loaded from."""
    raw = np.zeros(size + ALIGNMENT // 8)
    first = -(raw.ctypes.data // 8) % (ALIGNMENT // 8)
    return raw[first : first + size]


def joined(parts: list[dict[str, np.ndarray]], task: Task) -> Rows:
    """The rows of all calls as one run's. A later call starts with the row that the one before ended with."""
    wheels, end = task.kernel.wheels, 7 + task.kernel.wheels
    offsets = np.cumsum([0] + [len(part["rows"]) - 1 for part in parts])
    rows = np.concatenate([part["rows"][k > 0 :] for k, part in enumerate(parts)])
    switches = np.concatenate([part["switches"] for part in parts])
    switch_rows = np.concatenate(
        [part["switches"][:, 1].astype(int) + offset for part, offset in zip(parts, offsets, strict=False)]
    )
    # A row starts a step unless it is the last one or the row after it is that after a switch.
    starts = np.setdiff1d(np.arange(len(rows) - 1), switch_rows - 1)
    steps = np.concatenate([part["steps"][: len(part["rows"]) - 1] for part in parts])
    axial = None
    if task.kernel.has_spins:
        later = np.concatenate([part["axial"] for part in parts])
        table = np.concatenate([np.asarray(task.state.free_axial())[None], later])
        axial = table[np.searchsorted(switch_rows, np.arange(len(rows)), side="right")]
    y = rows[:, 1:end]
    return Rows(
        elapsed=rows[:, 0].copy(),
        y=y.copy(),
        contact=rows[:, end:].astype(int),
        axial=axial,
        dense=dense_polynomials(y, steps, starts) if len(starts) else None,
        step_rows=starts,
        directions=switches[:, 2 : 2 + wheels].astype(int),
        switch_rows=switch_rows,
    )


def dense_polynomials(y: np.ndarray, steps: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Bernstein coefficients (S, 17, 6 + N) of the steps, from the Legendre coefficients of their rates.

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
    return coefficients


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
