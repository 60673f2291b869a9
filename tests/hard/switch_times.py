"""When switches are: against the true flow, at any rate of switching, and backwards in time."""

import numpy as np

from hard import naive, true_flow
from hard.case import Cases, Measurement, Scale
from hard.setting import ENGINES, EPS, JOINT, MODELS, Setting, settings, speeds_of_wheels

CASES = Cases("Switches")
RATES = {"thousands of switches in a second": 1500.0, "one switch in an hour": 1.5e-4}  # |nu| in 1/s


def random_start(random: np.random.Generator) -> dict:
    return {"nu": random.normal(size=3), "chi": random.uniform(-JOINT, JOINT, 3), "spins": random.normal(size=(3, 4))}


@CASES.case(
    "switch-times",
    "Times of switches, against the true flow in 28 digits",
    naive="solves for the time on the interpolant of a step, which is less exact than the step",
    promise="within 100 eps (|t| + |h|) + eps |chi|/|chi'|",
)
def against_the_true_flow(scale: Scale) -> list[Measurement]:
    """The first switch from random starts; the error in units of 100 eps (|t| + |h|) + eps |chi| / |chi'|."""
    random = np.random.default_rng(31)
    starts = [random_start(random) for _ in range(scale.of(2, 20))]
    found = []
    for model in MODELS:
        errors, theirs = {engine: [] for engine in ENGINES}, []
        for start in starts:
            runs = {e: Setting(model, "impact", e).run(**start, duration=3.0, accuracy=1e-14) for e in ENGINES}
            reached = runs["compiled"].switches
            task = Setting(model, "impact", "python").task(**start, duration=float(reached.t[0]) * (1 + 1e-6))
            exact, wheel, _ = true_flow.first_switch(task)
            row = np.searchsorted(runs["compiled"].t, reached.t[0])
            speed = abs(runs["compiled"].nu[row] @ speeds_of_wheels(task.kernel)[:, wheel])
            allowed = 100 * EPS * 2 * exact + EPS * JOINT / speed
            for engine, run in runs.items():
                errors[engine].append(abs(run.switches.t[0] - exact) / allowed)
            if scale.compares:
                theirs.append(abs(naive.simulate(task, most_switches=0).t - exact) / allowed)
        found += [
            Setting(model, "impact", engine).measurement(
                "error / (100 eps (t + h) + eps chi/chi')", max(errors[engine]), 1, max(theirs, default=None)
            )
            for engine in ENGINES
        ]
    return found


@CASES.case(
    "any-rate",
    "Thousands of switches in a second, and one in an hour",
    naive="its absolute tolerance suits one speed only: a slow motion loses digits, or a switch",
    promise="the motion is that of ordinary speeds, scaled",
)
def any_rate(scale: Scale) -> list[Measurement]:
    """The same motion much faster and much slower: the same switches, the same path."""
    found = []
    for setting in settings():
        start = {"nu": np.array([1.0, 0.2, 1.0]), "chi": (0.1, -0.2, 0.3), "spins": np.full((3, 4), 0.5)}
        if setting.model != "free":
            del start["spins"]
        duration = scale.of(2.0, 20.0)
        base = setting.run(**start, duration=duration)
        naive_base = naive.simulate(setting.task(**start, duration=duration)) if scale.compares else None
        for name, factor in RATES.items():
            scaled = start | {key: start[key] * factor for key in ("nu", "spins") if key in start}
            run = setting.run(**scaled, duration=duration / factor)
            moved = np.abs(run.pose[-1] - base.pose[-1]).max()
            wrong = run.switches.wheel.tolist() != base.switches.wheel.tolist()
            theirs = None
            if naive_base is not None:
                motion = naive.simulate(setting.task(**scaled, duration=duration / factor))
                theirs = _naive_distance(naive_base, motion)
            found.append(setting.measurement(f"{name}: distance of the ends", moved + wrong, 1e-10, theirs))
    return found


def _naive_distance(base: naive.Motion, motion: naive.Motion) -> float:
    """As above: of the poses, and 1 for other switches."""
    wrong = [wheel for _, wheel, _ in motion.switches] != [wheel for _, wheel, _ in base.switches]
    return float(np.abs(motion.y[6:] - base.y[6:]).max()) + wrong


@CASES.case(
    "backwards",
    "Time reversed through smooth switches (massless, locked)",
    naive="switches at another place on the way back",
    promise="the run ends at the start, through the same switches",
)
def backwards(scale: Scale) -> list[Measurement]:
    """From the end with opposite speeds back to the start, through smooth switches of rollers that have no memory."""
    found = []
    for setting in settings(models=("massless", "locked"), laws=("smooth",)):
        random = np.random.default_rng(33)
        worst = theirs = 0.0
        for _ in range(scale.of(2, 20)):
            start = random_start(random)
            there = setting.run(**start, duration=6.0, accuracy=1e-13)
            end = {"nu": -there.nu[-1], "chi": there.chi[-1], "pose": there.pose[-1], "duration": 6.0}
            back = setting.run(**end, accuracy=1e-13)
            assert len(there.switches) > 3
            wrong = back.switches.wheel.tolist() != there.switches.wheel[::-1].tolist()
            worst = max(worst, _missed_start(start, back.nu[-1], back.chi[-1], back.pose[-1]) + wrong)
            if scale.compares:
                theirs = max(theirs, _naive_way_back(setting, start))
        found.append(setting.measurement("distance from the start", worst, 1e-10, scale.shown(theirs)))
    return found


def _naive_way_back(setting: Setting, start: dict) -> float:
    """How far from the start SciPy's way back ends."""
    away = naive.simulate(setting.task(**start, duration=6.0)).y
    end = {"nu": -away[:3], "chi": np.clip(away[3:6], -JOINT, JOINT), "pose": away[6:], "duration": 6.0}
    home = naive.simulate(setting.task(**end)).y
    return _missed_start(start, home[:3], home[3:6], home[6:])


def _missed_start(start: dict, nu: np.ndarray, chi: np.ndarray, pose: np.ndarray) -> float:
    return float(max(np.abs(nu + start["nu"]).max(), np.abs(chi - start["chi"]).max(), np.abs(pose).max()))
