"""Starts exactly on a joint; switches exactly at the end of a run or at a time of output."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import JOINT, Setting, accelerations_of_wheels, random_start, settings, speeds_of_wheels

CASES = Cases("Switches")
AT_ONCE = 1e-12  # s


@CASES.case(
    "start-on-a-joint",
    "Start exactly on a joint, moving out or in, or at rest",
    naive="sees the switch of a wheel at rest only when the wheel is some way beyond the joint",
    promise="a wheel that moves outwards, or rests and accelerates outwards, switches at once, another does not; a "
    "vehicle at rest stays as it is, and rollers that spin go on spinning",
)
def start_on_a_joint(scale: Scale) -> Iterator[Measurement]:
    for setting in settings():
        count = scale.of(6, 60)
        for what, start in (("moving", moving), ("resting", resting)):
            random = np.random.default_rng(11)
            wrong = sum(misjudged(setting, *start(random, setting)) for _ in range(count))
            yield setting.measurement(f"starts judged wrongly, {what}, in %", 100 * wrong / count, 0)
        yield setting.measurement("largest change of a vehicle at rest", change_at_rest(setting), 0)


def moving(random: np.random.Generator, setting: Setting) -> tuple[dict[str, Any], float]:
    """A start whose wheel 0 stands on a joint and moves; and how fast outwards."""
    sign = random.choice((1, -1))
    task = random_start(random, duration=0.2)
    task["chi"][0] = sign * JOINT
    return task, sign * (task["nu"] @ speeds_of_wheels(setting.task(**task).kernel)[:, 0])


def resting(random: np.random.Generator, setting: Setting) -> tuple[dict[str, Any], float]:
    """A start whose wheel 0 rests on a joint, nu = (nu_1, 0, 0); and its acceleration outwards."""
    sign = random.choice((1, -1))
    chi = np.append(sign * JOINT, random.uniform(-0.5, 0.5, 2))
    task = {"nu": (random.normal(), 0, 0), "chi": chi, "duration": 1e-3}
    return task, sign * accelerations_of_wheels(setting.task(**task))[0]


def misjudged(setting: Setting, task: dict[str, Any], outwards: float) -> bool:
    """Whether wheel 0 switches at once where it should not, or the other way round."""
    switches = setting.run(**task).switches
    return bool(((switches.t <= AT_ONCE) & (switches.wheel == 0)).any()) != (outwards > 0)


def change_at_rest(setting: Setting) -> float:
    """Of what stands, and of spins of free rollers, which go on."""
    run = setting.run(nu=(0, 0, 0), chi=(JOINT, -JOINT, 0.1), spins=3.0, duration=5.0)
    still = [run.nu, run.chi - run.chi[0], run.pose, run.contact - run.contact[0]]
    still += [run.spins - 3.0] if setting.model == "free" else []
    return max(float(np.abs(values).max()) for values in still) + len(run.switches)


@CASES.case(
    "switch-at-the-end",
    "A switch at the end time or at an output time",
    naive="misses the event at the end, or gives the sample before the switch",
    promise="the switch is in the run, and a sample at its time is the state after it",
)
def at_the_end(scale: Scale) -> Iterator[Measurement]:
    """A run that ends at the time of a switch has it; a sample at that time shows the state after it."""
    for setting in settings():
        random, ends, samples = np.random.default_rng(13), 0, 0
        for _ in range(scale.of(2, 10)):
            task = {"nu": random.normal(size=3), "chi": random.uniform(-0.5, 0.5, 3), "duration": 2.0}
            whole = setting.run(**task)
            times = np.unique(whole.switches.t)
            ends += missing_ends(setting, task, times[:2], whole)
            samples += wrong_samples(whole, times)
        yield setting.measurement("switches missing at the end of a run", ends, 0)
        yield setting.measurement("samples on the wrong side of a switch", samples, 0)


def missing_ends(setting: Setting, task: dict, times: np.ndarray, whole) -> int:
    """How many of the runs that end at one of the times do not have the whole run's switches until then."""
    ends = ((t, setting.run(**task | {"duration": float(t)}).switches.wheel.tolist()) for t in times)
    return sum(wheels != whole.switches.wheel[whole.switches.t <= t].tolist() for t, wheels in ends)


def wrong_samples(run, times: np.ndarray) -> int:
    rows = np.searchsorted(run.t, times, side="right") - 1
    before = np.searchsorted(run.t, times, side="left")
    pairs = ((times, rows), (np.nextafter(times, 0), before))
    return sum(int((run.sample(t).contact != run.contact[row]).any(axis=-1).sum()) for t, row in pairs)
