"""The compiled engine: runtime/csrc does phases, events and transitions; here its buffers are filled and read.

A call runs until a buffer is full; then progress is reported and the rows are copied out. Tables, controllers and
motors act within a call. An effect of another kind is asked at each event, between two calls.
"""

from dataclasses import replace
from functools import lru_cache
from math import comb
from typing import Any

import numpy as np

from omniroll.effects.effect import Motors, Sampler, Table
from omniroll.effects.effect_set import EffectRun
from omniroll.effects.numbers import Curve
from omniroll.engine.runs import SWITCHES_WITHOUT_PROGRESS, Rows, Task, assembled, speed_scale
from omniroll.errors import SimulationStopped
from omniroll.kernels import sets
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory

NODES = 16  # of a step; gauss.h
MOST_WHEELS = 64  # set_in_lanes.h
ROWS = 4096  # a buffer's length
ALIGNMENT = 128  # bytes
MOST_BYTES = 2**30  # of rows and steps; their trajectory takes some four times that
MOST_GUARDS = 2 * MOST_WHEELS  # run.c
DONE, FULL, STUCK, NO_STEP, ASK = range(5)  # engine.h
TOO_LONG = 5
REASONS = {
    STUCK: "switches without progress in time",
    NO_STEP: "the step became too small",
    TOO_LONG: "more rows than memory should hold; go on in another run from the state that this one ends with",
}

# A step's error is that inside it; at its end, collocation is far better. What the iterations of all steps leave adds
# up to at most this part of the tolerance, if the vehicle goes on as it starts.
SWEEP = 0.1
FINEST_STEP, FINEST_SWEEP = 1e-15, 1e-16
# The outputs that are the rates of the engine's states, where no effect of the run reads them.
RATES = {"drive_work": "drive_power", "axle_loss": "axle_loss", "roller_loss": "roller_loss"}


def can_run(task: Task) -> bool:
    """Whether the compiled engine takes this task; the Python engine takes all."""
    if task.kernel.wheels > MOST_WHEELS or task.kernel.backend != "compiled":
        return False
    run = EffectRun(task.effects, task.kernel, task.start_time)
    if run.axles is not None:
        return False
    if not task.kernel.effects:
        return not run.next_time() < np.inf and not run.begin_phase(0.0)
    known = names_of(task.kernel, "states")
    return all(quantity.name in known for quantity in run.state_vector.quantities) and all(
        len(guard.weights) <= 3 for guard in run.begin_phase(0.0)
    )


def engine_of(kernel: Kernel) -> Any:
    """`ffi` and `lib` with the engine of a kernel's set."""
    return sets.engine(kernel.base, kernel.effects, kernel.sharp)


def names_of(kernel: Kernel, kind: str) -> list[str]:
    """What the engine of a set integrates beside nu, chi and the pose ("states"), or needs as "inputs"."""
    engine = engine_of(kernel)
    return engine.ffi.string(getattr(engine.lib, f"omniroll_run_{kind}")()).decode().split()


