"""What the engines share: the task of one run, and the trajectory that its rows make."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.engine.outlook import TO_HOLD_MORE
from omniroll.engine.switching import EPS
from omniroll.kernels.kernel import Flow, Kernel, kernel
from omniroll.kernels.phases import Carry, call_in_phases
from omniroll.results.on_demand import Stats
from omniroll.results.trajectory import Trajectory
from omniroll.results.trajectory_content import SWITCH_FIELDS
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

Progress = Callable[[float, float], Any]
Places = np.ndarray | slice
ALL = slice(None)


class Partial(Protocol):
    """A run that is not at its end yet."""

    @property
    def row_count(self) -> int:
        """How many rows there are so far."""

    @property
    def bytes_held(self) -> float:
        """Bytes that these rows and their steps take."""

    def part(self, first: int) -> Trajectory:
        """The motion from row `first` to the last one."""

    def forget(self) -> None:
        """Take all rows but the last one from memory: they have been kept elsewhere, and what follows is a part that
        begins with that row."""


Keep = Callable[[Partial], None]  # sees a run now and then
Interrupted = Callable[[], str]  # asked now and then; a text ends the run there, and says why
MEMORY = 2.0**30  # bytes that the rows and steps of a run may take; their trajectory takes some four times that
ROUNDINGS = 1000  # of the rollers' speed: more than nu' has
STATE = ("nu", "chi", "pose", "contact")  # what a run that has stopped says of its end
AS_THEY_ARE = ("elapsed", "contact", "pivots", "modes", "step_rows", "drive")  # of Rows, in a trajectory
TOO_MANY_ROWS = f"more rows than memory should hold; {TO_HOLD_MORE}"
SWITCHES_WITHOUT_PROGRESS = 200  # per wheel, before the watchdog stops a run


@dataclass(frozen=True)
class Task:
    """What is to be simulated, checked."""

    vehicle: Vehicle
    kernel: Kernel  # of the vehicle with what its effects bring
    state: State
    duration: float
    start_time: float
    switching: str
    accuracy: float
    engine: str
    progress: Progress | None
    effects: EffectSet = EffectSet()
    memory: float = MEMORY
    room: float | None = None  # bytes for the rows and steps that `keep` puts elsewhere; None: memory must hold them
    keep: Keep | None = None
    interrupted: Interrupted | None = None
    first_rows: int = 128  # of the engine's first call, if memory allows; each next one has twice as many
    coarse: Progress | None = None  # is told of the coarser run that the error estimate needs


@dataclass(frozen=True)
class Rows:
    """What a run leaves: T rows, S steps that take time, K switches of a vehicle with N wheels of n rollers.

    elapsed      (T,) time since the start of the run
    y            (T, 6 + N + E) nu, chi, pose, and E numbers that the effects integrate
    contact      (T, N) physical roller in contact
    axial        a function that gives the axial speeds of the free rollers by place, (..., N, n-1), in some rows
    dense        a function that gives the (..., d + 1, 6 + N + E) Bernstein coefficients of y on some steps
    step_rows    (S,) the row at which a step starts
    directions   (K, N) +1, -1, or 0 for a wheel that did not switch; 2 for one that stops at its joint, -2 for one that
                 goes on from there to the side from which it came; +3, -3 for one that passes on to the next arc of
                 its roller
    switch_rows  (K,) the row after a switch
    drive        (T, D, N) inputs of the drives, or None
    pivots       (T, N) 1 for a wheel with two rows or of mecanum that stands on its joint; None of others
    modes        (T, B) of bearings that may stick, as Trajectory has them; None where none may, or they are unknown
    """

    elapsed: np.ndarray
    y: np.ndarray
    contact: np.ndarray
    axial: Callable[[Places], np.ndarray]
    dense: Callable[[Places], np.ndarray]
    step_rows: np.ndarray
    directions: np.ndarray
    switch_rows: np.ndarray
    drive: np.ndarray | None = None
    pivots: np.ndarray | None = None
    modes: np.ndarray | None = None


def speed_scale(task: Task) -> float:
    """|nu(0)|, or where the vehicle rests the rollers' speed, or 1/duration; with effects at least that."""
    least = 1 / task.duration if task.duration > 0 else 1.0
    for speeds in (task.state.nu, task.state.axial):
        if speeds is not None and speeds.any():
            norm = math.hypot(*speeds.ravel().tolist())
            return max(norm, least) if task.effects else norm
    return least


def least_speed(task: Task, tolerance: float) -> float:
    """The |nu| that errors are measured against at least.

    Effects may move a vehicle far more slowly than its rollers spin. Errors count over the largest |nu|, so that the
    rollers' speed is taken only as far as its rounding in nu' asks for it.
    """
    if not task.effects:
        return speed_scale(task)
    of_rounding = speed_scale(task) * min(1.0, ROUNDINGS * EPS / tolerance)
    return max(float(np.linalg.norm(task.state.nu)), of_rounding)


