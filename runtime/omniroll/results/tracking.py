"""Tracking wheels: encoders on wheels that carry no load, roll along one direction and slide freely across it.

Their rates are linear in nu, by the generated function, and so are their angles in the integrals of nu over time.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.results.dense import integrals_at, places_in_steps, steps_of
from omniroll.vehicles.vehicle import Vehicle

if TYPE_CHECKING:
    from omniroll.results.measurements import Instruments
    from omniroll.results.trajectory import Trajectory

PLACEMENT = ("tracking_places", "tracking_directions", "tracking_radius")


def checked_placement(instruments: "Instruments") -> None:
    """Raises InvalidValueError unless all of PLACEMENT is given and fits together, or nothing of it is."""
    given = {name: getattr(instruments, name) for name in PLACEMENT}
    lacking = [name for name, value in given.items() if value is None]
    if lacking and len(lacking) < len(given):
        there = next(name for name in PLACEMENT if name not in lacking)
        raise InvalidValueError(lacking[0], None, f"must be given beside {there}")
    if not lacking and len(given["tracking_directions"]) != len(given["tracking_places"]):
        bound = f"must be {len(given['tracking_places'])} numbers, one for each of tracking_places"
        raise InvalidValueError("tracking_directions", given["tracking_directions"], bound)


def rates(bound: Kernel, nu: np.ndarray, instruments: "Instruments") -> np.ndarray:
    """(..., W) the rates of the tracking wheels at nu (..., 3); their angles where nu is integrated over time."""
    scales = bound.wheels, bound.rollers_per_wheel, bound.constant("platform_radius"), bound.constant("yaw_scale")
    components = list(np.moveaxis(nu, -1, 0))
    wheels = zip(instruments.tracking_places, instruments.tracking_directions, strict=True)
    found = [
        parts.tracking_wheel(*scales, components, list(place), direction, instruments.tracking_radius)
        for place, direction in wheels
    ]
    return np.stack(found, axis=-1)


def ways_at(run: "Trajectory", times: np.ndarray) -> np.ndarray:
    """(T, 3) nu integrated from the start of a run to times (T,) within it: its steps are polynomials.

    Raises InvalidValueError where the polynomials were not saved.
    """
    if run.dense is None:
        raise InvalidValueError("names", "tracking_angle", "is integrated over the run: its dense output was not saved")
    starts, lengths = steps_of(run.elapsed, run.step_rows)
    if not len(starts):
        return np.zeros((len(times), 3))
    step, x = places_in_steps(starts, lengths, np.asarray(times) - run.start_time)
    nu = run.dense[:, :, :3]
    ways = lengths[:, None] * nu.mean(axis=1)
    before = np.concatenate([np.zeros((1, 3)), np.cumsum(ways, axis=0)[:-1]])
    return before[step] + lengths[step, None] * integrals_at(nu[step], x)


def ways_reckoned(
    vehicle: Vehicle, bound: Kernel, counts: np.ndarray, turns: np.ndarray, instruments: "Instruments"
) -> np.ndarray | None:
    """(T - 1, 3) nu integrated over each step, by least squares, from what the encoders count and the gyro tells.

    counts  (T, W) of the tracking wheels
    turns   (T - 1,) by which the heading grows in each step, by the gyro: used where the wheels alone do not tell all

    None where both together do not tell all of the motion.
    """
    rows = rates(bound, np.eye(3), instruments).T
    told = np.diff(counts, axis=0) * (2 * np.pi / instruments.tracking_counts_per_turn)
    if np.linalg.matrix_rank(rows) < 3:
        # Over the radius, so that both kinds of rows count alike where there are more than it needs.
        scale = vehicle.platform_radius / instruments.tracking_radius
        rows = np.concatenate([rows, [[0, 0, scale / vehicle.yaw_scale]]])
        told = np.concatenate([told, scale * turns[:, None]], axis=1)
        if np.linalg.matrix_rank(rows) < 3:
            return None
    return told @ np.linalg.pinv(rows).T


def turns_of(gyro: np.ndarray, times: Sequence[float] | np.ndarray) -> np.ndarray:
    """(T - 1,) by which the heading grows from each time to the next: the trapezoidal rule over a gyro's readings."""
    return np.diff(times) * (gyro[1:] + gyro[:-1]) / 2


def is_there(instruments: Any) -> bool:
    """Whether there are tracking wheels."""
    return instruments.tracking_places is not None
