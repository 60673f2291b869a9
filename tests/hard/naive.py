"""What a general library gives where wheels roll: SciPy's DOP853 with an event for each joint, over the same kernels.

Written as its manual has it: terminal events chi_i = +-pi/n that rise, the law at whatever events the solver names,
and a restart from there.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from omniroll.effects.effect_set import EffectRun
from omniroll.engine.runs import Task
from omniroll.engine.switching import SwitchingModel
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State


@dataclass
class Motion:
    """What a run left.

    switches  (t, wheel, direction)
    jumps     of the energy, J, at each instant of switches
    t, y      time and (nu, chi, pose) at the end
    energy    at the start and at the end, J
    """

    switches: list[tuple[float, int, int]] = field(default_factory=list)
    jumps: list[float] = field(default_factory=list)
    t: float = 0.0
    y: np.ndarray | None = None
    energy: tuple[float, float] = (np.nan, np.nan)


def energy(kernel: Kernel, state: State) -> float:
    free = state.free_axial()
    with np.errstate(all="ignore"):  # beyond the joint
        spins = () if free is None else (kernel.spins_from_axial(state.nu, state.chi, free),)
        return float(kernel.energy(state.nu, state.chi, *spins))


def joint_events(wheels: int, joint: float) -> list:
    """One terminal event for each wheel and direction, in the order (0, +), (0, -), (1, +) ..."""
    events = [lambda _, y, i=i, sign=sign: sign * y[3 + i] - joint for i in range(wheels) for sign in (1, -1)]
    for event in events:
        event.terminal, event.direction = True, 1
    return events


def simulate(task: Task, *, rtol: float = 1e-12, most_switches: int = 1000) -> Motion:
    """The motion of a task without effects; it ends after so many switches, or where the solver gives up."""
    bound, state = task.kernel, task.state
    model = SwitchingModel(bound, task.switching)
    events, motion = joint_events(bound.wheels, model.joint), Motion(y=packed(state))
    while motion.t < task.duration and len(motion.switches) <= most_switches:
        flow, _ = EffectRun(task.effects, bound, 0.0).phase(0.0, state.free_axial())
        try:
            with np.errstate(all="ignore"):  # beyond the joint the kernel has no meaning
                found = solve_ivp(flow, (motion.t, task.duration), packed(state), "DOP853", events=events, rtol=rtol,
                                  atol=1e-14)  # fmt: skip
        except ValueError:  # of its root finder: the interpolant does not meet the step's end
            break
        motion.t, state = float(found.t[-1]), unpacked(found.y[:, -1], state)
        if found.status < 0:
            break
        if found.status == 1:
            state = switched(model, state, found.t_events, motion)
    motion.y, motion.energy = packed(state), (energy(bound, task.state), energy(bound, state))
    return motion


def switched(model: SwitchingModel, state: State, t_events: list, motion: Motion) -> State:
    directions = np.zeros(model.kernel.wheels, int)
    for place, times in enumerate(t_events):
        if len(times):
            directions[place // 2] = 1 - 2 * (place % 2)
            motion.switches.append((motion.t, place // 2, 1 - 2 * (place % 2)))
    after = model.apply(state, directions)
    motion.jumps.append(energy(model.kernel, after) - energy(model.kernel, state))
    return after


def packed(state: State) -> np.ndarray:
    return np.concatenate([state.nu, state.chi, state.pose])


def unpacked(y: np.ndarray, like: State) -> State:
    end = 3 + len(like.chi)
    return State(y[:3], y[3:end], y[end : end + 3], like.contact, like.axial)
