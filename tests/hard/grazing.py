"""Wheels that turn back near their joints: before it, at it, beyond it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from hard import true_flow
from hard.case import Cases, Measurement, Scale
from hard.setting import (
    ENGINES,
    EPS,
    JOINT,
    LAWS,
    MODELS,
    Setting,
    accelerations_of_wheels,
    random_start,
    settings,
    speeds_of_wheels,
)

CASES = Cases("Switches")
NOISE = 8 * EPS * JOINT  # a turn that is less than this beyond the joint may count as a touch
DISTANCES = (1e-4, 1e-7, 1e-10, 1e-12, 1e-14)  # of a turn from the joint, in rad


@dataclass(frozen=True)
class Turn:
    """A start whose wheel 0 moves outwards and turns back; where it is then in the true flow, beyond pi/n."""

    model: str
    start: dict
    beyond: float


def _outwards(random: np.random.Generator, model: str) -> dict | None:
    """A start near the joint with a small speed outwards and an acceleration inwards, or None."""
    setting = Setting(model, "smooth", "python")
    start = random_start(random, 0.3, duration=1.0)
    start["chi"][0] = 0.97 * JOINT
    speed = 10 ** random.uniform(-2.5, -1)
    per_nu = speeds_of_wheels(setting.task(**start).kernel)[:, 0]
    start["nu"][2] += (speed - start["nu"] @ per_nu) / per_nu[2]
    acceleration = accelerations_of_wheels(setting.task(**start))[0]
    if not -20 < acceleration < -0.3:
        return None
    start["chi"][0] = JOINT - speed**2 / (2 * -acceleration)
    return start | {"duration": 2 * speed / -acceleration}


def _aimed(model: str, start: dict, beyond: float) -> Turn | None:
    """The start moved until its peak lies `beyond` the joint; None where the series or the roller are too short."""
    chi = start["chi"].copy()
    for _ in range(4):
        if abs(chi[0]) > JOINT:
            return None
        aimed = start | {"chi": chi.copy()}
        try:
            found = true_flow.most_beyond(Setting(model, "smooth", "python").task(**aimed), 0, 1)
        except ValueError:
            return None
        if abs(found - beyond) < EPS * JOINT:
            break
        chi[0] += beyond - found
    return Turn(model, aimed, found)


@cache
def starts(model: str, count: int, beyond: float) -> list[Turn]:
    """Starts whose wheel 0 turns `beyond` the joint, as exactly as the floats allow."""
    random, found = np.random.default_rng([7, MODELS.index(model)]), []
    while len(found) < count:
        start = _outwards(random, model)
        turn = start and _aimed(model, start, beyond)
        found += [turn] if turn else []
    return found


def amount(scale: Scale) -> tuple[int, tuple[float, ...]]:
    """Starts for each distance, and distances."""
    return scale.of((1, DISTANCES[::2]), (4, DISTANCES))


@CASES.case(
    "turning-back",
    "Turning back just before, at and just after the joint",
    naive="looks only at the ends of steps, where the wheel is inside both times",
    promise=f"a turn that passes the joint by more than {NOISE:.1e} rad (8 eps) is seen, one before it is none",
)
def turning_back(scale: Scale) -> Iterator[Measurement]:
    """Before and after the joint: is the switch seen where there is one, and not where there is none?"""
    count, distances = amount(scale)
    for setting in settings():
        wrong = 0
        own = [turn for d in distances for sign in (1, -1) for turn in starts(setting.model, count, sign * d)]
        for turn in own:
            wrong += (0 in setting.run(**turn.start).switches.wheel) != (turn.beyond > 0)
        yield setting.measurement("turns judged wrongly, in %", 100 * wrong / len(own), 0)


@CASES.case(
    "out-and-in",
    "Out and in again within one step",
    naive="makes no switch, or makes one where the wheel comes back",
    promise="the switch is at the first crossing: in the true motion the wheel is there within 8 eps of its joint",
)
def out_and_in(scale: Scale) -> Iterator[Measurement]:
    """Where the true flow is at the time at which the engines see the wheel leave its roller."""
    count, distances = amount(scale)
    for setting in settings(laws=("smooth",)):
        worst = 0.0
        for turn in [turn for d in distances for turn in starts(setting.model, count, d)]:
            run = setting.run(**turn.start, accuracy=1e-14)
            worst = max(worst, _misplaced(turn, run.switches.t[run.switches.wheel == 0]))
        yield setting.measurement("|chi| of the true flow there minus pi/n, in eps pi/n", worst, 8)


def _misplaced(turn: Turn, times) -> float:
    """Of the first of the times; infinite where there is none."""
    if not len(times):
        return float("inf")
    task = Setting(turn.model, "smooth", "python").task(**turn.start)
    return abs(true_flow.beyond_at(task, 0, 1, [float(times[0])])[0]) / (EPS * JOINT)


@CASES.case(
    "vanishing-at-the-joint",
    "A wheel whose speed vanishes exactly at the joint",
    promise="either no switch, or one and back; the motion is the same but for the time between, sqrt(8 eps); |chi| "
    "<= pi/n",
)
def vanishing_at_the_joint(scale: Scale) -> Iterator[Measurement]:
    """The wheel's speed vanishes at the joint, as exactly as floats can say it: a touch or a switch."""
    for model in MODELS:
        for law in LAWS if model == "massless" else ("smooth",):
            both = [Setting(model, law, engine) for engine in ENGINES]
            for turn in starts(model, scale.of(2, 8), 0.0):
                runs = [setting.run(**turn.start) for setting in both]
                apart = float(np.abs(runs[0].nu[-1] - runs[1].nu[-1]).max() / np.linalg.norm(turn.start["nu"]))
                for setting, run in zip(both, runs, strict=True):
                    beyond = float(np.abs(run.chi).max() - JOINT) / (EPS * JOINT)
                    yield setting.measurement("|chi| - pi/n, largest, in eps pi/n", beyond, 0)
                    if model != "free":
                        what = "distance of the engines' nu afterwards"
                        yield setting.measurement(what, apart, NOISE**0.5)
