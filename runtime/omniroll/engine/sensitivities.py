"""How a run depends on its start and on its numbers: deviations followed through steps, switches and what acts.

Between two events a deviation follows the variational equations (variations.py). Where a wheel passes to its next
roller, the rule of the switch is differentiated as it stands, on numbers that carry tangents, and the deviation of the
time at which it happens is in it: with the map g of the switch and the rates f,

    d+ = g' (d- + f- dt) - f+ dt,   dt = -dchi_i / chi_i'

(the saltation matrix). Rows show the motion at a fixed time, and so do their deviations. Where a current reaches or
leaves its limit the rates do not jump, and a sample comes at a fixed time: d+ = d-. Where a held value of a table
changes at a time that deviates, d+ = d- + (f- - f+) dt.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.engine.columns import Column, columns_of, stacked, start_shapes
from omniroll.engine.drive_deviations import DriveDeviations, refuse_what_is_not_followed
from omniroll.engine.runs import Task
from omniroll.engine.switching import SwitchingModel, tau
from omniroll.engine.variations import Deviations, Variations
from omniroll.errors import NoDerivativeError, OneSidedWarning
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.trajectory import Sensitivity, Trajectory
from omniroll.vehicles.state import State, by_place, by_roller

TOGETHER = 1e-9  # of the larger one: deviations that differ by less are the same
GRAZING = 1e-6  # of the fastest wheel's speed: a wheel that passes its joint more slowly grazes it


def with_sensitivities(trajectory: Trajectory, names: Sequence[str]) -> Trajectory:
    """The same trajectory, which now has the derivatives of its motion by the numbers of these names.

    Raises InvalidValueError for names that have none, and NoDerivativeError where the motion has none.
    """
    followed = Followed.along(trajectory, tuple(names))
    object.__setattr__(trajectory, "followed", followed)  # its other fields stay frozen
    return trajectory


def check_names(task: Task, names: Sequence[str]) -> None:
    """Raises InvalidValueError for names and effects that have no sensitivities."""
    plain = task.effects.kernel(task.vehicle, task.kernel.roller_model, "python")
    columns_of(names, plain, task.effects.effects)
    refuse_what_is_not_followed(task.effects.effects, plain)


@dataclass
class Followed:
    """Deviations of a run in P columns; T rows, S steps, K phases between switches.

    names   of the columns
    rows    (T, m, P) deviations of what Deviations.state names
    inputs  (S, 2 U, P) of the inputs of the steps, and of how fast these change
    phases  (K,) the row at which each phase between two switches starts
    axial   (K, P, N, n) deviations of the rollers' axial speeds there, by physical roller; None but for free rollers
    """

    names: tuple[str, ...]
    rows: np.ndarray
    inputs: np.ndarray
    phases: np.ndarray
    axial: np.ndarray | None

    @classmethod
    def along(cls, trajectory: Trajectory, names: tuple[str, ...]) -> "Followed":
        sweep = Sweep(Motion(trajectory), Columns(trajectory, names))
        sweep.run()
        return sweep.followed()

    def at(self, trajectory: Trajectory, name: str, t: ArrayLike | None) -> Sensitivity:
        """The derivatives by one of the numbers, in the rows or at times within the run."""
        column = self.names.index(validation.choice("name", name, self.names))
        motion, columns = Motion(trajectory), Columns(trajectory, self.names)
        times = trajectory.t if t is None else validation.real_array("t", t)
        y, row = (motion.y, np.arange(len(trajectory))) if t is None else trajectory.state_and_row(times)
        moved = self.rows[row][..., column]
        between = trajectory.t[row] < times
        if between.any():
            moved[between] += self.since_row(motion, columns, row[between], times[between])[..., column]
        whole = np.zeros(y.shape)
        whole[..., motion.deviations.state] = moved
        carrying = with_tangent(y, whole)
        parts = {name: motion.vector.view(whole, name) for name in ("nu", "chi", "pose")}
        spins = self._spins(motion, columns.single(column), column, carrying, row, times)
        return Sensitivity(name, times, **parts, spins=spins)

    def _spins(
        self, motion: "Motion", bound: TangentKernel, column: int, y: np.ndarray, row: np.ndarray, times: np.ndarray
    ) -> np.ndarray | None:
        """(..., N, n-1) the derivatives of the free rollers' spins in states y (..., size) that carry their own."""
        if self.axial is None:
            return None
        trajectory = motion.trajectory
        phase = np.searchsorted(self.phases, row, side="right") - 1
        first = self.phases[phase]
        axial = by_place(with_tangent(motion.axial[first], self.axial[phase, column]), trajectory.contact[first])
        start = np.zeros(y.shape)
        start[..., motion.deviations.state] = self.rows[first][..., column]
        before = motion.vector.views(with_tangent(motion.y[first], start))
        elapsed = np.where(trajectory.t[row] < times, times - trajectory.start_time, trajectory.elapsed[row])
        later = trajectory.effects.axial_later(
            bound, axial[..., 1:], before, motion.vector.views(y), elapsed - trajectory.elapsed[first]
        )
        nu, chi = motion.vector.view(y, "nu"), motion.vector.view(y, "chi")
        return tangent_of(bound.spins_from_axial(nu, chi, later))

    def since_row(self, motion: "Motion", columns: "Columns", row: np.ndarray, times: np.ndarray) -> np.ndarray:
        """(k, m, P) what the deviations have come to since the rows (k,)."""
        trajectory, variations = motion.trajectory, columns.variations(motion)
        step = np.searchsorted(trajectory.step_rows, row, side="right") - 1
        x = np.clip((times - trajectory.start_time - variations.starts[step]) / variations.lengths[step], 0, 1)
        maps = np.concatenate([variations.within(step[p], x[p]) for p in variations.chunks(len(step))])
        return applied(maps, self.rows[row], self.inputs[step])


