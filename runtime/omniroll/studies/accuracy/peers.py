"""The integrators beside each other: each makes one motion at one setting and says what it cost.

omniroll's own engines; SciPy's methods with the compiled kernel as right-hand side, events at the joints and
the switching model between phases, one of them with the float kernel too; the controller's step of the generated C
(classical Runge-Kutta from joint to joint) of fixed length and without error control, in double and in float.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from omniroll.effects.effect_set import EffectRun
from omniroll.engine.runs import Task, speed_scale
from omniroll.engine.simulate import one_run
from omniroll.engine.switching import SwitchingModel, outward, tau
from omniroll.errors import SimulationStopped
from omniroll.kernels import sets
from omniroll.kernels.kernel import kernel
from omniroll.results.trajectory import Trajectory

SMALLEST_RTOL = 2.3e-14  # SciPy takes no less than 100 eps
LONGEST = 200_000  # phases or evaluations before a run is given up
MOMENT = 1e-6  # s of a run that has its engine compiled


@dataclass(frozen=True)
class Outcome:
    """Samples y (T, 6 + N) and contact (T, N) at the task's sample times, energies (T,), switches, evaluations."""

    y: np.ndarray
    contact: np.ndarray
    energy: np.ndarray
    switches: list[tuple[float, int, int]]
    evaluations: int


@dataclass(frozen=True)
class Peer:
    """An integrator: run(task, times, setting) -> Outcome; `settings` from coarse to fine; what a setting is.

    prepare(task, setting) compiles what has to be, and is not counted; with_effects: whether effects may act;
    sticking: whether axles may stick.
    """

    name: str
    run: Callable[[Task, np.ndarray, float], Outcome]
    settings: tuple[float, ...]
    setting: str = "tolerance"
    prepare: Callable[[Task, float], None] = lambda task, setting: None
    with_effects: bool = True
    sticking: bool = False

    def takes(self, task: Task) -> bool:
        """Whether it runs a task with the effects that this has."""
        sticks = bool(task.effects.bearings(task.kernel))
        return (self.with_effects or not task.effects) and (self.sticking or not sticks)


def by_engine(engine: str) -> Callable:
    def run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
        own = replace(task, engine=engine, kernel=task.effects.kernel(task.vehicle, task.kernel.roller_model, engine))
        return outcome_of(one_run(own, tolerance), task, times)

    return run


def compiled_before(task: Task, tolerance: float) -> None:
    """Have all that a task's run and its samples need compiled, by the beginning of it: times are those of runs."""
    beginning = replace(task, duration=min(task.duration, MOMENT))
    outcome_of(one_run(beginning, tolerance), beginning, np.zeros(1))


def outcome_of(trajectory: Trajectory, task: Task, times: np.ndarray) -> Outcome:
    """A trajectory at the sample times, which are counted from the start."""
    clock = np.minimum(task.start_time + times, trajectory.t[-1])
    samples = trajectory.sample(clock)
    y = np.concatenate([samples.nu, samples.chi, samples.pose], axis=-1)
    table = trajectory.switches
    switches = list(zip(table.t - task.start_time, table.wheel, table.direction, strict=True))
    return Outcome(y, samples.contact, samples.energy, switches, trajectory.stats["evaluations"])


def by_scipy(method: str, number_type: str = "double") -> Callable:
    def run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
        return ScipyRun(task, times, method, tolerance, number_type).outcome()

    return run


