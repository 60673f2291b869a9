"""The compiled engine: runtime/csrc does phases, events and transitions; here its buffers are filled and read.

A call runs until its rows are full, few at first and then some thousand; then progress is reported. Tables, controllers
and drives with modes act within a call. Between two calls a controller that is a Python function takes its samples, and
an effect that the engine does not know is asked at each event.

What a run leaves stays as the engine wrote it until it is read. A run that nobody makes a trajectory of, such as the
control of another, is never copied.
"""

import math
import warnings
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from math import comb
from typing import Any

import numpy as np

from omniroll.effects import registry
from omniroll.effects.effect import Process
from omniroll.effects.effect_set import EffectRun
from omniroll.effects.ground_loads import FAILURES, Carried, GroundFailsError, Loads
from omniroll.effects.registry import Quantity
from omniroll.effects.state_vector import StateVector
from omniroll.engine.outlook import FIRST, outlook_of
from omniroll.engine.runs import (
    SWITCHES_WITHOUT_PROGRESS,
    TOO_MANY_ROWS,
    Places,
    Task,
    assembled,
    least_speed,
    shown_state,
    state_of,
)
from omniroll.engine.stiffness import blamed
from omniroll.engine.what_acts import WhatActs, what_acts
from omniroll.errors import KernelsMissingError, SimulationStopped
from omniroll.kernels import sets
from omniroll.kernels.kernel import Kernel, general_kernel
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import State

NODES = 16  # of a step; gauss.h
MOST_WHEELS = 64  # set_in_lanes.h
ROWS = 4096  # of a call; the first calls of a run are shorter
MANY_EVALUATIONS = 1e7  # left, at a third of a microsecond to one each: of seconds a word is said
GROWTH = 8  # times its rows has a buffer that grows: a page costs nothing before it is written to, and a copy much
CALLS = 8  # that fill the memory of a run at least
ALIGNMENT = 128  # bytes
MOST_GUARDS = 4 * MOST_WHEELS  # run.c
GUARD = 6  # numbers of a guard, before those of the wheels' rates; events.c
LAST = slice(-1, None)  # row
DONE, FULL, STUCK, NO_STEP, ASK, _, GROUND = range(7)  # engine.h
TOO_LONG, ENDED, HOPELESS = 7, 8, 9  # beside those of engine_calls.h
REASONS = {
    STUCK: "switches without progress in time",
    NO_STEP: "the step became too small",
    TOO_LONG: TOO_MANY_ROWS,
}

# A step's error is that inside it; at its end, collocation is far better. What the iterations of all steps leave adds
# up to at most this part of the tolerance, if the vehicle goes on as it starts.
SWEEP = 0.1
FINEST_STEP, FINEST_SWEEP = 1e-15, 1e-16


def lacking(kernel: Kernel) -> str:
    """What such a vehicle needs and the compiled engine does not have, so that the Python engine runs; or nothing."""
    return f"room for more than {MOST_WHEELS} wheels" if kernel.wheels > MOST_WHEELS else ""


def can_run(task: Task) -> bool:
    """Whether the compiled engine takes this task; the Python engine takes all."""
    if lacking(task.kernel):
        return False
    bound = kernel_of(task)
    if bound is None:
        return False
    if not task.effects:
        return True
    plan = task.effects.plan(task.kernel, task.start_time)
    if not bound.effects:
        return not plan.has_events
    known = names_of(bound, "states")
    integrated = task.effects.quantities(task.kernel.roller_model)
    return plan.guards_read_speeds_alone and all(quantity.name in known for quantity in integrated)


def kernel_of(task: Task) -> Kernel | None:
    """The kernel on which the compiled engine runs a task: its own, or where that is not compiled the general one.

    None for the Python engine. Raises KernelsMissingError where a kernel that was built has lost its engine.
    """
    return _kernel_of(task.kernel) if task.engine == "compiled" else None


@lru_cache(maxsize=64)
def _kernel_of(kernel: Kernel) -> Kernel | None:
    if kernel.backend != "compiled":
        return general_kernel(kernel)
    try:
        engine_of(kernel)
    except KernelsMissingError as problem:
        general = general_kernel(kernel)
        if general is None:
            raise
        warnings.warn(f"the precompiled general engine runs, which is slower: {problem}", RuntimeWarning, 2)
        return general
    return kernel


