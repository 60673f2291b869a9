"""How a run depends on its start and on its numbers: deviations followed through steps, switches and what acts.

Between two events a deviation follows the variational equations (csrc/deviations). How it passes a switch is in
passages.py. Rows show the motion at a fixed time, and so do their deviations. Where a current reaches or leaves its
limit the rates do not jump, and a sample comes at a fixed time: d+ = d-. Where a held value of a table changes at a
time that deviates, d+ = d- + (f- - f+) dt.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.engine.bearing_modes import FREE
from omniroll.engine.compiled_variations import CompiledVariations
from omniroll.engine.contact_modes import MODES
from omniroll.engine.drive_deviations import DriveDeviations, refuse_what_is_not_followed
from omniroll.engine.events_beside import TOGETHER, no_derivative
from omniroll.engine.motion import Columns, Motion, columns_beside
from omniroll.engine.passages import Instant, Passage, Phase, grazing
from omniroll.engine.runs import Task
from omniroll.engine.sticking import Sticking
from omniroll.engine.switching import SwitchingModel, tau
from omniroll.errors import InvalidValueError, NoDerivativeError, OneSidedWarning
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.trajectory import Sensitivity, Trajectory
from omniroll.vehicles.checks import refuse_kinds, refuse_moving_rows, refuse_two_rows
from omniroll.vehicles.state import State


def with_sensitivities(trajectory: Trajectory, names: Sequence[str]) -> Trajectory:
    """The same trajectory, which now has the derivatives of its motion by the numbers of these names.

    Raises InvalidValueError for names that have none, NoDerivativeError where the motion has none, and
    KernelsMissingError where the library that follows them is neither there nor can be compiled.
    """
    columns = columns_beside(trajectory, tuple(names))
    refuse_what_is_not_followed(trajectory.effects.effects, columns.plain)
    sweep = Sweep(Motion(trajectory), columns)
    sweep.run()
    object.__setattr__(trajectory, "followed", sweep.followed())  # its other fields stay frozen
    return trajectory


def check_names(task: Task, names: Sequence[str]) -> None:
    """Raises InvalidValueError for names and effects that have no sensitivities."""
    refuse_two_rows(task.vehicle, "sensitivities", names, "compare runs with changed numbers, or take rows = 1")
    refuse_moving_rows(task.vehicle, "sensitivities", names, "compare runs with changed numbers")
    refuse_kinds(task.vehicle, "sensitivities", names, "compare runs with changed numbers")
    plain = task.effects.kernel(task.vehicle, task.kernel.roller_model, "python")
    if not all(isinstance(name, str) for name in names):
        raise InvalidValueError("sensitivities", names, "must be a sequence of names")
    task.effects.made(Columns, plain, tuple(names), 0)
    refuse_what_is_not_followed(task.effects.effects, plain)


@dataclass(frozen=True)
class Look:
    """Deviations `moved` (..., m, P) at some times (...), or in the rows; y (..., size), and the row before each."""

    motion: Motion
    columns: Columns
    times: np.ndarray
    rows: bool
    y: np.ndarray
    row: np.ndarray
    moved: np.ndarray


@dataclass
class Followed:
    """Deviations of a run in P columns; T rows, S steps, K phases between switches.

    names   of the columns
    rows    (T, m, P) deviations of what Deviations.state names
    inputs  (S, F, P) of what drives the steps: inputs, how fast these change, and numbers
    phases  (K,) the row at which each phase between two switches starts
    axial   (K, N n, P) deviations of the rollers' axial speeds there, by physical roller; None but for free rollers
    look, compiled  what was computed last, for whoever asks again
    """

    names: tuple[str, ...]
    rows: np.ndarray
    inputs: np.ndarray
    phases: np.ndarray
    axial: np.ndarray | None
    look: Look | None = None
    compiled: CompiledVariations | None = None

    def at(self, trajectory: Trajectory, name: str, t: ArrayLike | None) -> Sensitivity:
        """The derivatives by one of the numbers, in the rows or at times within the run."""
        column = self.names.index(validation.choice("name", name, self.names))
        look = self.look_at(trajectory, t)
        motion, moved, phase = look.motion, look.moved[..., column], look.motion.phase_of(look.row)
        whole = motion.whole(moved)
        parts = {name: motion.vector.view(whole, name) for name in ("nu", "chi", "pose")}
        spins = None
        if self.axial is not None:
            start, axial = self.rows[self.phases[phase]][..., column], self.axial[phase][..., column]
            axial = axial.reshape(*phase.shape, motion.plain.wheels, motion.plain.rollers_per_wheel)
            bound, y = look.columns.single(column), with_tangent(look.y, whole)
            spins = tangent_of(motion.later_spins(bound, y, look.row, look.times, start, axial))
        return Sensitivity(name, look.times, **parts, spins=spins)

    def look_at(self, trajectory: Trajectory, t: ArrayLike | None) -> Look:
        """All deviations in the rows or at times within the run. The last look is kept: many names ask for one."""
        times = trajectory.t if t is None else validation.real_array("t", t)
        look = self.look
        if look is not None and look.rows == (t is None) and np.array_equal(look.times, times):
            return look
        motion, columns = Motion(trajectory), columns_beside(trajectory, self.names)
        y, row = (motion.y, np.arange(len(trajectory))) if t is None else trajectory.state_and_row(times)
        moved = self.moved_at(motion, columns, row, times)
        self.look = Look(motion, columns, times.copy(), t is None, y, row, moved)
        return self.look

    def __getstate__(self) -> dict:
        return vars(self) | {"look": None, "compiled": None}

    def moved_at(self, motion: Motion, columns: Columns, row: np.ndarray, times: np.ndarray) -> np.ndarray:
        """(..., m, P) all deviations at times (...) in the rows (...) or between them and the next ones."""
        trajectory, moved = motion.trajectory, np.array(self.rows[row])  # a copy: at one time alone it would be a view
        between = trajectory.t[row] < times
        if not between.any():
            return moved
        if self.compiled is None:
            sticking = Sticking.of(motion, columns)
            self.compiled = CompiledVariations(motion, columns, self.rows, self.inputs, self.axial, sticking)
        step = np.searchsorted(trajectory.step_rows, row[between], side="right") - 1
        first = trajectory.step_rows[step]
        starts = trajectory.elapsed[first]
        x = np.clip((times[between] - trajectory.start_time - starts) / (trajectory.elapsed[first + 1] - starts), 0, 1)
        moved[between] += self.compiled.since_rows(step, motion.phase_of(first), x)
        return moved


class Sweep:
    """One walk along a run, from its start to its end, with P deviations."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns = motion, columns
        self.trajectory, self.deviations = motion.trajectory, motion.deviations
        self.size = len(self.deviations.state)
        self.moving = self.deviations.moving
        given = self.deviations.input_size + self.moving
        self.rows = np.zeros((len(self.trajectory), self.size, len(columns)))
        numbers = np.zeros((len(columns.numbered), len(columns)))
        numbers[np.arange(len(columns.numbered)), columns.numbered] = 1.0
        self.inputs = np.zeros((len(self.trajectory.step_rows), given + len(numbers), len(columns)))
        self.inputs[:, given:] = numbers
        plain = self.motion.plain
        shape = (len(self.motion.phases), plain.wheels * plain.rollers_per_wheel, len(columns))
        self.axial = np.zeros(shape) if plain.has_spins else None
        self.sticking = Sticking.of(motion, columns)
        self.compiled = CompiledVariations(motion, columns, self.rows, self.inputs, self.axial, self.sticking)

    def followed(self) -> Followed:
        columns = self.columns.names
        return Followed(columns, self.rows, self.inputs, self.motion.phases, self.axial, compiled=self.compiled)

    def run(self) -> None:
        """Fill the rows: in C from one row to the next at which something is left to Python, and up to switches that
        are not plain."""
        last, row, given = len(self.trajectory) - 1, 0, 0
        self._put_start()
        stops = np.append(np.flatnonzero(self._stops()), last)
        samples = np.append(np.flatnonzero(self._samples()), last)
        while row < last:
            end = int(stops[np.searchsorted(stops, row, side="right")])
            if self.motion.starts_step[row]:
                self._enter(row, self.rows[row])
            elif row + 1 in self.switched and self.sticking is not None:
                self.sticking.refuse_rests(row)
            if row >= given:
                given = int(samples[np.searchsorted(samples, row, side="right")])
                self._give(row, given)
            phase = int(self.motion.phase_of(row))
            reached = self.compiled.follow(row, end, phase, knot=self._knot(row))
            if reached < end and not self.motion.starts_step[reached]:
                if reached + 1 not in self.switched:
                    self.sticking.refuse(reached, self.compiled.why())
                if self.sticking is not None:
                    self.sticking.refuse_rests(reached)
                self._pass_together(reached)
                reached += 1
            row = reached
            self._phase_begun(row)

    def _stops(self) -> np.ndarray:
        """(T,) bool: rows at which something is left to Python: samples, and where rates jump at times that deviate."""
        found, trajectory = self._samples(), self.trajectory
        if self.sticking is not None:
            found[self.sticking.rests_at_switches] = True
        if self.moving:
            found[:-1] |= self.drives.jumps(trajectory.elapsed[1:]) & ~self.motion.starts_step[:-1]
        return found

    def _knot(self, row: int) -> np.ndarray | None:
        """(P,) by how much the time deviates at which a drive jumps behind a row; None where none does."""
        if not self.moving or self.motion.starts_step[row]:
            return None
        return self.drives.jump(self.trajectory.elapsed[row + 1])

    def _samples(self) -> np.ndarray:
        """(T,) bool: rows at which samples are due, up to which it is known what drives give."""
        found, trajectory = np.zeros(len(self.trajectory), bool), self.trajectory
        if self.moving and len(trajectory.step_rows):
            first = trajectory.step_rows
            times = self.drives.samples(trajectory.elapsed[-1])
            found[first[np.unique(np.searchsorted(trajectory.elapsed[first], times)).clip(max=len(first) - 1)]] = True
        return found

    def _phase_begun(self, row: int) -> None:
        """The walk has come to a row: for those who look at phases."""

    def _enter(self, row: int, moved: np.ndarray) -> None:
        """A step begins with deviations (m, P). Samples are due."""
        if self.compiled.turns[row]:  # which C has not passed
            self.sticking.refuse(row, self.compiled.why())
        while self.moving and self.drives.next_time() <= self.trajectory.elapsed[row]:
            self.drives.pass_time(self.trajectory.elapsed[row], with_tangent(self.motion.y[row, :3], moved[:3].T))

    @cached_property
    def switched(self) -> set[int]:
        return set(self.motion.switched.tolist())

    def _put_start(self) -> None:
        places, given, plain = self.deviations.places, self.columns.start, self.motion.plain
        if plain.slips:
            self.rows[0], axial = self._start()
            if axial is not None:
                self.axial[0] = axial
            return
        for name in ("nu", "chi", "pose"):
            if name in given:
                self.rows[0, places[name]] = given[name].T
        still = np.zeros((len(self.columns), plain.wheels, plain.rollers_per_wheel - 1))
        self.compiled.begin(0, given.get("spins", still) if plain.has_spins else None)

    def _pass_together(self, row: int) -> None:
        """A switch of several wheels, or of one that grazes its joint."""
        self.phase = int(self.motion.phase_of(row))
        self.began = self.rows[self.motion.phases[self.phase]]
        found = self._passed_apart(row, self.rows[row])
        if found is None:
            self.compiled.follow(row, row + 1, self.phase, as_one=True)
            return
        self.rows[row + 1], axial = found
        if axial is not None:
            self.axial[self.phase + 1] = axial
        self.compiled.begin(self.phase + 1)

    def _start(self) -> tuple[np.ndarray, np.ndarray | None]:
        """(m, P) and (N n, P) the deviations at the start."""
        trajectory, given, lead = self.trajectory, self.columns.start, (len(self.columns),)
        nu, chi, pose, spins = (
            None if (own := getattr(trajectory, name)) is None
            else with_tangent(own[0], np.broadcast_to(given.get(name, 0.0), (*lead, *own.shape[1:])))
            for name in ("nu", "chi", "pose", "spins")
        )  # fmt: skip
        kernel, state = self.columns.kernel, State(nu, chi, pose, trajectory.contact[:1])
        if spins is not None:
            state = state.with_free_axial(kernel.axial_speeds(nu, chi, spins))
        state = self._begun(state)
        moved = self.passage.deviation(self.passage.whole(self.motion.y[0], state, kernel)).T
        own = None if spins is None else tangent_of(state.axial).reshape(len(self.columns), -1).T
        return moved if self.sticking is None else self.sticking.began(moved), own

    def _begun(self, state: State) -> State:
        """The state at the start where wheels may slip: at the rates and the spins that the ground's effect has."""
        columns, effects = self.columns, self.trajectory.effects
        state = effects.begin(columns.kernel, state)
        for (_, name), moved in columns.signals.items():
            if name == "wheel_rates":
                state = replace(state, rates=with_tangent(state.rates, moved))
            elif name == "contact_spins":
                state = state.with_contact_axial(with_tangent(state.contact_axial(), moved))
        return state

    def _give(self, row: int, end: int) -> None:
        """Put down what drives give in the steps from this row up to another: until then no sample is due."""
        trajectory = self.trajectory
        first, last = np.searchsorted(trajectory.step_rows, (row, end))
        if not self.moving or first == last:
            return
        rows = trajectory.step_rows[first:last]
        elapsed = trajectory.elapsed[rows]
        names = [name for name in trajectory.effects.drives() if name in self.deviations.inputs and name not in MODES]
        drive = {name: trajectory.drive[rows, k] for k, name in enumerate(names)}
        length = (trajectory.elapsed[rows + 1] - elapsed)[:, None]
        slopes = {name: (trajectory.drive[rows + 1, k] - drive[name]) / length for k, name in enumerate(names)}
        found = self.drives.after(elapsed, drive, slopes)
        found |= {} if self.sticking is None else self.sticking.given(rows)
        for k, name in enumerate(names):
            width = self.motion.plain.wheels
            for own, start in zip(found[name], (0, self.deviations.input_size), strict=True):
                self.inputs[first:last, start + k * width : start + (k + 1) * width] = own.swapaxes(1, 2)
        if self.deviations.spins_stick:
            given = found[FREE][0]
            places = self.deviations.places[FREE].ravel() - self.size
            self.inputs[first:last, places] = given.reshape(len(rows), len(self.columns), -1).swapaxes(1, 2)

    @cached_property
    def drives(self) -> DriveDeviations:
        return DriveDeviations(self.columns, self.trajectory.start_time)

    # Switches

    @cached_property
    def passage(self) -> Passage:
        return Passage(self.motion, self.columns.kernel)

    def _instant(self, row: int) -> Instant:
        motion = self.motion
        return Instant(self.trajectory.elapsed[[row]], motion.y[[row]], motion.rates[[row]])

    def _passed_apart(self, row: int, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray | None] | None:
        """(m, P) and (N n, P) the deviations after the switch between this row and the next, where the wheels do not
        switch as one in the motions beside the run; None where they do."""
        before, wheels = self._instant(row), np.flatnonzero(self.motion.directions[row + 1])
        times = self._time_deviations(before, moved, wheels)
        apart = self.columns.sizes * np.ptp(times, axis=0)
        parted = apart > tau(self.trajectory.t[row], self.trajectory.elapsed[row])
        if not parted.any():
            return None
        self._refuse_impacts(before, parted, wheels)
        if self.sticking is not None:
            self.sticking.refuse_orders(row, wheels)
        return self._one_after_the_other(row, moved, times)

    def _refuse_impacts(self, before: Instant, parted: np.ndarray, wheels: np.ndarray) -> None:
        plain = self.motion.plain
        if self.trajectory.switching == "impact" and plain.roller_model != "massless" and not plain.slips:
            names = ", ".join(np.array(self.columns.names)[parted])
            reason = f"they switch together, and impacts one after the other make another motion; by {names}"
            raise self._no_derivative(before, reason, wheels)

    def _no_derivative(self, at: Instant, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return no_derivative(self.trajectory.start_time + at.elapsed[0], reason, wheels)

    def _time_deviations(self, at: Instant, moved: np.ndarray, wheels: np.ndarray) -> np.ndarray:
        """(W, P) by how much the times deviate at which the wheels (W,) are at their joints."""
        speeds = at.rates[0, self.deviations.places["chi"]]
        slow = wheels[grazing(speeds)[wheels]]
        if len(slow):
            reason = "the wheel grazes its joint, so that a change however small lets it pass or turn back"
            raise self._no_derivative(at, reason, slow)
        return -moved[3 + wheels] / speeds[wheels, None]

    def _one_after_the_other(
        self, row: int, moved: np.ndarray, times: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """The same where the wheels switch in another order, or not together, in the motions beside the run.

        Each column has the order in which its wheels switch when its number grows. With a number that falls they switch
        in the opposite order; a warning says so where that makes a difference.
        """
        wheels = np.flatnonzero(self.motion.directions[row + 1])
        orders = np.argsort(times, axis=0, kind="stable")
        rising, falling = [tuple(order) for order in orders.T], [tuple(order[::-1]) for order in orders.T]
        found = {order: self._in_order(row, moved, wheels[list(order)]) for order in {*rising, *falling}}
        own, other = (
            np.stack([self.passage.deviation(found[order].y)[k] for k, order in enumerate(of)], axis=1)
            for of in (rising, falling)
        )
        parted = np.abs(own - other).max(axis=0) > TOGETHER * np.abs(own).max(axis=0)
        if parted.any():
            names = ", ".join(np.array(self.columns.names)[parted])
            at = f"t = {float(self.trajectory.t[row])!r}, wheels {', '.join(map(str, wheels))}"
            text = f"the wheels switch together, at {at}: the derivatives by {names} are those for numbers that grow"
            warnings.warn(OneSidedWarning(text), stacklevel=2)
        if self.axial is None:
            return own, None
        return own, np.stack([tangent_of(found[order].axial[k]).ravel() for k, order in enumerate(rising)], axis=1)

    def _in_order(self, row: int, moved: np.ndarray, wheels: np.ndarray) -> Phase:
        """The phase after wheels have switched one after the other, in all columns."""
        motion, first = self.motion, self.motion.phases[self.phase]
        directions, after = motion.directions[row + 1], self._instant(row + 1)
        plain = SwitchingModel(motion.plain, self.trajectory.switching)
        phase, at = self._phase_from(first), self._instant(row)
        axial = None if motion.axial is None else motion.axial[row]
        state = self.passage.state(motion.y[row], self.trajectory.contact[row], axial)
        for k, wheel in enumerate(wheels):
            alone = np.where(np.arange(len(directions)) == wheel, directions, 0)
            times = self._time_deviations(at, moved, np.array([wheel]))[0]
            state = plain.apply(state, alone)
            following = after if k == len(wheels) - 1 else self._between(at, state, row)
            phase = self.passage.passed(phase, at, following, moved.T, alone[None], times)
            moved, at = self.passage.deviation(phase.y).T, following
        return phase

    def _phase_from(self, row: int) -> Phase:
        """The present phase, which has started in this row, on numbers that carry its deviations."""
        motion, trajectory = self.motion, self.trajectory
        axial = None
        if self.axial is not None:
            moved = self.axial[self.phase].T.reshape(len(self.columns), motion.plain.wheels, -1)
            axial = with_tangent(motion.axial[row], moved)
        y = self.passage.carrying(motion.y[[row]], self.began.T)
        return Phase(trajectory.elapsed[[row]], trajectory.contact[[row]], y, axial)

    def _between(self, at: Instant, state: State, row: int) -> Instant:
        """The instant between two switches of one time."""
        y = self.passage.whole(at.y[0], state, self.motion.plain)
        inputs = self.motion.inputs[row]
        if "momenta" in self.deviations.inputs:
            given = self.deviations.views(inputs) | {"momenta": self.motion.plain.momenta(state.free_axial())}
            inputs = self.deviations.joined(given)
        return Instant(at.elapsed, y[None], self.motion.rates_in(y, inputs, np.array(row))[None])