class ScipyRun:
    """Phases by solve_ivp, ended by its events and by known times; switches by the switching model.

    number_type is that of the kernel whose rates are integrated; all else is in double. With effects it is double.
    """

    def __init__(self, task: Task, times: np.ndarray, method: str, tolerance: float, number_type: str = "double"):
        self.task, self.times, self.method, self.tolerance = task, times, method, max(tolerance, SMALLEST_RTOL)
        self.bound, self.state = task.kernel, task.state
        if number_type == "double":
            rates = self.bound
        else:
            rates = kernel(self.bound.vehicle, self.bound.roller_model, "compiled", number_type)
        self.acting = EffectRun(task.effects, rates, task.start_time)
        self.vector = self.acting.state_vector
        self.added = np.zeros(self.vector.size - self.vector.plain)
        self.wheels, self.joint = self.bound.wheels, np.pi / self.bound.rollers_per_wheel
        self.law = SwitchingModel(self.bound, task.switching)
        self.rows: list[np.ndarray] = []
        self.contacts: list[np.ndarray] = []
        self.energies: list[float] = []
        self.switches: list[tuple[float, int, int]] = []
        self.evaluations = 0
        self._start_added()

    def outcome(self) -> Outcome:
        now, duration, phase_start = 0.0, self.task.duration, 0.0
        self._switch(now, self._due())
        for _ in range(LONGEST):
            self._pass_events(now)
            if not now < duration:
                break
            until = min(duration, self.acting.next_time())
            phase = self._phase(now, until)
            self._keep(now, phase)
            self._to(phase.y[:, -1], phase.t[-1] - now)
            now = until if phase.status == 0 else float(phase.t[-1])
            if phase.status == 1:
                self._pass_guards(phase)
                self._switch(now, self._due(tau(self.task.start_time + now, now - phase_start)))
                phase_start = now
        self._keep_rest()
        return Outcome(
            np.array(self.rows), np.array(self.contacts), np.array(self.energies), self.switches, self.evaluations
        )

    # What acts

    def _pass_events(self, now: float) -> None:
        """Known times that have come, guards that are passed at once; then the rates and the guards from now on."""
        while True:
            if now >= self.acting.next_time():
                self.acting.pass_time(now, self.state)
                continue
            self.flow, self.guards = self.acting.phase(now, self.state.free_axial())
            passed = self.guards.beyond(0.0, self._y()) if len(self.guards) else np.zeros(0, bool)
            if not passed.any():
                return
            self.acting.pass_guards(passed)

    def _pass_guards(self, phase) -> None:
        """The guards that have ended the phase; events at joints stand before them."""
        if len(self.guards):
            passed = np.array([len(times) > 0 for times in phase.t_events[2 * self.wheels :]])
            if passed.any():
                self.acting.pass_guards(passed)

    def _start_added(self) -> None:
        y = self._y()
        self.vector.put(y, self.task.effects.initial(self.bound, self.state))
        self.added = y[self.vector.plain :]

    # A phase

    def _phase(self, now: float, until: float):
        phase = solve_ivp(
            lambda time, y: self.flow(time - now, y), (now, until), self._y(), method=self.method, rtol=self.tolerance,
            atol=self.tolerance * self._scale(), events=self._events(now), dense_output=True,
        )  # fmt: skip
        self.evaluations += phase.nfev
        if phase.status < 0:
            raise ArithmeticError(phase.message)
        return phase

    def _scale(self) -> np.ndarray:
        speed = speed_scale(self.task) if self.task.effects else np.linalg.norm(self.state.nu) or 1.0
        radius = self.bound.vehicle.platform_radius
        plain = [speed] * 3 + [self.joint] * self.wheels + [radius, radius, 1.0]
        return np.concatenate([plain, self.vector.scale_of_added(self.bound, speed)])

    def _events(self, start: float) -> list[Callable]:
        joints = [
            lambda _, y, place=3 + i, sign=sign: sign * y[place] - self.joint
            for i in range(self.wheels)
            for sign in (1, -1)
        ]
        passed = [lambda time, y, k=k: self.guards.values(time - start, y)[k] for k in range(len(self.guards))]
        for event in (*joints, *passed):
            event.terminal, event.direction = True, 1.0
        return joints + passed

    def _y(self) -> np.ndarray:
        return np.concatenate([self.state.nu, self.state.chi, self.state.pose, self.added])

    def _axial(self, y: np.ndarray, h: float) -> np.ndarray | None:
        """The free rollers' axial speeds at y, the time h after the present state."""
        axial = self.state.free_axial()
        if axial is None:
            return None
        before, after = self.vector.views(self._y()), self.vector.views(y)
        return self.task.effects.axial_later(self.bound, axial, before, after, np.float64(h))

    def _to(self, y: np.ndarray, h: float) -> None:
        axial, end, plain = self._axial(y, h), 3 + self.wheels, self.vector.plain
        self.state = replace(self.state, nu=y[:3].copy(), chi=y[3:end].copy(), pose=y[end:plain].copy())
        self.added = y[plain:].copy()
        if axial is not None:
            self.state = self.state.with_free_axial(axial)

    # Switches

    def _due(self, gap: float = 0.0) -> np.ndarray:
        """Directions of the wheels that reach their joint within `gap`; they are put onto it."""
        speeds = self.bound.wheel_speeds(self.state.nu)
        sign = np.sign(speeds)
        with np.errstate(divide="ignore", invalid="ignore"):
            waits = np.where(speeds != 0, (self.joint - sign * self.state.chi) / np.abs(speeds), np.inf)
        chi = np.where(waits <= gap, sign * self.joint, np.clip(self.state.chi, -self.joint, self.joint))
        self.state = replace(self.state, chi=chi)
        return outward(chi, speeds, self.bound.rollers_per_wheel)

    def _switch(self, now: float, directions: np.ndarray) -> None:
        for _ in range(10):
            if not directions.any():
                return
            self.state = self.law.apply(self.state, directions)
            self._start_added()
            self.switches += [(now, int(i), int(directions[i])) for i in np.flatnonzero(directions)]
            directions = self._due()
        raise ArithmeticError("switches without progress in time")

    # Rows

    def _keep(self, now: float, phase) -> None:
        while len(self.rows) < len(self.times) and self.times[len(self.rows)] < phase.t[-1]:
            time = self.times[len(self.rows)]
            self._row(phase.sol(time), time - now)

    def _keep_rest(self) -> None:
        while len(self.rows) < len(self.times):
            self._row(self._y(), 0.0)

    def _row(self, y: np.ndarray, h: float) -> None:
        plain = y[: self.vector.plain]
        self.rows.append(plain)
        self.contacts.append(self.state.contact)
        self.energies.append(_energy(self.bound, plain, self._axial(y, h)))


