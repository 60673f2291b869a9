"""Axles that stick: one by one, all at once, on a joint, on a slope, while the speed passes zero, and under impacts."""

from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np
from flint import arb

from hard import on_the_spot, true_flow
from hard.case import Cases, Measurement, Scale
from hard.constrained import solved
from hard.on_the_spot import equal
from hard.setting import EPS, JOINT, LAWS, MODELS, PAPER, Setting, random_start, speeds_of_wheels
from omniroll import Bearings, Slope, Torque, TorqueTable
from omniroll.studies.accuracy.mechanics import Mechanics
from omniroll.studies.accuracy.reference import digits

CASES = Cases("Effects")
ACCURACY = 1e-13
TOUCHES = (1e-4, 1e-7, 1e-10, 1e-13)  # of the speed at the start
ROUNDINGS = 64
TENFOLD = 10 * ACCURACY / EPS  # eps: ten times the accuracy that was asked for
ON_THE_SPOT = Setting("massless", "impact", "compiled")


def slow_wheel(random: np.random.Generator, setting: Setting, duration: float) -> dict[str, Any]:
    """A start with one wheel that soon stops and others near their joints, and bearings."""
    start = random_start(random, duration=duration)
    per_nu = speeds_of_wheels(setting.task(**start).kernel)
    start["nu"] += per_nu[:, 0] * (0.1 - start["nu"] @ per_nu[:, 0]) / (per_nu[:, 0] @ per_nu[:, 0])
    start["chi"] = JOINT * np.array([0.1, 0.93, 0.9]) * np.sign(start["nu"] @ per_nu)
    sliding = 0.02 * random.uniform(0.5, 1.5, 3)
    holding = sliding * random.choice((1.0, 1.3), 3)
    return start | {"effects": (Bearings(wheel_coulomb=sliding, wheel_break_away=holding),)}


@CASES.case(
    "stick-one-by-one",
    "Wheels that stick one by one, and that impacts turn again",
    naive="fades the friction in a band around rest, since with its sign alone the solver gives up: it creeps",
    promise="the motion is the true one",
)
def one_by_one(scale: Scale) -> Iterator[Measurement]:
    """From random starts until they rest, through switches that turn again what stuck."""
    short = (("massless", "impact", 0.3), ("locked", "impact", 0.1))
    for model, law, duration in scale.of(short, [(model, law, 0.5) for model in MODELS for law in LAWS]):
        random, setting, worst = np.random.default_rng([71, MODELS.index(model)]), Setting(model, law, "compiled"), 0.0
        for _ in range(scale.of(1, 2)):
            start = slow_wheel(random, setting, duration)
            run = setting.run(**start, accuracy=ACCURACY)
            assert (run.kernel.wheel_speeds(run.nu) == 0).any()
            worst = max(worst, true_flow.missed(run, true_flow.motion(setting.task(**start))))
        yield setting.measurement("distance from the true motion", worst, 1e-11)


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
    random, late, missed, creeps = np.random.default_rng(72), 0.0, 0.0, 0.0
    for _ in range(scale.of(3, 20)):
        nu_3, torque = random.choice((-1, 1)) * 10 ** random.uniform(-3, 1), 10 ** random.uniform(-3, 0)
        with on_the_spot.digits():
            stop, angle = stopping(nu_3, torque)
            start = {"nu": (0, 0, nu_3), "duration": 2 * float(stop)}
            run = ON_THE_SPOT.run(**start, effects=(Bearings(wheel_coulomb=torque),), accuracy=ACCURACY)
            rests = np.flatnonzero((run.nu == 0).all(axis=1))
            late = max(late, abs(float(run.elapsed[rests[0]] / stop - 1)) / EPS if len(rests) else np.inf)
            missed = max(missed, on_the_spot.missed(run, (mpmath.mpf(0), angle), abs(float(on_the_spot.rate(nu_3)))))
            creeps = max(creeps, float(np.abs(run.nu[run.elapsed > 1.001 * float(stop)]).max()))
    return [
        ON_THE_SPOT.measurement("error of the instant, in eps", late, ROUNDINGS),
        ON_THE_SPOT.measurement("error of the heading, in eps", missed, ROUNDINGS),
        ON_THE_SPOT.measurement("largest nu afterwards", creeps, 0),
    ]


