"""Wheels that reach their joints at the same instant, or almost."""

import numpy as np

from hard import naive
from hard.case import Cases, Measurement, Scale
from hard.setting import JOINT, PAPER, Setting, settings, speeds_of_wheels
from omniroll.engine.switching import tau

CASES = Cases("Switches")


def wrong_instants(switches: list[tuple[float, int]], wheels: int, expected: int) -> int:
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
def turning_on_the_spot(scale: Scale) -> list[Measurement]:
    """nu = (0, 0, 1) from equal chi: by symmetry all wheels reach their joints at once, for ever."""
    duration = scale.of(15.0, 100.0)
    task = {"nu": (0, 0, 1), "duration": duration}

    def measured(setting: Setting) -> Measurement:
        run = setting.run(**task)
        turned = run.pose[-1, 2] * run.vehicle.yaw_scale * run.kernel.wheel_speeds(np.array([0, 0, 1.0]))[0]
        expected = int(abs(turned) / (2 * JOINT) + 0.5)
        found = list(zip(run.switches.t.tolist(), run.switches.wheel.tolist(), strict=True))
        theirs = None
        if scale.compares:
            switches = naive.simulate(setting.task(**task)).switches
            theirs = wrong_instants([(t, wheel) for t, wheel, _ in switches], 3, expected)
        return setting.measurement(
            "instants at which not all wheels switch together",
            wrong_instants(found, 3, expected),
            bound=0,
            naive=theirs,
        )

    return [measured(setting) for setting in settings()]


@CASES.case(
    "gaps",
    "Two wheels 1 ulp apart, tau/10 apart, 10 tau apart",
    naive="takes a difference of rounding for a difference in time, and loses the second wheel",
    promise="one switch up to tau/10, two from 10 tau on; tau = 100 eps (t + h)",
)
def gaps(scale: Scale) -> list[Measurement]:
    """Turning on the spot, wheel 1 a little behind: by an ulp of chi, a tenth of tau, ten tau."""
    found = []
    for setting in settings():
        random = np.random.default_rng(2)
        wrong, theirs, count = 0, 0, scale.of(3, 30)
        for _ in range(count):
            nu, chi = np.array([0, 0, random.uniform(0.3, 3)]), random.uniform(-0.5, 0.5)
            rate = nu @ speeds_of_wheels(setting.task(nu=nu, duration=0).kernel)[:, 0]
            arrival = (JOINT - np.sign(rate) * chi) / abs(rate)
            for gap, instants in (("ulp", 1), (0.1, 1), (10, 2)):
                behind = np.spacing(chi) if gap == "ulp" else gap * tau(arrival, arrival) * abs(rate)
                start = {"nu": nu, "chi": (chi, chi - np.sign(rate) * behind, chi), "duration": 1.1 * arrival}
                switches = setting.run(**start).switches
                wrong += sorted(switches.wheel) != [0, 1, 2] or len(set(switches.t)) != instants
                if scale.compares:
                    others = naive.simulate(setting.task(**start)).switches
                    theirs += sorted(w for _, w, _ in others) != [0, 1, 2] or len({t for t, *_ in others}) != instants
        share = 100 / (3 * count)
        found.append(setting.measurement("starts judged wrongly, in %", share * wrong, 0, scale.shown(share * theirs)))
    return found


@CASES.case(
    "relabelled",
    "Wheels in another order",
    naive="is as good here, where the wheels arrive one after the other",
    promise="the switches and the motion are the same",
)
def relabelled(scale: Scale) -> list[Measurement]:
    """The wheels in another order: the same switches of the same wheels, the same motion."""
    vehicle = PAPER.replace(wheel_angles=(0.1, 2.0, 4.4))
    found = []
    for setting in settings():
        random = np.random.default_rng(3)
        worst, theirs, duration = 0.0, 0.0, scale.of(3.0, 6.0)
        for _ in range(scale.of(1, 6)):
            nu, chi, spins = random.normal(size=3), random.uniform(-JOINT, JOINT, 3), random.normal(size=(3, 4))
            order = random.permutation(3)
            again = vehicle.replace(wheel_angles=[vehicle.wheel_angles[k] for k in order])
            start = {"nu": nu, "chi": chi, "spins": spins, "duration": duration}
            ordered = start | {"chi": chi[order], "spins": spins[order]}
            one, other = setting.run(vehicle, **start), setting.run(again, **ordered)
            apart = np.abs(one.pose[-1] - other.pose[-1]).max() + np.abs(one.nu[-1] - other.nu[-1]).max()
            wrong = order[other.switches.wheel].tolist() != one.switches.wheel.tolist()
            worst = max(worst, float(apart) + wrong)
            if scale.compares:
                motions = naive.simulate(setting.task(vehicle, **start)), naive.simulate(setting.task(again, **ordered))
                theirs = max(theirs, _naive_distance(*motions, order))
        found.append(setting.measurement("distance of the ends", worst, 1e-9, scale.shown(theirs)))
    return found


def _naive_distance(one: naive.Motion, other: naive.Motion, order: np.ndarray) -> float:
    """As above: nu and pose at the ends, and 1 for other switches."""
    (nu, _, pose), (other_nu, _, other_pose) = np.split(one.y, [3, 6]), np.split(other.y, [3, 6])
    wrong = [int(order[wheel]) for _, wheel, _ in other.switches] != [wheel for _, wheel, _ in one.switches]
    return float(np.abs(pose - other_pose).max() + np.abs(nu - other_nu).max()) + wrong