def engine_of(kernel: Kernel) -> Any:
    """`ffi` and `lib` with the engine of a kernel's set."""
    return sets.engine(kernel.base, kernel.effects, kernel.wheels, kernel.sharp)


def names_of(kernel: Kernel, kind: str) -> tuple[str, ...]:
    """What the engine of a set integrates beside nu, chi and the pose ("states"), or needs as "inputs"."""
    return _names(kernel.base, kernel.effects, kernel.wheels, kernel.sharp, kind)


@cache
def _names(base: str, effects: tuple[str, ...], wheels: int, sharp: bool, kind: str) -> tuple[str, ...]:
    """They are those of the set; wheels and sharp name the library that a run opens anyway."""
    engine = sets.engine(base, effects, wheels, sharp)
    return tuple(engine.ffi.string(getattr(engine.lib, f"omniroll_run_{kind}")()).decode().split())


class CompiledRun:
    """One simulation with one tolerance."""

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.tolerance = task, kernel_of(task), tolerance
        self.module = engine_of(self.kernel)
        self.wheels, self.places = self.kernel.wheels, self.kernel.rollers_per_wheel - 1
        self.columns = columns(self.kernel, task.effects.quantities(self.kernel.roller_model))
        self.space = self._workspace()
        self.struct = self.space.begin()
        self.run, self.status, self.ended, self.is_named = self.struct[0], None, "", False
        self._fill()
        self.kept, self.modes, self.sampled = [], [], np.zeros(0)  # what acts, in memory that the engine writes
        self.called: list[tuple[int, Process]] = []  # samplers whose samples are taken here
        self.forgotten = Forgotten()
        if self.task.effects:
            self._describe_what_acts()

    def _workspace(self) -> "Workspace":
        return workspace(self.kernel, self.columns)

    def advance(self) -> "CompiledRun":
        """Simulate, up to the duration or to where the run cannot go on."""
        step, arguments = self.module.lib.omniroll_run, (self.struct, self.kernel.model_for(self.module.ffi))
        self.outlook = outlook_of(self.task.duration, self.space.bytes_per_row, self.task.memory, self.task.room)
        most = min(ROWS, max(FIRST, int(self.task.memory / CALLS / self.space.bytes_per_row)))
        largest = int(self.task.memory / self.space.bytes_per_row) + most
        self.status, room = FULL, min(FIRST, most)
        while self.status == FULL:
            self.space.make_room(self.run.row_count, self.run.switch_count, room, largest)
            room = min(2 * room, most)
            self.status = step(*arguments)
            while self.status == ASK and not self._is_ended():
                self._answer()
                self.status = step(*arguments)
            if self.status == FULL:
                self._look_ahead()
            if self.status == FULL and not self._is_ended() and self.task.keep is not None:
                self.task.keep(self)
            if self.task.progress is not None:
                self.task.progress(self.run.elapsed, self.task.duration)
        return self

    def _look_ahead(self) -> None:
        """Whether memory holds the rows so far, and those that are to come."""
        if self.bytes_held > self.task.memory:
            self.status = TOO_LONG
        elif self.outlook.is_hopeless(self.run.step_count, self.run.switch_count, self.run.elapsed):
            self.status = HOPELESS
        else:
            self._name_what_is_slow()

    def _name_what_is_slow(self) -> None:
        """Say once which term makes the steps short, of a run that goes on for long."""
        run = self.run
        left = self.outlook.left * run.sweep_count * NODES / max(run.step_count, 1)
        if self.is_named or not self.outlook.has_collapsed(run.step_count, run.switch_count) or left < MANY_EVALUATIONS:
            return
        self.is_named = True
        if cause := blamed(self.task, self.end()):
            needs = f"at its present pace the run needs {left:.0e} more evaluations of the accelerations"
            warnings.warn(needs + cause, RuntimeWarning, stacklevel=2)

    def _is_ended(self) -> bool:
        """Whether somebody wishes that the run ends here."""
        self.ended = self.task.interrupted() if self.task.interrupted is not None else ""
        if self.ended:
            self.status = ENDED
        return bool(self.ended)

    def trajectory(self) -> Trajectory:
        """The result of a run, which is simulated now if it has not been. Raises SimulationStopped."""
        if self.status is None:
            self.advance()
        stopped = self.stop
        result = self.recorded()
        self.release()
        if stopped is None:
            return result
        stopped.trajectory = result
        raise stopped

    def recorded(self) -> Trajectory:
        """The trajectory up to where the run has come; its buffers are free then."""
        return self.part(0)

    def part(self, first: int) -> Trajectory:
        """The trajectory from row `first` to where the run has come."""
        return assembled(self.task, Recorded(self, first), self.stats())

    @property
    def row_count(self) -> int:
        """How many rows there are so far."""
        return self.run.row_count

    @property
    def bytes_held(self) -> float:
        """Bytes that the rows and steps in memory take."""
        return self.run.row_count * self.space.bytes_per_row

    def forget(self) -> None:
        """Take all rows but the last one from memory, and all switches."""
        run, space = self.run, self.space
        last, switches = run.row_count - 1, run.switch_count
        self.forgotten = self.forgotten.and_of(self.task, space, switches)
        space.rows[0] = space.rows[last]
        run.row_count, run.switch_count = 1, 0

    def end(self) -> dict[str, Any]:
        """t, nu, chi, contact, pose and the free rollers' axial speeds (N, n-1) or None, where the run has come.

        Where wheels may slip also `speeds`: by name what contacts have, as Contacts takes it.
        """
        state: dict[str, Any] = {name: array.copy() for name, array in state_of(self).items()}
        own = self.task.effects.own_speeds(self.task.kernel, self.task.state)
        state["speeds"] = {name: self.speeds(name).copy() for name in own}
        return state | {"t": self.task.start_time + self.run.elapsed, "axial": self._end_axial()}

    def _end_axial(self) -> np.ndarray | None:
        if not self.kernel.has_spins:
            return None
        return Recorded(self).axial(LAST)[0] if self.task.effects else self.axial.copy()

    @property
    def done(self) -> bool:
        """Whether the run has come to the end of its duration."""
        return self.status == DONE

    def distance_from(self, coarse: "CompiledRun") -> float:
        """How far a coarser run of the same motion is from this one, in the norm of `accuracy`.

        It is taken at the ends of the coarse run's steps.
        """
        return self.module.lib.omniroll_distance(
            coarse._course(), self._course(), self.task.vehicle.platform_radius, self._speed()
        )

    def _course(self) -> Any:
        """Pointer to what the run has left, as C takes it; `space` keeps it alive."""
        return self.module.ffi.new(
            "omniroll_course_t *",
            {
                "wheels": self.wheels,
                "contact": self.columns.end,
                "count": self.run.row_count,
                "row_size": self.space.rows.shape[1],
                "step_size": self.space.steps.shape[1],
                "rows": self.run.rows,
                "steps": self.run.steps,
            },
        )

    def _speed(self) -> float:
        """|nu| at the start; with effects the largest of the run; 1 for a vehicle that stays where it is."""
        nu = self.space.rows[: self.run.row_count if self.task.effects else 1, 1:4]
        return math.sqrt(np.einsum("ij,ij->i", nu, nu).max()) or 1.0

    def largest_pose(self) -> np.ndarray:
        """(3,) the largest |x|, |y| and |theta| of the run."""
        first = 4 + self.wheels
        return np.abs(self.space.rows[: self.run.row_count, first : first + 3]).max(axis=0)

    def release(self) -> None:
        """Leave the buffers to another run: what this one has recorded is not needed any more."""
        if self.space is not None:
            self.space.give_back()
            self.space = None

    # What acts

    def _answer(self) -> None:
        """Samples have come, or whatever the engine asks for: the effects say what acts from now on."""
        if not self.run.asks:
            self._take_samples()
            return
        if self.run.elapsed >= self.acting.next_time():
            self.acting.pass_time(self.run.elapsed, self._state())
        else:
            self.acting.pass_guards(self.passed[: self.run.guard_count] != 0)
        self._give_inputs()

    def _take_samples(self) -> None:
        for k, process in self.called:
            if process.next_time() <= self.run.elapsed:
                process.pass_time(self._state())
                self.sampled[k, 1] = process.output
                self.run.samplers[k].samples += 1

    def _state(self) -> State:
        """A copy of where the run has come; without the axial speeds."""
        rates = self.speeds("rates").copy() if self.kernel.slips else None
        return State(self.nu.copy(), self.chi.copy(), self.pose.copy(), self.contact.copy(), rates=rates)

    def speeds(self, name: str) -> np.ndarray:
        """(N,) rates or contact_omega where wheels may slip: where the engine has them."""
        start = self.columns.starts[name]
        return self.space.core[start : start + self.wheels]

    def _give_inputs(self) -> None:
        guards = self.acting.begin_phase(self.run.elapsed, self.run.carry)
        self.signals[2, : len(self.columns.inputs)] = self.inputs[1, : len(self.columns.inputs)]
        self.inputs[...] = 0
        for k, name in enumerate(self.columns.inputs):
            if name in self.acting.signals:
                signal = self.acting.signals[name]
                self.inputs[0, k], self.inputs[1, k] = signal.value, signal.slope
        for row, guard in zip(self.guards, guards, strict=False):
            of_nu, of_rates = guard.of_speeds(self.wheels)
            size = max(guard.size, abs(guard.constant))
            row[:] = [guard.constant, guard.slope, *of_nu, size, *of_rates[: len(row) - GUARD]]
        self.run.guard_count = len(guards)
        self.run.inputs_elapsed, self.run.inputs_carry = self.run.elapsed, self.run.carry
        self.run.next_time = self.acting.next_time()

    def _describe_what_acts(self) -> None:
        """Tables, controllers and drives with modes act by themselves; the engine asks effects of other kinds here."""
        plan = self.task.effects.plan(self.task.kernel, self.task.start_time)
        if plan.asks or plan.called:
            self.acting = EffectRun(self.task.effects, self.task.kernel, self.task.start_time)
        acts = what_acts(self.module.ffi, plan, self.columns.inputs, self.wheels)
        self._put(acts, [form.modes.copy() for form in plan.modal])

    def _put(self, acts: WhatActs, modes: list[np.ndarray]) -> None:
        self.acts, self.modes = acts, modes
        self.kept, self.sampled = acts.put_into(self.run, modes)
        if acts.plan.asks:
            self.run.asks = 1
            self._give_inputs()
            return
        first = len(acts.plan.samplers)
        self.called = [(first + k, self.acting.processes[place]) for k, (place, _) in enumerate(acts.plan.called)]

    # The start

    def _fill(self) -> None:
        task, space, step = self.task, self.space, max(self.tolerance, FINEST_STEP)
        state = task.state
        for name in ("nu", "chi", "pose", "contact"):
            getattr(space, name)[...] = getattr(state, name)
        self.nu, self.chi, self.pose, self.contact = space.nu, space.chi, space.pose, space.contact
        self.inputs, self.guards, self.passed, self.signals = space.inputs, space.guards, space.passed, space.signals
        self.axial = space.axial
        self._put_free_speeds(state)
        run = self.run
        run.impact = int(task.switching == "impact")
        run.start_time, run.duration = task.start_time, task.duration
        run.tolerance = step
        run.sweep_tolerance = max(SWEEP * self.tolerance / self._shares(), FINEST_SWEEP)
        run.speed, run.next_time = least_speed(task, step), math.inf
        if self.columns.states:
            space.part_sizes[:] = self.columns.part_sizes

    def _put_free_speeds(self, state: State) -> None:
        """Speeds that do not follow from nu: of free rollers, and where wheels may slip of these and of contacts."""
        if self.kernel.has_spins:
            self.axial[...] = state.free_axial()
        for name, speeds in self.task.effects.own_speeds(self.task.kernel, state).items():
            self.speeds(name)[:] = speeds

    def _shares(self) -> float:
        """Into how many parts the engine is given what iterations may leave; with effects it divides that itself."""
        if self.kernel.effects:
            return 1.0
        speeds = np.abs(self.kernel.wheel_speeds(self.nu)).sum()
        return 1 + float(speeds) * self.task.duration / (2 * self.run.joint)

    # What the run left

    def stats(self) -> dict[str, Any]:
        """Figures of the run by name."""
        run = self.run
        return {
            "engine": "compiled",
            "kernel": self.kernel.set_name,
            "steps": int(run.step_count),
            "rejected_steps": int(run.rejected_count),
            "phases": int(run.phase_count) + 1,
            "evaluations": int(run.sweep_count) * NODES,
            "tolerance": self.tolerance,
            "step_error": self._step_error(),
            "switches": self.forgotten.switches + _wheels_switched(self.space, run.switch_count),
        }

    def _step_error(self) -> float:
        """What steps leave by themselves, over |nu|: inside the worst of them, and in the iterations of all.

        Two runs of the same steps agree about the first. The polynomials' last terms overstate it by more than ten.
        """
        iterations = self.run.sweep_error if self.kernel.effects else self.run.step_count * self.run.sweep_tolerance
        return self.run.step_error / 10 + iterations

    @property
    def stop(self) -> SimulationStopped | None:
        """Why the run could not go on; without its trajectory."""
        if self.done:
            return None
        wheel, count = None, self.run.switch_count
        if self.status == STUCK and count:
            wheel = int(np.flatnonzero(self.space.switches[count - 1, 2:])[-1])
        if self.status == GROUND:
            reason, wheel = self._why_the_ground_fails()
            return self._stopped(reason, wheel)
        reason = self.ended or (self.outlook.described() if self.status == HOPELESS else REASONS[self.status])
        if self.status == NO_STEP:
            part = self.run.hardest_part
            name = "nu" if part < 0 else self.columns.states[part]
            reason += f": {name} changes faster than a step can follow"
        if self.status in (NO_STEP, HOPELESS):
            reason += blamed(self.task, self.end())
        return self._stopped(reason, wheel)

    def _stopped(self, reason: str, wheel: int | None) -> SimulationStopped:
        time = self.task.start_time + self.run.elapsed
        return SimulationStopped(reason, t=time, wheel=wheel, state=shown_state(self))

    def _why_the_ground_fails(self) -> tuple[str, int]:
        """In words why loads and motion do not go on together, and a wheel that has to do with it."""
        ground, grip = self.run.ground, self.task.effects.grip(self.task.vehicle)
        compression = np.array([self.run.grips[k].load for k in range(self.wheels)])
        found = Carried(compression, np.array(list(ground.failed_sums)), compression, ground.failed_determinant)
        try:
            Loads(self.kernel.vehicle.places(), grip.loads).refuse_as(
                FAILURES[ground.failure - 1], found, bool(ground.failure_is_regular)
            )
        except GroundFailsError as error:
            return str(error), error.wheel