def flow_at_start(effects: EffectSet, bound: Kernel, state: State, start_time: float) -> tuple[Flow, np.ndarray]:
    """The rates f(time, y) in the first phase of a run, and y at its start; without friction that sticks."""
    acting = EffectRun(effects, bound, start_time)
    acting.pass_time(0.0, state)
    y = np.zeros(acting.state_vector.size)
    places = {"nu": state.nu, "chi": state.chi, "pose": state.pose}
    acting.state_vector.put(y, places | effects.initial(bound, state))
    flow, _ = acting.phase(0.0, state.free_axial())
    return flow, y


def state_of(run: Any) -> dict[str, np.ndarray]:
    """The arrays of STATE, by name, of what has them as attributes."""
    return {name: getattr(run, name) for name in STATE}


def shown_state(run: Any) -> dict[str, list]:
    """The same as lists, for SimulationStopped."""
    return {name: array.tolist() for name, array in state_of(run).items()}


def assembled(task: Task, rows: Rows, stats: dict[str, Any]) -> Trajectory:
    """The trajectory of a run. All that follows from its rows is computed when it is first read."""
    wheels, model = task.vehicle.wheels, task.kernel.roller_model
    parts = {"nu": slice(3), "chi": slice(3, 3 + wheels), "pose": slice(3 + wheels, 6 + wheels)}

    def bound() -> Kernel:
        return kernel(task.kernel.vehicle, model, "python")  # works on all rows at once

    def contact_spin(some: Places = ALL) -> np.ndarray:
        if trajectory.contacts is not None:
            return trajectory.contacts.spins(trajectory.nu, trajectory.chi)[some]
        return bound().wheel_rates(trajectory.nu[some], trajectory.chi[some])[1]

    def spins(some: Places = ALL) -> np.ndarray:
        carry, nu, chi = Carry(trajectory.contact, trajectory.pivots).at(some), trajectory.nu, trajectory.chi
        found = call_in_phases(bound(), "spins_from_axial", nu[some], chi[some], rows.axial(some), carry=carry)
        contacts = trajectory.contacts
        return found if contacts is None else found - contacts.carried(nu, chi)[some]

    def energy(some: Places = ALL) -> np.ndarray:
        if trajectory.contacts is not None:
            axial = rows.axial(ALL) if task.kernel.has_spins else None
            return trajectory.contacts.energy_by_axial(trajectory.nu, trajectory.chi, axial)[some]
        own = (trajectory.spins if some is ALL else spins(some),) if task.kernel.has_spins else ()
        carry = Carry(trajectory.contact, trajectory.pivots).at(some)
        return call_in_phases(bound(), "energy", trajectory.nu[some], trajectory.chi[some], *own, carry=carry)

    def columns(part: slice) -> np.ndarray:
        return rows.y[:, part].copy()

    trajectory = Trajectory(
        vehicle=task.vehicle,
        roller_model=model,
        switching=task.switching,
        accuracy=task.accuracy,
        engine=task.engine,
        start_time=task.start_time,
        made={name: partial(columns, part) for name, part in parts.items()}
        | {name: partial(getattr, rows, name) for name in AS_THEY_ARE}
        | {
            "t": lambda: task.start_time + rows.elapsed,
            "contact_spin": contact_spin,
            "spins": spins if task.kernel.has_spins else lambda: None,
            "energy": energy,
            "switches": lambda: _switches(task, rows, trajectory.energy),
            "dense": lambda: rows.dense(ALL) if len(rows.step_rows) else None,
            "added": lambda: columns(slice(6 + wheels, None)) if task.effects else None,
        },
        stats=Stats(
            stats | {"error_estimate": None, "sensitivity": None},
            {"phase_energy_drift": lambda: _phase_drift(trajectory, rows.switch_rows)},
        ),
        effects=task.effects,
        in_part={"contact_spin": contact_spin, "spins": spins, "energy": energy}
        | ({"axial": rows.axial} if task.effects.slips and task.kernel.has_spins else {})
        | ({"dense": rows.dense} if len(rows.step_rows) else {}),
    )
    return trajectory


def _switches(task: Task, rows: Rows, energy: np.ndarray) -> np.recarray:
    """A record for each wheel that switched; the energy jump of a joint switch is shared equally among its wheels."""
    switch, wheel = np.nonzero(rows.directions)
    after = rows.switch_rows[switch]
    together = np.count_nonzero(rows.directions, axis=1)[switch]
    records = np.empty(len(switch), SWITCH_FIELDS)
    records["t"] = task.start_time + rows.elapsed[after]
    direction = rows.directions[switch, wheel]
    records["wheel"], records["direction"] = wheel, np.where(np.abs(direction) > 1, 0, direction)
    records["energy_jump"] = (energy[after] - energy[after - 1]) / together
    return records.view(np.recarray)


def _phase_drift(trajectory: Trajectory, switch_rows: np.ndarray) -> float:
    """The largest relative change, between two switches, of the energy less what effects have done."""
    starts = np.append(0, switch_rows)
    balance = trajectory.energy - trajectory.gained()
    change = np.maximum.reduceat(balance, starts) - np.minimum.reduceat(balance, starts)
    first = trajectory.energy[starts]
    if trajectory.effects:  # which may start from rest
        first = np.maximum.reduceat(trajectory.energy, starts)
    return float((change[first > 0] / first[first > 0]).max(initial=0.0))
