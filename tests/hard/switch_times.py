"""When switches are: against the true flow."""

from collections.abc import Iterator

import numpy as np

from hard import true_flow
from hard.case import Cases, Measurement, Scale
from hard.setting import ENGINES, EPS, JOINT, MODELS, Setting, random_start, speeds_of_wheels

CASES = Cases("Switches")


@CASES.case(
    "switch-times",
    "Times of switches, against the true flow in 28 digits",
    naive="solves for the time on the interpolant of a step, which is less exact than the step",
    promise="within 100 eps (|t| + |h|) + eps |chi|/|chi'|",
)
def against_the_true_flow(scale: Scale) -> Iterator[Measurement]:
    """The first switch from random starts; the error in units of 100 eps (|t| + |h|) + eps |chi| / |chi'|."""
    random = np.random.default_rng(31)
    starts = [random_start(random, JOINT) for _ in range(scale.of(2, 20))]
    for model in MODELS:
        errors = {engine: [] for engine in ENGINES}
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
        what = "error / (100 eps (t + h) + eps chi/chi')"
        for engine in ENGINES:
            setting = Setting(model, "impact", engine)
            yield setting.measurement(what, max(errors[engine]), 1)