class CompiledRun:
    """One simulation with one tolerance."""

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.tolerance = task, task.kernel, tolerance
        self.module = engine_of(self.kernel)
        self.wheels, self.places = self.kernel.wheels, self.kernel.rollers_per_wheel - 1
        self.columns = Columns(self.kernel, task)
        self.acting = EffectRun(task.effects, self.kernel, task.start_time)
        self.described: dict[str, list[dict[str, Any]]] = {}
        self.kept: list[Any] = []  # what the engine has pointers to
        self._allocate()
        self._fill()
        if self.task.effects:
            self._describe_what_acts()

    def trajectory(self) -> Trajectory:
        """Simulate, and return the result. Raises SimulationStopped."""
        step, arguments = self.module.lib.omniroll_run, (self.struct, self.kernel.model_for(self.module.ffi))
        parts, status, size = [], FULL, 0
        while status == FULL:
            self.run.row_count = self.run.switch_count = 0
            status = step(*arguments)
            while status == ASK:
                self._answer()
                status = step(*arguments)
            parts.append(self._copied())
            size += sum(array.nbytes for array in parts[-1].values())
            if status == FULL and size > MOST_BYTES:
                status = TOO_LONG
            if self.task.progress is not None:
                self.task.progress(self.run.elapsed, self.task.duration)
        result = assembled(self.task, joined(parts, self.task, self.columns), self._stats())
        if status != DONE:
            raise self._stopped(status, result)
        return result

    # What acts

    def _answer(self) -> None:
        """A time has come, or guards are passed: the effects say what acts from now on."""
        if self.run.elapsed >= self.acting.next_time():
            state = replace(self.task.state, nu=self.nu.copy(), chi=self.chi.copy(), pose=self.pose.copy())
            self.acting.pass_time(self.run.elapsed, state)
        else:
            self.acting.pass_guards(self.passed[: self.run.guard_count] != 0)
        self._give_inputs()

    def _give_inputs(self) -> None:
        guards = self.acting.begin_phase(self.run.elapsed)
        self.signals[2, : len(self.columns.inputs)] = self.inputs[1, : len(self.columns.inputs)]
        self.inputs[...] = 0
        for k, name in enumerate(self.columns.inputs):
            if name in self.acting.signals:
                signal = self.acting.signals[name]
                self.inputs[0, k], self.inputs[1, k] = signal.value, signal.slope
        for row, guard in zip(self.guards, guards, strict=False):
            size = max(guard.size, abs(guard.constant))
            row[:] = [guard.constant, guard.slope, *guard.weights, *np.zeros(3 - len(guard.weights)), size]
        self.run.guard_count = len(guards)
        self.run.inputs_elapsed, self.run.next_time = self.run.elapsed, self.acting.next_time()

    def _describe_what_acts(self) -> None:
        """Tables, controllers and motors, which the engine asks itself; it asks effects of other kinds here."""
        described = [process.compiled() for process in self.acting.processes]
        forms = [form for forms in described if forms is not None for form in forms]
        by_kind = {kind: [form for form in forms if isinstance(form, kind)] for kind in (Table, Sampler, Motors)}
        if None in described or len(by_kind[Motors]) > 1:
            self.run.asks = 1
            self._give_inputs()
            return
        signals = [*self.columns.inputs, "voltage"]
        for form in by_kind[Table]:
            self._put("tables", {"signal": signals.index(form.signal), "curve": self._curve(form.curve)})
        for form in by_kind[Sampler]:
            numbers = {"sum": np.zeros(self.wheels), "output": np.zeros(self.wheels)}
            numbers |= {"proportional": form.proportional, "integral": form.integral}
            own = {"signal": signals.index(form.signal), "sample_time": form.sample_time, "limit": form.limit}
            self._put("samplers", own | {"target": self._curve(form.target)} | self._pointers(numbers))
        for form in by_kind[Motors]:
            self.modes = np.zeros(self.wheels, np.int64)
            own = {name: value for name, value in vars(form).items() if name != "wheel_rows"}
            own["modes"] = self.module.ffi.from_buffer("long long[]", self.modes)
            self._put("motors", own | self._pointers({"wheel_rows": form.wheel_rows}))
        for name, entries in self.described.items():
            kind = name if name == "motors" else name.removesuffix("s")
            array = self.module.ffi.new(f"omniroll_{kind}_t[]", entries)
            self.kept.append(array)
            setattr(self.run, name, array)
            setattr(self.run, f"{kind}_count", len(entries))

    def _put(self, kind: str, entry: dict[str, Any]) -> None:
        self.described.setdefault(kind, []).append(entry)

    def _pointers(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Pointers to contiguous arrays, which live as long as this run."""
        made = {name: np.array(array, float, order="C") for name, array in arrays.items()}
        self.kept += made.values()
        return {name: self._pointer(array) for name, array in made.items()}

    def _curve(self, curve: Curve) -> dict[str, Any]:
        numbers = {"times": curve.knots, "values": curve.values}
        return {
            "width": curve.values.shape[1],
            "held": int(curve.interpolation == "hold"),
            "count": len(curve.knots),
            "next": int(np.searchsorted(curve.knots, 0.0, side="right")),
        } | self._pointers(numbers)

    # Buffers

    def _allocate(self) -> None:
        wheels, places, columns = self.wheels, self.places, self.columns
        self.rows = np.empty((ROWS, columns.width))
        self.steps = np.empty((ROWS, 2 + NODES * (6 + wheels + columns.added)))
        self.switches = np.empty((ROWS, 2 + wheels))
        has_spins = self.kernel.has_spins
        self.switch_axial = np.empty((ROWS, wheels, places) if has_spins else (1, 1, 1))
        state = self.task.state
        self.nu, self.chi, self.pose = state.nu.copy(), state.chi.copy(), state.pose.copy()
        self.axial = np.array(state.free_axial()) if has_spins else np.zeros((1, 1))
        self.contact = state.contact.astype(np.int64)
        self.work = aligned(self.module.lib.omniroll_run_work_size(wheels, self.kernel.rollers_per_wheel))
        self.core, self.core_before = np.zeros(columns.added + 1), np.zeros(columns.added + 1)
        self.accounts = np.zeros(columns.added + 1)
        self.part_sizes = columns.part_sizes()
        self.inputs = np.zeros((2, max(1, len(columns.inputs)), wheels))
        self.guards = np.zeros((MOST_GUARDS, 6))
        self.passed, self.leads_to = np.zeros(MOST_GUARDS, np.int64), np.zeros((MOST_GUARDS, 2), np.int64)
        self.signals = np.zeros((3, len(columns.inputs) + 1, wheels))

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
        run.speed, run.next_time = speed_scale(task), np.inf
        for name in (
            "nu", "chi", "pose", "axial", "work", "rows", "steps", "switches", "switch_axial",
            "core", "core_before", "accounts", "part_sizes", "inputs", "guards", "signals",
        ):  # fmt: skip
            setattr(run, name, self._pointer(getattr(self, name)))
        for name in ("contact", "passed", "leads_to"):
            setattr(run, name, self.module.ffi.from_buffer("long long[]", getattr(self, name)))

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
            "engine": "compiled",
            "steps": int(run.step_count),
            "rejected_steps": int(run.rejected_count),
            "phases": int(run.phase_count) + 1,
            "evaluations": int(run.sweep_count) * NODES,
            "tolerance": self.tolerance,
            "step_error": self._step_error(),
        }

    def _step_error(self) -> float:
        """What steps leave by themselves, over |nu|: inside the worst of them, and in the iterations of all.

        Two runs of the same steps agree about the first. The polynomials' last terms overstate it by more than ten.
        """
        iterations = self.run.sweep_error if self.kernel.effects else self.run.step_count * self.run.sweep_tolerance
        return self.run.step_error / 10 + iterations

    def _stopped(self, status: int, result: Trajectory) -> SimulationStopped:
        state = {name: getattr(self, name).tolist() for name in ("nu", "chi", "pose", "contact")}
        wheel = int(result.switches.wheel[-1]) if status == STUCK and len(result.switches) else None
        time = self.task.start_time + self.run.elapsed
        reason = REASONS[status]
        if status == NO_STEP:
            part = self.run.hardest_part
            name = "nu" if part < 0 else self.columns.states[part]
            reason += f": {name} changes faster than a step can follow"
        return SimulationStopped(reason, t=time, wheel=wheel, state=state, trajectory=result)


def aligned(size: int) -> np.ndarray:
    """`size` doubles at an address that vectors can be loaded from."""
    raw = np.zeros(size + ALIGNMENT // 8)
    first = -(raw.ctypes.data // 8) % (ALIGNMENT // 8)
    return raw[first : first + size]


class Columns:
    """Where a row's numbers stand: time, nu, chi, pose, what the set adds, contact, inputs.

    inputs  names of the kernel's inputs
    added   how many numbers the set integrates beside nu, chi and the pose
    order   of these in the trajectory, as places in the row of the engine
    """

    def __init__(self, kernel: Kernel, task: Task):
        self.kernel, self.state_vector = kernel, task.effects.state_vector(kernel)
        self.states, self.inputs = names_of(kernel, "states"), names_of(kernel, "inputs")
        outputs = {a.name: a.shape for s in kernel.signatures.values() for a in s.outputs}
        rates = {quantity.name: quantity.rate for quantity in self.state_vector.quantities}
        self.sizes = [int(np.prod(outputs[(RATES | rates)[name]])) for name in self.states]
        starts = dict(zip(self.states, np.cumsum([0, *self.sizes]), strict=False))
        places = [
            np.arange(starts[quantity.name], starts[quantity.name] + self.sizes[self.states.index(quantity.name)])
            for quantity in self.state_vector.quantities
        ]
        self.order = np.concatenate([np.zeros(0, int), *places]).astype(int)
        self.added = sum(self.sizes)
        self.end = 7 + kernel.wheels + self.added
        self.width = self.end + kernel.wheels * (1 + len(self.inputs))

    def part_sizes(self) -> np.ndarray:
        """The size at |nu| = 1 of each state."""
        scale, place = self.state_vector.scale_of_added(self.kernel, 1.0), {}
        for quantity in self.state_vector.quantities:
            place[quantity.name] = scale[self.state_vector.slices[quantity.name].start - self.state_vector.plain]
        return np.array([*(place.get(name, 1.0) for name in self.states), 0.0])

    def state(self, numbers: np.ndarray) -> np.ndarray:
        """(..., 6 + N + E) in the order of the trajectory, from that of the engine."""
        plain = 6 + self.kernel.wheels
        return np.concatenate([numbers[..., :plain], numbers[..., plain + self.order]], axis=-1)


def joined(parts: list[dict[str, np.ndarray]], task: Task, columns: Columns) -> Rows:
    """The rows of all calls as one run's. A later call starts with the row that the one before ended with."""
    wheels = task.kernel.wheels
    offsets = np.cumsum([0] + [len(part["rows"]) - 1 for part in parts])
    rows = np.concatenate([part["rows"][k > 0 :] for k, part in enumerate(parts)])
    switches = np.concatenate([part["switches"] for part in parts])
    switch_rows = np.concatenate(
        [part["switches"][:, 1].astype(int) + offset for part, offset in zip(parts, offsets, strict=False)]
    )
    steps = np.concatenate([part["steps"][: len(part["rows"]) - 1] for part in parts])
    starts = np.flatnonzero(steps[:, 0] > 0)
    y = columns.state(rows[:, 1 : columns.end])
    return Rows(
        elapsed=rows[:, 0].copy(),
        y=y,
        contact=rows[:, columns.end : columns.end + wheels].astype(int),
        axial=axial_speeds(parts, task, columns, rows[:, 0], y, switch_rows) if task.kernel.has_spins else None,
        dense=lambda: dense_polynomials(rows[:, 1 : columns.end], steps, starts, columns) if len(starts) else None,
        step_rows=starts,
        directions=switches[:, 2 : 2 + wheels].astype(int),
        switch_rows=switch_rows,
        drive=rows[:, columns.end + wheels :].reshape(len(rows), -1, wheels).copy() if columns.inputs else None,
    )


def axial_speeds(
    parts: list[dict[str, np.ndarray]],
    task: Task,
    columns: Columns,
    elapsed: np.ndarray,
    y: np.ndarray,
    switch_rows: np.ndarray,
) -> np.ndarray:
    """Axial speeds of the free rollers (T, N, n-1): those after the last switch, and what has become of them."""
    later = np.concatenate([part["axial"] for part in parts])
    table = np.concatenate([np.asarray(task.state.free_axial())[None], later])
    switched = np.searchsorted(switch_rows, np.arange(len(y)), side="right")
    axial = table[switched]
    if not task.effects:
        return axial
    since = np.append(0, switch_rows)[switched]
    bound = task.effects.kernel(task.vehicle, task.kernel.roller_model, "python")  # works on all rows at once
    before, after = columns.state_vector.views(y[since]), columns.state_vector.views(y)
    found = task.effects.axial_later(bound, axial, before, after, elapsed - elapsed[since])
    return np.array(np.broadcast_to(found, axial.shape))


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
    return columns.state(coefficients) if columns.added else coefficients


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
