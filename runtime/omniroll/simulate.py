"""Simulation: phases by the integrator, switches by the switching model, rows into a Trajectory."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import states, validation
from omniroll.comparison import difference
from omniroll.errors import AccuracyWarning, InvalidValueError, SimulationStopped
from omniroll.integrate import Phase, PhaseIntegrator, StepFailedError
from omniroll.kernels import ROLLER_MODELS, Kernel, kernel
from omniroll.switching import EPS, LAWS, State, SwitchingModel, outward, tau
from omniroll.trajectory import SWITCH_FIELDS, Trajectory
from omniroll.vehicle import Vehicle

ENGINES = ("compiled", "python")
Progress = Callable[[float, float], Any]

SAFETY = 0.5  # local errors may add up to this part of the accuracy
STEPS_PER_PHASE = 10  # roughly, for the share of one step in the error
CONTROL = 100.0  # the control run's tolerance is this much coarser
TRIALS = 4  # runs, each with a tighter tolerance, before the accuracy counts as out of reach
FINEST = EPS  # a tolerance that no step can feel
SWITCHES_WITHOUT_PROGRESS = 200  # per wheel, before the watchdog stops a run


@dataclass(frozen=True)
class Task:
    """What is to be simulated, checked."""

    kernel: Kernel
    state: State
    duration: float
    start_time: float
    switching: str
    accuracy: float
    engine: str
    progress: Progress | None


def simulate(
    vehicle: Vehicle,
    *,
    nu: ArrayLike,
    chi: ArrayLike = 0,
    spins: ArrayLike = 0,
    pose: ArrayLike = (0, 0, 0),
    duration: float,
    start_time: float = 0,
    roller_model: str = "free",
    switching: str = "impact",
    accuracy: float = 1e-9,
    engine: str = "compiled",
    progress: Progress | None = None,
    control: bool = True,
) -> Trajectory:
    """Simulate a vehicle with N wheels of n rollers from a given state.

    nu            (3,) in 1/s
    chi           (N,) in rad, |chi| <= pi/n, or one angle for all wheels; roller 0 of each wheel has contact
    spins         (N, n-1) in rad/s of the free rollers j = 2..n relative to their disks, or one number for
                  all; must be 0 for locked and massless rollers
    pose          x, y in m, theta in rad
    duration      in s, not negative
    start_time    in s
    roller_model  "free", "locked" or "massless"
    switching     "impact" or "smooth": the law at a change of rollers, see omniroll.switching
    accuracy      the error of the run, in the max-norm of ((x, y)/R, theta, nu/|nu(0)|), is to be below this
    engine        "compiled": C kernels; "python": Python kernels
    progress      called as progress(time done, duration) now and then
    control       compare with a second, coarser run: its distance is the measure of the error (stats), and
                  where it is too large the run is made again with a tighter tolerance. Without it there is no
                  estimate.

    Returns a Trajectory. Raises InvalidValueError (a ValueError) with the field, its value and the bound;
    SimulationStopped, which has the trajectory so far, when switches follow each other without progress in
    time; KernelsMissingError for the compiled engine where no C kernels were built. Warns with
    AccuracyWarning where the error estimate stays above the accuracy.
    """
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    validation.choice("roller_model", roller_model, ROLLER_MODELS)
    validation.choice("switching", switching, LAWS)
    validation.choice("engine", engine, ENGINES)
    task = Task(
        kernel=kernel(vehicle, roller_model, engine),
        state=_initial_state(vehicle, roller_model, nu, chi, spins, pose, engine),
        duration=_duration(duration),
        start_time=validation.real("start_time", start_time),
        switching=switching,
        accuracy=_accuracy(accuracy),
        engine=engine,
        progress=progress,
    )
    _check_range(task)
    return _controlled(task) if control and task.duration > 0 else Run(task, task.accuracy).trajectory()


def _initial_state(
    vehicle: Vehicle,
    roller_model: str,
    nu: ArrayLike,
    chi: ArrayLike,
    spins: ArrayLike,
    pose: ArrayLike,
    engine: str,
) -> State:
    nu = states.speeds(validation.real_array("nu", nu, (3,)))
    chi = states.wheel_angles_in_contact(chi, vehicle)
    if chi.ndim != 1:
        raise InvalidValueError("chi", chi.tolist(), f"must have the shape ({vehicle.wheels},)")
    spins = states.free_spins(spins, vehicle, roller_model)
    if spins is not None and spins.ndim != 2:
        shape = (vehicle.wheels, vehicle.rollers_per_wheel - 1)
        raise InvalidValueError("spins", spins.tolist(), f"must have the shape {shape}")
    axial = None
    if spins is not None:
        free = kernel(vehicle, roller_model, engine).axial_speeds(nu, chi, spins)
        axial = np.pad(free, ((0, 0), (1, 0)))  # contact is 0, so that j and the physical number agree
    pose = validation.real_array("pose", pose, (3,))
    return State(nu, chi, pose, np.zeros(vehicle.wheels, int), axial)


def _duration(duration: float) -> float:
    number = validation.real("duration", duration)
    if number < 0:
        raise InvalidValueError("duration", duration, "must not be negative")
    return number if number == 0 else validation.positive("duration", number)


def _accuracy(accuracy: float) -> float:
    number = validation.real("accuracy", accuracy)
    if not 0 < number < 1:
        raise InvalidValueError("accuracy", accuracy, "must lie between 0 and 1")
    return number


def _check_range(task: Task) -> None:
    """Refuse what would leave the number range at once: rates, or the way that they make."""
    state = task.state
    free = state.free_axial()
    flow = task.kernel.flow(None if free is None else task.kernel.momenta(free))
    with np.errstate(all="ignore"):
        rates = flow(0.0, np.concatenate([state.nu, state.chi, state.pose]))
        way = rates * task.duration
    states.refuse_unless_finite("rates", state.nu, rates)
    if np.abs(way).max() > validation.LARGEST:
        raise InvalidValueError(
            "duration", task.duration, "too long at these speeds: the way leaves the number range"
        )


# Runs and their control


def _controlled(task: Task) -> Trajectory:
    """Runs at tighter tolerances until two agree to the accuracy. The coarser one of two is the control."""
    tolerance = task.accuracy
    control = _attempt(replace(task, progress=None), min(CONTROL * tolerance, 0.1))
    for trial in range(TRIALS):
        run = Run(task, tolerance)
        trajectory = run.trajectory()
        if control is None:  # the coarse run could not go on where the fine one could
            break
        distance = difference(control, trajectory)
        # The error falls with the tolerance, but not always in proportion: claim half of the digits.
        estimate = distance / math.sqrt(CONTROL) + _rounding(trajectory)
        trajectory.stats["error_estimate"] = float(estimate)
        if estimate <= task.accuracy or tolerance <= FINEST or trial == TRIALS - 1:
            break
        control, tolerance = trajectory, max(tolerance / CONTROL, FINEST)
    estimate = trajectory.stats["error_estimate"]
    if estimate is None or estimate > task.accuracy:
        shown = "unknown" if estimate is None else f"{estimate:.2g}"
        warnings.warn(
            f"the error of this run may be above the accuracy {task.accuracy:g}: estimate {shown}",
            AccuracyWarning,
            stacklevel=3,
        )
    return trajectory


def _attempt(task: Task, tolerance: float) -> Trajectory | None:
    try:
        return Run(task, tolerance).trajectory()
    except SimulationStopped:
        return None


def _rounding(trajectory: Trajectory) -> float:
    """What rounding alone leaves of the pose, in the norm of the accuracy."""
    pose = np.abs(trajectory.pose).max(axis=0)
    return EPS * max(
        pose[0] / trajectory.vehicle.platform_radius,
        pose[1] / trajectory.vehicle.platform_radius,
        pose[2],
        1.0,
    )


# One run


@dataclass
class Rows:
    """What is collected during a run."""

    elapsed: list[float] = field(default_factory=list)
    y: list[np.ndarray] = field(default_factory=list)
    contact: list[np.ndarray] = field(default_factory=list)
    axial: list[np.ndarray | None] = field(default_factory=list)
    dense: list[np.ndarray] = field(default_factory=list)
    step_rows: list[int] = field(default_factory=list)
    switches: list[tuple] = field(default_factory=list)
    switch_rows: list[int] = field(default_factory=list)

    def add(self, elapsed: float, y: np.ndarray, state: State) -> None:
        self.elapsed.append(elapsed)
        self.y.append(y)
        self.contact.append(state.contact)
        self.axial.append(state.free_axial())


class Run:
    """One simulation with one tolerance."""

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.state = task, task.kernel, task.state
        vehicle = self.kernel.vehicle
        self.model = SwitchingModel(self.kernel, task.switching)
        self.tolerance = tolerance
        scale = np.concatenate(
            [
                np.full(3, self._speed_scale()),
                np.full(vehicle.wheels, self.model.joint),
                [vehicle.platform_radius, vehicle.platform_radius, 1.0],
            ]
        )
        self.integrator = PhaseIntegrator(
            vehicle.wheels, self.model.joint, scale, SAFETY * tolerance / self._steps_expected()
        )
        self.rows = Rows()
        self.elapsed, self.carry = 0.0, 0.0  # time since the start, and what its rounding has left over
        self.phases = 0
        self.anchor, self.idle_switches = 0.0, 0

    def trajectory(self) -> Trajectory:
        """Simulate, and return the result. Raises SimulationStopped."""
        self.rows.add(0.0, self._y(), self.state)
        directions = self._due_at_once()
        while True:
            if directions.any():
                self._switch(directions)
                directions = self._due_at_once()
            elif self.elapsed < self.task.duration:
                directions = self._phase()
            else:
                return self._result()

    def _y(self) -> np.ndarray:
        return np.concatenate([self.state.nu, self.state.chi, self.state.pose])

    def _speed_scale(self) -> float:
        """|nu(0)|, or where the vehicle rests the rollers' speed, or 1/duration."""
        axial = self.task.state.axial
        for speeds in (self.task.state.nu, axial):
            if speeds is not None and speeds.any():
                return float(np.linalg.norm(speeds))
        return 1 / self.task.duration if self.task.duration > 0 else 1.0

    def _steps_expected(self) -> float:
        """How many local errors will add up, if the vehicle goes on as it starts."""
        speed = np.abs(self.kernel.wheel_speeds(self.state.nu)).max()
        return STEPS_PER_PHASE * (1 + speed * self.task.duration / (2 * self.model.joint))

    def _time(self) -> float:
        return self.task.start_time + self.elapsed

    def _due_at_once(self) -> np.ndarray:
        """Directions of the wheels that stand at their joints and move outwards, 0 for the others."""
        chi_dot = self.kernel.wheel_speeds(self.state.nu)
        return outward(self.state.chi, chi_dot, self.kernel.rollers_per_wheel)

    def _phase(self) -> np.ndarray:
        """Integrate up to the next switch or to the end; the directions of the wheels that switch then."""
        start, free = self.elapsed, self.state.free_axial()
        flow = self.kernel.flow(None if free is None else self.kernel.momenta(free))
        limit = (self.task.duration - start) - self.carry
        try:
            phase = self.integrator.run(
                flow, self._y(), limit, lambda h: tau(self.task.start_time + start + h, h)
            )
        except StepFailedError as error:
            self._record(error.phase)  # type: ignore[attr-defined]
            self._stop(str(error), None)
        self._record(phase)
        if phase.duration >= limit or not phase.directions.any():  # the end, without the rounding of its sums
            self.elapsed, self.carry = self.task.duration, 0.0
            self.rows.elapsed[-1] = self.elapsed
        self.phases += 1
        if self.task.progress is not None:
            self.task.progress(self.elapsed, self.task.duration)
        return phase.directions

    def _record(self, phase: Phase) -> None:
        """Rows and polynomials of a phase; the state and the time at its end."""
        start, carry = self.elapsed, self.carry
        for h, y, dense in zip(phase.times, phase.ends, phase.dense, strict=True):
            self.rows.step_rows.append(len(self.rows.y) - 1)
            self.rows.dense.append(dense)
            self.elapsed, self.carry = _compensated_sum(start, carry, h)
            self.rows.add(self.elapsed, y, self.state)
        self.rows.y[-1] = phase.y  # differs where a wheel is put onto its joint without a step
        end = 3 + self.kernel.wheels
        self.state = replace(self.state, nu=phase.y[:3], chi=phase.y[3:end], pose=phase.y[end:])

    def _switch(self, directions: np.ndarray) -> None:
        self._watch(directions)
        before = self._energy(self.state)
        self.state = self.model.apply(self.state, directions)
        if not np.isfinite(self.state.nu).all():
            self._stop(
                "the speeds after the switch leave the number range", int(np.flatnonzero(directions)[0])
            )
        wheels = np.flatnonzero(directions)
        jump = (self._energy(self.state) - before) / len(wheels)
        self.rows.switch_rows.append(len(self.rows.y))
        self.rows.add(self.elapsed, self._y(), self.state)
        self.rows.switches += [(self._time(), int(wheel), int(directions[wheel]), jump) for wheel in wheels]

    def _energy(self, state: State) -> float:
        if state.axial is None:
            return float(self.kernel.energy(state.nu, state.chi))
        spins = self.kernel.spins_from_axial(state.nu, state.chi, state.free_axial())
        return float(self.kernel.energy(state.nu, state.chi, spins))

    def _watch(self, directions: np.ndarray) -> None:
        """The watchdog (rule 9 of the switching model): stop a run that switches without progress in time."""
        if self.elapsed - self.anchor > tau(self._time(), self.elapsed - self.anchor):
            self.anchor, self.idle_switches = self.elapsed, 0
        self.idle_switches += 1
        if self.idle_switches > SWITCHES_WITHOUT_PROGRESS * self.kernel.wheels:
            self._stop(
                f"{self.idle_switches} switches without progress in time", int(np.flatnonzero(directions)[0])
            )

    def _stop(self, reason: str, wheel: int | None) -> None:
        state = {
            "nu": self.state.nu.tolist(),
            "chi": self.state.chi.tolist(),
            "pose": self.state.pose.tolist(),
            "contact": self.state.contact.tolist(),
        }
        raise SimulationStopped(reason, t=self._time(), wheel=wheel, state=state, trajectory=self._result())

    # The result

    def _result(self) -> Trajectory:
        rows, end, task = self.rows, 3 + self.kernel.wheels, self.task
        y, elapsed = np.array(rows.y), np.array(rows.elapsed)
        nu, chi, pose = y[:, :3].copy(), y[:, 3:end].copy(), y[:, end:].copy()
        _, contact_spin = self.kernel.wheel_rates(nu, chi)
        spins = None
        if self.kernel.has_spins:
            spins = self.kernel.spins_from_axial(nu, chi, np.array(rows.axial))
        energy = self.kernel.energy(nu, chi, *self.kernel.spins_or_nothing(spins))
        return Trajectory(
            vehicle=self.kernel.vehicle,
            roller_model=self.kernel.roller_model,
            switching=task.switching,
            accuracy=task.accuracy,
            engine=task.engine,
            start_time=task.start_time,
            t=task.start_time + elapsed,
            elapsed=elapsed,
            nu=nu,
            chi=chi,
            contact=np.array(rows.contact),
            contact_spin=contact_spin,
            spins=spins,
            pose=pose,
            energy=energy,
            switches=np.array(rows.switches, SWITCH_FIELDS).view(np.recarray),
            dense=np.array(rows.dense).reshape(len(rows.dense), -1, y.shape[1]) if rows.dense else None,
            step_rows=np.array(rows.step_rows, int),
            stats=self._stats(energy),
        )

    def _stats(self, energy: np.ndarray) -> dict[str, Any]:
        counts = self.integrator.counts
        return {
            "steps": counts.steps,
            "evaluations": counts.evaluations,
            "phases": self.phases,
            "switches": len(self.rows.switches),
            "tolerance": self.tolerance,
            "error_estimate": None,
            "phase_energy_drift": _phase_drift(energy, self.rows.switch_rows),
        }


def _compensated_sum(start: float, carry: float, h: float) -> tuple[float, float]:
    """start + carry + h rounded, and the rounding error (Knuth's two-sum)."""
    h = h + carry
    total = start + h
    part = total - start
    return total, (start - (total - part)) + (h - part)


def _phase_drift(energy: np.ndarray, switch_rows: list[int]) -> float:
    """The largest relative change of energy between two switches."""
    drift = 0.0
    for phase in np.split(energy, switch_rows):
        if len(phase) and phase[0] > 0:
            drift = max(drift, float(np.ptp(phase) / phase[0]))
    return drift
