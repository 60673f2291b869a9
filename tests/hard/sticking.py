"""Axles that stick: one by one, all at once, on a joint, on a slope, while the speed passes zero, and under impacts."""

from functools import cache
from typing import Any

import mpmath
import numpy as np

from hard import naive, on_the_spot
from hard.case import Cases, Measurement, Scale
from hard.known_times import equal, interpolated
from hard.setting import EPS, JOINT, LAWS, MODELS, PAPER, Setting, settings, speeds_of_wheels
from hard.sticking_flow import Held, Motion, follow
from omniroll import Bearings, Slope, Torque, TorqueTable, Trajectory
from omniroll.studies.accuracy.reference import digits

CASES = Cases("Effects")
ACCURACY = 1e-13
BAND = 1e-3  # rad/s: below this rate the friction of a naive implementation fades
TOUCHES = (1e-4, 1e-7, 1e-10, 1e-13)  # of the speed at the start
ROUNDINGS = 64
TENFOLD = 10 * ACCURACY / EPS  # eps: ten times the accuracy that was asked for


@cache
def engines() -> tuple[str, ...]:
    """Those that have the set-valued law with events."""
    return ("compiled",)


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
    chi = JOINT * np.array([0.1, 0.93, 0.9]) * np.sign(nu @ per_nu)
    sliding = 0.02 * random.uniform(0.5, 1.5, 3)
    start = {"nu": nu, "chi": chi, "spins": random.normal(size=(3, 4)), "duration": duration}
    return start, sliding, sliding * random.choice((1.0, 1.3), 3)


@CASES.case(
    "stick-one-by-one",
    "Wheels that stick one by one, and that impacts turn again",
    naive="fades the friction in a band around rest, since with its sign alone the solver gives up: it creeps",
    promise="the motion is the true one",
)
def one_by_one(scale: Scale) -> list[Measurement]:
    """From random starts until they rest, through switches that turn again what stuck."""
    found = []
    short = (("massless", "impact", 0.3), ("locked", "impact", 0.1))
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
                "distance from the true motion", worst[engine], 1e-11, scale.shown(theirs)
            )
            for engine in engines()
        ]
    return found


def stopping(nu_3: float, torque: float) -> tuple[Any, Any]:
    """Time until a vehicle that turns on the spot stops, and the angle that its wheels turn until then."""
    q, slowing = on_the_spot.rate(nu_3), on_the_spot.gain() * mpmath.mpf(torque)
    return abs(q) / slowing, q * abs(q) / (2 * slowing)


@CASES.case(
    "all-stick-at-once",
    "All wheels stick at one instant",
    naive="creeps",
    promise=f"all rest from within {ROUNDINGS} eps of the true instant on, exactly",
)
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
            setting.measurement("error of the heading, in eps", missed, ROUNDINGS, scale.shown(theirs)),
            setting.measurement("largest nu afterwards", creeps, 0),
        ]
    return found


