"""Tracking wheels: encoders on wheels that carry no load, roll along one direction and slide freely across it.

Their rates are linear in nu, by the generated function, and so are their angles in the integrals of nu over time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.results.dense import integrals_at, places_in_steps, steps_of


@dataclass(frozen=True)
class TrackingWheels:
    """W tracking wheels of a vehicle, with the names that they have in Instruments.

    Raises InvalidValueError for what does not fit together.
    """

    tracking_places: Sequence[tuple[float, float]]
    tracking_directions: Sequence[float]
    tracking_radius: float
    tracking_counts_per_turn: float

    def __post_init__(self) -> None:
        lacking = [name for name, value in vars(self).items() if value is None]
        if lacking:
            raise InvalidValueError(lacking[0], None, "must be given where there are tracking wheels")
        if len(self.tracking_directions) != len(self.tracking_places):
            bound = f"must be {len(self.tracking_places)} numbers, one for each of tracking_places"
            raise InvalidValueError("tracking_directions", self.tracking_directions, bound)

    def rates(self, bound: Kernel, nu: np.ndarray) -> np.ndarray:
        """(..., W) their rates at nu (..., 3); their angles where nu is integrated over time."""
        scales = bound.wheels, bound.rollers_per_wheel, bound.constant("platform_radius"), bound.constant("yaw_scale")
        components = list(np.moveaxis(nu, -1, 0))
        wheels = zip(self.tracking_places, self.tracking_directions, strict=True)
        found = [
            parts.tracking_wheel(*scales, components, list(place), direction, self.tracking_radius)
            for place, direction in wheels
        ]
        return np.stack(found, axis=-1)

    def ways_reckoned(self, bound: Kernel, counts: np.ndarray, turns: np.ndarray) -> np.ndarray | None:
        """(T - 1, 3) nu integrated over each step, by least squares, from what the encoders count and a gyro tells.

        counts  (T, W) of the encoders
        turns   (T - 1,) by which the heading grows in each step, by the gyro: used where the wheels alone do not tell
                all of the motion

        None where both together do not.
        """
        rows = self.rates(bound, np.eye(3))
        told = np.diff(counts, axis=0) * (2 * np.pi / self.tracking_counts_per_turn)
        if np.linalg.matrix_rank(rows) < 3:
            # The turn is taken times what makes it as large as a wheel's, so that all rows count alike.
            scale = bound.vehicle.platform_radius / self.tracking_radius
            rows = np.concatenate([rows, [[0], [0], [scale / bound.vehicle.yaw_scale]]], axis=1)
            told = np.concatenate([told, scale * turns[:, None]], axis=1)
            if np.linalg.matrix_rank(rows) < 3:
                return None
        return told @ np.linalg.pinv(rows)


def ways_at(elapsed: np.ndarray, step_rows: np.ndarray, dense: np.ndarray | None, since: np.ndarray) -> np.ndarray:
    """(T, 3) nu integrated from the start of a run to times `since` then (T,): its steps are polynomials.

    elapsed, step_rows, dense  of a Trajectory

    Raises InvalidValueError where the polynomials were not saved.
    """
    if dense is None:
        bound = "is integrated over the run, whose dense output was not saved"
        raise InvalidValueError("names", "tracking_angle", bound)
    starts, lengths = steps_of(elapsed, step_rows)
    if not len(starts):
        return np.zeros((len(since), 3))
    step, x = places_in_steps(starts, lengths, since)
    nu = dense[:, :, :3]
    ways = lengths[:, None] * nu.mean(axis=1)
    before = np.concatenate([np.zeros((1, 3)), np.cumsum(ways, axis=0)[:-1]])
    return before[step] + lengths[step, None] * integrals_at(nu[step], x)


def turns_of(gyro: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(T - 1,) by which the heading grows from each time to the next: the trapezoidal rule over a gyro's readings."""
    return np.diff(times) * (gyro[1:] + gyro[:-1]) / 2
