"""The compiled engine: runtime/csrc does phases, events and transitions; here its buffers are filled and read.

A call runs until its rows are full, few at first and then some thousand; then progress is reported. Tables, controllers
and drives with modes act within a call. Between two calls a controller that is a Python function takes its samples, and
an effect that the engine does not know is asked at each event.

What a run leaves stays as the engine wrote it until it is read. A run that nobody makes a trajectory of, such as the
control of another, is never copied.
"""

import math
import warnings
from functools import lru_cache
from typing import Any

import numpy as np

from omniroll.codegen.specialise import OFTEN_ABSENT
from omniroll.effects.effect import Process
from omniroll.effects.effect_set import EffectRun
from omniroll.engine import workspace
from omniroll.engine.outlook import FIRST, outlook_of
from omniroll.engine.pieces import Pieces
from omniroll.engine.recorded import Forgotten, Recorded, wheels_switched
from omniroll.engine.runs import TOO_MANY_ROWS, Task, assembled, least_speed, shown_state, state_of
from omniroll.engine.stiffness import TO_CHANGE, blamed, to_and_fro
from omniroll.engine.what_acts import WhatActs, what_acts
from omniroll.engine.works import EngineCall, Work, result_of
from omniroll.engine.workspace import NODES, Workspace, columns, engine_of, names_of
from omniroll.errors import InvalidValueError, KernelsMissingError, SimulationStopped
from omniroll.kernels.kernel import CompiledKernel, Kernel
from omniroll.kernels.lanes import MOST_WHEELS
from omniroll.kernels.neutral_kernel import NeutralKernel, neutral_kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.slipping import Contacts, given_in_rows
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.checks import joint_angle, joint_angles
from omniroll.vehicles.state import State

MANY_EVALUATIONS = 1e7  # left, at a third of a microsecond to one each: of seconds a word is said
CALLS = 8  # that fill the memory of a run at least
LAST = slice(-1, None)  # row
DONE, FULL, STUCK, NO_STEP, ASK, _, UNLAWFUL = range(7)  # engine.h
TOO_LONG, ENDED, HOPELESS = 7, 8, 9  # beside those of engine_calls.h
REASONS = {
    STUCK: "switches without progress in time",
    NO_STEP: "the step became too small",
    UNLAWFUL: "what sticks takes more than it can: this is a fault of omniroll; please report the scene",
    TOO_LONG: TOO_MANY_ROWS,
}

# A step's error is that inside it; at its end, collocation is far better. What the iterations of all steps leave adds
# up to at most this part of the tolerance, if the vehicle goes on as it starts.
SWEEP = 0.1
FINEST_STEP, FINEST_SWEEP = 1e-15, 1e-16


def check_can_run(task: Task) -> None:
    """Raises InvalidValueError or KernelsMissingError, which say what to do, where the compiled engine cannot run this
    task."""
    wheels = task.kernel.wheels
    if wheels > MOST_WHEELS:
        bound = f"has room for {MOST_WHEELS} wheels, and this vehicle has {wheels}: choose engine='python'"
        raise InvalidValueError("engine", task.engine, bound)
    bound = kernel_of(task)
    if bound is None:
        text = f"the set of effects {task.kernel.set_name} has no engine, and no C compiler (cc) is found to make one"
        raise KernelsMissingError(f"{text}: install it, or choose engine='compiled' or 'python'")
    if not task.effects:
        return
    plan = task.effects.plan(task.kernel, task.start_time)
    known = names_of(bound, "states") if bound.effects else ()
    integrated = task.effects.quantities(task.kernel) if bound.effects else ()
    if plan.asks and task.kernel.pivots:
        names = ", ".join(type(effect).__name__ for effect in task.effects.effects)
        bound = "has guards in Python, which do not go with mecanum wheels and two rows of rollers: take omni-wheels"
        raise InvalidValueError("effects", names, bound)
    if not plan.guards_read_speeds_alone or (plan.has_events and not bound.effects):
        bound = "cannot follow guards of an effect that read more than speeds: choose engine='python'"
        raise InvalidValueError("engine", task.engine, bound)
    if any(quantity.name not in known for quantity in integrated):
        names = ", ".join(quantity.name for quantity in integrated if quantity.name not in known)
        raise InvalidValueError("engine", task.engine, f"does not integrate {names}: choose engine='python'")


