"""How good a run is, for the price of one coarser run: a controlled run says how large its error is, and is made again
until that is small enough. The run itself comes first: whatever ends the work, what is kept is a run of the task.

The coarser run starts a little beside the other one, so that the distance of the two holds both what the tolerance
leaves and what the motion makes of a small error. Numbers are rounded to eps: that error is always there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from omniroll.effects.contact import UNSHARED, Contact
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.compiled_engine import CompiledRun, can_run
from omniroll.engine.python_run import PythonRun
from omniroll.engine.runs import STATE, Task
from omniroll.engine.switching import EPS
from omniroll.engine.works import Work, result_of, side_by_side
from omniroll.errors import AccuracyWarning, InvalidValueError, SimulationStopped
from omniroll.kernels.kernel import effects_of
from omniroll.kernels.neutral_kernel import PREBUILT, first_general_set
from omniroll.results.laws import broken
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles import checks as states

CONTROL = 100.0  # the tolerance of the control run is this many times that of the run
COARSEST = 0.1  # but not above this
ASIDE = 1e-12  # how far aside the control run starts, relative to each quantity's size
# A finer accuracy is of the size of what ASIDE makes: the sensitivity is then measured by runs of its own.
FINE_REQUEST = 1e-11
TRIALS = 4  # at most so many runs, each with a tighter tolerance, try to reach the accuracy
SMALL_MISS = 5.0  # an estimate at most so many times the accuracy asks for one digit more, else for two
FINEST = EPS  # the tightest tolerance that is tried: rounding is as large

# The sensitivity is measured by two runs, one of whose starts is moved a little.
MOVED = 1e-7  # how far the start is moved, relative to each quantity's size
MOVED_NU = np.array([0.48, -0.64, 0.6])  # the direction in which nu is moved; of length 1, along no axis of the vehicle
HEADING = np.array([0.0, 0.0, 1.0])
FINE = 1e-3  # the tolerance of the runs is FINE * MOVED, so that their errors are small against the distance


AnyRun = CompiledRun | PythonRun


def made(task: Task, tolerance: float) -> AnyRun:
    """One simulation with one tolerance, up to its end or to where it cannot go on."""
    return result_of(making(task, tolerance))


def making(task: Task, tolerance: float) -> Work[AnyRun]:
    """The same as a work, whose calls of the engine others may share."""
    run = (_engine_in_python(task) if task.engine == "python" else CompiledRun)(task, tolerance)
    yield from run.advancing()
    swings = isinstance(run, CompiledRun) and run.chatters() is not None
    standing = _on_joints(task) if swings and task.room is None else None
    return run if standing is None else (yield from making(standing, tolerance))


def _on_joints(task: Task) -> Task | None:
    """The task of wheels that slip, which may stand on their joints; None of others, of those that may already, and
    where no engine is built for it."""
    own = (replace(one, joints=True) if isinstance(one, Contact) else one for one in task.effects.effects)
    acting, model = EffectSet(tuple(own)), task.kernel.roller_model
    if task.kernel.pivots or not acting.slips or UNSHARED & {*acting.names()}:
        return None
    if first_general_set(model, effects_of(task.vehicle, model, acting.names())) is None:
        return None
    standing = replace(task, effects=acting, kernel=acting.kernel(task.vehicle, model, PREBUILT))
    return standing if can_run(standing) else None


def _engine_in_python(task: Task) -> type[PythonRun]:
    """Which of both takes a task. Raises InvalidValueError where none does."""
    from omniroll.engine.python_engine import Run  # which imports SciPy's integrators
    from omniroll.engine.time_stepping import SteppedInTime

    if "contact_springs" in task.effects.names():
        raise InvalidValueError("engine", "python", "has no loads from springs: choose compiled")
    return SteppedInTime if task.effects.slips_or_sticks(task.kernel) else Run


def one_run(task: Task, tolerance: float) -> Trajectory:
    """One simulation with one tolerance. Raises SimulationStopped."""
    return lawful(made(task, tolerance).trajectory())


def lawful(run: Trajectory) -> Trajectory:
    """A run whose energy is accounted for. Raises SimulationStopped for another one, which is no result."""
    if (law := broken(run)) is None:
        return run
    row = max(0, int(np.searchsorted(run.t, law.t)) - 1)
    state = {name: getattr(run, name)[row].tolist() for name in STATE}
    reason = f"{law.what}: this is a fault of omniroll, and the motion from there on is wrong; please report the scene"
    raise SimulationStopped(reason, t=law.t, wheel=None, state=state, trajectory=run)


@dataclass
class Controlled:
    """A run, an estimate of its error or None, and a function that gives the sensitivity of the motion or None."""

    run: AnyRun
    error_estimate: float | None
    sensitivity: Callable[[], float | None]

    def trajectory(self) -> Trajectory:
        """The trajectory, with the estimate among its figures. Raises SimulationStopped."""
        trajectory = lawful(self.run.trajectory())
        trajectory.stats["error_estimate"] = self.error_estimate
        trajectory.stats.make_on_demand("sensitivity", self.sensitivity)
        return trajectory


def controlled(task: Task) -> Controlled:
    """Runs at tighter tolerances until two agree to the accuracy; the coarser one of two is the control.

    There is no estimate where one of the two cannot go on. Where that is a run that was made again, the one before it
    stands, with its own estimate.
    """
    return result_of(controlling(task))


def controlling(task: Task) -> Work[Controlled]:
    """The same as a work."""
    if task.engine == "python" and task.effects.slips_or_sticks(task.kernel):
        return (yield from _with_twice_the_step(task))
    quiet, accuracy = _quiet(task), task.accuracy
    aside = ASIDE if accuracy >= FINE_REQUEST else 0.0
    tolerance, estimate = accuracy, None
    floor = _Floor(task, aside)
    run, control = yield from _first_two(task, moved(quiet, aside))
    if control is None:
        return Controlled(run, None, floor.sensitivity)
    for trial in range(TRIALS):
        if trial > 0:
            run = yield from making(task, tolerance)
        if not (control.done and run.done):
            if trial > 0:
                run, control = control, run
            break
        distance = run.distance_from(control)
        least = yield from floor.of(run, distance if trial == 0 else None)
        estimate = _error(control, run, distance) + least
        reached = estimate - least <= accuracy
        if reached or least > accuracy or tolerance <= FINEST or trial == TRIALS - 1:
            break
        control.release()
        control = run
        tolerance = max(tolerance / (10.0 if estimate <= SMALL_MISS * accuracy else CONTROL), FINEST)
    control.release()
    return Controlled(run, estimate, floor.sensitivity)


def _with_twice_the_step(task: Task) -> Work[Controlled]:
    """A run that is stepped in time, and as its error its distance to one with twice the step: it is of first order."""
    run = yield from making(task, task.accuracy)
    control = yield from making(_quiet(task), 2 * task.accuracy)
    estimate = run.distance_from(control) if run.done and control.done else None
    return Controlled(run, estimate, lambda: sensitivity(task))


def _first_two(task: Task, beside: Task) -> Work[tuple[AnyRun, AnyRun | None]]:
    """The first run of the task, and then a coarser one that starts beside it; None where the first one has stopped.
    Nobody is told or asked anything while both are made at once."""
    coarse = min(CONTROL * task.accuracy, COARSEST)
    if _quiet(task) is task and task.interrupted is None and not _asks_python(task):
        run, control = yield from side_by_side([making(task, task.accuracy), making(beside, coarse)])
        return run, control
    run = yield from making(task, task.accuracy)
    if not run.done:
        return run, None
    beside = replace(beside, progress=task.coarse) if task.coarse is not None else beside
    return run, (yield from making(_behind(task, beside, run), coarse))


def _asks_python(task: Task) -> bool:
    """Whether a run calls functions in Python: what these keep must see one run after the other."""
    if not task.effects:
        return False
    plan = task.effects.plan(task.kernel, task.start_time)
    return bool(plan.asks or plan.called)


def _quiet(task: Task) -> Task:
    """The task without those who are told of it."""
    if task.progress is task.coarse is task.keep is None:
        return task
    return replace(task, progress=None, coarse=None, keep=None)


def _behind(task: Task, other: Task, run: AnyRun) -> Task:
    """Another task, during which whoever keeps the task sees its finished run."""
    if task.keep is None:
        return other
    return replace(other, keep=lambda _: task.keep(run))  # type: ignore[misc,arg-type]


def controlled_run(task: Task) -> Trajectory:
    """The trajectory of a controlled run, with stats["error_estimate"] and stats["sensitivity"]; these are None where a
    run that they need has stopped. Raises SimulationStopped."""
    return controlled(task).trajectory()


def _error(control: AnyRun, run: AnyRun, distance: float) -> float:
    """The error of a run, from its distance to a coarser one."""
    stats = run.stats()
    # The error falls with the tolerance, but not always in proportion: claim half of the digits.
    error = distance / math.sqrt(control.tolerance / run.tolerance)
    if control.stats()["steps"] == stats["steps"]:  # events have cut both into the same steps
        error = max(error, stats.get("local_errors", 0.0))
    return error + stats.get("step_error", 0.0)


class _Floor:
    """What no tolerance can do away with: rounding, magnified by the motion.

    aside  how far aside the first control run starts. Its distance then holds that much of the sensitivity, which is
           more than rounding makes of it.
    """

    def __init__(self, task: Task, aside: float):
        self.kept, self.task, self.aside, self.most = task, _quiet(task), aside, math.inf
        self.measured: float | None = None

    def of(self, run: AnyRun, first_distance: float | None) -> Work[float]:
        """The floor of a run; `first_distance` is that to the first control run, None for later ones."""
        pose = run.largest_pose()
        radius = self.task.vehicle.platform_radius
        rounding = EPS * max(pose[0] / radius, pose[1] / radius, pose[2], 1.0)
        if self.aside and first_distance is not None:
            self.most = first_distance / self.aside  # of the sensitivity
            return rounding
        if EPS * self.most <= 0.1 * self.task.accuracy:
            return EPS * self.most
        if self.measured is None:
            self.measured = yield from _measuring(_behind(self.kept, self.task, run), run)
        return max(rounding, EPS * self.measured) if self.measured is not None else math.inf

    def sensitivity(self) -> float | None:
        """How much larger a small error of the start becomes, at least 1; None where a run for it has stopped."""
        if self.measured is None:
            self.measured = sensitivity(self.task)
        return self.measured


def sensitivity(task: Task) -> float | None:
    """The largest distance to the motion from a start that is moved by MOVED, over MOVED; at least 1.

    None where one of the two runs has stopped. Both are fine, on the compiled engine where it can: the sensitivity is
    the motion's, not the engine's.
    """
    return result_of(_measuring(task))


def _measuring(task: Task, base: AnyRun | None = None) -> Work[float | None]:
    """The same as a work. A finished run of this task, `base`, serves where it is fine enough."""
    task = replace(task, engine="compiled") if can_run(task) else task
    tolerance = min(task.accuracy, FINE * MOVED)
    if base is None or base.tolerance > tolerance or isinstance(base, PythonRun) == (task.engine != "python"):
        base = yield from making(task, tolerance)
    companion = yield from making(moved(task, MOVED), base.tolerance)
    if not (base.done and companion.done):
        return None
    found = max(1.0, base.distance_from(companion) / MOVED)
    companion.release()
    return found


def moved(task: Task, by: float) -> Task:
    """The task with its start moved: nu relative to |nu|, chi relative to pi/n, and the heading."""
    if by == 0:
        return task
    state, joint = task.state, states.joint_angles(task.kernel.vehicle)
    uneven = np.cos(2.0 * np.arange(len(state.chi)) + 1.0)  # no symmetry of the wheels survives this
    chi = np.where(np.abs(state.chi) < joint * (1 - by), state.chi + by * joint * uneven, state.chi)
    nu = state.nu + by * math.sqrt(state.nu @ state.nu) * MOVED_NU
    pose = state.pose + by * HEADING
    moved_state = replace(state, nu=nu, chi=chi, pose=pose)
    return replace(task, state=task.effects.begin(task.kernel, moved_state))


def accuracy_doubts(task: Task, trajectory: Trajectory) -> tuple[UserWarning, ...]:
    """The warning that a controlled run deserves whose error estimate is above the accuracy, or missing; or none."""
    estimate = trajectory.stats["error_estimate"]
    if estimate is not None and estimate <= task.accuracy:
        return ()
    shown = "unknown" if estimate is None else f"{estimate:.2g}"
    text = f"the error of this run may be above the accuracy {task.accuracy:g}: estimate {shown}"
    return (AccuracyWarning(text),)
