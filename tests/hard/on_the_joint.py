"""Starts exactly on a joint; switches exactly at the end of a run or at a time of output."""

import numpy as np

from hard import naive
from hard.case import Cases, Measurement, Scale
from hard.setting import JOINT, Setting, accelerations_of_wheels, settings, speeds_of_wheels

CASES = Cases("Switches")
AT_ONCE = 1e-12  # s


@CASES.case(
    "start-on-a-joint",
    "Start exactly on a joint, moving out or in",
    naive="is as good: it counts an event that rises from exactly 0",
    promise="a wheel that moves outwards switches at once, one that moves inwards does not",
)
def start_moving(scale: Scale) -> list[Measurement]:
    """Wheel 0 stands on a joint and moves: at once a switch outwards, none inwards."""
    found = []
    for setting in settings():
        random = np.random.default_rng(11)
        judged, count = np.zeros(2), scale.of(6, 60)
        for _ in range(count):
            sign = random.choice((1, -1))
            task = {
                "nu": random.normal(size=3),
                "chi": np.append(sign * JOINT, random.uniform(-0.5, 0.5, 2)),
                "spins": random.normal(size=(3, 4)),
                "duration": 0.2,
            }
            outwards = sign * (task["nu"] @ speeds_of_wheels(setting.task(**task).kernel)[:, 0]) > 0
            judged += _misjudged(setting, task, outwards)
        wrong, theirs = 100 * judged / count
        found.append(setting.measurement("starts judged wrongly, in %", wrong, 0, theirs))
    return found


def _misjudged(setting: Setting, task: dict, outwards: bool) -> np.ndarray:
    """(2,) bool: whether wheel 0 switches at once where it should not, or the other way round; the same of the naive
    run."""
    switches, theirs = setting.run(**task).switches, naive.simulate(setting.task(**task), most_switches=10).switches
    both = zip(switches.t, switches.wheel, strict=True), ((t, wheel) for t, wheel, _ in theirs)
    return np.array([any(t <= AT_ONCE and wheel == 0 for t, wheel in found) != outwards for found in both])


@CASES.case(
    "rest-on-a-joint",
    "Start exactly on a joint, at rest",
    naive="sees the switch only when the wheel is some way beyond the joint",
    promise="a wheel that accelerates outwards switches at once, another does not; a vehicle at rest stays as it is",
)
def start_at_rest(scale: Scale) -> list[Measurement]:
    """Wheel 0 rests on a joint, nu = (nu_1, 0, 0): it is a switch where the wheel accelerates outwards."""
    found = []
    for setting in settings():
        random = np.random.default_rng(12)
        judged, count = np.zeros(2), scale.of(6, 40)
        for _ in range(count):
            sign = random.choice((1, -1))
            task = {
                "nu": (random.normal(), 0, 0),
                "chi": np.append(sign * JOINT, random.uniform(-0.5, 0.5, 2)),
                "duration": 1e-3,
            }
            outwards = sign * accelerations_of_wheels(setting.task(**task))[0] > 0
            judged += _misjudged(setting, task, outwards)
        wrong, theirs = 100 * judged / count
        found.append(setting.measurement("starts judged wrongly, in %", wrong, 0, theirs))
        found.append(setting.measurement("largest change of a vehicle at rest", _change_at_rest(setting), 0))
    return found


def _change_at_rest(setting: Setting) -> float:
    run = setting.run(nu=(0, 0, 0), chi=(JOINT, -JOINT, 0.1), duration=5.0)
    still = [run.nu, run.chi - run.chi[0], run.pose, run.contact - run.contact[0]]
    return max(float(np.abs(values).max()) for values in still) + len(run.switches)


@CASES.case(
    "switch-at-the-end",
    "A switch at the end time or at an output time",
    naive="misses the event at the end, or gives the sample before the switch",
    promise="the switch is in the run, and a sample at its time is the state after it",
)
def at_the_end(scale: Scale) -> list[Measurement]:
    """A run that ends at the time of a switch has it; a sample at that time shows the state after it."""
    found = []
    for setting in settings():
        random = np.random.default_rng(13)
        ends, samples, theirs, count = 0, 0, 0, 0
        for _ in range(scale.of(2, 10)):
            task = {"nu": random.normal(size=3), "chi": random.uniform(-0.5, 0.5, 3), "duration": 2.0}
            whole = setting.run(**task)
            times = np.unique(whole.switches.t)
            ends += _missing_ends(setting, task, times[:2], whole)
            samples += _wrong_samples(whole, times)
            if scale.compares:
                first = naive.simulate(setting.task(**task | {"duration": float(times[0])}))
                theirs += len(first.switches) == 0
            count += 1
        found.append(setting.measurement("switches missing at the end of a run", ends, 0, scale.shown(theirs)))
        found.append(setting.measurement("samples on the wrong side of a switch", samples, 0))
    return found


def _missing_ends(setting: Setting, task: dict, times: np.ndarray, whole) -> int:
    """How many of the runs that end at one of the times do not have the whole run's switches until then."""
    missing = 0
    for t in times:
        run = setting.run(**task | {"duration": float(t)})
        missing += run.switches.wheel.tolist() != whole.switches.wheel[whole.switches.t <= t].tolist()
    return missing


def _wrong_samples(run, times: np.ndarray) -> int:
    rows = np.searchsorted(run.t, times, side="right") - 1
    before = np.searchsorted(run.t, times, side="left")
    at, just_before = run.sample(times), run.sample(np.nextafter(times, 0))
    return int((at.contact != run.contact[rows]).any(axis=-1).sum()) + int(
        (just_before.contact != run.contact[before]).any(axis=-1).sum()
    )