@CASES.case(
    "stick-on-a-joint",
    "Wheels that come to rest 1e-4 ... 1e-12 rad before their joints, on them, and beyond them",
    naive="creeps over the joint, or ends short of it",
    promise="a joint that is passed is a switch, no other is; on the joint any will do; the wheels rest there",
)
def on_a_joint(scale: Scale) -> list[Measurement]:
    """The wheels come to rest just before their joints, on them, and just after them."""
    found, distances = [], (-1e-4, -1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1e-4)
    for setting in settings(models=("massless",), laws=("impact",), engines=engines()):
        random, wrong, theirs, moved, count = np.random.default_rng(73), 0, 0, 0.0, scale.of(1, 10)
        for _ in range(count):
            nu_3, torque = random.choice((-1, 1)) * random.uniform(0.1, 1), random.uniform(5e-3, 2e-2)
            with on_the_spot.digits():
                stop, angle = stopping(nu_3, torque)
                edges = int((abs(angle) + mpmath.mpf(JOINT)) / (2 * mpmath.mpf(JOINT)))  # passed before this joint
                heading = -angle / on_the_spot.ratio()
                for beyond in distances:
                    chi = mpmath.sign(angle) * ((2 * edges + 1) * mpmath.mpf(JOINT) + beyond - abs(angle))
                    start = {"nu": (0, 0, nu_3), "chi": float(chi), "duration": 2 * float(stop)}
                    run = setting.run(**start, effects=(Bearings(wheel_coulomb=torque),), accuracy=ACCURACY)
                    wrong += not _switches_fit(len(run.switches), edges, beyond) or bool(
                        (np.abs(run.chi) > JOINT).any()
                    )
                    off = float(abs(mpmath.mpf(float(run.pose[-1, 2])) - heading)) / max(1.0, float(abs(angle))) / EPS
                    moved = max(moved, off, float(np.abs(run.nu[-1]).max()) / EPS)
                    if scale.compares:
                        task, law = setting.task(**start, effects=(Torque(0.0),)), dead_band(np.full(3, torque))
                        motion = naive.simulate(task, law=law, rtol=1e-9, method="LSODA")
                        theirs += motion.gave_up or not _switches_fit(len(motion.switches), edges, beyond)
        share = 100 / (count * len(distances))
        found += [
            setting.measurement("stops judged wrongly, in %", share * wrong, 0, scale.shown(share * theirs)),
            setting.measurement("error of the heading, in eps", moved, ROUNDINGS),
        ]
    return found


def _switches_fit(switches: int, edges: int, beyond: float) -> bool:
    """Of three wheels that have passed so many joints and stop at the next, or this much beyond it."""
    if beyond == 0:  # within rounding; also there and back
        return 3 * edges <= switches <= 3 * edges + 6
    return switches == 3 * (edges + (beyond > 0))


def break_away(start: dict[str, Any], setting: Setting, slope: Slope) -> Any:
    """The least torque in 28 digits, the same for all axles, that holds the vehicle at rest; inside digits()."""
    task = setting.task(**start, effects=(slope, Torque(0.0)))
    held = Held(task, np.zeros(3))
    held.modes = [0, 0, 0]
    y, axial = held.start()
    held.rates(held.begin(y, axial, held.number(0.0)))
    return max((abs(torque) for torque in held.taken.values()), key=float)


@CASES.case(
    "break-away-angle",
    "A slope at exactly the break-away angle, and 1 ulp beside it",
    naive="creeps down",
    promise="rest is held at the exact torque and 1 ulp above it, also where sliding takes less; "
    f"{ROUNDINGS} eps below it is not; in between it may be held or not, which moves no further than rounding",
)
def at_its_break_away_angle(scale: Scale) -> list[Measurement]:
    """At rest on a slope, with break-away torques at the exact one, 1 ulp beside it, and 64 eps below it."""
    found = []
    for setting in settings(models=scale.of(("massless", "free"), MODELS), laws=("impact",), engines=engines()):
        random, judged = (
            np.random.default_rng([74, MODELS.index(setting.model)]),
            Setting(setting.model, "impact", "python"),
        )
        lets_go, beside, holds, theirs = 0.0, 0.0, 0, 0.0
        count = scale.of(2, 6)
        for _ in range(count):
            slope = Slope(10 ** random.uniform(-3, 0), random.uniform(-3, 3))
            start = {"nu": (0, 0, 0), "chi": random.uniform(-0.5, 0.5, 3), "pose": (0, 0, random.uniform(-3, 3))}
            start["duration"] = 1.0
            with digits():
                exact = break_away(start, judged, slope)
            least = _rounded_up(exact)
            for torque, sliding in ((least, least), (np.nextafter(least, np.inf), 0.3 * least)):
                acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=torque), slope)
                run = setting.run(**start | {"duration": 1000.0}, effects=acting, accuracy=1e-9)
                lets_go = max(lets_go, float(np.abs(run.nu).max()))
            below = float(np.nextafter(least, 0.0))
            beside = max(beside, _distance(setting, start, slope, below)[0] / (EPS * 9.8 * slope.angle))
            off, way = _distance(setting, start, slope, least * (1 - ROUNDINGS * EPS))
            holds += off > 0.5 * way
            if scale.compares:
                task = judged.task(**start, effects=(slope, Torque(0.0)))
                motion = naive.simulate(task, law=dead_band(np.full(3, least)), rtol=1e-9, method="LSODA")
                theirs = max(theirs, np.inf if motion.gave_up else float(np.abs(motion.y[:3]).max()))
        found += [
            setting.measurement("at the angle: largest nu", lets_go, 0, scale.shown(theirs)),
            setting.measurement("1 ulp beyond it: error of nu after 1 s / (eps g angle)", beside, ROUNDINGS),
            setting.measurement(f"{ROUNDINGS} eps beyond it: starts that do not slide, in %", 100 * holds / count, 0),
        ]
    return found


