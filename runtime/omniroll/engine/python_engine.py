"""The Python engine: phases by the integrator, switches by the switching model. Small, and meant to be read.

Friction that slips and sticks is in time_stepping.py."""

import warnings
from dataclasses import replace

import numpy as np

from omniroll.engine.dop853 import compensated_sum
from omniroll.engine.integrate import Phase, PhaseIntegrator, StepFailedError, StepTooSmallError
from omniroll.engine.outlook import FIRST, outlook_of
from omniroll.engine.python_run import NUMBER, PythonRun
from omniroll.engine.runs import SWITCHES_WITHOUT_PROGRESS, TOO_MANY_ROWS, Task, least_speed, speed_scale, state_of
from omniroll.engine.stiffness import TO_CHANGE, blamed
from omniroll.engine.switching import EPS, SwitchingModel, outward, tau
from omniroll.kernels.kernel import Flow

SAFETY = 0.5  # local errors may add up to this part of the accuracy
STEPS_PER_PHASE = 10  # roughly, for the share of one step in the error
SLOW = 1e-6  # of the fastest wheel's speed: only slower wheels are asked whether they rest
ROUNDINGS = 16  # inputs of the drives that differ by less are the same
NUMBERS_PER_STEP = 12  # that a step keeps for each of the state: those of its polynomial and of its row
MOST_STEPS = 4096  # between two looks ahead
MANY_STEPS, LOOKS = 1e5, 3  # left at the third look or later: many minutes at some ms each, of which a word is said
CHATTER = 1e-6  # of pi/n: where no wheel turns by more, switches are no progress


