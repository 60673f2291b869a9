"""What a general library gives: SciPy's DOP853 with an event for each joint, over the same kernels and laws.

Written as its manual has it: terminal events chi_i = +-pi/n that rise, the law at whatever events the solver names,
and a restart from there.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from omniroll.runs import Task
from omniroll.switching import State, SwitchingModel


@dataclass
class Motion:
    """What a run left.

    switches  (t, wheel, direction)
    t, y      time and (nu, chi, pose) at the end; last: y before the last switch
    beyond    the largest |chi| - pi/n seen
    gave_up   too many switches, or no step
    """

    switches: list[tuple[float, int, int]] = field(default_factory=list)
    t: float = 0.0
    y: np.ndarray | None = None
    last: np.ndarray | None = None
    beyond: float = -np.inf
    gave_up: bool = False

    def times(self) -> list[float]:
        return sorted({t for t, _, _ in self.switches})


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


def simulate(task: Task, *, rtol: float = 1e-12, most_switches: int = 1000, start_time: float = 0) -> Motion:
    """The motion of a task on a clock that starts at `start_time`; it gives up after so many switches."""
    bound, state = task.kernel, task.state
    model = SwitchingModel(bound, task.switching)
    events = joint_events(bound.wheels, model.joint)
    motion, end = Motion(t=start_time, y=_packed(state)), start_time + task.duration
    while motion.t < end and not motion.gave_up:
        free = state.free_axial()
        flow = bound.flow(None if free is None else bound.momenta(free))
        with np.errstate(all="ignore"):  # beyond the joint the kernel has no meaning
            span = (motion.t, end)
            found = solve_ivp(flow, span, _packed(state), "DOP853", events=events, rtol=rtol, atol=1e-14)
        motion.t, motion.last = float(found.t[-1]), found.y[:, -1]
        chi = found.y[3 : 3 + bound.wheels]
        motion.beyond = max(motion.beyond, float(np.abs(chi).max()) - model.joint)
        state = _unpacked(motion.last, state)
        if found.status == 1:
            state = _switched(model, state, found.t_events, motion)
        motion.gave_up = found.status < 0 or len(motion.switches) > most_switches
    motion.y = _packed(state)
    return motion


def _switched(model: SwitchingModel, state: State, t_events: list, motion: Motion) -> State:
    directions = np.zeros(model.kernel.wheels, int)
    for place, times in enumerate(t_events):
        if len(times):
            directions[place // 2] = 1 - 2 * (place % 2)
            motion.switches.append((motion.t, place // 2, 1 - 2 * (place % 2)))
    return model.apply(state, directions)


def _packed(state: State) -> np.ndarray:
    return np.concatenate([state.nu, state.chi, state.pose])


def _unpacked(y: np.ndarray, like: State) -> State:
    end = 3 + len(like.chi)
    return State(y[:3], y[3:end], y[end:], like.contact, like.axial)