def _energy(bound, y: np.ndarray, axial: np.ndarray | None) -> float:
    nu, chi = y[:3], y[3 : 3 + bound.wheels]
    spins = () if axial is None else (bound.spins_from_axial(nu, chi, axial),)
    return float(bound.energy(nu, chi, *spins))


def by_fixed_steps(number_type: str) -> Callable:
    def run(task: Task, times: np.ndarray, per_sample: float) -> Outcome:
        return fixed_steps(task, times, int(per_sample), number_type)

    return run


def fixed_steps(task: Task, times: np.ndarray, per_sample: int, number_type: str) -> Outcome:
    """The step of the generated C, `per_sample` times from one sample to the next, as a controller calls it.

    A switch is known at the end of the step that passes it.
    """
    bound = kernel(task.kernel.vehicle, task.kernel.roller_model, "compiled", number_type)
    library = sets.library(bound.base, bound.effects, number_type)
    ffi, lib, state, start = library.ffi, library.lib, library.ffi.new("omniroll_state *"), task.state
    wheels, slots = bound.wheels, bound.rollers_per_wheel - 1
    arrays = {
        "chi": start.chi.astype(bound.dtype),
        "contact": start.contact.astype(np.intc),
        "work": np.zeros(24 + 14 * wheels + 4 * wheels * slots, bound.dtype),
    }
    if bound.has_spins:
        arrays |= {"axial": start.free_axial().astype(bound.dtype), "momenta": np.zeros((wheels, 2), bound.dtype)}
    for name, array in arrays.items():
        setattr(state, name, ffi.cast(f"{'int' if name == 'contact' else 'omniroll_real'} *", ffi.from_buffer(array)))
    for name in ("nu", "pose"):
        for k, number in enumerate(getattr(start, name)):
            getattr(state, name)[k] = number
    law = lib.OMNIROLL_IMPACT if task.switching == "impact" else lib.OMNIROLL_SMOOTH
    status = lib.omniroll_start(bound.model, state)
    h = (times[1] - times[0]) / per_sample
    rows, contacts, energies, switches, done = [], [], [], [], 0
    for sample in range(len(times)):
        parts = ([float(x) for x in state.nu], arrays["chi"].astype(float), [float(x) for x in state.pose])
        rows.append(np.concatenate(parts))
        contacts.append(arrays["contact"].astype(int))
        energies.append(_energy(task.kernel, rows[-1], arrays["axial"].astype(float) if bound.has_spins else None))
        for _ in range(per_sample if sample < len(times) - 1 else 0):
            before = arrays["contact"].copy()
            status = status or lib.omniroll_step(bound.model, law, h, state)
            done += 1
            changed = np.flatnonzero(arrays["contact"] != before)
            turns = (before - arrays["contact"]) % bound.rollers_per_wheel
            switches += [(done * h, int(i), 1 if turns[i] == 1 else -1) for i in changed]
    if status:
        raise SimulationStopped(f"the C step returned status {status}", t=float(times[-1]), wheel=None, state={})
    return Outcome(np.array(rows), np.array(contacts), np.array(energies), switches, 4 * done)


TOLERANCES = tuple(10.0**-k for k in range(2, 15))
COARSE = TOLERANCES[1:12:2]
FIXED = (4, 16, 64, 256, 1024)  # steps a sample
PEERS = (
    Peer("compiled", by_engine("compiled"), TOLERANCES, prepare=compiled_before, sticking=True),
    Peer("Python engine", by_engine("python"), COARSE),
    Peer("SciPy RK45", by_scipy("RK45"), (1e-3, 1e-5, 1e-7, 1e-9)),
    Peer("SciPy DOP853", by_scipy("DOP853"), COARSE),
    Peer("DOP853, float kernel", by_scipy("DOP853", "float"), TOLERANCES[1:8], with_effects=False),
    Peer("SciPy LSODA", by_scipy("LSODA"), COARSE),
    Peer("SciPy Radau", by_scipy("Radau"), (1e-3, 1e-5, 1e-7, 1e-9)),
    Peer("RK4 fixed, double", by_fixed_steps("double"), FIXED, "steps a sample", with_effects=False),
    Peer("RK4 fixed, float", by_fixed_steps("float"), FIXED, "steps a sample", with_effects=False),
)


def quietly(peer: Peer, task: Task, times: np.ndarray, setting: float) -> Outcome:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return peer.run(task, times, setting)
