"""Rollers that stick in their bearings: rolling to rest on their disks, held on a slope, through impacts at joints."""

from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np

from hard import on_the_spot
from hard.case import Cases, Measurement, Scale
from hard.setting import EPS, JOINT, MODELS, PAPER, settings
from omniroll import Bearings, Slope, Vehicle

CASES = Cases("Effects")
ACCURACY = 1e-13
TENFOLD = 10 * ACCURACY / EPS  # eps: ten times the accuracy that was asked for
ROUNDINGS = 64
BESIDE_JOINT = (0.3, 1e-4, 1e-8, 1e-12)  # of the joint's angle: where wheels stand
OPPOSITE = Vehicle.paper(2)  # it rolls along both axles, and its wheels do not turn


def along_the_axles(model: str, chi: np.ndarray) -> tuple[list, Any]:
    """1/rho of both rollers in contact, and the mass that moves along the axles; inside digits()."""
    v = OPPOSITE
    inverse = [1 / (mpmath.mpf(v.wheel_radius) * mpmath.cos(float(c)) - mpmath.mpf(v.roller_axis_radius)) for c in chi]
    inertia = 0 if model == "massless" else mpmath.mpf(v.roller_inertia)
    return inverse, mpmath.mpf(v.mass) + inertia * sum(own**2 for own in inverse)


def beside_joint(random: np.random.Generator) -> np.ndarray:
    """The same for both wheels, so that what their rollers' spins have of a yaw momentum cancels."""
    return np.full(2, JOINT * random.choice((-1, 1)) * (1 - random.choice(BESIDE_JOINT)))


def rolling_to_rest(scale: Scale) -> Iterator[Measurement]:
    """Along the axles rollers in contact slow the vehicle down uniformly; wheels stand beside their joints."""
    for setting in settings(models=scale.of(("free",), MODELS), laws=("impact",), engines=("compiled",)):
        random, late, off, creeps = np.random.default_rng(81), 0.0, 0.0, 0.0
        for _ in range(scale.of(2, 20)):
            chi, nu_1 = beside_joint(random), random.choice((-1, 1)) * 10 ** random.uniform(-3, 0)
            sliding = np.full(2, 10 ** random.uniform(-4, -2))
            with on_the_spot.digits():
                inverse, mass = along_the_axles(setting.model, chi)
                slowing = sum(mpmath.mpf(float(t)) * own for t, own in zip(sliding, inverse, strict=True)) / mass
                speed = mpmath.mpf(OPPOSITE.platform_radius) * mpmath.mpf(float(nu_1))
                stop, way = abs(speed) / slowing, speed * abs(speed) / (2 * slowing)
                start = {"nu": (nu_1, 0, 0), "chi": chi, "duration": 2 * float(stop)}
                acting = (Bearings(roller_coulomb=sliding),)
                run = setting.run(OPPOSITE, **start, effects=acting, accuracy=ACCURACY)
                rests = np.flatnonzero(np.abs(run.nu[:, 0]) <= EPS * abs(nu_1))
                late = max(late, abs(float(run.elapsed[rests[0]] / stop - 1)) / EPS if len(rests) else np.inf)
                off = max(off, float(abs(mpmath.mpf(float(run.pose[-1, 0])) / way - 1)) / EPS)
                after = np.abs(run.nu[run.elapsed > 1.001 * float(stop), 0]).max()
                creeps = max(creeps, float(after / abs(nu_1)) / EPS)
        yield setting.measurement("error of the stop's instant, in eps", late, ROUNDINGS)
        yield setting.measurement("error of the way, in eps", off, ROUNDINGS)
        yield setting.measurement("largest nu_1 afterwards, in eps of the first", creeps, 1)


def at_the_break_away_torque(scale: Scale) -> Iterator[Measurement]:
    """On a slope along the axles, with break-away torques that just hold, and some eps less."""
    for setting in settings(models=scale.of(("free",), MODELS), laws=("impact",), engines=("compiled",)):
        random, lets_go, holds = np.random.default_rng(82), 0.0, 0
        count = scale.of(2, 20)
        for _ in range(count):
            chi, slope = beside_joint(random), Slope(10 ** random.uniform(-3, 0), 0.0)
            with on_the_spot.digits():
                inverse, mass = along_the_axles(setting.model, chi)
                pull = mpmath.mpf(OPPOSITE.mass) * mpmath.mpf(slope.gravity) * mpmath.sin(slope.angle)
                exact = pull / sum(inverse)
                for part, held in ((1 + ROUNDINGS * EPS, True), (1 - ROUNDINGS * EPS, False)):
                    torque = float(exact * part)
                    start = {"nu": (0, 0, 0), "chi": chi, "duration": 100.0 if held else 1.0}
                    acting = (Bearings(roller_coulomb=0.3 * torque, roller_break_away=torque), slope)
                    run = setting.run(OPPOSITE, **start, effects=acting, accuracy=ACCURACY)
                    if held:
                        alone = pull / mass / mpmath.mpf(OPPOSITE.platform_radius) * mpmath.mpf(100)
                        lets_go = max(lets_go, float(np.abs(run.nu[:, 0]).max() / alone) / EPS)
                    else:
                        holds += run.nu[-1, 0] == 0
        what = f"{ROUNDINGS} eps above it: largest nu_1 / (eps of what the pull alone gives)"
        yield setting.measurement(what, lets_go, ROUNDINGS)
        yield setting.measurement(f"{ROUNDINGS} eps below it: starts that do not roll, in %", 100 * holds / count, 0)


