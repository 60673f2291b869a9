"""Currents of motors at their limit: one that grazes it, and one that meets it while rollers pass."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hard import true_flow
from hard.case import Cases, Measurement, Scale
from hard.impacts import slow_arrival
from hard.setting import EPS, MODELS, Setting, random_start, settings
from omniroll import Motor, Trajectory
from omniroll.engine.runs import Task
from omniroll.studies.accuracy.reference import Mechanics, digits, flint_module

CASES = Cases("Effects")
WINDING = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 3.0, "back_emf": 0.03}
DURATION = 0.1  # s
TRIALS, THIRDS = 2000, 60
DISTANCES = (1e-4, 1e-7, 1e-10, 1e-13)  # of the largest current from the limit, over the sizes of its terms
ROUNDINGS = 16  # of the current: passing by less may count as a touch
LANDED = 4  # roundings of the current: a limit is located within these
STALL = 1.0  # V, at which a motor at rest has just its limit


@dataclass(frozen=True)
class Rise:
    """A start whose motor 0 has its largest current inside the run, and no other current near.

    volts    (3,) at the start, and their rise per second
    current  the true one of motor 0 over the elapsed time, without limit; inside digits()
    peak     the largest of it in A, in 28 digits
    size     the sum of the sizes of the current's terms there
    """

    model: str
    start: dict[str, Any]
    volts: tuple[np.ndarray, np.ndarray]
    current: Callable[[Any], Any]
    peak: Any
    size: float

    def motor(self, limit: float | None) -> Motor:
        return _motor(*self.volts, limit)


def _motor(volts: np.ndarray, rise: np.ndarray, limit: float | None) -> Motor:
    table = np.array([volts, volts + DURATION * rise])
    return Motor(table, **WINDING, times=(0.0, DURATION), current_limit=limit)


def current(task: Task, wheel: int = 0) -> Callable[[Any], Any]:
    """The current of a motor over the elapsed time of a run without limit and switches; inside digits()."""
    y, m = true_flow.course(task), Mechanics(task, flint_module().arb)
    gain, ohms = m.number(WINDING["back_emf"]) * m.number(WINDING["gear_ratio"]), m.number(WINDING["resistance"])
    m.acting.begin(m.number(0.0))

    def value(time: Any) -> Any:
        volts = m.acting.at(time)["voltage"][wheel]
        return (volts - gain * m.wheel_speeds(y(time)[:3])[wheel]) / ohms

    return value


@cache
def rises(model: str, count: int) -> tuple[Rise, ...]:
    random, found = np.random.default_rng([23, MODELS.index(model)]), []
    for _ in range(TRIALS):
        rise = _rise(random, model)
        found += [rise] if rise else []
        if len(found) == count:
            return tuple(found)
    raise AssertionError("no starts found")


def _rise(random: np.random.Generator, model: str) -> Rise | None:
    """The voltage of motor 0 rises as fast as its back-EMF does in the middle of the run."""
    start = random_start(random, 0.2, duration=DURATION)
    start["nu"] *= 3
    setting, volts, rise = Setting(model, "impact", "compiled"), np.array([1.5, 0.0, 0.0]), np.zeros(3)
    times = DURATION * np.array([0.0, 0.49, 0.51, 1.0])
    for _ in range(3):  # aimed in double; what is expected comes from the course below
        run = setting.run(**start, effects=(_motor(volts, rise, None),))
        emf = WINDING["back_emf"] * WINDING["gear_ratio"] * run.kernel.wheel_speeds(run.sample(times).nu)[:, 0]
        rise[0] = (emf[2] - emf[1]) / (times[2] - times[1])
    found = (volts[0] + rise[0] * times - emf) / WINDING["resistance"]
    if len(run.switches) or min(found[1] - found[0], found[1] - found[3]) < 5 * DISTANCES[0] * found[1]:
        return None
    with digits():
        value = current(setting.task(**start, effects=(_motor(volts, rise, None),)))
        early, late = flint_module().arb(0), flint_module().arb(DURATION)
        for _ in range(THIRDS):
            a, b = (early + (late - early) / 3).mid(), (late - (late - early) / 3).mid()
            early, late = (a, late) if value(a) < value(b) else (early, b)
        peak = value(early).mid()
    sizes = np.abs(volts[0]) + np.abs(rise[0]) * DURATION + np.abs(emf).max()
    return Rise(model, start, (volts, rise), value, peak, float(peak) + sizes / WINDING["resistance"])


def limited_from(run: Trajectory) -> float | None:
    """When the current of motor 0 first comes to its limit; None where it never does."""
    rows = np.flatnonzero(run.drive[:, run.effects.drives().index("damping"), 0] == 0)
    return float(run.elapsed[rows[0]]) if len(rows) else None


def _misplaced(rise: Rise, limit: float, time: float | None) -> float:
    """How far the true current is from its limit at a time, in roundings; infinite where there is no time."""
    if time is None:
        return float("inf")
    with digits():
        return abs(float(rise.current(flint_module().arb(time)) - limit)) / (EPS * rise.size)


@CASES.case(
    "current-grazes-its-limit",
    "A current that grazes its limit, just below it and just above",
    naive="looks at the ends of steps, where the current is below its limit both times",
    promise=f"a current that passes its limit by more than {ROUNDINGS} roundings is seen, at the first crossing; "
    "one that turns back before it is not",
)
def grazing(scale: Scale) -> Iterator[Measurement]:
    """Just below its limit, and just above: is the limit seen, and where?"""
    distances = scale.of(DISTANCES[1::2], DISTANCES)
    for setting in settings(models=scale.of(("free",), MODELS), laws=("impact",)):
        wrong, late, tries = 0, 0.0, 0
        for rise in rises(setting.model, scale.of(1, 3)):
            for limit in [float(rise.peak) - sign * d * rise.size for d in distances for sign in (1, -1)]:
                passes = float(rise.peak - limit) > 0
                time = limited_from(setting.run(**rise.start, effects=(rise.motor(limit),), accuracy=1e-14))
                wrong, tries = wrong + ((time is not None) != passes), tries + 1
                late = max(late, _misplaced(rise, limit, time)) if passes else late
        yield setting.measurement("turns judged wrongly, in %", 100 * wrong / tries, 0)
        yield setting.measurement("the true current there less its limit, in roundings", late, LANDED)


def bouncing(random: np.random.Generator, duration: float) -> dict[str, Any]:
    """Impacts send wheel 0 back from its joint, and motor 0 drives it there again.

    At rest its current is just the limit, so that each time the wheel turns round the current leaves its limit, and at
    each impact it is there again.
    """
    motor = Motor((STALL, 0, 0), **WINDING, current_limit=STALL / WINDING["resistance"])
    return slow_arrival(random, "locked") | {"duration": duration, "effects": (motor,)}


def law_missed(run: Trajectory) -> float:
    """The torques less those of motors with cut-off currents, in roundings; the largest.

    In the rows where a phase begins or ends: rows between two transitions at one instant belong to none.
    """
    (motor,), rates = run.effects.effects, run.kernel.wheel_speeds(run.nu)
    given = (
        run.drive[:, run.effects.drives().index("torque")] - run.drive[:, run.effects.drives().index("damping")] * rates
    )
    per_ampere = motor.gear_ratio * motor.torque_constant
    emf = motor.back_emf * motor.gear_ratio * rates
    wanted = per_ampere * np.clip((motor.voltage - emf) / motor.resistance, -motor.current_limit, motor.current_limit)
    terms = np.abs(run.nu) @ np.abs(run.kernel.wheel_speeds(np.eye(3))) * motor.back_emf * motor.gear_ratio
    sizes = per_ampere * (motor.current_limit + (np.abs(motor.voltage) + terms) / motor.resistance)
    later = np.diff(run.elapsed) > 0
    of_phase = np.append(True, later) | np.append(later, True)
    return float((np.abs(given - wanted) / (EPS * sizes))[of_phase].max())


@CASES.case(
    "limit-and-switch",
    "Chatter: impacts send a wheel back from its joint, and its motor passes its limit each time",
    naive="loses some of the bounces",
    promise="the bounces and the changes at the limit are those of the true motion; where a phase begins or ends "
    "the rows have the torque that the motor gives; no impact raises the energy",
)
def limit_and_switch(scale: Scale) -> Iterator[Measurement]:
    """The first bounces against the flow in 28 digits; after more of them time itself is a matter of rounding."""
    bounces, amount = scale.of(1, 12), {"compiled": 10, "python": scale.of(0, 2)}
    random = np.random.default_rng(3)
    starts = [bouncing(random, 0.02) for _ in range(3)][1:2] + [bouncing(random, 0.02) for _ in range(scale.of(0, 9))]
    whole = Setting("locked", "impact", "compiled").run(**starts[0], accuracy=1e-13)
    assert _meetings(whole) >= 20
    times = np.unique(whole.switches.t)
    first = starts[0] | {"duration": float(times[bounces - 1] + times[bounces]) / 2}
    truth = true_flow.motion(Setting("locked", "impact", "python").task(**first))
    for setting in settings(models=("locked",), laws=("impact",)):
        run = setting.run(**first, accuracy=1e-13)
        apart = float(np.abs(np.append(run.nu[-1], run.pose[-1]) - truth.y[-1][[0, 1, 2, 6, 7, 8]]).max())
        apart += abs(len(run.switches) - len(truth.switches))
        runs = [setting.run(**start, accuracy=1e-13) for start in starts[: amount[setting.engine]]] or [run]
        rise = max(float(run.switches.energy_jump.max(initial=0)) / run.energy[0] for run in runs)
        yield setting.measurement("distance from the true motion after the first bounces", apart, 1e-11)
        yield setting.measurement("torques less the law of the motors, in roundings", max(map(law_missed, runs)), 16)
        yield setting.measurement("largest rise of energy at a switch / eps", rise / EPS, 16)


def _meetings(run: Trajectory) -> int:
    """Instants at which a wheel switches and a current comes to its limit or leaves it."""
    limited = run.drive[:, run.effects.drives().index("damping")] == 0
    changes = np.flatnonzero((limited[1:] != limited[:-1]).any(axis=1)) + 1
    return int(np.isin(run.t[changes], run.switches.t).sum())