def _wheels_switched(space: "Workspace", switches: int) -> int:
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

    def and_of(self, task: Task, space: "Workspace", switches: int) -> "Forgotten":
        """The same with the rows that memory holds now, among which there were so many switches."""
        count = self.switches + _wheels_switched(space, switches)
        if task.kernel.has_spins and switches:
            row = int(space.switches[switches - 1, 1])
            return Forgotten(count, space.switch_axial[switches - 1].copy(), space.rows[row].copy())
        return Forgotten(count, self.axial, space.rows[0].copy() if self.row is None else self.row)


def aligned(size: int) -> np.ndarray:
    """`size` doubles at an address that vectors can be loaded from."""
    raw = np.zeros(size + ALIGNMENT // 8)
    first = -(raw.ctypes.data // 8) % (ALIGNMENT // 8)
    return raw[first : first + size]


STATE_ARRAYS = (
    "nu", "chi", "pose", "axial", "work", "core", "core_before", "accounts", "part_sizes", "inputs", "guards",
    "signals",
)  # fmt: skip
RECORDS = ("rows", "steps", "switches", "switch_axial")
WHOLE_ARRAYS = ("contact", "passed", "leads_to")


class Workspace:
    """The buffers of one run, and the struct that points to them. Runs of one set and one size take them by turns.

    rows         room for so many rows at first
    keeps_steps  whether the polynomials of the steps are wanted
    """

    def __init__(
        self, kernel: Kernel, columns: "Columns", pool: "list[Workspace]", rows: int | None = None,
        keeps_steps: bool = True,
    ):  # fmt: skip
        rows = ROWS if rows is None else rows
        self.pool, self.ffi = pool, engine_of(kernel).ffi
        wheels, places = kernel.wheels, kernel.rollers_per_wheel - 1
        self.nu, self.chi, self.pose = np.zeros(3), np.zeros(wheels), np.zeros(3)
        self.axial = np.zeros((wheels, places) if kernel.has_spins else (1, 1))
        self.work = aligned(engine_of(kernel).lib.omniroll_run_work_size(wheels, kernel.rollers_per_wheel))
        self.core, self.core_before = np.zeros(columns.added + 1), np.zeros(columns.added + 1)
        self.accounts, self.part_sizes = np.zeros(columns.added + 1), np.zeros(len(columns.states) + 1)
        self.inputs = np.zeros((2, max(1, len(columns.inputs)), wheels))
        self.guards = np.zeros((MOST_GUARDS, GUARD + (wheels if kernel.slips else 0)))
        self.signals = np.zeros((3, len(columns.inputs) + 1, wheels))
        self.contact = np.zeros(wheels, np.int64)
        self.passed, self.leads_to = np.zeros(MOST_GUARDS, np.int64), np.zeros((MOST_GUARDS, 2), np.int64)
        self.rows = np.empty((rows, columns.width))
        self.steps = np.empty((rows if keeps_steps else 1, 2 + NODES * (6 + wheels + columns.added)))
        self.switches = np.empty((rows, 2 + wheels))
        self.switch_axial = np.empty((rows, *self.axial.shape) if kernel.has_spins else (1, 1, 1))
        self.bytes_per_row = self.rows[0].nbytes + self.steps[0].nbytes + self.switch_axial[0].nbytes
        self.struct = self.ffi.new("omniroll_run_t *")
        self.start = self.ffi.new("omniroll_run_t *")
        start = self.start
        start.wheels, start.rollers_per_wheel = wheels, kernel.rollers_per_wheel
        start.joint = np.pi / kernel.rollers_per_wheel
        start.patience = SWITCHES_WITHOUT_PROGRESS * wheels
        start.row_capacity = start.switch_capacity = rows
        for name in STATE_ARRAYS + RECORDS:
            setattr(start, name, self.ffi.from_buffer("double[]", getattr(self, name)))
        if not keeps_steps:
            start.steps = self.ffi.NULL
        for name in WHOLE_ARRAYS:
            setattr(start, name, self.ffi.from_buffer("long long[]", getattr(self, name)))

    def begin(self) -> Any:
        """The struct as it is before a run."""
        self.ffi.memmove(self.struct, self.start, self.ffi.sizeof("omniroll_run_t"))
        for array in (self.core, self.core_before, self.accounts, self.inputs, self.signals):
            array.fill(0)
        return self.struct

    def make_room(self, rows: int, switches: int, room: int, largest: int) -> None:
        """Room for so many further rows and switches, at most ROWS; there will be at most `largest` of each."""
        run = self.struct[0]
        for name, count in (("rows", rows), ("steps", rows), ("switches", switches), ("switch_axial", switches)):
            old = getattr(self, name)
            if count + room > len(old) > 1:
                grown = min(GROWTH * (count + max(room, ROWS)), max(largest, count + room))
                array = np.empty((grown, *old.shape[1:]))
                array[:count] = old[:count]
                setattr(self, name, array)
                setattr(run, name, self.ffi.from_buffer("double[]", array))
        run.row_capacity, run.switch_capacity = rows + room, switches + room

    def give_back(self) -> None:
        """To the runs that come; not where a long run has made the buffers large."""
        if len(self.rows) == len(self.switches) == ROWS:
            self.pool.append(self)


@lru_cache(maxsize=16)
def workspaces(
    base: str, effects: tuple[str, ...], sharp: bool, wheels: int, rollers: int, rows: int
) -> list[Workspace]:
    """Those that no run has at present."""
    return []


def workspace(kernel: Kernel, columns: "Columns") -> Workspace:
    """One that no other run has, for the library that is loaded now."""
    pool = workspaces(kernel.base, kernel.effects, kernel.sharp, kernel.wheels, kernel.rollers_per_wheel, ROWS)
    while pool:
        try:
            space = pool.pop()
        except IndexError:  # another thread has taken it
            break
        if space.ffi is engine_of(kernel).ffi:
            return space
    return Workspace(kernel, columns, pool)


class Columns:
    """Where a row's numbers stand: time, nu, chi, pose, what the set adds, contact, inputs.

    inputs  names of the kernel's inputs
    added   how many numbers the set integrates beside nu, chi and the pose; the last `accounts` of them are accounts
    starts  where each of them begins among these
    order   of these in the trajectory, as places in the row of the engine
    part_sizes  the size at |nu| = 1 of each state
    """

    def __init__(self, kernel: Kernel, quantities: tuple[Quantity, ...]):
        self.states, self.inputs = names_of(kernel, "states"), names_of(kernel, "inputs")
        self.state_vector = StateVector(kernel, quantities)
        self.sizes: list[int] = []
        self.accounts = 0
        self.order, self.starts = np.zeros(0, int), {}
        if self.states:
            self._place_states(kernel)
            self.part_sizes = self._sizes_of_parts(kernel)
        self.added = sum(self.sizes)
        self.end = 7 + kernel.wheels + self.added
        self.width = self.end + kernel.wheels * (1 + len(self.inputs))
        self.plain = 6 + kernel.wheels

    def _place_states(self, kernel: Kernel) -> None:
        outputs = {a.name: a.shape for s in kernel.signatures.values() for a in s.outputs}
        of_set = registry.quantities(kernel.effects, kernel.roller_model)
        rates = {quantity.name: quantity.rate for quantity in (*of_set, *self.state_vector.quantities)}
        self.sizes = [math.prod(outputs[rates[name]]) for name in self.states]
        kept = {quantity.name for quantity in of_set if quantity.account}
        self.accounts = sum(size for name, size in zip(self.states, self.sizes, strict=True) if name in kept)
        self.starts = dict(zip(self.states, np.cumsum([0, *self.sizes]).tolist(), strict=False))
        places = [
            self.starts[quantity.name] + np.arange(self.sizes[self.states.index(quantity.name)])
            for quantity in self.state_vector.quantities
        ]
        self.order = np.concatenate([np.zeros(0, int), *places]).astype(int)

    def _sizes_of_parts(self, kernel: Kernel) -> np.ndarray:
        """The size at |nu| = 1 of each state."""
        scale, place = self.state_vector.scale_of_added(kernel, 1.0), {}
        for quantity in self.state_vector.quantities:
            place[quantity.name] = scale[self.state_vector.slices[quantity.name].start - self.state_vector.plain]
        return np.array([*(place.get(name, 1.0) for name in self.states), 0.0])

    def state(self, numbers: np.ndarray) -> np.ndarray:
        """(..., 6 + N + E) in the order of the trajectory, from that of the engine."""
        if not self.added:
            return numbers
        return np.concatenate([numbers[..., : self.plain], numbers[..., self.plain + self.order]], axis=-1)


columns = lru_cache(maxsize=64)(Columns)


class Recorded:
    """What a run has left, as omniroll.engine.runs.Rows; each part is made of the engine's numbers when it is read."""

    def __init__(self, run: CompiledRun, first: int = 0):
        self.task, self.columns, space = run.task, run.columns, run.space
        rows, switches = run.run.row_count, run.run.switch_count
        before = int(np.searchsorted(space.switches[:switches, 1], first, side="right")) if first else 0
        self.has_spins, self.first = run.kernel.has_spins, first
        self.rows, self.steps = _kept(space.rows, first, rows), _kept(space.steps, first, rows)
        self.switches = _kept(space.switches, before, switches)
        if self.has_spins:  # what the free rollers had after the last switch before these rows, and where that was
            self.later_axial = _kept(space.switch_axial, before, switches)
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
    def contact(self) -> np.ndarray:
        return self.rows[:, self.columns.end : self.columns.end + self.task.vehicle.wheels].astype(int)

    @property
    def drive(self) -> np.ndarray | None:
        places = [self.columns.inputs.index(name) for name in self.task.effects.drives()]
        if not places:
            return None
        wheels = self.task.vehicle.wheels
        return self.rows[:, self.columns.end + wheels :].reshape(len(self.rows), -1, wheels)[:, places]

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


def _kept(buffer: np.ndarray, first: int, end: int) -> np.ndarray:
    """Entries of a buffer that is used again; or of one that a long run has made large, and that is not."""
    return buffer[first:end].copy() if len(buffer) == ROWS else buffer[first:end]


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
