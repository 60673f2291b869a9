"""Stiff friction: Coulomb's law with a named speed of 1e-3 ... 1e-9 rad/s, against closed forms in 40 digits."""

from collections.abc import Iterator
from itertools import chain
from typing import Any

import mpmath
import numpy as np

from hard import on_the_spot
from hard.case import Cases, Measurement, Scale
from hard.setting import PAPER, Setting
from omniroll import Bearings

CASES = Cases("Effects")
ACCURACY = 1e-9
SPEEDS = (1e-3, 1e-6, 1e-9)  # rad/s
COMPILED = Setting("massless", "impact", "compiled")
SPIN = 3.0  # rad/s
STEPS = 40  # more than the same motion takes with 1 rad/s
PRICE = 5  # of a named speed of 1e-6 rad/s over that of 1 rad/s, in evaluations


def clock(speed: Any, named: Any) -> Any:
    """slowing t, but for a constant, where w' = - slowing w/sqrt(w^2 + named^2) and w = speed."""
    whole = mpmath.sqrt(speed**2 + named**2)
    return named * mpmath.atanh(named / whole) - whole


def turned(speed: Any, named: Any) -> Any:
    """slowing times the angle that is turned until nothing is left of the speed."""
    return (speed * mpmath.sqrt(speed**2 + named**2) + named**2 * mpmath.asinh(speed / named)) / 2


def missed_times(rates: np.ndarray, times: np.ndarray, named: float, slowing: Any) -> float:
    """How far rates (T,) at times are from the closed form, while well above the named speed, over the first."""
    first, worst = mpmath.mpf(float(rates[0])), 0.0
    for rate, time in zip(rates.tolist(), times.tolist(), strict=True):
        if rate > 100 * named:
            passed = (clock(mpmath.mpf(rate), mpmath.mpf(named)) - clock(first, mpmath.mpf(named))) / slowing
            worst = max(worst, float(abs(passed - mpmath.mpf(time)) * slowing / first))
    return worst


def wheels(scale: Scale) -> Iterator[Measurement]:
    """On the spot, until nothing is left of the speed."""
    for named in SPEEDS:
        random, worst, steps = np.random.default_rng(81), 0.0, 0.0
        for _ in range(scale.of(1, 5)):
            nu_3, torque = -random.uniform(0.2, 1), random.uniform(5e-3, 2e-2)
            with on_the_spot.digits():
                q, slowing = on_the_spot.rate(nu_3), on_the_spot.gain() * mpmath.mpf(torque)
                start = {"nu": (0, 0, nu_3), "duration": float(2 * q / slowing), "accuracy": ACCURACY}
                run, plain = (
                    COMPILED.run(**start, effects=(Bearings(wheel_coulomb=torque, wheel_speed=speed),))
                    for speed in (named, 1.0)
                )
                heading = -turned(q, mpmath.mpf(named)) / slowing / on_the_spot.ratio()
                rates = -run.nu[:, 2] / PAPER.yaw_scale * float(on_the_spot.ratio())
                off = float(abs(mpmath.mpf(float(run.pose[-1, 2])) - heading))
                left = float(np.abs(run.nu[-1]).max()) / abs(nu_3)
                worst = max(worst, off, left, missed_times(rates, run.elapsed, named, slowing))
                steps = max(steps, run.stats["steps"] - plain.stats["steps"])
        yield COMPILED.measurement(f"axles, {named:g} rad/s: error", worst, ACCURACY)
        yield COMPILED.measurement(f"axles, {named:g} rad/s: steps more than with 1 rad/s", steps, STEPS)


def rollers(scale: Scale) -> Iterator[Measurement]:
    """chi = 0 and equal spins: what the rollers do to the vehicle cancels, and it stays at rest."""
    setting, torque = Setting("free", "impact", "compiled"), 5e-6
    for named in SPEEDS:
        with on_the_spot.digits():
            slowing = mpmath.mpf(torque) / mpmath.mpf(PAPER.roller_inertia)
            start = {"nu": (0, 0, 0), "spins": SPIN, "duration": float(2 * SPIN / slowing)}
            run, plain = (
                setting.run(**start, accuracy=ACCURACY, effects=(Bearings(roller_coulomb=torque, roller_speed=speed),))
                for speed in (named, 1.0)
            )
            spins = run.spins.reshape(len(run), -1)
            worst = max(missed_times(column, run.elapsed, named, slowing) for column in spins.T)
        lost = abs(float(run.quantity("roller_loss")[-1]) / run.energy[0] - 1)
        worst = max(worst, lost, float(np.abs(spins[-1]).max()) / SPIN, float(np.abs(run.nu).max()) / SPIN)
        steps = run.stats["steps"] - plain.stats["steps"]
        yield setting.measurement(f"rollers, {named:g} rad/s: error", worst, ACCURACY)
        yield setting.measurement(f"rollers, {named:g} rad/s: steps more than with 1 rad/s", steps, STEPS)


def prices(scale: Scale) -> Iterator[Measurement]:
    """How much more often the rates are evaluated than with 1 rad/s, where wheels and rollers stop and turn."""
    setting = Setting("free", "impact", "compiled")
    runs = (("wheel", 2e-3, (1, 0, 1), 6), ("roller", 1e-5, (1, 0, 1), 6), ("wheel", 2e-3, (1, 0, 0.3), 1.5))
    for body, torque, nu, duration in runs[: scale.of(2, 3)]:
        both = ((Bearings(**{f"{body}_coulomb": torque, f"{body}_speed": speed}),) for speed in (1.0, 1e-6))
        plain, named = (setting.run(nu=nu, duration=duration, accuracy=ACCURACY, effects=e).stats for e in both)
        ratio = named["evaluations"] / plain["evaluations"]
        yield setting.measurement(f"{body}s, 1e-06 rad/s: evaluations over those with 1 rad/s", ratio, PRICE)


@CASES.case(
    "named-speeds",
    "Stiff named speeds of the regularised law: 1e-3 ... 1e-9 rad/s (compiled engine)",
    promise=f"the error is within the accuracy, 1e-9; a stop takes at most {STEPS} steps more than with 1 rad/s; "
    f"1e-6 rad/s costs at most {PRICE} times the evaluations of 1 rad/s",
)
def named_speeds(scale: Scale) -> Iterator[Measurement]:
    return chain(wheels(scale), rollers(scale), prices(scale))
