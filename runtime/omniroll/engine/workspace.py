"""The memory of one run of the compiled engine, and where each number stands in it."""

import math
import threading
from functools import lru_cache
from typing import Any

import numpy as np

from omniroll.effects import registry
from omniroll.effects.guards import GUARDED
from omniroll.effects.registry import Quantity
from omniroll.effects.state_vector import StateVector
from omniroll.engine.runs import SWITCHES_WITHOUT_PROGRESS
from omniroll.kernels import sets
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.lanes import aligned
from omniroll.vehicles.checks import joint_angles

NODES = 16  # of a step; gauss.h
ROWS = 4096  # of a call; the first calls of a run are shorter
FIRST_BYTES = 2**28  # that the rows of a run have at first, if some rows do
FEWEST = 32  # rows that they are at least
GROWTH = 8  # times its rows has a buffer that grows: a page costs nothing before it is written to, and a copy much
MOST_GUARDS = 256  # run.c
GUARD = 6  # numbers of a guard, before those of the wheels' rates and of the tilt; events.c


def engine_of(kernel: Kernel) -> Any:
    """`ffi` and `lib` with the engine of a kernel's set."""
    return sets.engine(kernel.base, kernel.effects, kernel.wheels, kernel.sharp)


@lru_cache(maxsize=64)
def names_of(kernel: Kernel, kind: str) -> tuple[str, ...]:
    """What the engine of a set integrates beside nu, chi and the pose ("states"), or needs as "inputs"."""
    engine = engine_of(kernel)
    return tuple(engine.ffi.string(getattr(engine.lib, f"omniroll_run_{kind}")()).decode().split())