def applied(maps: np.ndarray, deviation: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """What maps (..., m, m + 2 U + P) make of deviations (..., m, P), of inputs (..., 2 U, P) and of the numbers."""
    state, given = deviation.shape[-2], deviation.shape[-2] + inputs.shape[-2]
    return maps[..., :state] @ deviation + maps[..., state:given] @ inputs + maps[..., given:]


class Motion:
    """The rows of a run, with what its phases were given and its rates there."""

    def __init__(self, trajectory: Trajectory):
        self.trajectory = trajectory
        self.plain = trajectory.effects.kernel(trajectory.vehicle, trajectory.roller_model, "python")
        self.deviations = Deviations(trajectory.effects, self.plain)
        self.vector = self.deviations.vector
        self.y = trajectory.state_rows()

    @cached_property
    def axial(self) -> np.ndarray | None:
        """(T, N, n) axial speeds of the rollers by physical number; 0 for those in contact."""
        if not self.plain.has_spins:
            return None
        found = self.trajectory
        free = self.plain.axial_speeds(found.nu, found.chi, found.spins)
        return by_roller(np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1), found.contact)

    @cached_property
    def inputs(self) -> np.ndarray:
        """(T, U) what the rows' phases were given."""
        trajectory, shapes = self.trajectory, self.deviations.inputs
        given = {name: trajectory.drive[:, k] for k, name in enumerate(trajectory.effects.drives())}
        if "momenta" in shapes:
            given["momenta"] = self.plain.momenta(
                self.plain.axial_speeds(trajectory.nu, trajectory.chi, trajectory.spins)
            )
        return self.deviations.joined(given) if shapes else np.zeros((len(trajectory), 0))

    @cached_property
    def directions(self) -> np.ndarray:
        """(T, N) +1 or -1 where a wheel has switched before the row, else 0."""
        passed = np.diff(self.trajectory.contact, axis=0, prepend=self.trajectory.contact[:1])
        rollers = self.plain.rollers_per_wheel
        return np.where(passed % rollers == 1, -1, np.where(passed % rollers == rollers - 1, 1, 0))

    def rates_in(self, y: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(..., m) the rates of what deviates in states (..., size)."""
        return self.deviations.rates_of(self.plain, y, inputs)

    @cached_property
    def rates(self) -> np.ndarray:
        """(T, m) the same in the rows."""
        return self.rates_in(self.y, self.inputs)


class Columns:
    """The columns of a run: what each of its numbers moves; before them `others`, in which no number deviates."""

    def __init__(self, trajectory: Trajectory, names: tuple[str, ...], others: int = 0):
        self.effects = trajectory.effects.effects
        self.plain = trajectory.effects.kernel(trajectory.vehicle, trajectory.roller_model, "python")
        self.columns: tuple[Column, ...] = (Column(""),) * others + columns_of(names, self.plain, self.effects)
        shapes = {n: value.shape for n, value in zip(self.plain.constant_names, self.plain.constants, strict=True)}
        self.constants = stacked(self.columns, lambda column: column.constants, shapes)
        self.start = stacked(self.columns, lambda column: column.start, start_shapes(self.plain))
        wheels = self.plain.wheels
        self.signals = stacked(
            self.columns,
            lambda column: column.signals,
            {key: self.effects[key[0]].shape_of(key[1], wheels) for c in self.columns for key in c.signals},
        )

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(column.name for column in self.columns)

    @cached_property
    def sizes(self) -> np.ndarray:
        """(P,) the sizes of the numbers."""
        return np.array([column.size for column in self.columns])

    @cached_property
    def kernel(self) -> TangentKernel:
        """The functions on (P,) states, each with the deviation of its own number."""
        return TangentKernel(self.plain, self.constants, (len(self),))

    def single(self, column: int) -> TangentKernel:
        """The functions with the deviation of one number, for states of any leading axes."""
        return TangentKernel(self.plain, {name: tangents[column] for name, tangents in self.constants.items()})

    def variations(self, motion: Motion) -> Variations:
        return Variations(motion.trajectory, self.plain, self.constants, len(self), motion.deviations, motion.inputs)


@dataclass(frozen=True)
class Phase:
    """What a phase between two switches starts with, on numbers that carry the deviations of P columns.

    elapsed  in s
    contact  (N,) the rollers in contact
    y        (P, size)
    axial    (P, N, n) axial speeds by physical roller; None but for free rollers
    """

    elapsed: float
    contact: np.ndarray
    y: np.ndarray
    axial: np.ndarray | None

    def free(self) -> np.ndarray:
        """(P, N, n-1) of the rollers that are free."""
        return State(self.y, self.y, self.y, self.contact, self.axial).free_axial()


@dataclass(frozen=True)
class Instant:
    """A state of the run at a switch: y (size,) and the rates (m,) of what deviates."""

    elapsed: float
    y: np.ndarray
    rates: np.ndarray


class Sweep:
    """One walk along a run, from its start to its end, with P deviations."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns = motion, columns
        self.trajectory, self.deviations, self.vector = motion.trajectory, motion.deviations, motion.vector
        self.kernel, self.effects = columns.kernel, motion.trajectory.effects
        self.model = SwitchingModel(self.kernel, self.trajectory.switching)
        self.drives = DriveDeviations(columns.effects, self.kernel, columns.signals, self.trajectory.start_time)
        size, given = len(self.deviations.state), self.deviations.input_size
        self.rows = np.zeros((len(self.trajectory), size, len(columns)))
        self.inputs = np.zeros((len(self.trajectory.step_rows), 2 * given, len(columns)))
        self.phases: list[int] = []
        self.axial: list[np.ndarray] = []

    def followed(self) -> Followed:
        axial = np.array(self.axial) if self.motion.plain.has_spins else None
        return Followed(self.columns.names, self.rows, self.inputs, np.array(self.phases), axial)

    def run(self) -> None:
        motion, trajectory = self.motion, self.trajectory
        step_of = {int(row): step for step, row in enumerate(trajectory.step_rows)}
        moved = self.rows[0] = self._begin(0, self._start())
        maps = self._maps()
        for row in range(len(trajectory) - 1):
            if row in step_of:
                step = step_of[row]
                self.inputs[step] = self._inputs(row, moved)
                moved = moved + applied(next(maps), moved, self.inputs[step])
            elif motion.directions[row + 1].any():
                moved = self._begin(row + 1, self._switched(row, moved))
            elif (times := self.drives.jump(trajectory.elapsed[row + 1])) is not None:
                moved = moved + (motion.rates[row] - motion.rates[row + 1])[:, None] * times
            self.rows[row + 1] = moved

    def _maps(self) -> Iterator[np.ndarray]:
        """The maps of the steps, one after the other."""
        if len(self.trajectory.step_rows):
            variations = self.columns.variations(self.motion)
            for steps in variations.chunks():
                yield from variations.maps(steps)

    def _begin(self, row: int, phase: Phase) -> np.ndarray:
        """(m, P) the deviations of a phase that starts in this row."""
        self.phase = phase
        self.phases.append(row)
        if "momenta" in self.deviations.inputs:
            self.momenta = tangent_of(self.kernel.momenta(phase.free()))
        if phase.axial is not None:
            self.axial.append(tangent_of(phase.axial))
        return self._deviations(phase.y)

    # Numbers that carry deviations

    def _carrying(self, y: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """(P, size) y with deviations (m, P)."""
        whole = np.zeros((moved.shape[1], self.vector.size))
        whole[:, self.deviations.state] = moved.T
        return with_tangent(y, whole)

    def _deviations(self, y: np.ndarray) -> np.ndarray:
        """The inverse of `_carrying`."""
        return tangent_of(y)[:, self.deviations.state].T

    def _state(self, y: np.ndarray, contact: np.ndarray, axial: np.ndarray | None) -> State:
        return State(*(self.vector.view(y, name) for name in ("nu", "chi", "pose")), contact, axial)

    def _whole(self, y: np.ndarray, state: State, bound: Kernel) -> np.ndarray:
        """y (..., size) of a state in which what the effects integrate begins anew; what they have done stays."""
        whole = np.array(np.broadcast_to(y, (*state.nu.shape[:-1], self.vector.size)), state.nu.dtype)
        parts = {"nu": state.nu, "chi": state.chi, "pose": state.pose} | self.effects.initial(bound, state)
        for name, value in parts.items():
            whole[..., self.vector.slices[name]] = value.reshape(*value.shape[: state.nu.ndim - 1], -1)
        return whole

    def _later(self, phase: Phase, y: np.ndarray, elapsed: np.ndarray) -> np.ndarray | None:
        """(P, N, n) axial speeds by physical roller in a later state y (P, size) of a phase."""
        if phase.axial is None:
            return None
        before, after = self.vector.views(phase.y), self.vector.views(y)
        free = self.effects.axial_later(self.kernel, phase.free(), before, after, elapsed)
        return by_roller(np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1), phase.contact)

    def _start(self) -> Phase:
        trajectory, given, lead = self.trajectory, self.columns.start, (len(self.columns),)
        nu, chi, pose, spins = (
            None if (own := getattr(trajectory, name)) is None
            else with_tangent(own[0], np.broadcast_to(given.get(name, 0.0), (*lead, *own.shape[1:])))
            for name in ("nu", "chi", "pose", "spins")
        )  # fmt: skip
        state = State(nu, chi, pose, trajectory.contact[0])
        if spins is not None:
            free = self.kernel.axial_speeds(nu, chi, spins)
            state = replace(state, axial=np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1))
        y = self._whole(self.motion.y[0], state, self.kernel)
        return Phase(trajectory.elapsed[0], state.contact, y, state.axial)

    def _inputs(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(2 U, P) deviations of what the step from this row is given."""
        shapes, trajectory = self.deviations.inputs, self.trajectory
        if not shapes:
            return np.zeros((0, len(self.columns)))
        elapsed, length = trajectory.elapsed[row], trajectory.elapsed[row + 1] - trajectory.elapsed[row]
        found = {}
        if trajectory.drive is not None:
            while self.drives.next_time() <= elapsed:
                self.drives.pass_time(elapsed, self._carrying(self.motion.y[row], moved)[:, :3])
            names = self.effects.drives()
            drive = dict(zip(names, trajectory.drive[row], strict=True))
            slopes = dict(zip(names, (trajectory.drive[row + 1] - trajectory.drive[row]) / length, strict=True))
            found = self.drives.after(elapsed, drive, slopes)
        if "momenta" in shapes:
            found["momenta"] = self.momenta, np.zeros_like(self.momenta)
        values, slopes = ({name: found[name][k] for name in shapes} for k in (0, 1))
        return np.concatenate([self.deviations.joined(values), self.deviations.joined(slopes)], axis=-1).T

    # Switches

    def _instant(self, row: int) -> Instant:
        return Instant(self.trajectory.elapsed[row], self.motion.y[row], self.motion.rates[row])

    def _switched(self, row: int, moved: np.ndarray) -> Phase:
        """The phase after the switch between this row and the next.

        Wheels that switch together still do where a number grows by its own size, or they do not.
        """
        directions, before = self.motion.directions[row + 1], self._instant(row)
        wheels = np.flatnonzero(directions)
        times = self._time_deviations(before, moved, wheels)
        parted = self.columns.sizes * np.ptp(times, axis=0) > tau(self.trajectory.t[row], before.elapsed)
        if not parted.any():
            return self._passed(self.phase, before, self._instant(row + 1), moved, directions, times[0])
        if self.trajectory.switching == "impact" and self.kernel.roller_model != "massless":
            names = ", ".join(np.array(self.columns.names)[parted])
            reason = f"they switch together, and impacts one after the other make another motion; by {names}"
            raise self._no_derivative(before, reason, wheels)
        return self._one_after_the_other(row, moved, times)

    def _no_derivative(self, at: Instant, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return NoDerivativeError(
            reason, t=float(self.trajectory.start_time + at.elapsed), wheels=tuple(wheels.tolist())
        )

    def _time_deviations(self, at: Instant, moved: np.ndarray, wheels: np.ndarray) -> np.ndarray:
        """(W, P) by how much the times deviate at which the wheels (W,) are at their joints."""
        speeds = at.rates[3 : 3 + self.kernel.wheels]
        slow = wheels[np.abs(speeds[wheels]) <= GRAZING * np.abs(speeds).max()]
        if len(slow):
            reason = "the wheel grazes its joint, so that a change however small lets it pass or turn back"
            raise self._no_derivative(at, reason, slow)
        return -moved[3 + wheels] / speeds[wheels, None]

    def _passed(
        self,
        phase: Phase,
        before: Instant,
        after: Instant,
        moved: np.ndarray,
        directions: np.ndarray,
        times: np.ndarray,
    ) -> Phase:
        """The phase after wheels have switched as one, at a time that deviates by `times` (P,)."""
        reached = self._carrying(before.y, moved + before.rates[:, None] * times)
        axial = self._later(phase, reached, with_tangent(before.elapsed - phase.elapsed, times))
        state = self.model.apply(self._state(reached, phase.contact, axial), directions)
        switched = self._whole(after.y, state, self.kernel)
        left = Phase(after.elapsed, state.contact, switched, state.axial)
        y = self._carrying(after.y, self._deviations(switched) - after.rates[:, None] * times)
        return replace(left, y=y, axial=self._later(left, y, with_tangent(0.0, -times)))

    def _one_after_the_other(self, row: int, moved: np.ndarray, times: np.ndarray) -> Phase:
        """The same where the wheels switch in another order, or not together, in the motions beside the run.

        Each column has the order in which its wheels switch when its number grows. With a number that falls they switch
        in the opposite order; a warning says so where that makes a difference.
        """
        wheels = np.flatnonzero(self.motion.directions[row + 1])
        orders = np.argsort(times, axis=0, kind="stable")
        rising, falling = [tuple(order) for order in orders.T], [tuple(order[::-1]) for order in orders.T]
        found = {order: self._in_order(row, moved, wheels[list(order)]) for order in {*rising, *falling}}
        picked, opposite = [found[order] for order in rising], [found[order] for order in falling]
        own, other = (
            np.stack([self._deviations(p.y)[:, k] for k, p in enumerate(of)], axis=1) for of in (picked, opposite)
        )
        parted = np.abs(own - other).max(axis=0) > TOGETHER * np.abs(own).max(axis=0)
        if parted.any():
            names = ", ".join(np.array(self.columns.names)[parted])
            at = f"t = {float(self.trajectory.t[row])!r}, wheels {', '.join(map(str, wheels))}"
            text = f"the wheels switch together, at {at}: the derivatives by {names} are those for numbers that grow"
            warnings.warn(OneSidedWarning(text), stacklevel=2)
        y = np.stack([p.y[k] for k, p in enumerate(picked)])
        axial = None if picked[0].axial is None else np.stack([p.axial[k] for k, p in enumerate(picked)])
        return replace(picked[0], y=y, axial=axial)

    def _in_order(self, row: int, moved: np.ndarray, wheels: np.ndarray) -> Phase:
        """The phase after wheels have switched one after the other, in all columns."""
        directions, after = self.motion.directions[row + 1], self._instant(row + 1)
        phase, at, plain = self.phase, self._instant(row), SwitchingModel(self.motion.plain, self.trajectory.switching)
        axial = None if self.motion.axial is None else self.motion.axial[row]
        state = self._state(at.y, phase.contact, axial)
        for k, wheel in enumerate(wheels):
            alone = np.where(np.arange(len(directions)) == wheel, directions, 0)
            times = self._time_deviations(at, moved, np.array([wheel]))[0]
            state = plain.apply(state, alone)
            following = after if k == len(wheels) - 1 else self._between(at, state, row)
            phase = self._passed(phase, at, following, moved, alone, times)
            moved, at = self._deviations(phase.y), following
        return phase

    def _between(self, at: Instant, state: State, row: int) -> Instant:
        """The instant between two switches of one time."""
        y = self._whole(at.y, state, self.motion.plain)
        inputs = self.motion.inputs[row]
        if "momenta" in self.deviations.inputs:
            given = self.deviations.views(inputs) | {"momenta": self.motion.plain.momenta(state.free_axial())}
            inputs = self.deviations.joined(given)
        return Instant(at.elapsed, y, self.motion.rates_in(y, inputs))
