"""Axles that stick: one by one, all at once, on a joint, on a slope, while the speed passes zero, and under impacts."""

from functools import cache
from typing import Any

import mpmath
import numpy as np

from hard import naive, on_the_spot
from hard.case import Case, Measurement, Scale
from hard.setting import ENGINES, EPS, JOINT, LAWS, MODELS, Setting, settings, speeds_of_wheels
from hard.sticking_flow import Motion, follow
from omniroll import Bearings, Torque, Trajectory

SECTION = "Effects"
ACCURACY = 1e-13
BAND = 1e-3  # rad/s: below this rate the friction of a naive implementation fades
TOUCHES = (1e-4, 1e-7, 1e-10, 1e-13)  # of the speed at the start
ROUNDINGS = 64


@cache
def engines() -> tuple[str, ...]:
    """Those that have the set-valued law."""
    probe = Setting("massless", "impact", "compiled").run(
        nu=(0, 0, 0), duration=1.0, effects=(Bearings(wheel_coulomb=1.0),)
    )
    return ENGINES if probe.stats["engine"] == "compiled" else ("python",)


def dead_band(sliding: np.ndarray, drive: naive.Law | None = None) -> naive.Law:
    """Friction whose torque fades in proportion to the rate inside a narrow band around rest."""

    def torques(t: float, rates: np.ndarray) -> np.ndarray:
        return -sliding * np.clip(rates / BAND, -1, 1) + (0.0 if drive is None else drive(t, rates))

    return torques


def apart(run: Trajectory, truth: Motion) -> float:
    """The distance of the ends, and 1 for each switch too many or too few."""
    end = np.concatenate([run.nu[-1], run.chi[-1], run.pose[-1]])
    return float(np.abs(end - truth.y).max()) + abs(len(run.switches) - len(truth.switches))


def by_scipy(setting: Setting, start: dict[str, Any], law: naive.Law, truth: np.ndarray) -> float:
    task = setting.task(**start, effects=(*start.get("effects", ()), Torque(0.0)))
    motion = naive.simulate(task, law=law, rtol=1e-9)
    return float("inf") if motion.gave_up else float(np.abs(motion.y - truth).max())


def slow_wheel(random: np.random.Generator, setting: Setting, duration: float) -> tuple[dict, np.ndarray, np.ndarray]:
    """A start with one wheel that soon stops and others near their joints; sliding and break-away torques."""
    nu = random.normal(size=3)
    per_nu = speeds_of_wheels(setting.task(nu=nu, duration=0).kernel)
    nu += per_nu[:, 0] * (0.1 - nu @ per_nu[:, 0]) / (per_nu[:, 0] @ per_nu[:, 0])
    chi = JOINT * np.array([0.1, 0.97, 0.95]) * np.sign(nu @ per_nu)
    sliding = 0.02 * random.uniform(0.5, 1.5, 3)
    start = {"nu": nu, "chi": chi, "spins": random.normal(size=(3, 4)), "duration": duration}
    return start, sliding, sliding * random.choice((1.0, 1.3), 3)


def one_by_one(scale: Scale) -> list[Measurement]:
    """From random starts until they rest, through switches that turn again what stuck."""
    found = []
    short = (("massless", "impact", 0.3), ("locked", "impact", 0.08))
    for model, law, duration in scale.of(short, [(model, law, 0.5) for model in MODELS for law in LAWS]):
        random, worst, theirs = np.random.default_rng([71, MODELS.index(model)]), dict.fromkeys(engines(), 0.0), 0.0
        judged = Setting(model, law, "python")
        for _ in range(scale.of(1, 2)):
            start, sliding, holding = slow_wheel(random, judged, duration)
            truth = follow(judged.task(**start, effects=(Torque(0.0),)), sliding, holding)
            assert any(0 in modes for _, modes in truth.modes)
            acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=holding),)
            for engine in engines():
                run = Setting(model, law, engine).run(**start, effects=acting, accuracy=ACCURACY)
                worst[engine] = max(worst[engine], apart(run, truth))
            if scale.compares:
                theirs = max(theirs, by_scipy(judged, start, dead_band(sliding), truth.y))
        found += [
            Setting(model, law, engine).measurement(
                "distance from the true motion", worst[engine], 1e-11, theirs if scale.compares else None
            )
            for engine in engines()
        ]
    return found


def stopping(nu_3: float, torque: float) -> tuple[Any, Any]:
    """Time until a vehicle that turns on the spot stops, and the angle that its wheels turn until then."""
    q, slowing = on_the_spot.rate(nu_3), on_the_spot.gain() * mpmath.mpf(torque)
    return abs(q) / slowing, q * abs(q) / (2 * slowing)