class Columns:
    """Where a row's numbers stand: time, nu, chi, pose, what the set adds, contact, modes, inputs.

    inputs  names of the kernel's inputs
    added   how many numbers the set integrates beside nu, chi and the pose; the last `accounts` of them are accounts
    starts  where each of them begins among these
    order   of these in the trajectory, as places in the row of the engine
    part_sizes  the size at |nu| = 1 of each state
    guarded     how many numbers are those that a guard may read beside nu
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
        self.modes_at = self.end + kernel.wheels
        of_bearings = engine_of(kernel).lib.omniroll_run_modes(kernel.wheels, kernel.rollers_per_wheel)
        self.inputs_at = self.modes_at + of_bearings
        self.width = self.inputs_at + kernel.wheels * len(self.inputs)
        self.plain = 6 + kernel.wheels
        self.guarded = [size for name, size in zip(self.states, self.sizes, strict=True) if name in GUARDED]
        self.guarded += [kernel.wheels] * (kernel.rows_move and not kernel.slips)  # rates that go by angles

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


# The arrays that a run points to, by the groups of its struct; "": those that are in no group.
ARRAYS: dict[str, tuple[str, ...]] = {
    "": ("work", "joint", "rollers", "wheel_rows"),
    "task": ("part_sizes",),
    "state": ("nu", "chi", "pose", "contact", "axial", "core", "core_before", "accounts"),
    "acts": ("inputs", "signals", "guards", "passed", "leads_to"),
}
RECORDS = ("rows", "steps", "switches", "switch_axial")


class Workspace:
    """The buffers of one run, and the struct that points to them. Runs of one set and one size take them by turns.

    rows         room for so many rows at first; None: ROWS, or fewer of a vehicle with very many rollers
    keeps_steps  whether the polynomials of the steps are wanted
    """

    def __init__(
        self, kernel: Kernel, columns: "Columns", pool: "list[Workspace]", rows: int | None = None,
        keeps_steps: bool = True,
    ):  # fmt: skip
        rows = first_rows(kernel, columns) if rows is None else rows
        self.first, self.pool, self.ffi = rows, pool, engine_of(kernel).ffi
        wheels, places = kernel.wheels, kernel.rollers_per_wheel - 1
        self.nu, self.chi, self.pose = np.zeros(3), np.zeros(wheels), np.zeros(3)
        self.axial = np.zeros((wheels, places) if kernel.has_spins else (1, 1))
        self.work = aligned(engine_of(kernel).lib.omniroll_run_work_size(wheels, kernel.rollers_per_wheel))
        self.core, self.core_before = np.zeros(columns.added + 1), np.zeros(columns.added + 1)
        self.accounts, self.part_sizes = np.zeros(columns.added + 1), np.zeros(len(columns.states) + 1)
        self.inputs = np.zeros((2, max(1, len(columns.inputs)), wheels))
        self.guards = np.zeros((MOST_GUARDS, GUARD + sum(columns.guarded)))
        self.signals = np.zeros((3, len(columns.inputs) + 1, wheels))
        self.wheel_rows = np.zeros((wheels, 3))
        self.contact, self.rollers = np.zeros(wheels, np.int64), np.array(kernel.vehicle.rollers, np.int64)
        self.joint = joint_angles(kernel.vehicle)
        self.passed, self.leads_to = np.zeros(MOST_GUARDS, np.int64), np.zeros((MOST_GUARDS, 2), np.int64)
        self.rows = np.empty((rows, columns.width))
        self.steps = np.empty((rows if keeps_steps else 1, step_width(kernel, columns)))
        self.switches = np.empty((rows, 2 + wheels))
        self.switch_axial = np.empty((rows, *self.axial.shape) if kernel.has_spins else (1, 1, 1))
        self.bytes_per_row = self.rows[0].nbytes + self.steps[0].nbytes + self.switch_axial[0].nbytes
        self.struct = self.ffi.new("omniroll_run_t *")
        self.start = self.ffi.new("omniroll_run_t *")
        start = self.start
        start.wheels, start.rollers_per_wheel = wheels, kernel.rollers_per_wheel
        start.task.patience = SWITCHES_WITHOUT_PROGRESS * wheels
        start.record.row_capacity = start.record.switch_capacity = rows
        for group, names in (ARRAYS | {"record": RECORDS}).items():
            self._point(getattr(start, group) if group else start, *names)
        if not keeps_steps:
            start.record.steps = self.ffi.NULL

    def _point(self, group: Any, *names: str) -> None:
        """Let these fields of a group point to the arrays of their names."""
        for name in names:
            kind = "long long[]" if getattr(self, name).dtype == np.int64 else "double[]"
            setattr(group, name, self.ffi.from_buffer(kind, getattr(self, name)))

    def begin(self) -> Any:
        """The struct as it is before a run."""
        self.ffi.memmove(self.struct, self.start, self.ffi.sizeof("omniroll_run_t"))
        for array in (self.core, self.core_before, self.accounts, self.inputs, self.signals):
            array.fill(0)
        return self.struct

    def make_room(self, room: int, largest: int) -> None:
        """Room for so many further rows and switches, at most ROWS; there will be at most `largest` of each."""
        record = self.struct.record
        rows, switches = record.row_count, record.switch_count
        for name, count in (("rows", rows), ("steps", rows), ("switches", switches), ("switch_axial", switches)):
            old = getattr(self, name)
            if count + room > len(old) > 1:
                grown = min(GROWTH * (count + max(room, ROWS)), max(largest, count + room))
                array = np.empty((grown, *old.shape[1:]))
                array[:count] = old[:count]
                setattr(self, name, array)
                self._point(record, name)
        record.row_capacity, record.switch_capacity = rows + room, switches + room

    def give_back(self) -> None:
        """To the runs that come; not where a long run has made the buffers large."""
        if len(self.rows) == len(self.switches) == self.first:
            self.pool.append(self)


def step_width(kernel: Kernel, columns: "Columns") -> int:
    """Numbers of a step's record: its length, its row, and the polynomial of what is integrated."""
    return 2 + NODES * (6 + kernel.wheels + columns.added)


def first_rows(kernel: Kernel, columns: "Columns") -> int:
    """How many rows a run has room for at first."""
    spins = kernel.wheels * (kernel.rollers_per_wheel - 1) if kernel.has_spins else 0
    numbers = columns.width + step_width(kernel, columns) + spins
    return min(ROWS, max(FEWEST, int(FIRST_BYTES / (8 * numbers))))


class _OfThread(threading.local):
    """The workspaces of a thread that no run has at present: what a run has written is in the cache of its core."""

    def __init__(self) -> None:
        self.of_set_and_size = lru_cache(maxsize=16)(lambda *_: [])


OF_THREAD = _OfThread()


def workspace(kernel: Kernel, columns: "Columns") -> Workspace:
    """One that no other run has, for the library that is loaded now."""
    pool = OF_THREAD.of_set_and_size(
        kernel.base, kernel.effects, kernel.sharp, kernel.vehicle.rollers, kernel.rollers_per_wheel, ROWS
    )
    while pool:
        space = pool.pop()
        if space.ffi is engine_of(kernel).ffi:
            return space
    return Workspace(kernel, columns, pool)
