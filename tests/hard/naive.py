"""What a general library gives: SciPy's DOP853 with an event for each joint, over the same kernels and laws.

Written as its manual has it: terminal events chi_i = +-pi/n that rise, the law at whatever events the solver names,
and a restart from there. What drives the wheels is a function that the solver calls with the rates: tables are
interpolated in it, currents cut off, friction has a sign or a dead band.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from omniroll.effects.effect_set import EffectRun
from omniroll.engine.runs import Task
from omniroll.engine.switching import SwitchingModel
from omniroll.kernels.kernel import Flow, Kernel
from omniroll.vehicles.state import State

Law = Callable[[float, np.ndarray], np.ndarray]  # (N,) torques from the elapsed time and the wheels' rates (N,)
MOST_EVALUATIONS = 200_000


class GaveUpError(ArithmeticError):
    """The solver takes too many evaluations."""


@dataclass
class Motion:
    """What a run left.

    switches  (t, wheel, direction)
    jumps     of the energy, J, at each instant of switches
    t, y      time and (nu, chi, pose) at the end
    energy    at the start and at the end, J
    beyond    the largest |chi| - pi/n seen
    gave_up   too many switches or evaluations, no step, or no event where it sees one
    seen      the elapsed times of other events that were asked for
    """

    switches: list[tuple[float, int, int]] = field(default_factory=list)
    jumps: list[float] = field(default_factory=list)
    t: float = 0.0
    y: np.ndarray | None = None
    energy: tuple[float, float] = (np.nan, np.nan)
    beyond: float = -np.inf
    gave_up: bool = False
    seen: list[float] = field(default_factory=list)

    def times(self) -> list[float]:
        return sorted({t for t, _, _ in self.switches})


def energy(kernel: Kernel, state: State) -> float:
    free = state.free_axial()
    with np.errstate(all="ignore"):  # beyond the joint
        spins = () if free is None else (kernel.spins_from_axial(state.nu, state.chi, free),)
        return float(kernel.energy(state.nu, state.chi, *spins))


def joint_events(wheels: int, joint: float) -> list:
    """One terminal event for each wheel and direction, in the order (0, +), (0, -), (1, +) ..."""
    events = []
    for wheel in range(wheels):
        for sign in (1, -1):

            def event(t, y, wheel=wheel, sign=sign):
                return sign * y[3 + wheel] - joint

            event.terminal, event.direction = True, 1
            events.append(event)
    return events


def simulate(
    task: Task,
    *,
    rtol: float = 1e-12,
    most_switches: int = 1000,
    start_time: float = 0,
    law: Law | None = None,
    watched: Sequence[Callable[[float, np.ndarray], float]] = (),
    method: str = "DOP853",
) -> Motion:
    """The motion of a task on a clock that starts at `start_time`; it gives up after so many switches.

    Of the effects a controller may act: each of its samples begins a new integration. A `law` gives the torques in
    place of a Torque of the task. `watched` are further event functions of (t, y), which end nothing.
    """
    bound, state = task.kernel, task.state
    acting = EffectRun(task.effects, bound, start_time)
    work = np.zeros(acting.state_vector.size - acting.state_vector.plain)  # integrated along, nothing depends on it
    model = SwitchingModel(bound, task.switching)
    events = [*joint_events(bound.wheels, model.joint), *watched]
    motion, end = Motion(t=start_time, y=_packed(state)), start_time + task.duration
    while motion.t < end and not motion.gave_up:
        if motion.t >= start_time + acting.next_time():
            acting.pass_time(acting.next_time(), state)
        y, span = np.append(_packed(state), work), (motion.t, min(end, start_time + acting.next_time()))
        flow, _ = acting.phase(motion.t - start_time, state.free_axial())
        if law is not None:
            flow = _driven(flow, acting, law)
        try:
            with np.errstate(all="ignore"):  # beyond the joint the kernel has no meaning
                found = solve_ivp(_counted(flow), span, y, method, events=events, rtol=rtol, atol=1e-14)
        except (GaveUpError, ValueError):  # ValueError of its root finder: the interpolant does not meet the step's end
            motion.gave_up = True
            break
        motion.t = float(found.t[-1])
        motion.seen += [float(t) for times in found.t_events[2 * bound.wheels :] for t in times]
        chi = found.y[3 : 3 + bound.wheels]
        motion.beyond = max(motion.beyond, float(np.abs(chi).max()) - model.joint)
        state = _unpacked(found.y[:, -1], state)
        if found.status == 1:
            state = _switched(model, state, found.t_events[: 2 * bound.wheels], motion)
        motion.gave_up = found.status < 0 or len(motion.switches) > most_switches
    motion.y, motion.energy = _packed(state), (energy(bound, task.state), energy(bound, state))
    return motion


def _driven(flow: Flow, acting: EffectRun, law: Law) -> Flow:
    """The same with torques by a law of time and rates."""
    torque = acting.bound_rates.buffers["torque"]

    def driven(t: float, y: np.ndarray) -> np.ndarray:
        torque[:] = law(t, acting.kernel.wheel_speeds(y[:3]))
        return flow(t, y)

    return driven


def _counted(flow: Flow) -> Flow:
    count = 0

    def counted(t: float, y: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        if count > MOST_EVALUATIONS:
            raise GaveUpError
        return flow(t, y)

    return counted


def _switched(model: SwitchingModel, state: State, t_events: list, motion: Motion) -> State:
    directions = np.zeros(model.kernel.wheels, int)
    for place, times in enumerate(t_events):
        if len(times):
            directions[place // 2] = 1 - 2 * (place % 2)
            motion.switches.append((motion.t, place // 2, 1 - 2 * (place % 2)))
    after = model.apply(state, directions)
    motion.jumps.append(energy(model.kernel, after) - energy(model.kernel, state))
    return after


def _packed(state: State) -> np.ndarray:
    return np.concatenate([state.nu, state.chi, state.pose])


def _unpacked(y: np.ndarray, like: State) -> State:
    end = 3 + len(like.chi)
    return State(y[:3], y[3:end], y[end : end + 3], like.contact, like.axial)