def _rounded_up(value: Any) -> float:
    near = float(value)
    return float(np.nextafter(near, np.inf)) if float(value - near) > 0 else near


def _distance(setting: Setting, start: dict[str, Any], slope: Slope, torque: float) -> tuple[float, float]:
    """How far nu is from the true one at the end of a start from rest, and how large the true one is."""
    judged = Setting(setting.model, setting.law, "python")
    truth = follow(judged.task(**start, effects=(slope, Torque(0.0))), np.full(3, torque), np.full(3, torque))
    run = setting.run(**start, effects=(Bearings(wheel_coulomb=torque), slope), accuracy=ACCURACY)
    return float(np.abs(run.nu[-1] - truth.y[:3]).max()), float(np.abs(truth.y[:3]).max())


@CASES.case(
    "touching-zero",
    "A speed whose least value is zero, and 1e-4 ... 1e-13 of the first one above and below",
    naive="creeps through zero: its motion knows of no break-away",
    promise="below zero the wheels stick until they break away, above they do not",
)
def touching(scale: Scale) -> list[Measurement]:
    """The drive slows the wheels down and then speeds them up; their least speed is just above zero, or just below.

    Below it they stick, until the drive is at the break-away torque, so that the motions afterwards are far apart.
    """
    found, distances = [], scale.of(TOUCHES[1::2], TOUCHES)
    for setting in settings(models=("massless",), laws=("impact",), engines=engines()):
        random, wrong, missed, theirs, tries = np.random.default_rng(75), 0, 0.0, 0.0, 0
        for _ in range(scale.of(1, 6)):
            sliding, growth = random.uniform(5e-3, 2e-2), random.uniform(1e-2, 5e-2)
            holding = 1.5 * sliding
            table = TorqueTable((0.0, 4.0), equal([0.0, 4.0 * growth]))
            for distance in [sign * d for d in distances for sign in (1, -1)]:
                with on_the_spot.digits():
                    lost = on_the_spot.gain() * mpmath.mpf(sliding) ** 2 / (2 * mpmath.mpf(growth))
                    nu_3 = float(-lost * (1 + distance) * mpmath.mpf(PAPER.yaw_scale) / on_the_spot.ratio())
                    stops = on_the_spot.rate(nu_3) < lost
                    duration = 1.5 * holding / growth
                    end = _through_zero(nu_3, sliding, holding, growth, duration)
                    start = {"nu": (0, 0, nu_3), "duration": duration}
                    acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=holding), table)
                    run = setting.run(**start, effects=acting, accuracy=ACCURACY)
                    fastest = abs(float(on_the_spot.rate(nu_3)))
                    wrong, tries = wrong + (bool((run.nu == 0).all(axis=1).any()) != stops), tries + 1
                    missed = max(missed, on_the_spot.missed(run.nu[-1], run.pose[-1, 2], end, fastest))
                    if scale.compares:
                        law = dead_band(np.full(3, sliding), interpolated(table))
                        motion = naive.simulate(setting.task(**start, effects=(Torque(0.0),)), law=law, rtol=1e-9)
                        theirs = max(theirs, on_the_spot.missed(motion.y[:3], motion.y[-1], end, fastest))
        found += [
            setting.measurement("touches judged wrongly, in %", 100 * wrong / tries, 0),
            setting.measurement("error of nu and heading, in eps", missed, TENFOLD, scale.shown(theirs)),
        ]
    return found


