"""What a fit has found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np
from scipy.special import stdtrit

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.errors import InvalidValueError
from omniroll.identification.arrangements import better_arrangement, percent
from omniroll.identification.determination import LOOSE, undetermined
from omniroll.identification.experiments import Experiment, experiments
from omniroll.identification.log import Log
from omniroll.identification.model import Model
from omniroll.identification.pictures import draw_residuals
from omniroll.identification.prediction import Readings
from omniroll.identification.written import scene_text
from omniroll.scenes.loading import Scene
from omniroll.vehicles.vehicle import Vehicle

NEAR = 1e-3  # of a number's deviation and size: so near it is on its bound, which a search need not reach exactly
MISSED = 0.1  # of the size of a reading that residuals may have, and
TOGETHER = 0.5  # how much each may go with the one before it, until the model is none of the log's
ODD = 4.0  # deviations from which on a residual's size or correlation is no chance


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """Numbers that were fitted to logs; n of them, in the order of `names`.

    what        the Scene or the Vehicle as it was
    model       the model with the fitted numbers
    names       of the numbers
    values      (n,) their values, each in its unit
    sizes       (n,) the sizes in which the Jacobian counts them
    bounds      (n, 2) the least and the most that each may be
    jacobian    (m, n) derivatives of all readings over their noise, and of the priors, by the numbers in their sizes
    logs        the logs
    residuals   for each log what was read less what the fitted model reads, by name
    noise       for each log the standard deviation of each reading's noise
    estimated   names of the readings whose noise is what the fit left over
    differenced names of the numbers by which the Jacobian has differences of runs; its other columns are exact
    start       the model before the fit
    is_ended    whether somebody has ended the fit: these are the best numbers that it had found
    """

    what: Scene | Vehicle
    model: Model
    names: tuple[str, ...]
    values: np.ndarray
    sizes: np.ndarray
    bounds: np.ndarray
    jacobian: np.ndarray
    logs: tuple[Log, ...]
    residuals: tuple[Readings, ...]
    noise: tuple[dict[str, float], ...]
    estimated: tuple[str, ...]
    differenced: tuple[str, ...] = ()
    is_ended: bool = False
    start: Model | None = None

    def __getitem__(self, name: str) -> float:
        """The value of a number by its name."""
        return float(self.values[self._place(name)])

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle with the fitted numbers."""
        return self.model.vehicle

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What acts, with the fitted numbers."""
        return self.model.effects

    @cached_property
    def covariance(self) -> np.ndarray:
        """(n, n) of the values. What no log determines has a deviation of some ten times its size."""
        information = self.jacobian.T @ self.jacobian + np.eye(len(self.names)) / LOOSE**2
        return np.linalg.inv(information) * np.outer(self.sizes, self.sizes)

    @property
    def deviations(self) -> np.ndarray:
        """(n,) standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> np.ndarray:
        """(n, n) between -1 and 1."""
        return self.covariance / np.outer(self.deviations, self.deviations)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """The ends of the interval that holds a number with the probability `level`, between 0 and 1.

        name  of the number

        It knows no bounds: where one is the nearest to what the logs ask for, `on_bounds` says so.

        Raises InvalidValueError for a name that was not fitted, and for other levels.
        """
        level = validation.real("level", level)
        if not 0 < level < 1:
            raise InvalidValueError("level", level, "must lie between 0 and 1")
        place = self._place(name)
        freedom = max(1, len(self.jacobian) - len(self.names))
        half = stdtrit(freedom, (1 + level) / 2) * self.deviations[place]
        return float(self.values[place] - half), float(self.values[place] + half)

    @cached_property
    def undetermined(self) -> tuple[str, ...]:
        """What the logs and priors do not determine, in words: "mass and wheel_inertia only as ..."."""
        return undetermined(self.jacobian, self.names, self.sizes)

    @cached_property
    def on_bounds(self) -> tuple[str, ...]:
        """Numbers that end on a bound, in words: "mass ends on its bound 2.3: ..."."""
        near = NEAR * np.minimum(self.deviations, self.sizes)[:, None]
        rows, sides = np.nonzero(np.abs(self.values[:, None] - self.bounds) <= near)
        return tuple(
            f"{self.names[row]} ends on its bound {self.bounds[row, side]:g}: its interval, and those of numbers that "
            "go with it, are as if there were none"
            for row, side in zip(rows, sides, strict=True)
        )

    def experiments(
        self,
        *,
        candidates: Mapping[str, Sequence[Effect]] | None = None,
        duration: float = 10.0,
        step: float = 0.01,
    ) -> list[Experiment]:
        """Candidate drives in order, the one that would tell most about the numbers first.

        candidates  effects by name, each in the place of those of the fit; None: straight, sideways, on the spot, and
                    turning while driving, with the largest torque or voltage of the fit's own drive
        duration    of a drive, in s
        step        time between two readings, in s; they are those of the first log, with their noise

        Raises InvalidValueError where there are no candidates and the fit has no drive to take them from.
        """
        return experiments(self, candidates, duration, step)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Where the residuals are not noise, so that the model misses something, and the intervals are too narrow."""
        return tuple(
            doubt
            for log, left, noise in zip(self.logs, self.residuals, self.noise, strict=True)
            for name, value in left.items()
            for doubt in _doubts(f"{log.name}, {name}", value / noise[name], name in self.estimated)
        )

    @cached_property
    def misses(self) -> tuple[str, ...]:
        """Where the model does not read what the logs do at all: not this model, or not these columns."""
        found = [
            f"{log.name}, {name}: the fitted model leaves {percent(share)} of it, which is no noise: not this model"
            for log, left in zip(self.logs, self.residuals, strict=True)
            for name, value in left.items()
            if (share := _share(value, log.data[name])) > MISSED and _alike(value) > TOGETHER
        ]
        other = better_arrangement(self.start, self.logs) if found and self.start is not None else None
        return (*found, *([other] if other else []))

    def save(self, path: str | PathLike) -> Path:
        """Write the scene with the fitted numbers as a TOML file; its path. Raises InvalidValueError of a Vehicle."""
        if not isinstance(self.what, Scene):
            raise InvalidValueError("what", self.what, "must be a Scene, for a scene file to be written")
        notes = [f"Numbers fitted to {', '.join(log.name for log in self.logs)}:", *str(self).splitlines()]
        path = validation.file_path("path", path)
        path.write_text(scene_text(self.what.tables, self.model, self.names, notes), encoding="utf-8")
        return path

    def picture(self, path: str | PathLike) -> Path:
        """Draw the residuals of every reading as PNG; its path. Needs matplotlib."""
        return draw_residuals(self.logs, self.residuals, self.noise, validation.file_path("path", path))

    def __str__(self) -> str:
        width = max(map(len, self.names))
        lines = []
        for name, value in zip(self.names, self.values, strict=True):
            low, high = self.interval(name)
            lines.append(f"{name:<{width}}  {value:.6g}  95 %: {low:.6g} ... {high:.6g}")
        how = [f"{', '.join(self.differenced)}: derivatives by differences of runs"] if self.differenced else []
        if self.is_ended:
            how.append("ended before it was done: these are the best numbers so far, and their intervals are no answer")
        return "\n".join([*lines, *self.on_bounds, *self.undetermined, *self.doubts, *self.misses, *how])

    def _place(self, name: str) -> int:
        return self.names.index(validation.choice("name", name, self.names))


def _share(left: np.ndarray, read: np.ndarray) -> float:
    """The size of residuals over that of what was read, about its mean."""
    size = float(np.sqrt(np.mean((read - read.mean(axis=0)) ** 2)))
    return float(np.sqrt(np.mean(left**2))) / size if size else 0.0


def _alike(left: np.ndarray) -> float:
    """How much each residual goes with the one before it, between -1 and 1."""
    return float(np.sum(left[1:] * left[:-1]) / np.sum(left**2)) if np.any(left) else 0.0


def _doubts(place: str, left: np.ndarray, is_estimated: bool) -> list[str]:
    """What is odd in residuals (T, ...) over their noise: their size, and how each goes with the one before."""
    count, found = left.size, []
    size = float(np.mean(left**2))
    if not is_estimated and (size - 1) * np.sqrt(count / 2) > ODD:
        found.append(f"{place}: residuals are {np.sqrt(size):.3g} times the noise")
    alike = _alike(left)
    if abs(alike) * np.sqrt(count) > ODD:
        found.append(f"{place}: each residual goes with the one before it, correlation {alike:.2f}")
    return found