@CASES.case(
    "stick-on-a-joint",
    "Wheels that come to rest 1e-4 ... 1e-12 rad before their joints, on them, and beyond them",
    naive="creeps over the joint, or ends short of it",
    promise="a joint that is passed is a switch, no other is; on the joint any will do; the wheels rest there",
)
def on_a_joint(scale: Scale) -> list[Measurement]:
    """The wheels come to rest just before their joints, on them, and just after them."""
    random, wrong, off, count = np.random.default_rng(73), 0, 0.0, scale.of(1, 10)
    distances = (-1e-4, -1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1e-4)
    for _ in range(count):
        nu_3, torque = random.choice((-1, 1)) * random.uniform(0.1, 1), random.uniform(5e-3, 2e-2)
        with on_the_spot.digits():
            stop, angle = stopping(nu_3, torque)
            edges = int((abs(angle) + mpmath.mpf(JOINT)) / (2 * mpmath.mpf(JOINT)))  # passed before this joint
            for beyond in distances:
                chi = mpmath.sign(angle) * ((2 * edges + 1) * mpmath.mpf(JOINT) + beyond - abs(angle))
                start = {"nu": (0, 0, nu_3), "chi": float(chi), "duration": 2 * float(stop)}
                run = ON_THE_SPOT.run(**start, effects=(Bearings(wheel_coulomb=torque),), accuracy=ACCURACY)
                is_outside = bool((np.abs(run.chi) > JOINT).any())
                wrong += is_outside or not switches_fit(len(run.switches), edges, beyond)
                off = max(off, on_the_spot.missed(run, (mpmath.mpf(0), angle), abs(float(on_the_spot.rate(nu_3)))))
    return [
        ON_THE_SPOT.measurement("stops judged wrongly, in %", 100 * wrong / (count * len(distances)), 0),
        ON_THE_SPOT.measurement("error of the heading, in eps", off, ROUNDINGS),
    ]


def switches_fit(switches: int, edges: int, beyond: float) -> bool:
    """Of three wheels that have passed so many joints and stop at the next, or this much beyond it."""
    if beyond == 0:  # within rounding; also there and back
        return 3 * edges <= switches <= 3 * edges + 6
    return switches == 3 * (edges + (beyond > 0))


