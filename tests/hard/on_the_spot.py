"""Closed forms of a vehicle with massless rollers that turns on the spot, in 40 digits; numbers are taken as exact.

All wheels have the same rate q: the paper's vehicle turns at theta' = -q l/R. A torque u on each axle gives
q' = gain u, and the switches change nothing.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import mpmath
import numpy as np

from hard.setting import EPS, PAPER, Setting
from omniroll import Trajectory

DIGITS = 40


@contextmanager
def digits() -> Iterator[None]:
    with mpmath.workdps(DIGITS):
        yield


def ratio() -> Any:
    """R/l: a wheel's rate over that of the heading, but for its sign."""
    return mpmath.mpf(PAPER.platform_radius) / mpmath.mpf(PAPER.wheel_radius)


def gain() -> Any:
    """q' for equal torques of 1 N m. The kinetic energy is (I_S + N J (R/l)^2) theta'^2/2."""
    turning = mpmath.mpf(PAPER.yaw_inertia) + PAPER.wheels * mpmath.mpf(PAPER.wheel_inertia) * ratio() ** 2
    return PAPER.wheels * ratio() ** 2 / turning


def rate(nu_3: float) -> Any:
    """q of a start."""
    return -mpmath.mpf(float(nu_3)) / mpmath.mpf(PAPER.yaw_scale) * ratio()


def driven(q: Any, pieces: Iterable[tuple[Any, Any, Any]]) -> tuple[Any, Any]:
    """q and the angle turned after pieces (length, torque at its start, at its end); torques are linear in between."""
    angle, per_torque = mpmath.mpf(0), gain()
    for length, early, late in pieces:
        angle += q * length + per_torque * (2 * early + late) * length**2 / 6
        q += per_torque * (early + late) / 2 * length
    return q, angle


def missed(run: Trajectory, end: tuple[Any, Any], fastest: float) -> float:
    """How far the end of a run that starts with heading 0 is from the closed one, (q, angle): in eps, rates over the
    fastest wheel's, angles over theirs."""
    (q, angle), nu, heading = end, run.nu[-1], run.pose[-1, 2]
    scale = fastest * PAPER.yaw_scale / float(ratio())
    turning = float(abs(mpmath.mpf(float(nu[2])) + q * mpmath.mpf(PAPER.yaw_scale) / ratio())) / scale
    turned = float(abs(mpmath.mpf(float(heading)) + angle / ratio())) / max(1.0, float(abs(angle)))
    return max(turning, turned, float(np.abs(nu[:2]).max()) / scale) / EPS


def equal(torques: np.ndarray) -> np.ndarray:
    """(K, 3) the same torques on all wheels."""
    return np.repeat(np.asarray(torques, float)[:, None], PAPER.wheels, axis=1)


def settings(*engines: str) -> list[Setting]:
    return [Setting("massless", "impact", engine) for engine in engines]