def _through_zero(nu_3: float, sliding: float, holding: float, growth: float, duration: float) -> tuple[Any, Any]:
    """q and angle at the end: q > 0 slows down under a torque that grows from 0, and may stop and break away."""
    q, slide, hold, grow, end = on_the_spot.rate(nu_3), *map(mpmath.mpf, (sliding, holding, growth, duration))
    gain = on_the_spot.gain()
    least = slide**2 - 2 * grow * q / gain
    if least < 0:
        return on_the_spot.driven(q, [(end, -slide, grow * end - slide)])
    stop, away = (slide - mpmath.sqrt(least)) / grow, hold / grow
    _, before = on_the_spot.driven(q, [(stop, -slide, grow * stop - slide)])
    q, after = on_the_spot.driven(mpmath.mpf(0), [(end - away, hold - slide, grow * end - slide)])
    return q, before + after


@CASES.case(
    "reversal",
    "Reversal through zero speed under torques that jump to and fro",
    naive="creeps where the drive is weaker than what breaks away",
    promise="the motion is the closed form: at once to the other side, or rest",
)
def reversing(scale: Scale) -> list[Measurement]:
    """Torques that jump to and fro: through zero speed at once where they are strong, else to rest."""
    found = []
    for setting in settings(models=("massless",), laws=("impact",), engines=engines()):
        random, missed, theirs = np.random.default_rng(76), 0.0, 0.0
        for _ in range(scale.of(1, 8)):
            sliding = random.uniform(2e-3, 1e-2)
            torques = np.array([1, -1, 1, -1, 1, -1]) * sliding * random.choice((0.9, 1.3, 3.0), 6)
            table = TorqueTable(0.5 * np.arange(6), equal(torques), "hold")
            start = {"nu": (0, 0, 0.1), "duration": 3.0}
            with on_the_spot.digits():
                end, fastest = _to_and_fro(0.1, sliding, 1.2 * sliding, torques, 0.5)
                acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=1.2 * sliding), table)
                run = setting.run(**start, effects=acting, accuracy=ACCURACY)
                missed = max(missed, on_the_spot.missed(run.nu[-1], run.pose[-1, 2], end, fastest))
                if scale.compares:
                    law = dead_band(np.full(3, sliding), interpolated(table))
                    motion = naive.simulate(setting.task(**start, effects=(Torque(0.0),)), law=law, rtol=1e-9)
                    theirs = max(theirs, on_the_spot.missed(motion.y[:3], motion.y[-1], end, fastest))
        what = "error of nu and heading, in eps"
        found.append(setting.measurement(what, missed, TENFOLD, scale.shown(theirs)))
    return found


def _to_and_fro(nu_3: float, sliding: float, holding: float, torques: np.ndarray, piece: float) -> tuple[tuple, float]:
    """(q, angle) at the end of pieces of constant torque, and the largest |q| at their ends."""
    q, angle, fastest = on_the_spot.rate(nu_3), mpmath.mpf(0), 0.0
    slide, hold = mpmath.mpf(sliding), mpmath.mpf(holding)
    for torque in map(mpmath.mpf, torques.tolist()):
        left = mpmath.mpf(piece)
        while left > 0:
            fastest = max(fastest, abs(float(q)))
            if q == 0 and abs(torque) <= hold:
                break
            acting = torque - slide * mpmath.sign(q if q != 0 else torque)
            stop = -q / (on_the_spot.gain() * acting)
            length = stop if q != 0 and 0 < stop < left else left
            q_after, more = on_the_spot.driven(q, [(length, acting, acting)])
            q, angle, left = (mpmath.mpf(0) if length is stop else q_after), angle + more, left - length
    return (q, angle), max(fastest, abs(float(q)))
