"""Derivatives of runs by differences: two runs with a number a little larger and smaller, extrapolated to no change."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import omniroll
from omniroll import Vehicle

TIGHT = {"accuracy": 1e-14, "control": False}
VEHICLE = Vehicle.paper()
START = {"nu": (1.0, 0.3, 0.8), "chi": (0.1, -0.2, 0.15), "pose": (0.1, 0.2, 0.3)}
TIED = {"nu": (0.0, 0.0, 1.0), "chi": (0.1, 0.1, 0.1), "pose": (0.0, 0.0, 0.0), "spins": 0.0}  # wheels switch together
SPINS = np.random.default_rng(0).normal(size=(3, VEHICLE.rollers_per_wheel - 1))


@dataclass(frozen=True)
class Case:
    """A run that can be made with a number changed."""

    roller_model: str = "locked"
    switching: str = "impact"
    effects: tuple = ()
    duration: float = 1.0
    vehicle: Vehicle = VEHICLE
    start: dict[str, Any] = field(default_factory=dict)

    def run(self, **options: Any) -> omniroll.Trajectory:
        spins = {"spins": SPINS} if self.roller_model == "free" else {}
        return omniroll.simulate(
            self.vehicle, **(START | spins | self.start), duration=self.duration, roller_model=self.roller_model,
            switching=self.switching, effects=self.effects, **(TIGHT | options),
        )  # fmt: skip

    def changed(self, name: str, by: float) -> "Case":
        """The case with the number of this name larger."""
        number, *places = name.replace("]", "").split("[")
        place = tuple(map(int, places))

        def moved(value: Any) -> Any:
            array = np.array(value, float)
            if place and array.ndim < len(place):
                array = np.repeat(array, self.vehicle.wheels)
            array[place] += by
            return array.tolist()

        start = START | ({"spins": SPINS} if self.roller_model == "free" else {}) | self.start
        if number in start:
            return replace(self, start=self.start | {number: moved(start[number])})
        if number in omniroll.vehicles.vehicle.Vehicle.__dataclass_fields__:
            return replace(self, vehicle=self.vehicle.replace(**{number: moved(getattr(self.vehicle, number))}))
        effects = tuple(
            replace(effect, **{number: moved(getattr(effect, number))}) if _has(effect, number) else effect
            for effect in self.effects
        )
        return replace(self, effects=effects)


def _has(effect: omniroll.effects.effect.Effect, number: str) -> bool:
    return getattr(effect, number, None) is not None


def motion(run: omniroll.Trajectory, t: float | None = None) -> np.ndarray:
    """nu, chi, pose and spins at a time, or at the end, in one row."""
    found = run.sample(run.t[-1] if t is None else t)
    return np.concatenate([getattr(found, name).ravel() for name in names_of(run)])


def derivative(run: omniroll.Trajectory, name: str, t: float | None = None) -> np.ndarray:
    """What the run says of the same."""
    found = run.sensitivity(name, run.t[-1] if t is None else t)
    return np.concatenate([getattr(found, part).ravel() for part in names_of(run)])


def names_of(run: omniroll.Trajectory) -> list[str]:
    return ["nu", "chi", "pose"] + (["spins"] if run.spins is not None else [])


def differenced(case: Case, name: str, change: float, t: float | None = None, **options: Any) -> np.ndarray:
    """The derivative of `motion` by a number, from central differences of three sizes, of runs with these options."""

    def central(by: float) -> np.ndarray:
        ends = [motion(case.changed(name, side * by).run(**options), t) for side in (-1, 1)]
        return (ends[1] - ends[0]) / (2 * by)

    wide, middle, narrow = (central(change / k) for k in (1, 2, 4))
    first, second = (4 * middle - wide) / 3, (4 * narrow - middle) / 3
    return (16 * second - first) / 15
