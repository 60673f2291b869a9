"""A run of the compiled engine that goes on call by call: what a session works on.

A step ends in a pause, which the engine does not take for an event. Values that steps give are written where the
processes and the engine read them; all that changes is known as memory, which can be read and written back.
"""

from collections.abc import Callable, Mapping
from itertools import chain
from typing import Any

import numpy as np

from omniroll.effects.effect import Process
from omniroll.effects.effect_set import MOMENTS, EffectRun, Plan
from omniroll.engine.compiled_engine import ASK, FULL, HOPELESS, CompiledRun
from omniroll.engine.outlook import FIRST, OutlookOfStep
from omniroll.engine.recorded import Forgotten
from omniroll.engine.runs import Task, least_speed
from omniroll.engine.what_acts import WhatActs
from omniroll.engine.workspace import ARRAYS, Workspace
from omniroll.results.trajectory import Trajectory

STEPS_EXPECTED = 1e5  # the iterations of so many steps together may leave a part of the accuracy
CAPACITY = 16  # rows of the engine's buffer, which nobody reads
SEEN = 512  # where somebody does


class SteppedRun(CompiledRun):
    """A run that pauses where its duration is over, and keeps neither rows nor steps.

    see  is called with what each call of the engine has left, before that is forgotten; None: nobody looks at it
    """

    def __init__(self, task: Task, tolerance: float, see: Callable[[Trajectory], None] | None = None):
        self.see = see
        self.acting = EffectRun(task.effects, task.kernel, task.start_time)
        super().__init__(task, tolerance)
        self.run.task.pauses = 1
        self.names = (*self.columns.inputs, "voltage")  # of the signals
        self.call: Callable = self.module.lib.omniroll_run
        self.model = self.kernel.model_for(self.module.ffi)
        self.passes = np.zeros(self.kernel.wheels, np.int64)  # joints passed forwards less those backwards
        self._find_memory()
        self.at_start = self.memory.read()

    def _find_memory(self) -> None:
        """Where the values stand that steps give, and all that the engine or a step writes."""
        self.held: dict[str, list[np.ndarray]] = {}
        for process in self.acting.processes:
            for name, values in process.held().items():
                self.held.setdefault(name, []).append(values)
        written = [getattr(self.space, name) for name in chain.from_iterable(ARRAYS.values())]
        written += [*self.modes, self.sampled, self.passes, *chain.from_iterable(self.held.values())]
        self.memory = Memory(self.module.ffi, [self.struct, *self.kept], written)

    def _workspace(self) -> Workspace:
        capacity = CAPACITY if self.see is None else SEEN
        return Workspace(self.kernel, self.columns, [], capacity, keeps_steps=self.see is not None)

    def _describe_what_acts(self) -> None:
        """The engine reads and writes the processes' own arrays, which steps write and `readings` read."""
        plan = Plan(self.acting)
        acts = WhatActs(self.module.ffi, plan, self.columns.inputs, self.wheels)
        self._put(acts, [form.modes for form in plan.modal])

    def _shares(self) -> float:
        return STEPS_EXPECTED

    def go_on(self, elapsed: float) -> None:
        """Go on to the time `elapsed` since the start. Raises SimulationStopped."""
        run, record = self.run, self.record
        begin = self.state.elapsed, record.step_count
        run.task.duration, record.row_count, record.switch_count = elapsed, 0, 0
        self.go_on_from(self.call(self.struct, self.model), *begin)

    def go_on_from(self, status: int, elapsed: float, steps: int) -> None:
        """Go on after a first call of the engine, with what that has returned. Raises SimulationStopped.

        elapsed, steps  where the run was before that call
        """
        self.status, self.outlook, self.switched = status, None, 0
        while True:
            while self.status == ASK:
                self._answer()
                self.status = self.call(self.struct, self.model)
            if self.record.switch_count:
                self.switched += self.record.switch_count
                directions = self.space.switches[: self.record.switch_count, 2:].astype(np.int64)
                self.passes += np.where(np.abs(directions) == 1, directions, 0).sum(axis=0)
            if self.status == FULL:
                self._look_ahead_from(elapsed, steps)
            self._show()
            if self.status != FULL:
                break
            self.record.row_count = self.record.switch_count = 0
            self.status = self.call(self.struct, self.model)
        if not self.done:
            raise self.stop

    def _show(self) -> None:
        """Show what the engine has left since it was last called."""
        if self.see is not None:
            self.see(self.part(0))
            self.forgotten = self.forgotten.and_of(self.task, self.space, self.record.switch_count)

    def _look_ahead_from(self, elapsed: float, steps: int) -> None:
        """Whether the step that began there has a future: asked after some of the engine's steps, then after twice as
        many, and so on."""
        if self.outlook is None:
            self.outlook, self.next_look = OutlookOfStep(self.run.task.duration - elapsed), FIRST
        done = self.record.step_count - steps
        if done >= self.next_look:
            self.next_look = 2 * done
            if self.outlook.is_hopeless(done, self.switched, self.state.elapsed - elapsed):
                self.status = HOPELESS

    @property
    def asked(self) -> list[Process]:
        """The processes that the engine asks at their events; of most it does by itself what they say."""
        return self.acting.processes if self.run.acts.asks else [process for _, process in self.called]

    def change_what_acts(self) -> None:
        """What acts has been written into: this instant is an event, at which the signals are made anew."""
        self.passed[:] = 0
        self.run.acts.next_time, self.run.past.at_event = self.state.elapsed, 1

    def go_back(self, memory: bytes, remembered: list[Mapping[str, Any]]) -> None:
        """Go back to where this memory was read, and the processes that the engine asks to what they gave then."""
        for process, own in zip(self.asked, remembered, strict=True):
            process.restore(own)
        self._write(memory)

    def go_to_start(self) -> None:
        """Go back to the start. Processes that the engine asks are made anew: not each of them can be saved."""
        self.forgotten = Forgotten()
        if self.asked:
            self.acting = EffectRun(self.task.effects, self.task.kernel, self.task.start_time)
            self._describe_what_acts()
            self._find_memory()
        self._write(self.at_start)

    def _write(self, memory: bytes) -> None:
        self.memory.write(memory)
        if self.run.acts.asks:
            self.acting.begin_phase(self.run.acts.inputs_elapsed, self.run.acts.inputs_carry)

    def start(self, task: Task) -> None:
        """Put the state at the start of a task in the place of this one's."""
        self.nu[:], self.chi[:], self.pose[:] = task.state.nu, task.state.chi, task.state.pose
        self._put_free_speeds(task.state)
        self.run.task.speed = least_speed(task, self.run.task.tolerance)

    # What can be read

    def _end_axial(self) -> np.ndarray | None:
        return self.axial_now() if self.kernel.has_spins else None

    def signals_now(self) -> dict[str, np.ndarray]:
        """(N,) each input and the voltages of the motors, as they act before this instant's events."""
        acts, state = self.run.acts, self.state
        since = (state.elapsed - acts.inputs_elapsed) + (state.carry - acts.inputs_carry)
        if acts.asks:
            return {name: signal.at(since) for name, signal in self.acting.signals.items()} | self._modes()
        values = self.signals[0] + self.signals[1] * since
        given = (*self.task.effects.drives(), *(["voltage"] if acts.modal_count else []))
        return {name: value for name, value in zip(self.names, values, strict=True) if name in given} | self._modes()

    def _modes(self) -> dict[str, np.ndarray]:
        """(N,) the torques of bearings that may stick, and the modes of contacts that may."""
        own = self.run.bearings
        ends = {"bearing_torque": own.axle_count, "contact_bearing": own.axle_count + self.wheels}
        torques = np.array([own.each[k].torque for k in range(min(own.count, ends["contact_bearing"]))])
        present = set(self.task.effects.drives())
        bearings = {name: torques[end - self.wheels : end] for name, end in ends.items() if name in present}
        recorded = [name for effect in self.task.effects.effects for name in effect.recorded()]
        recorded += [name for name in MOMENTS if name in present]
        modes = {name: self.inputs[0, self.columns.inputs.index(name)].copy() for name in recorded}
        return bearings | modes

    def integrated(self, core: np.ndarray) -> dict[str, np.ndarray]:
        """What the effects integrate, by name, where the rest of the core is `core`."""
        if not self.task.effects:
            return {}
        views = self._views(core)
        return {quantity.name: views[quantity.name] for quantity in self.columns.state_vector.quantities}

    def _views(self, core: np.ndarray) -> dict[str, np.ndarray]:
        """The same, with nu, chi and the pose."""
        accounts = self.columns.accounts
        ends = self.columns.added - accounts
        numbers = np.concatenate([self.nu, self.chi, self.pose, core[:ends], self.space.accounts[:accounts]])
        return self.columns.state_vector.views(self.columns.state(numbers))

    def axial_now(self) -> np.ndarray:
        """Axial speeds (N, n-1) of the free rollers: those at axial_elapsed, and what has become of them."""
        if not self.task.effects:
            return self.axial
        before, after = self._views(self.space.core_before), self._views(self.space.core)
        since = np.array(self.state.elapsed - self.state.axial_elapsed)
        return self.task.effects.axial_later(self.task.kernel, self.axial, before, after, since)


