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

from omniroll.engine.runs import Task
from omniroll.engine.simulate import one_run
from omniroll.engine.switching import SwitchingModel, outward, tau
from omniroll.errors import SimulationStopped
from omniroll.kernels import sets
from omniroll.kernels.kernel import kernel
from omniroll.results.trajectory import Trajectory

SMALLEST_RTOL = 2.3e-14  # SciPy takes no less than 100 eps
LONGEST = 200_000  # phases or evaluations before a run is given up


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

    prepare(task, setting) compiles what has to be, and is not counted.
    """

    name: str
    run: Callable[[Task, np.ndarray, float], Outcome]
    settings: tuple[float, ...]
    setting: str = "tolerance"
    prepare: Callable[[Task, float], None] = lambda task, setting: None


def by_engine(engine: str) -> Callable:
    def run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
        own = replace(task, engine=engine, kernel=kernel(task.kernel.vehicle, task.kernel.roller_model, engine))
        return outcome_of(one_run(own, tolerance), task, times)

    return run


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
    """Phases by solve_ivp, ended by its events; switches by the switching model.

    number_type is that of the kernel whose rates are integrated; all else is in double.
    """

    def __init__(self, task: Task, times: np.ndarray, method: str, tolerance: float, number_type: str = "double"):
        self.task, self.times, self.method, self.tolerance = task, times, method, max(tolerance, SMALLEST_RTOL)
        self.bound, self.state = task.kernel, task.state
        self.rates = kernel(self.bound.vehicle, self.bound.roller_model, "compiled", number_type)
        self.wheels, self.joint = self.bound.wheels, np.pi / self.bound.rollers_per_wheel
        self.law = SwitchingModel(self.bound, task.switching)
        self.events = [self._event(3 + i, sign) for i in range(self.wheels) for sign in (1, -1)]
        self.rows: list[np.ndarray] = []
        self.contacts: list[np.ndarray] = []
        self.energies: list[float] = []
        self.switches: list[tuple[float, int, int]] = []
        self.evaluations = 0

    def _event(self, place: int, sign: int) -> Callable:
        def beyond(_: float, y: np.ndarray) -> float:
            return sign * y[place] - self.joint

        beyond.terminal, beyond.direction = True, 1.0
        return beyond

    def outcome(self) -> Outcome:
        now, duration, phase_start = 0.0, self.task.duration, 0.0
        self._switch(now, self._due())
        for _ in range(LONGEST):
            if not now < duration:
                break
            phase = self._phase(now, duration)
            self._keep(now, phase)
            now, y = float(phase.t[-1]), phase.y[:, -1]
            self._to(y)
            if phase.status == 1:
                self._switch(now, self._due(tau(self.task.start_time + now, now - phase_start)))
                phase_start = now
        self._keep_rest()
        return Outcome(
            np.array(self.rows), np.array(self.contacts), np.array(self.energies), self.switches, self.evaluations
        )

    def _phase(self, now: float, duration: float):
        axial = self.state.free_axial()
        flow = self.rates.flow(None if axial is None else self.bound.momenta(axial))
        speed = np.linalg.norm(self.state.nu) or 1.0
        radius = self.bound.vehicle.platform_radius
        scale = np.array([speed] * 3 + [self.joint] * self.wheels + [radius, radius, 1.0])
        y = np.concatenate([self.state.nu, self.state.chi, self.state.pose])
        phase = solve_ivp(
            flow, (now, duration), y, method=self.method, rtol=self.tolerance, atol=self.tolerance * scale,
            events=self.events, dense_output=True,
        )  # fmt: skip
        self.evaluations += phase.nfev
        if phase.status < 0:
            raise ArithmeticError(phase.message)
        return phase

    def _to(self, y: np.ndarray) -> None:
        end = 3 + self.wheels
        self.state = replace(self.state, nu=y[:3].copy(), chi=y[3:end].copy(), pose=y[end:].copy())

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
            self.switches += [(now, int(i), int(directions[i])) for i in np.flatnonzero(directions)]
            directions = self._due()
        raise ArithmeticError("switches without progress in time")

    def _keep(self, now: float, phase) -> None:
        while len(self.rows) < len(self.times) and self.times[len(self.rows)] < phase.t[-1]:
            self._row(phase.sol(self.times[len(self.rows)]))

    def _keep_rest(self) -> None:
        y = np.concatenate([self.state.nu, self.state.chi, self.state.pose])
        while len(self.rows) < len(self.times):
            self._row(y)

    def _row(self, y: np.ndarray) -> None:
        self.rows.append(y)
        self.contacts.append(self.state.contact)
        self.energies.append(_energy(self.bound, y, self.state.free_axial()))


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
PEERS = (
    Peer("compiled", by_engine("compiled"), TOLERANCES),
    Peer("Python engine", by_engine("python"), COARSE),
    Peer("SciPy RK45", by_scipy("RK45"), (1e-3, 1e-5, 1e-7, 1e-9)),
    Peer("SciPy DOP853", by_scipy("DOP853"), COARSE),
    Peer("DOP853, float kernel", by_scipy("DOP853", "float"), TOLERANCES[1:8]),
    Peer("SciPy LSODA", by_scipy("LSODA"), COARSE),
    Peer("SciPy Radau", by_scipy("Radau"), (1e-3, 1e-5, 1e-7, 1e-9)),
    Peer("RK4 fixed, double", by_fixed_steps("double"), (4, 16, 64, 256, 1024), "steps a sample"),
    Peer("RK4 fixed, float", by_fixed_steps("float"), (4, 16, 64, 256, 1024), "steps a sample"),
)


def quietly(peer: Peer, task: Task, times: np.ndarray, setting: float) -> Outcome:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return peer.run(task, times, setting)