def through_joints(scale: Scale) -> Iterator[Measurement]:
    """On the spot no roller spins on its disk, so that no impact at a joint takes energy, and the heading is linear."""
    for setting in settings(models=("free",), engines=("compiled",)):
        random, drift, moved, spun = np.random.default_rng(83), 0.0, 0.0, 0.0
        passed = scale.of(20, 10_000)
        for _ in range(scale.of(1, 5)):
            nu_3 = random.choice((-1, 1)) * random.uniform(0.5, 2)
            with on_the_spot.digits():
                duration = float(passed * 2 * mpmath.mpf(JOINT) / abs(on_the_spot.rate(nu_3)))
                heading = mpmath.mpf(float(nu_3)) / mpmath.mpf(PAPER.yaw_scale) * mpmath.mpf(duration)
                start = {"nu": (0, 0, nu_3), "duration": duration}
                run = setting.run(**start, effects=(Bearings(roller_coulomb=1.0),), accuracy=ACCURACY)
                switches = max(1, len(run.switches))
                drift = max(drift, float(np.abs(run.energy / run.energy[0] - 1).max()) / EPS / switches)
                off = abs(mpmath.mpf(float(run.pose[-1, 2])) - heading) / max(1, abs(heading))
                moved = max(moved, float(off) / EPS)
                spun = max(spun, float(np.abs(run.spins).max()) / (abs(nu_3) / PAPER.yaw_scale) / EPS)
        yield setting.measurement("energy: drift / (eps switches)", drift, 1)
        yield setting.measurement("error of the heading, in eps", moved, TENFOLD)
        yield setting.measurement("largest spin of a free roller, in eps of theta'", spun, ROUNDINGS)


def breaking_away_beside_joints(scale: Scale) -> Iterator[Measurement]:
    """Its disk takes a free roller along with the torque B theta' chi' cos(psi); at the joint one stands at the top."""
    places = scale.of((0.3, 1e-3), (0.3, 1e-1, 1e-2, 1e-3, 1e-4))
    for setting in settings(models=("free",), laws=("impact",), engines=("compiled",)):
        random, worst = np.random.default_rng(84), 0.0
        for beside in places:
            for _ in range(scale.of(1, 4)):
                nu_3 = random.choice((-1, 1)) * random.uniform(0.5, 2)
                with on_the_spot.digits():
                    rate = on_the_spot.rate(nu_3)
                    yaw = mpmath.mpf(float(nu_3)) / mpmath.mpf(PAPER.yaw_scale)
                    most = mpmath.mpf(PAPER.roller_inertia) * abs(yaw * rate)
                    torque = float(most * mpmath.cos(beside))
                    start = {"nu": (0, 0, nu_3), "duration": float(2 * mpmath.mpf(JOINT) / abs(rate))}
                    run = setting.run(**start, effects=(Bearings(roller_coulomb=torque),), accuracy=ACCURACY)
                    turning = np.flatnonzero(run.spins.any(axis=(1, 2)))
                    if not len(turning):
                        worst = np.inf
                        continue
                    instant = mpmath.mpf(float(run.elapsed[turning[0] - 1]))
                    taken = most * mpmath.cos(mpmath.mpf(JOINT) - abs(rate) * instant)  # by the roller at the top
                    worst = max(worst, float(abs(taken / mpmath.mpf(torque) - 1)) / EPS)
        yield setting.measurement("torque at the break-away, off its bound, in eps", worst, TENFOLD)


@CASES.case(
    "sticking-rollers",
    "Rollers that stop on their disks, 1e-12 ... 0.3 of the way from a joint, that hold on a slope, stick "
    "through impacts at joints, and break away beside them",
    naive="fades the friction in a band around rest, and creeps; looks every 1 ms whether something breaks away",
    promise="the closed forms: uniform slowing down and rest; held at the torque that holds; no impact takes "
    "energy where all rollers rest on their disks; a free roller breaks away where its disk asks for more",
)
def everything(scale: Scale) -> list[Measurement]:
    parts = (rolling_to_rest, at_the_break_away_torque, through_joints, breaking_away_beside_joints)
    return [measurement for part in parts for measurement in part(scale)]