class Memory:
    """Some structs and arrays as bytes, and back: structs without their pointers, arrays whole. The bytes of one are
    another's where both have the same sizes."""

    def __init__(self, ffi: Any, structs: list, arrays: list[np.ndarray]):
        self.structs = [(np.frombuffer(ffi.buffer(struct), np.uint8), _plain(ffi, struct)) for struct in structs]
        self.arrays = arrays
        sizes = [np.count_nonzero(plain) for _, plain in self.structs] + [array.nbytes for array in arrays]
        self.ends = np.cumsum([0, *sizes]).tolist()

    @property
    def size(self) -> int:
        return self.ends[-1]

    def read(self) -> bytes:
        parts = [struct[plain].tobytes() for struct, plain in self.structs]
        return b"".join(parts + [array.tobytes() for array in self.arrays])

    def write(self, saved: bytes) -> None:
        parts = [saved[start:end] for start, end in zip(self.ends, self.ends[1:], strict=False)]
        for (struct, plain), part in zip(self.structs, parts, strict=False):
            struct[plain] = np.frombuffer(part, np.uint8)
        for array, part in zip(self.arrays, parts[len(self.structs) :], strict=True):
            array[...] = np.frombuffer(part, array.dtype).reshape(array.shape)


def _plain(ffi: Any, struct: Any) -> np.ndarray:
    """Which of these bytes are of no pointer."""
    kind = ffi.typeof(struct).item
    count = len(ffi.buffer(struct)) // ffi.sizeof(kind)
    plain = np.ones(ffi.sizeof(kind), bool)
    for start, size in _pointers(ffi, kind, 0):
        plain[start : start + size] = False
    return np.tile(plain, count)


def _pointers(ffi: Any, kind: Any, offset: int) -> list[tuple[int, int]]:
    """Where the pointers of a struct stand, and their sizes, in bytes; those of structs inside it too."""
    found = []
    for _, field in kind.fields:
        if field.type.kind == "pointer":
            found.append((offset + field.offset, ffi.sizeof(field.type)))
        elif field.type.kind == "struct":
            found += _pointers(ffi, field.type, offset + field.offset)
    return found