def all_at_once(scale: Scale) -> list[Measurement]:
    """On the spot all rates are the same, and come to zero at one instant."""
    found = []
    for setting in settings(models=("massless",), laws=("impact",), engines=engines()):
        random, late, missed, creeps, theirs = np.random.default_rng(72), 0.0, 0.0, 0.0, 0.0
        for _ in range(scale.of(3, 20)):
            nu_3, torque = random.choice((-1, 1)) * 10 ** random.uniform(-3, 1), 10 ** random.uniform(-3, 0)
            with on_the_spot.digits():
                stop, angle = stopping(nu_3, torque)
                start = {"nu": (0, 0, nu_3), "duration": 2 * float(stop)}
                run = setting.run(**start, effects=(Bearings(wheel_coulomb=torque),), accuracy=ACCURACY)
                rests = np.flatnonzero((run.nu == 0).all(axis=1))
                late = max(late, abs(float(run.elapsed[rests[0]] / stop - 1)) / EPS if len(rests) else np.inf)
                fastest = abs(float(on_the_spot.rate(nu_3)))
                missed = max(missed, on_the_spot.missed(run.nu[-1], run.pose[-1, 2], (mpmath.mpf(0), angle), fastest))
                creeps = max(creeps, float(np.abs(run.nu[run.elapsed > 1.001 * float(stop)]).max()))
                if scale.compares:
                    truth = np.zeros(9)
                    truth[-1] = -angle / on_the_spot.ratio()
                    task = setting.task(**start, effects=(Torque(0.0),))
                    motion = naive.simulate(task, law=dead_band(np.full(3, torque)), rtol=1e-9)
                    heading = np.inf if motion.gave_up else abs(motion.y[-1] - truth[-1]) / max(1, abs(truth[-1]))
                    theirs = max(theirs, float(heading / EPS))
        found += [
            setting.measurement("error of the instant, in eps", late, ROUNDINGS),
            setting.measurement("error of the heading, in eps", missed, ROUNDINGS, theirs if scale.compares else None),
            setting.measurement("largest nu afterwards", creeps, 0),
        ]
    return found


def on_a_joint(scale: Scale) -> list[Measurement]:
    """The wheels come to rest just before their joints, on them, and just after them."""
    found = []
    for setting in settings(models=("massless",), laws=("impact",), engines=engines()):
        random, wrong, moved, tries = np.random.default_rng(73), 0, 0.0, 0
        for _ in range(scale.of(1, 10)):
            nu_3, torque = random.choice((-1, 1)) * random.uniform(0.1, 1), random.uniform(5e-3, 2e-2)
            with on_the_spot.digits():
                stop, angle = stopping(nu_3, torque)
                turns = (
                    int((abs(angle) + mpmath.mpf(JOINT)) / (2 * mpmath.mpf(JOINT))) + 1
                )  # switches before this joint
                for beyond in (-1e-4, -1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1e-4):
                    edge = (2 * turns - 1) * mpmath.mpf(JOINT)
                    chi = float(mpmath.sign(angle) * (edge + beyond - abs(angle)))
                    start = {"nu": (0, 0, nu_3), "chi": chi, "duration": 2 * float(stop)}
                    run = setting.run(**start, effects=(Bearings(wheel_coulomb=torque),), accuracy=ACCURACY)
                    least, most = 3 * (turns - (beyond <= 0)), 3 * (turns - (beyond < 0))
                    wrong += not least <= len(run.switches) <= most or bool((np.abs(run.chi) > JOINT).any())
                    heading = -angle / on_the_spot.ratio()
                    off = float(abs(mpmath.mpf(float(run.pose[-1, 2])) - heading)) / max(1.0, float(abs(angle))) / EPS
                    moved, tries = max(moved, off, float(np.abs(run.nu[-1]).max()) / EPS), tries + 1
        found += [
            setting.measurement("stops judged wrongly, in %", 100 * wrong / tries, 0),
            setting.measurement("error of the heading, in eps", moved, ROUNDINGS),
        ]
    return found


CASES = [
    Case(
        name="stick-one-by-one",
        section=SECTION,
        title="Wheels that stick one by one, and that impacts turn again",
        naive="fades the friction in a band around rest, since with its sign alone the solver gives up: it creeps",
        promise="the motion is the true one",
        run=one_by_one,
    ),
    Case(
        name="all-stick-at-once",
        section=SECTION,
        title="All wheels stick at one instant",
        naive="creeps",
        promise=f"all rest from within {ROUNDINGS} eps of the true instant on, exactly",
        run=all_at_once,
    ),
    Case(
        name="stick-on-a-joint",
        section=SECTION,
        title="Wheels that come to rest 1e-4 ... 1e-12 rad before their joints, on them, and beyond them",
        naive="",
        promise="a joint that is passed is a switch, no other is; on the joint either will do; the wheels rest there",
        run=on_a_joint,
    ),
]
