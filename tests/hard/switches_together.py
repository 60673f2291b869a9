"""Wheels that reach their joints at the same instant, or almost."""

import numpy as np

from hard import naive
from hard.case import Case, Measurement, Scale
from hard.setting import JOINT, Setting, settings

SECTION = "Switches"


def wrong_instants(switches: list[tuple[float, int]], wheels: int, expected: int) -> int:
    """How many instants are missing, or have not all wheels exactly once."""
    together: dict[float, list[int]] = {}
    for t, wheel in switches:
        together.setdefault(t, []).append(wheel)
    right = sum(sorted(found) == list(range(wheels)) for found in together.values())
    return abs(expected - right) + len(together) - right


def turning_on_the_spot(scale: Scale) -> list[Measurement]:
    """nu = (0, 0, 1) from equal chi: by symmetry all wheels reach their joints at once, for ever."""
    duration = scale.of(30.0, 300.0)
    task = {"nu": (0, 0, 1), "duration": duration}

    def measured(setting: Setting) -> Measurement:
        run = setting.run(**task)
        turned = run.pose[-1, 2] * run.vehicle.yaw_scale * run.kernel.wheel_speeds(np.array([0, 0, 1.0]))[0]
        expected = int(abs(turned) / (2 * JOINT) + 0.5)
        found = list(zip(run.switches.t.tolist(), run.switches.wheel.tolist(), strict=True))
        theirs = naive.simulate(setting.task(**task)).switches
        return setting.measurement(
            "instants at which not all wheels switch together",
            wrong_instants(found, 3, expected),
            bound=0,
            naive=wrong_instants([(t, wheel) for t, wheel, _ in theirs], 3, expected),
        )

    return [measured(setting) for setting in settings()]


CASES = [
    Case(
        name="all-wheels-at-once",
        section=SECTION,
        title="All wheels at the same instant",
        naive="ends the step at the first event; the others then stand behind their joints, where no event rises",
        promise="one switch of all wheels, projected together, each time",
        run=turning_on_the_spot,
    ),
]