def break_away(start: dict[str, Any], setting: Setting, slope: Slope) -> Any:
    """The least torque in 28 digits, the same for all axles, that holds the vehicle at rest; inside digits().

    There are three wheels, so that the torques that hold it are unique.
    """
    m = Mechanics(setting.task(**start, effects=(slope, Torque(0.0))), arb)
    y = m.begin(*m.start(), m.number(0.0))
    nu_dot, mass_matrix = m.rates(y)[:3], m.module.mass_matrix(m.model, m.view(y, "chi"))
    pull = [sum(a * b for a, b in zip(row, nu_dot, strict=True)) for row in mass_matrix]
    rows = [m.wheel_speeds([arb(int(j == k)) for j in range(3)]) for k in range(3)]
    return max(map(abs, solved(rows, pull)), key=float)


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
    for model in scale.of(("massless", "free"), MODELS):
        random, setting = np.random.default_rng([74, MODELS.index(model)]), Setting(model, "impact", "compiled")
        lets_go, beside, holds, count = 0.0, 0.0, 0, scale.of(2, 6)
        for _ in range(count):
            slope = Slope(10 ** random.uniform(-3, 0), random.uniform(-3, 3))
            start = {"nu": (0, 0, 0), "chi": random.uniform(-0.5, 0.5, 3), "pose": (0, 0, random.uniform(-3, 3))}

            def fastest(torque: float, sliding: float, duration: float, start=start, slope=slope, setting=setting):
                acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=torque), slope)
                return float(np.abs(setting.run(**start, duration=duration, effects=acting, accuracy=1e-9).nu).max())

            with digits():
                exact = break_away(start | {"duration": 1.0}, setting, slope)
                least = float(exact)
                least = float(np.nextafter(least, np.inf)) if float(exact - least) > 0 else least
            above, below, less = np.nextafter(least, np.inf), np.nextafter(least, 0.0), least * (1 - ROUNDINGS * EPS)
            lets_go = max(lets_go, fastest(least, least, 1000.0), fastest(above, 0.3 * least, 1000.0))
            beside = max(beside, fastest(below, below, 1.0) / (EPS * 9.8 * slope.angle))
            holds += fastest(less, less, 1.0) == 0
        found += [
            setting.measurement("at the angle: largest nu", lets_go, 0),
            setting.measurement("1 ulp beyond it: nu after 1 s / (eps g angle)", beside, ROUNDINGS),
            setting.measurement(f"{ROUNDINGS} eps beyond it: starts that do not slide, in %", 100 * holds / count, 0),
        ]
    return found


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
    random, wrong, missed, tries = np.random.default_rng(75), 0, 0.0, 0
    for _ in range(scale.of(1, 6)):
        sliding, growth = random.uniform(5e-3, 2e-2), random.uniform(1e-2, 5e-2)
        holding = 1.5 * sliding
        table = TorqueTable((0.0, 4.0), equal([0.0, 4.0 * growth]))
        acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=holding), table)
        for distance in [sign * d for d in scale.of(TOUCHES[1::2], TOUCHES) for sign in (1, -1)]:
            with on_the_spot.digits():
                lost = on_the_spot.gain() * mpmath.mpf(sliding) ** 2 / (2 * mpmath.mpf(growth))
                nu_3 = float(-lost * (1 + distance) * mpmath.mpf(PAPER.yaw_scale) / on_the_spot.ratio())
                stops, duration = on_the_spot.rate(nu_3) < lost, 1.5 * holding / growth
                run = ON_THE_SPOT.run(nu=(0, 0, nu_3), duration=duration, effects=acting, accuracy=ACCURACY)
                wrong, tries = wrong + (bool((run.nu == 0).all(axis=1).any()) != stops), tries + 1
                end = through_zero(nu_3, sliding, holding, growth, duration)
                missed = max(missed, on_the_spot.missed(run, end, abs(float(on_the_spot.rate(nu_3)))))
    return [
        ON_THE_SPOT.measurement("touches judged wrongly, in %", 100 * wrong / tries, 0),
        ON_THE_SPOT.measurement("error of nu and heading, in eps", missed, TENFOLD),
    ]


def through_zero(nu_3: float, sliding: float, holding: float, growth: float, duration: float) -> tuple[Any, Any]:
    """q and angle at the end: q > 0 slows down under a torque that grows from 0, and may stop and break away."""
    q, slide, hold, grow, end = on_the_spot.rate(nu_3), *map(mpmath.mpf, (sliding, holding, growth, duration))
    least = slide**2 - 2 * grow * q / on_the_spot.gain()
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
    random, missed = np.random.default_rng(76), 0.0
    for _ in range(scale.of(1, 8)):
        sliding = random.uniform(2e-3, 1e-2)
        torques = np.array([1, -1, 1, -1, 1, -1]) * sliding * random.choice((0.9, 1.3, 3.0), 6)
        table = TorqueTable(0.5 * np.arange(6), equal(torques), "hold")
        acting = (Bearings(wheel_coulomb=sliding, wheel_break_away=1.2 * sliding), table)
        with on_the_spot.digits():
            run = ON_THE_SPOT.run(nu=(0, 0, 0.1), duration=3.0, effects=acting, accuracy=ACCURACY)
            missed = max(missed, on_the_spot.missed(run, *to_and_fro(0.1, sliding, 1.2 * sliding, torques, 0.5)))
    return [ON_THE_SPOT.measurement("error of nu and heading, in eps", missed, TENFOLD)]


def to_and_fro(nu_3: float, sliding: float, holding: float, torques: np.ndarray, piece: float) -> tuple[tuple, float]:
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
