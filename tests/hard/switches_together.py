"""Wheels that reach their joints at the same instant, or almost."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import JOINT, Setting, settings, speeds_of_wheels
from omniroll.engine.switching import tau

CASES = Cases("Switches")


def wrong_instants(switches: Iterable[tuple[float, int]], wheels: int, expected: int) -> int:
    """How many instants are missing, or have not all wheels exactly once."""
    together: dict[float, list[int]] = {}
    for t, wheel in switches:
        together.setdefault(t, []).append(wheel)
    right = sum(sorted(found) == list(range(wheels)) for found in together.values())
    return abs(expected - right) + len(together) - right


@CASES.case(
    "all-wheels-at-once",
    "All wheels at the same instant",
    naive="ends the step at the first event; the other wheels are then beyond their joints, where it sees no event",
    promise="each time all wheels switch together and are projected together",
)
def turning_on_the_spot(scale: Scale) -> Iterator[Measurement]:
    """nu = (0, 0, 1) from equal chi: by symmetry all wheels reach their joints at once, for ever."""
    task = {"nu": (0, 0, 1), "duration": scale.of(15.0, 100.0)}
    for setting in settings():
        run = setting.run(**task)
        turned = run.pose[-1, 2] * run.vehicle.yaw_scale * run.kernel.wheel_speeds(np.array([0, 0, 1.0]))[0]
        expected = int(abs(turned) / (2 * JOINT) + 0.5)
        wrong = wrong_instants(zip(run.switches.t.tolist(), run.switches.wheel.tolist(), strict=True), 3, expected)
        yield setting.measurement("instants at which not all wheels switch together", wrong, 0)


def one_behind(random: np.random.Generator, setting: Setting) -> Callable[[float | str], dict[str, Any]]:
    """Starts that turn on the spot, wheel 1 behind the others by a gap: an ulp of chi, or so many tau."""
    nu, chi = np.array([0, 0, random.uniform(0.3, 3)]), random.uniform(-0.5, 0.5)
    rate = nu @ speeds_of_wheels(setting.task(nu=nu, duration=0).kernel)[:, 0]
    arrival = (JOINT - np.sign(rate) * chi) / abs(rate)

    def start(gap: float | str) -> dict[str, Any]:
        behind = np.spacing(chi) if gap == "ulp" else gap * tau(arrival, arrival) * abs(rate)
        return {"nu": nu, "chi": (chi, chi - np.sign(rate) * behind, chi), "duration": 1.1 * arrival}

    return start


@CASES.case(
    "gaps",
    "Two wheels 1 ulp apart, tau/10 apart, 10 tau apart",
    naive="takes a difference of rounding for a difference in time, and loses the second wheel",
    promise="one switch up to tau/10, two from 10 tau on; tau = 100 eps (t + h)",
)
def gaps(scale: Scale) -> Iterator[Measurement]:
    """Turning on the spot, wheel 1 a little behind: by an ulp of chi, a tenth of tau, ten tau."""
    for setting in settings():
        random = np.random.default_rng(2)
        wrong, count = 0, scale.of(3, 30)
        for _ in range(count):
            behind_by = one_behind(random, setting)
            for gap, instants in (("ulp", 1), (0.1, 1), (10, 2)):
                start = behind_by(gap)
                switches = setting.run(**start).switches
                wrong += sorted(switches.wheel) != [0, 1, 2] or len(set(switches.t)) != instants
        share = 100 / (3 * count)
        yield setting.measurement("starts judged wrongly, in %", share * wrong, 0)