def can_run(task: Task) -> bool:
    """Whether the compiled engine takes this task."""
    try:
        check_can_run(task)
    except (InvalidValueError, KernelsMissingError):
        return False
    return True


def kernel_of(task: Task) -> Kernel | None:
    """The kernel on which the compiled engine runs a task: its own, or the general set that stands for it.

    None for the Python engine, and where nothing is compiled. Raises KernelsMissingError where a kernel that was built
    has lost its engine.
    """
    return None if task.engine == "python" else _kernel_of(task.kernel)


@lru_cache(maxsize=64)
def _kernel_of(kernel: Kernel) -> Kernel | None:
    if isinstance(kernel, NeutralKernel):
        return kernel.engine
    if not isinstance(kernel, CompiledKernel):
        return None
    try:
        engine_of(kernel)
    except KernelsMissingError as problem:
        general = neutral_kernel(kernel.vehicle, kernel.roller_model, kernel.effects, kernel.given)
        if general is None:
            raise
        warnings.warn(f"a prebuilt engine runs, which is slower: {problem}", RuntimeWarning, 2)
        return general.engine
    return kernel


class CompiledRun:
    """One simulation with one tolerance."""

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.tolerance = task, kernel_of(task), tolerance
        self.module = engine_of(self.kernel)
        self.wheels = self.kernel.wheels
        self.columns = columns(self.kernel, task.effects.quantities(self.kernel))
        self.space = self._workspace()
        self.struct = self.space.begin()
        self.run, self.state, self.record = self.struct[0], self.struct.state, self.struct.record
        self.status, self.ended, self.is_named = None, "", False
        self._fill()
        self.kept, self.modes, self.sampled = [], [], np.zeros(0)  # what acts, in memory that the engine writes
        self.acts: WhatActs | None = None
        self.called: list[tuple[int, Process]] = []  # samplers whose samples are taken here
        self.forgotten = Forgotten()
        if self.task.effects:
            self._describe_what_acts()

    def _workspace(self) -> Workspace:
        return workspace.workspace(self.kernel, self.columns)

    def advance(self) -> "CompiledRun":
        """Simulate, up to the duration or to where the run cannot go on."""
        result_of(self.advancing())
        return self

    def advancing(self) -> Work[None]:
        """The same as a work, whose calls of the engine others may share."""
        call = EngineCall(self.module, self.struct, self.kernel.model_for(self.module.ffi))
        self.outlook = outlook_of(self.task.duration, self.space.bytes_per_row, self.task.memory, self.task.room)
        most = min(workspace.ROWS, max(FIRST, int(self.task.memory / CALLS / self.space.bytes_per_row)))
        largest = int(self.task.memory / self.space.bytes_per_row) + most
        self.status, room = FULL, min(self.task.first_rows, most)
        while self.status == FULL:
            self.space.make_room(room, largest)
            room = min(2 * room, most)
            (self.status,) = yield [call]
            while self.status == ASK and not self._is_ended():
                self._answer()
                if self.ended:
                    self.status = ENDED
                    break
                (self.status,) = yield [call]
            if self.status == FULL:
                self._look_ahead()
            if self.status == FULL and not self._is_ended() and self.task.keep is not None:
                self.task.keep(self)
            if self.task.progress is not None:
                self.task.progress(self.state.elapsed, self.task.duration)

    def _look_ahead(self) -> None:
        """Whether memory holds the rows so far, and those that are to come."""
        if self.bytes_held > self.task.memory:
            self.status = TOO_LONG
        elif self.outlook.is_hopeless(self.record.step_count, self.record.switch_count, self.state.elapsed):
            self.status = HOPELESS
        else:
            self._name_what_is_slow()

    def _name_what_is_slow(self) -> None:
        """Say once which term makes the steps short, of a run that goes on for long."""
        record = self.record
        left = self.outlook.left * record.sweep_count * NODES / max(record.step_count, 1)
        collapsed = self.outlook.has_collapsed(record.step_count, record.switch_count)
        if self.is_named or not collapsed or left < MANY_EVALUATIONS:
            return
        if cause := blamed(self.task, self.end()):
            self.is_named = True
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
        result = self.part()
        self.release()
        if stopped is None:
            return result
        stopped.trajectory = result
        raise stopped

    def part(self, first: int = 0) -> Trajectory:
        """The trajectory from row `first` to where the run has come; its buffers are free then."""
        return assembled(self.task, Recorded(self, first), self.stats())

    @property
    def row_count(self) -> int:
        """How many rows there are so far."""
        return self.record.row_count

    @property
    def bytes_held(self) -> float:
        """Bytes that the rows and steps in memory take."""
        return self.record.row_count * self.space.bytes_per_row

    def forget(self) -> None:
        """Take all rows but the last one from memory, and all switches."""
        record, space = self.record, self.space
        self.forgotten = self.forgotten.and_of(self.task, space, record.switch_count)
        space.rows[0] = space.rows[record.row_count - 1]
        record.row_count, record.switch_count = 1, 0

    def end(self) -> dict[str, Any]:
        """t, nu, chi, contact, pose and the free rollers' axial speeds (N, n-1) or None, where the run has come.

        Where wheels may slip also `speeds`: by name what contacts have, as Contacts takes it, with the modes of
        massless rollers that may stick, or their spins, beside contacts that stick and where these follow loads.
        """
        state: dict[str, Any] = {name: array.copy() for name, array in state_of(self).items()}
        own = self.task.effects.own_speeds(self.task.kernel, self.task.state)
        speeds = {name: self.speeds(name).copy() for name in own}
        state["speeds"] = speeds | (self._spins(speeds) if self._is_cut else self.massless_modes())
        return state | {"t": self.task.start_time + self.state.elapsed, "axial": self._end_axial()}

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
        radius = self.task.vehicle.platform_radius
        return self.module.lib.omniroll_distance(coarse._course(), self._course(), radius, self._speed())

    def _course(self) -> Any:
        """Pointer to what the run has left, as C takes it; `space` keeps it alive."""
        sizes = {"row_size": self.space.rows.shape[1], "step_size": self.space.steps.shape[1]}
        places = {"wheels": self.wheels, "contact": self.columns.end, "count": self.record.row_count}
        arrays = {"rows": self.record.rows, "steps": self.record.steps}
        return self.module.ffi.new("omniroll_course_t *", places | sizes | arrays)

    def _speed(self) -> float:
        """|nu| at the start; with effects the largest of the run; 1 for a vehicle that stays where it is."""
        if not self.task.effects:
            return math.hypot(*self.space.rows[0, 1:4].tolist()) or 1.0
        nu = self.space.rows[: self.record.row_count, 1:4]
        return math.sqrt(np.einsum("ij,ij->i", nu, nu).max()) or 1.0

    def largest_pose(self) -> np.ndarray:
        """(3,) the largest |x|, |y| and |theta| of the run."""
        first = 4 + self.wheels
        return np.abs(self.space.rows[: self.record.row_count, first : first + 3]).max(axis=0)

    def release(self) -> None:
        """Leave the buffers to another run: what this one has recorded is not needed any more."""
        if self.space is not None:
            self.space.give_back()
            self.space = None

    # What acts

    def _answer(self) -> None:
        """Samples have come, or whatever the engine asks for: the effects say what acts from now on."""
        if not self.run.acts.asks:
            self._take_samples()
            return
        if self.state.elapsed >= self.acting.next_time():
            self.acting.pass_time(self.state.elapsed, self._state())
        else:
            self.acting.pass_guards(self.passed[: self.run.acts.guard_count] != 0)
            self.ended = next((process.ended for process in self.acting.processes if process.ended), "")
        self._give_inputs()

    def _take_samples(self) -> None:
        for k, process in self.called:
            if process.next_time() <= self.state.elapsed:
                process.pass_time(self._state())
                self.sampled[k, 1] = process.output
                self.run.acts.samplers[k].samples += 1

    def _state(self) -> State:
        """A copy of where the run has come; without the axial speeds."""
        rates = self.speeds("rates").copy() if self.kernel.slips else None
        carry = Carry.of_numbers(self.contact, self.task.vehicle.rollers_per_wheel)
        if self.kernel.pivots and rates is None:
            rates = kernel_in_phase(self.kernel, carry).wheel_speeds(self.nu, self.chi)
        return State(self.nu.copy(), self.chi.copy(), self.pose.copy(), carry.contact, rates=rates)

    def speeds(self, name: str) -> np.ndarray:
        """(N,) rates or contact_omega where wheels may slip: where the engine has them."""
        start = self.columns.starts[name]
        return self.space.core[start : start + self.wheels]

    def massless_modes(self) -> dict[str, np.ndarray]:
        """(N,) by name what the kernel takes of massless rollers that stick on their disks or turn there where wheels
        may slip, before this instant's events; without such rollers empty."""
        if self.task.effects.sliding_of_massless_rollers(self.task.kernel) is None:
            return {}
        rollers = [self.run.bearings.each[self.run.bearings.axle_count + wheel] for wheel in range(self.wheels)]
        sticks, taken = np.array([roller.mode == 0 for roller in rollers]), np.array([r.torque for r in rollers])
        return given_in_rows(taken, sticks) | ({"contact_taken": taken} if self._is_cut else {})

    @property
    def _is_cut(self) -> bool:
        """Whether massless rollers may stick beside contacts that may: their spins follow from headings, too."""
        return "corner_forces" in self.kernel.signatures

    def _spins(self, speeds: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """(N,) in rad/s by name, spins of such rollers, where contacts have `speeds` by name."""
        grip = self.task.effects.grip(self.task.kernel.vehicle)
        modes = {n: self.inputs[0, self.columns.inputs.index(n)].copy() for n in ("sticks", "slip_heading")}
        modes |= self.massless_modes()
        contacts = Contacts(self.task.kernel, speeds, grip, lambda: modes)
        return {"contact_spin": contacts.spins(self.nu, self.chi).copy()}

    def _give_inputs(self) -> None:
        guards = self.acting.begin_phase(self.state.elapsed, self.state.carry)
        self.signals[2, : len(self.columns.inputs)] = self.inputs[1, : len(self.columns.inputs)]
        self.inputs[...] = 0
        for k, name in enumerate(self.columns.inputs):
            if name in self.acting.signals:
                signal = self.acting.signals[name]
                self.inputs[0, k], self.inputs[1, k] = signal.value, signal.slope
        for row, guard in zip(self.guards, guards, strict=False):
            of_nu, *others = guard.of_parts(self.columns.state_vector.slices)
            size = max(guard.size, abs(guard.constant))
            row[:] = np.concatenate([[guard.constant, guard.slope], of_nu, [size], *others])
        acts, state = self.run.acts, self.state
        acts.guard_count, acts.next_time = len(guards), self.acting.next_time()
        acts.inputs_elapsed, acts.inputs_carry = state.elapsed, state.carry

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
            self.run.acts.asks = 1
            self._give_inputs()
            return
        first = len(acts.plan.samplers)
        self.called = [(first + k, self.acting.processes[place]) for k, (place, _) in enumerate(acts.plan.called)]

    # The start

    def _fill(self) -> None:
        task, space, step = self.task, self.space, max(self.tolerance, FINEST_STEP)
        state = task.state
        for name in ("nu", "pose", "contact"):
            getattr(space, name)[...] = getattr(state, name)
        self.nu, self.chi, self.pose, self.contact = space.nu, space.chi, space.pose, space.contact
        self.inputs, self.guards, self.passed, self.signals = space.inputs, space.guards, space.passed, space.signals
        self.axial = space.axial
        self._put_free_speeds(state)
        self.pieces = Pieces(self.kernel, self.module.ffi)
        self.pieces.put_into(self.run)
        self.put_angles(state.chi)
        asked = self.run.task
        asked.impact, asked.bare = int(task.switching == "impact"), int(not {*OFTEN_ABSENT} & {*task.kernel.effects})
        asked.start_time, asked.duration = task.start_time, task.duration
        asked.tolerance = step
        asked.sweep_tolerance = max(SWEEP * self.tolerance / self._shares(), FINEST_SWEEP)
        asked.speed, self.run.acts.next_time = least_speed(task, step), math.inf
        if self.columns.states:
            space.part_sizes[:] = self.columns.part_sizes

    def put_angles(self, chi: np.ndarray) -> None:
        """The wheels' angles (N,) in rad from the middles of their rollers, |chi| <= pi/n."""
        self.chi[...] = chi
        self.space.joint[...] = joint_angles(self.task.vehicle)
        self.contact[...] = self.pieces.contact_numbers(self.contact, self.nu, chi)

    def _put_free_speeds(self, state: State) -> None:
        """Speeds that do not follow from nu: of free rollers, and where wheels may slip of these and of contacts."""
        if self.kernel.has_spins:
            self.axial[...] = state.free_axial()
        for name, speeds in self.task.effects.own_speeds(self.task.kernel, state).items():
            self.speeds(name)[:] = speeds
        for effect in self.task.effects.effects:
            for name, numbers in effect.start().items():
                place = self.columns.starts[name]
                self.space.core[place : place + len(numbers)] = numbers

    def _shares(self) -> float:
        """Into how many parts the engine is given what iterations may leave; with effects it divides that itself."""
        if self.kernel.effects:
            return 1.0
        speeds = np.abs(self.kernel.wheel_speeds(self.nu)).sum()
        return 1 + float(speeds) * self.task.duration / (2 * joint_angle(self.task.vehicle.rollers_per_wheel))

    # What the run left

    def stats(self) -> dict[str, Any]:
        """Figures of the run by name."""
        return {
            "engine": "compiled",
            "kernel": self.kernel.set_name,
            "steps": int(self.record.step_count),
            "rejected_steps": int(self.record.rejected_count),
            "phases": int(self.record.phase_count) + 1,
            "evaluations": int(self.record.sweep_count) * NODES,
            "tolerance": self.tolerance,
            "step_error": self._step_error(),
            "switches": self.forgotten.switches + wheels_switched(self.space, self.record.switch_count),
        }

    def _step_error(self) -> float:
        """What steps leave by themselves, over |nu|: inside the worst of them, and in the iterations of all.

        Two runs of the same steps agree about the first. The polynomials' last terms overstate it by more than ten.
        """
        record, sweep = self.record, self.run.task.sweep_tolerance
        return record.step_error / 10 + (record.sweep_error if self.kernel.effects else record.step_count * sweep)

    def chatters(self) -> tuple[int, str] | None:
        """The wheel that ends the run by going to and fro over its joint, and that in words."""
        ends_so = self.status in (STUCK, HOPELESS)
        return to_and_fro(self.space.switches[: self.record.switch_count]) if ends_so else None

    @property
    def stop(self) -> SimulationStopped | None:
        """Why the run could not go on; without its trajectory."""
        if self.done:
            return None
        wheel, count = None, self.record.switch_count
        if self.status == STUCK and count:
            wheel = int(np.flatnonzero(self.space.switches[count - 1, 2:])[-1])
        elif self.status in (NO_STEP, UNLAWFUL):
            wheel = int(self.record.stopped_wheel) if self.record.stopped_wheel >= 0 else None
        reason = self.ended or (self.outlook.described() if self.status == HOPELESS else REASONS[self.status])
        if self.status == NO_STEP:
            part = self.record.hardest_part
            name = "nu" if part < 0 else self.columns.states[part]
            reason += f": {name} changes faster than a step can follow"
        if (chatters := self.chatters()) is not None:
            wheel, reason = chatters[0], f"{reason}: {chatters[1]}"
        elif self.status in (NO_STEP, HOPELESS):
            reason += blamed(self.task, self.end())
        if self.status == NO_STEP:
            reason += TO_CHANGE
        time = self.task.start_time + self.state.elapsed
        return SimulationStopped(reason, t=time, wheel=wheel, state=shown_state(self))
