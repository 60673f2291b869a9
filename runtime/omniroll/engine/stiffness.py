"""Which term of what acts on a vehicle makes its steps short, and how fast that term is; or which wheel, and why.

A term's time constant is one over the largest eigenvalue of the Jacobian of the rates. The term to blame is the one
without which that eigenvalue is smallest.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.runs import STATE, Task, flow_at_start
from omniroll.errors import OmnirollError
from omniroll.kernels.kernel import Flow
from omniroll.kernels.phases import Carry
from omniroll.vehicles.checks import joint_angle
from omniroll.vehicles.state import State

DIFFERENCE = 1e-13  # of a speed, over its size: a law that fades within less looks as if it faded within this
LARGEST_STATE = 400  # numbers; the Jacobian of a larger state takes too long
RECENT, TURNS_BACK = 64, 16  # of so many last switches a wheel that goes to and fro makes so many each way
INSTEAD = "change its start, torque or friction; where wheels slip, `joints = true` of the contact lets it stand there"
TO_CHANGE = "; change what acts on the wheel, the start or the accuracy"
SHARE = 0.5  # a term without which the rates are slower than this part of what they were is to blame


@dataclass(frozen=True)
class Sharpest:
    """The fastest term: its name in words, its time constant in s, and that of the motion, in s."""

    term: str
    time: float
    motion: float

    def __str__(self) -> str:
        ratio = self.motion / self.time
        return f"{self.term} has a time constant of {self.time:.1g} s, {ratio:.1g} times shorter than the motion's"


def blamed(task: Task, end: Mapping[str, Any]) -> str:
    """What makes the steps short where a run has come to, in words, after a colon; empty where nothing is known.

    end  nu, chi, pose, contact and axial, as a run gives them at its end
    """
    known = {name: np.array(end[name]) for name in STATE}
    known["contact"] = Carry.of_numbers(known["contact"], task.vehicle.rollers_per_wheel).contact
    state = State(*known.values(), task.state.axial)
    if end.get("axial") is not None:
        state = state.with_free_axial(np.array(end["axial"]))
    speeds = end.get("speeds", {})
    if "rates" in speeds:
        state = replace(state, rates=speeds["rates"])
    if "contact_omega" in speeds:
        state = state.with_contact_axial(speeds["contact_omega"])
    found = sharpest(replace(task, state=state))
    return "" if found is None else f": {found}"


def to_and_fro(switches: np.ndarray) -> tuple[int, str] | None:
    """The wheel that goes to and fro over its joint at the end of a run, and that in words; None where none does.

    switches  (S, 2 + N) times in s, rows, and for each wheel the direction in which it switches, or 0
    """
    last = switches[-RECENT:]
    each_way = np.minimum((last[:, 2:] > 0).sum(axis=0), (last[:, 2:] < 0).sum(axis=0))
    wheel = int(np.argmax(each_way))
    if each_way[wheel] < TURNS_BACK:
        return None
    text = f"the wheel passed its joint {each_way[wheel]} times each way in its last {last[-1, 0] - last[0, 0]:.1g} s"
    return wheel, f"{text}, since either roller drives it back to the other; {INSTEAD}"


def sharpest(task: Task) -> Sharpest | None:
    """The fastest term at the state of a task; None where nothing that acts is faster than the motion."""
    effects, motion = task.effects.effects, _motion_time(task)
    whole = _fastest(task, effects) if effects else None
    if whole is None or whole[0] * motion <= 1:
        return None
    fastest, way = whole
    found = [(rest[0], term) for term, others in _without(effects) if (rest := _fastest(task, others)) is not None]
    rate, term = min(found, default=(fastest, ""))
    return Sharpest(term + _wheel(task, way), 1 / fastest, motion) if rate < SHARE * fastest else None


def _wheel(task: Task, way: np.ndarray) -> str:
    """The wheel that a change of nu turns by far the most, in words, counted from 1; empty where there is none."""
    speeds = np.abs(task.kernel.wheel_speeds(way / max(float(np.abs(way).max()), 1e-300)))
    second, first = np.sort(speeds)[-2:] if speeds.size > 1 else (0.0, speeds[0])
    return f" at wheel {int(np.argmax(speeds)) + 1}" if first > 2 * second and first > 0 else ""


def _motion_time(task: Task) -> float:
    """In which a roller passes at the present speed, or the duration of the run; 1 s for a session, which has none."""
    longest = task.duration or 1.0
    speed = float(np.abs(task.kernel.wheel_speeds(task.state.nu)).max())
    passing = 2 * joint_angle(task.kernel.rollers_per_wheel)  # of the wheel that has most of them
    return min(longest, passing / speed) if speed > 0 else longest


def _without(effects: Sequence[Effect]) -> Iterator[tuple[str, list[Effect]]]:
    """Each term in words, and the effects without it."""
    for effect in effects:
        others = [other for other in effects if other is not effect]
        for term, rest in effect.terms():
            yield term, others if rest is None else [*others, rest]


def _fastest(task: Task, effects: Sequence[Effect]) -> tuple[float, np.ndarray] | None:
    """The largest size of an eigenvalue of the Jacobian of the rates, 1/s, and nu (3,) of its eigenvector.

    None where it cannot be had.
    """
    try:
        acting = EffectSet.checked(tuple(effects), task.vehicle)
        bound = acting.kernel(task.vehicle, task.kernel.roller_model, "python")
        flow, y = flow_at_start(acting, bound, task.state, task.start_time)
        if y.size > LARGEST_STATE:
            return None
        speed = max(float(np.abs(task.state.nu).max()), 1e-3)
        with np.errstate(all="ignore"):
            jacobian = _slopes(flow, y, DIFFERENCE * np.maximum(np.abs(y), speed))
        rates, ways = np.linalg.eig(jacobian)
    except (OmnirollError, ArithmeticError, np.linalg.LinAlgError):
        return None
    fastest = int(np.argmax(np.abs(rates)))
    return float(np.abs(rates[fastest])), ways[:3, fastest].real


def _slopes(flow: Flow, y: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The slopes (d, d) of the rates in y at the time 0, by differences of these steps (d,)."""
    rates, matrix = flow(0.0, y), np.empty((len(y), len(y)))
    for k, value in enumerate(y):
        moved = y.copy()
        moved[k] += steps[k]
        matrix[:, k] = (flow(0.0, moved) - rates) / (moved[k] - value)
    return matrix
