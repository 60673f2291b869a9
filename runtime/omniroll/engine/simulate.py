"""simulate(): checks what is asked, runs an engine, and makes the run again until its error is small enough."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.engine.compiled_engine import CompiledRun, can_run
from omniroll.engine.python_engine import Run
from omniroll.engine.runs import Progress, Task
from omniroll.engine.switching import EPS
from omniroll.errors import AccuracyWarning, InvalidValueError, SimulationStopped
from omniroll.kernels.kernel import Kernel, best_backend
from omniroll.results.comparison import difference, distance_at
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles import checks as states
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, RUN, STATE, SWITCHING, by_name, documented

ENTRIES = by_name(RUN)

CONTROL = 100.0  # the tolerance of the control run is this many times that of the run
TRIALS = 4  # at most so many runs, each with a tighter tolerance, try to reach the accuracy
FINEST = EPS  # the tightest tolerance that is tried: rounding is as large

# The sensitivity is measured by a second run whose start is moved a little.
MOVED = 1e-7  # how far the start is moved, relative to each quantity's size
MOVED_NU = np.array([0.48, -0.64, 0.6])  # the direction in which nu is moved; of length 1, along no axis of the vehicle
FINE = 1e-4  # the tolerance of the second run is FINE * MOVED, so that its error is small against the distance
PROBES = 201  # the number of times at which the two runs are compared


@documented(*STATE, *RUN, ROLLER_MODEL, SWITCHING)
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
    effects: Sequence[Effect] = (),
    control: bool = True,
) -> Trajectory:
    """Simulate a vehicle with N wheels of n rollers from a given state.

    vehicle       Vehicle, with N wheels of n rollers; roller 0 of each wheel has contact at the start
    effects       what acts on the vehicle besides its rolling, a sequence of effects: Torque, TorqueTable, Motor,
                  Controller, Bearings, Slope
    {entries}
    progress      function that is called as progress(time done, duration) now and then, or None
    control       True: compare with a second, coarser run; its distance is the measure of the error
                  (stats["error_estimate"]), and where it is too large the run is made again with a tighter
                  tolerance. A run from a start moved by 1e-7 gives stats["sensitivity"]: how much larger a small
                  error of the start becomes. The estimate is never below eps times that. False: both are None

    The motion between switches is (3.4) with (2.1) and (2.2); omniroll.engine.switching says what a switch does.
    Returns a Trajectory. Raises InvalidValueError (a ValueError) with the field, its value and the bound;
    SimulationStopped, which has the trajectory so far, when switches follow each other without progress in
    time, or when the compiled engine has filled 1 GiB with steps; KernelsMissingError for the compiled engine
    where no C kernels were built. Warns with AccuracyWarning where the error estimate stays above the accuracy,
    and with UnstableControllerWarning.
    """
    task = checked_task(
        vehicle, nu=nu, chi=chi, spins=spins, pose=pose, duration=duration, start_time=start_time,
        roller_model=roller_model, switching=switching, accuracy=accuracy, engine=engine, progress=progress,
        effects=effects,
    )  # fmt: skip
    for doubt in task.effects.doubts(vehicle):
        warnings.warn(doubt, stacklevel=2)
    if not control or task.duration == 0:
        return one_run(task, task.accuracy)
    trajectory = controlled_run(task)
    for doubt in accuracy_doubts(task, trajectory):
        warnings.warn(doubt, stacklevel=2)
    return trajectory


def checked_task(
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
    effects: Sequence[Effect] = (),
) -> Task:
    """The arguments of simulate, checked. Raises InvalidValueError."""
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    ROLLER_MODEL.checked(roller_model)
    SWITCHING.checked(switching)
    ENTRIES["engine"].checked(engine)
    acting = EffectSet.checked(effects, vehicle)
    bound = acting.kernel(vehicle, roller_model, best_backend() if acting and engine == "compiled" else engine)
    task = Task(
        vehicle=vehicle,
        kernel=bound,
        state=_initial_state(bound, nu, chi, spins, pose),
        duration=ENTRIES["duration"].checked(duration),
        start_time=ENTRIES["start_time"].checked(start_time),
        switching=switching,
        accuracy=ENTRIES["accuracy"].checked(accuracy),
        engine=engine,
        progress=progress,
        effects=acting,
    )
    _check_range(task)
    return task


def _initial_state(bound: Kernel, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike, pose: ArrayLike) -> State:
    vehicle = bound.vehicle
    nu = states.speeds(validation.real_array("nu", nu, (3,)))
    chi = states.wheel_angles_in_contact(chi, vehicle)
    if chi.ndim != 1:
        raise InvalidValueError("chi", chi.tolist(), f"must have the shape ({vehicle.wheels},)")
    spins = states.free_spins(spins, vehicle, bound.roller_model)
    if spins is not None and spins.ndim != 2:
        shape = (vehicle.wheels, vehicle.rollers_per_wheel - 1)
        raise InvalidValueError("spins", spins.tolist(), f"must have the shape {shape}")
    axial = None
    if spins is not None:
        free = bound.axial_speeds(nu, chi, spins)
        axial = np.pad(free, ((0, 0), (1, 0)))  # contact is 0, so that j and the physical number agree
    pose = validation.real_array("pose", pose, (3,))
    return State(nu, chi, pose, np.zeros(vehicle.wheels, int), axial)


def _check_range(task: Task) -> None:
    """Refuse what would leave the number range at once: energy, rates, or the way that they make."""
    state, bound = task.state, task.kernel
    free = state.free_axial()
    with np.errstate(all="ignore"):
        spins = () if free is None else (bound.spins_from_axial(state.nu, state.chi, free),)
        energy = bound.energy(state.nu, state.chi, *spins)
        acting = EffectRun(task.effects, bound, task.start_time)
        acting.pass_time(0.0, state)
        y = np.zeros(acting.state_vector.size)
        acting.state_vector.put(y, {"nu": state.nu, "chi": state.chi, "pose": state.pose})
        acting.state_vector.put(y, task.effects.initial(bound, free))
        flow, _ = acting.phase(0.0, free, y)
        rates = flow(0.0, y)
        way = rates[: acting.state_vector.plain] * task.duration
    states.refuse_unless_finite("rates and the energy", state.nu, rates, energy, *spins)
    if np.abs(way).max() > validation.LARGEST:
        raise InvalidValueError("duration", task.duration, "too long at these speeds: the way leaves the number range")


# Runs and their control


def controlled_run(task: Task) -> Trajectory:
    """Runs at tighter tolerances until two agree to the accuracy. The coarser one of two is the control.

    Fills in stats["error_estimate"] and stats["sensitivity"]; None where a run that they need has stopped.
    """
    tolerance = task.accuracy
    quiet = replace(task, progress=None)
    control = _attempt(quiet, min(CONTROL * tolerance, 0.1))
    for trial in range(TRIALS):
        trajectory = one_run(task, tolerance)
        if control is None:  # the coarse run could not go on where the fine one could
            break
        # The error falls with the tolerance, but not always in proportion: claim half of the digits.
        error = difference(control, trajectory) / math.sqrt(CONTROL)
        if control.stats["steps"] == trajectory.stats["steps"]:  # events have cut both into the same steps
            error = max(error, trajectory.stats.get("local_errors", 0.0))
        reached = error + trajectory.stats.get("step_error", 0.0) <= task.accuracy  # as the estimate counts it below
        if reached or tolerance <= FINEST or trial == TRIALS - 1:
            break
        control, tolerance = trajectory, max(tolerance / CONTROL, FINEST)
    sensitivity = _sensitivity(quiet, trajectory)
    trajectory.stats["sensitivity"] = sensitivity
    if control is not None and sensitivity is not None:
        floor = max(EPS * sensitivity, _rounding(trajectory))
        within_steps = trajectory.stats.get("step_error", 0.0)
        trajectory.stats["error_estimate"] = float(error + within_steps + floor)
    return trajectory


def accuracy_doubts(task: Task, trajectory: Trajectory) -> tuple[UserWarning, ...]:
    """The warning that a controlled run deserves whose error estimate is above the accuracy, or missing; or none."""
    estimate = trajectory.stats["error_estimate"]
    if estimate is not None and estimate <= task.accuracy:
        return ()
    shown = "unknown" if estimate is None else f"{estimate:.2g}"
    text = f"the error of this run may be above the accuracy {task.accuracy:g}: estimate {shown}"
    return (AccuracyWarning(text),)


def _sensitivity(task: Task, trajectory: Trajectory) -> float | None:
    """The largest distance to the motion from a start that is moved by MOVED, over MOVED; at least 1.

    The two runs must be exact to far less than their distance. Where the trajectory is not, both are made
    finely, on the compiled engine where it can: the sensitivity is the motion's, not the engine's.
    """
    tolerance = min(trajectory.stats["tolerance"], MOVED * FINE)
    task = replace(task, engine="compiled") if can_run(task) else task
    base = trajectory
    if trajectory.stats["tolerance"] > tolerance or trajectory.engine != task.engine:
        base = _attempt(task, tolerance)
    companion = _attempt(replace(task, state=_moved(task)), tolerance)
    if base is None or companion is None:
        return None
    times = np.linspace(base.t[0], base.t[-1], PROBES)
    return max(1.0, distance_at(companion, base, times) / MOVED)


def _moved(task: Task) -> State:
    """The start moved by MOVED: nu relative to |nu|, chi relative to pi/n, and the heading."""
    state, joint = task.state, states.joint_angle(task.kernel.rollers_per_wheel)
    wheels = task.kernel.wheels
    uneven = np.cos(2.0 * np.arange(wheels) + 1.0)  # no symmetry of the wheels survives this
    chi = np.where(np.abs(state.chi) < joint * (1 - MOVED), state.chi + MOVED * joint * uneven, state.chi)
    nu = state.nu + MOVED * np.linalg.norm(state.nu) * MOVED_NU
    return replace(state, nu=nu, chi=chi, pose=state.pose + [0.0, 0.0, MOVED])


def _attempt(task: Task, tolerance: float) -> Trajectory | None:
    try:
        return one_run(task, tolerance)
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


def one_run(task: Task, tolerance: float) -> Trajectory:
    """One simulation with one tolerance. Raises SimulationStopped."""
    engine = CompiledRun if task.engine == "compiled" and can_run(task) else Run
    return engine(task, tolerance).trajectory()