class Run(PythonRun):
    """One simulation with one tolerance, from one switch or event to the next."""

    def __init__(self, task: Task, tolerance: float):
        super().__init__(task, tolerance)
        vehicle, vector = self.kernel.vehicle, self.acting.state_vector
        self.model = SwitchingModel(self.kernel, task.switching)
        self.added = np.zeros(vector.size - vector.plain)  # what the effects integrate
        self._start_added()
        of_nu, of_chi = np.full(3, least_speed(task, tolerance)), np.full(vehicle.wheels, self.model.joint)
        of_pose = [vehicle.platform_radius, vehicle.platform_radius, 1.0]
        scale = np.concatenate([of_nu, of_chi, of_pose, vector.scale_of_added(self.kernel, speed_scale(task))])
        passed = np.abs(self.kernel.wheel_speeds(self.state.nu)).max() * task.duration / (2 * self.model.joint)
        allowed = SAFETY * tolerance / (STEPS_PER_PHASE * (1 + passed))  # local errors add up, as the vehicle starts
        self.integrator = PhaseIntegrator(vehicle.wheels, self.model.joint, scale, allowed)
        self.integrator.watch = self._is_ended
        self.carry = 0.0  # what the rounding of the time since the start has left over
        numbers = scale.size * NUMBERS_PER_STEP + self.kernel.wheels * self.kernel.rollers_per_wheel
        self.bytes_per_row = NUMBER * numbers
        self.outlook = outlook_of(task.duration, self.bytes_per_row, task.memory, task.room)
        self.next_look, self.is_named = FIRST, False
        self.phases = 0
        self.flow: Flow | None = None
        self.phase_start, self.slopes = 0.0, 0.0  # elapsed where what acts is from; slopes of the drives' inputs
        self.anchor, self.idle_switches, self.turned = 0.0, 0, 0.0

    def simulate(self) -> None:
        self._pass_events()
        directions = self._due_at_once()
        while True:
            if directions.any():
                self._switch(directions)
                directions = self._due_at_once()
            elif self.elapsed >= self.task.duration:
                return
            else:
                self._pass_events()
                directions = self._phase()

    def _pass_events(self) -> None:
        """What happens at this instant beside switches: times that have come, guards that are passed at once.

        A row shows what acts from now on: the first row of all, and one where that is not what acted before.
        """
        while True:
            if self.elapsed >= self.acting.next_time():
                self.acting.pass_time(self.elapsed, self.state)
                continue
            self._ask()
            passed = self.guards.beyond(0.0, self._y()) if len(self.guards) else np.zeros(0, bool)
            if not passed.any():
                break
            self._watch(None)
            self.acting.pass_guards(passed)
        slopes, self.slopes = self.slopes, self.acting.drive(1.0) - self.acting.drive(0.0)
        drive = self.acting.drive(0.0)
        if not self.rows.y:
            self._add_row()
            return
        last = self.rows.drive[-1]
        sizes = np.abs(last) + np.abs(drive) + np.abs(slopes * self.elapsed)
        if (np.abs(drive - last) > ROUNDINGS * EPS * sizes).any():
            self._add_row()

    def _ask(self) -> None:
        """What acts from now on: the rates and what ends the phase."""
        self.flow, self.guards = self.acting.phase(self.elapsed, self.state.free_axial(), self.carry)
        self.phase_start = self.elapsed

    def _y(self) -> np.ndarray:
        return np.concatenate([self.state.nu, self.state.chi, self.state.pose, self.added])

    def _add_row(self) -> None:
        drive = self.acting.drive(self.elapsed - self.phase_start)
        self.rows.add(self.elapsed, self._y(), self.state.contact, self.state.free_axial(), drive)

    def _start_added(self) -> None:
        """What the effects integrate about the free rollers begins anew with the rollers that are free now."""
        y = self._y()
        self.acting.state_vector.put(y, self.task.effects.initial(self.kernel, self.state))
        self.added = y[self.acting.state_vector.plain :]

    def _due_at_once(self) -> np.ndarray:
        """Directions of the wheels that stand at their joints and move or accelerate outwards, 0 for the others.

        A wheel rests where its speed would carry it over less than the rounding of its angle: without this an impact
        that sends a wheel back again and again, in less and less time, would have no last one.
        """
        chi, chi_dot = self.state.chi, self.kernel.wheel_speeds(self.state.nu)
        due = outward(chi, chi_dot, self.kernel.rollers_per_wheel)
        slow = np.abs(chi_dot) <= SLOW * np.max(np.abs(chi_dot), initial=0.0)
        if (slow & (np.abs(chi) >= self.model.joint)).any():
            self._ask()
            rates = self.flow(0.0, self._y())
            chi_ddot = self.kernel.wheel_speeds(rates[:3])
            resting = slow & (chi_dot**2 < 2 * EPS * self.model.joint * np.abs(chi_ddot))
            due = np.where(resting, outward(chi, chi_ddot, self.kernel.rollers_per_wheel), due)
        return due

    def _phase(self) -> np.ndarray:
        """Integrate up to the next switch, event or the end; the directions of the wheels that switch then."""
        start, end = self.elapsed, min(self.task.duration, self.acting.next_time())
        limit = (end - start) - self.carry
        try:
            phase = self.integrator.run(
                self.flow, self._y(), limit, lambda h: tau(self.task.start_time + start + h, h), self.guards
            )
        except StepFailedError as error:
            self._record(error.phase)  # type: ignore[attr-defined]
            if isinstance(error, StepTooSmallError):
                accelerations = self.kernel.wheel_speeds(self.flow(0.0, self._y())[:3])
                self._stop(f"{error}{self._blamed()}{TO_CHANGE}", int(np.abs(accelerations).argmax()))
            self._stop(str(error) + self._blamed())
        self._record(phase)
        ended = phase.directions.any() or phase.passed.any()
        if phase.duration >= limit or not ended:  # the end, without the rounding of its sums
            self.elapsed, self.carry = end, 0.0
            self.rows.elapsed[-1] = self.elapsed
        if phase.passed.any():
            self._watch(None)
            self.acting.pass_guards(phase.passed)
        self.phases += 1
        self._look_up()
        self._show()
        return phase.directions

    def _look_up(self) -> None:
        """What is watched after each step, between two phases: there are runs whose phases are one step each."""
        if self.elapsed < self.task.duration:
            try:
                self._is_ended(0.0)
            except StepFailedError as error:
                self._stop(str(error) + self._blamed())

    def _blamed(self) -> str:
        """What makes the steps short, in words, after a colon; empty where nothing is known."""
        return blamed(self.task, state_of(self.state) | {"axial": self.state.free_axial()})

    def _record(self, phase: Phase) -> None:
        """Rows and polynomials of a phase; the state and the time at its end."""
        start, carry = self.elapsed, self.carry
        axial = self._axial_during(phase)
        for k, (h, y, dense) in enumerate(zip(phase.times, phase.ends, phase.dense, strict=True)):
            self.rows.step_rows.append(len(self.rows.y) - 1)
            self.rows.dense.append(dense)
            self.elapsed, self.carry = compensated_sum(start, carry, h)
            drive = self.acting.drive(h)
            self.rows.add(self.elapsed, y, self.state.contact, None if axial is None else axial[k], drive)
        self.rows.y[-1] = phase.y  # differs where a wheel is put onto its joint without a step
        end, plain = 3 + self.kernel.wheels, self.acting.state_vector.plain
        if phase.dense:
            chi = np.array(phase.dense)[:, :, self.integrator.chi]
            self.turned += float(np.ptp(chi, axis=(0, 1)).max())
        self.state = replace(self.state, nu=phase.y[:3], chi=phase.y[3:end], pose=phase.y[end:plain])
        self.added = phase.y[plain:]
        if phase.times and axial is not None:
            self.state = self.state.with_free_axial(axial[-1])

    def _axial_during(self, phase: Phase) -> np.ndarray | None:
        """Axial speeds of the free rollers (K, N, n-1) at the ends of a phase's steps."""
        axial, layout = self.state.free_axial(), self.acting.state_vector
        if axial is None or not phase.times:
            return None
        before, after = layout.views(self._y()), layout.views(np.array(phase.ends))
        times = np.array(phase.times)
        later = self.task.effects.axial_later(self.kernel, axial, before, after, times)
        return np.broadcast_to(later, times.shape + axial.shape)

    def _switch(self, directions: np.ndarray) -> None:
        self._watch(int(np.flatnonzero(directions)[0]))
        self.state = self.model.apply(self.state, directions)
        if not np.isfinite(self.state.nu).all():
            self._stop("the speeds after the switch leave the number range", int(np.flatnonzero(directions)[0]))
        self._start_added()
        self.rows.switch(directions)
        self._add_row()

    def _is_ended(self, done: float) -> None:
        """Raises StepFailedError where somebody wishes that the run ends here, `done` s into the phase."""
        if reason := self._interruption():
            raise StepFailedError(reason)
        steps = self.integrator.counts.steps
        if steps >= self.next_look:
            self.next_look = steps + min(2 * self.outlook.length, MOST_STEPS) if self.outlook.length else 3 * FIRST
            if self.outlook.is_hopeless(steps, self.rows.switch_count, self.elapsed + done):
                raise StepFailedError(self.outlook.described())
            self._name_what_is_slow()
            if self.bytes_held + (steps - self.rows.step_count) * self.outlook.step_memory > self.task.memory:
                raise StepFailedError(TOO_MANY_ROWS)

    def _name_what_is_slow(self) -> None:
        """Say once which term makes the steps short, of a run that goes on: memory holds steps that take hours."""
        if self.is_named or self.outlook.windows < LOOKS or self.outlook.left < MANY_STEPS:
            return
        self.is_named = True
        if cause := self._blamed():
            needs = f"at its present pace the run needs {self.outlook.left:.0e} more steps of the Python engine"
            warnings.warn(needs + cause, RuntimeWarning, stacklevel=2)

    def _watch(self, wheel: int | None) -> None:
        """The watchdog (rule 9 of the switching model): stop a run that switches without progress.

        Progress takes time, and at a switch also that some wheel has turned: a wheel that a force holds at its joint
        goes to and fro there, in less and less time. `wheel` is None where a guard was passed.
        """
        moved = wheel is None or self.turned > CHATTER * self.model.joint
        if moved and self.elapsed - self.anchor > tau(self.task.start_time + self.elapsed, self.elapsed - self.anchor):
            self.anchor, self.idle_switches, self.turned = self.elapsed, 0, 0.0
        self.idle_switches += 1
        if self.idle_switches > SWITCHES_WITHOUT_PROGRESS * self.kernel.wheels:
            self._stop(f"{self.idle_switches} switches without progress in time", wheel)

    def figures(self) -> tuple[int, int, int, float]:
        counts = self.integrator.counts
        return counts.steps, counts.evaluations, self.phases, float(counts.error)
