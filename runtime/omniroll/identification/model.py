"""What is fitted: a vehicle, what acts on it, its start and its instruments, with numbers that have names.

mass, wheel_inertia, ...        of the vehicle
torque_constant, ...            of an effect, where it is one number
nu[0], chi[2], pose[1]          of the start
gyro_bias, wheel_rate_scale, accelerometer_delay
                                of an instrument, which reads scale * (what is, delay ago) + bias
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.motor import Motor
from omniroll.errors import InvalidValueError
from omniroll.identification.log import ENTRIES
from omniroll.kinds import Numbers
from omniroll.results.measurements import Instruments
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import VEHICLE, by_name

START = re.compile(r"(nu|chi|pose)\[(\d+)\]")
NEUTRAL = {"scale": 1.0, "bias": 0.0, "delay": 0.0}
OF_INSTRUMENT = re.compile(rf"({'|'.join(ENTRIES)})_({'|'.join(NEUTRAL)})")
SMALL = {
    "scale": 1.0,
    "bias": 0.01,
    "delay": 1e-3,
    "nu": 0.01,
    "chi": 0.01,
    "pose": 0.01,
}  # a small change of what is 0
POSITIVE = Numbers(above=0)
LEAST_PART = 1e-3  # of the size of its start that the size of a number keeps
LONGEST_DELAY = 0.2  # s, either way
OF_VEHICLE = tuple(name for name, entry in by_name(VEHICLE).items() if entry.kind == POSITIVE)


@dataclass(frozen=True)
class Number:
    """A number that a fit may change.

    name   as above
    start  where the fit begins; None: the value that the scene has
    least  its bounds, least <= value <= most; None: those that the number has by its kind
    most
    prior  mean and standard deviation of what is known of it besides the logs, or None

    Raises InvalidValueError where they do not fit each other.
    """

    name: str
    start: float | None = None
    least: float | None = None
    most: float | None = None
    prior: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        validation.text("name", self.name)
        for name in ("start", "least", "most"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, validation.real(f"{name} of {self.name}", value))
        if self.least is not None and self.most is not None and not self.least < self.most:
            raise InvalidValueError(f"most of {self.name}", self.most, f"must be above least = {self.least!r}")
        if self.prior is not None:
            mean, deviation = validation.real_array(f"prior of {self.name}", self.prior, (2,)).tolist()
            validation.positive(f"prior of {self.name}", deviation)
            object.__setattr__(self, "prior", (mean, deviation))


@dataclass(frozen=True)
class Free:
    """A Number with all that it leaves out, and the size of its start."""

    name: str
    start: float
    least: float
    most: float
    prior: tuple[float, float] | None
    size: float

    def size_in(self, model: "Model") -> float:
        """By how much it changes when it changes much; not 0 where it has come to 0."""
        return max(model.size(self.name), LEAST_PART * self.size)


@dataclass(frozen=True)
class Model:
    """A vehicle with its run and its instruments.

    vehicle      Vehicle
    options      the other arguments of omniroll.simulate
    instruments  Instruments: places and counts
    corrections  scale, bias and delay of instruments by name, where they are not neutral
    """

    vehicle: Vehicle
    options: Mapping[str, Any]
    instruments: Instruments
    corrections: Mapping[str, float] = field(default_factory=dict)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What acts."""
        return tuple(self.options.get("effects", ()))

    def value(self, name: str) -> float:
        """The number of that name. Raises InvalidValueError where there is none."""
        if OF_INSTRUMENT.fullmatch(name):
            return self.corrections.get(name, NEUTRAL[name.rpartition("_")[2]])
        if match := START.fullmatch(name):
            return float(self._start(match)[int(match[2])])
        if name in OF_VEHICLE:
            return getattr(self.vehicle, name)
        return getattr(self._owner(name), name)

    def correction(self, reading: str, kind: str) -> float:
        """The scale, bias or delay of a reading."""
        return self.corrections.get(f"{reading}_{kind}", NEUTRAL[kind])

    def sensitivities(self, name: str) -> tuple[str, ...]:
        """The names by which a run knows what this number moves; none for a number of an instrument."""
        if OF_INSTRUMENT.fullmatch(name):
            return ()
        if START.fullmatch(name) or name in OF_VEHICLE:
            return (name,)
        return (name, "back_emf") if self._is_both_constants(name) else (name,)

    def with_values(self, values: Mapping[str, float]) -> "Model":
        """The model with other numbers; runs of models whose numbers differ only in instruments are the same."""
        changed = self
        for name, value in values.items():
            if value != changed.value(name):
                changed = changed._with(name, float(value))
        return changed

    def least(self, name: str) -> float:
        """The lower bound that a number has by its kind."""
        if name.startswith("chi["):
            return -np.pi / self.vehicle.rollers_per_wheel
        if OF_INSTRUMENT.fullmatch(name) or START.fullmatch(name):
            return -np.inf
        return 0.0 if name in OF_VEHICLE or self.value(name) >= 0 else -np.inf

    def most(self, name: str) -> float:
        """The upper bound that a number has by its kind."""
        return np.pi / self.vehicle.rollers_per_wheel if name.startswith("chi[") else np.inf

    def size(self, name: str) -> float:
        """By how much a number changes when it changes much: its own size, or where it is 0 one of its kind."""
        value = abs(self.value(name))
        match = START.fullmatch(name)
        kind = match[1] if match else name.rpartition("_")[2]
        return max(value, SMALL[kind]) if kind in SMALL else value

    def _with(self, name: str, value: float) -> "Model":
        if OF_INSTRUMENT.fullmatch(name):
            return replace(self, corrections=self.corrections | {name: value})
        if match := START.fullmatch(name):
            start = self._start(match)
            start[int(match[2])] = value
            return replace(self, options=self.options | {match[1]: start})
        if name in OF_VEHICLE:
            return replace(self, vehicle=self.vehicle.replace(**{name: value}))
        owner = self._owner(name)
        changes = {name: value}
        if self._is_both_constants(name):
            changes["back_emf"] = value
        effects = tuple(replace(owner, **changes) if effect is owner else effect for effect in self.effects)
        return replace(self, options=self.options | {"effects": effects})

    def _is_both_constants(self, name: str) -> bool:
        """Whether a motor has one constant for torque and back-EMF, as one that is given by its torque_constant."""
        owner = self._owner(name)
        return isinstance(owner, Motor) and name == "torque_constant" and owner.back_emf == owner.torque_constant

    def _start(self, match: re.Match) -> np.ndarray:
        size = self.vehicle.wheels if match[1] == "chi" else 3
        if int(match[2]) >= size:
            raise InvalidValueError("free", match[0], f"{match[1]} has {size} numbers, counted from 0")
        return np.array(np.broadcast_to(self.options.get(match[1], 0.0), (size,)), float)

    def _owner(self, name: str) -> Effect:
        """The effect whose number it is."""
        owners = [effect for effect in self.effects if name in _numbers_of(effect)]
        if len(owners) != 1:
            known = [*OF_VEHICLE, *(n for effect in self.effects for n in _numbers_of(effect)), "nu[0]", "gyro_bias"]
            why = (
                "is a number of two effects" if owners else f"no such number; there are {', '.join(known)} and the like"
            )
            raise InvalidValueError("free", name, why)
        return owners[0]


def _numbers_of(effect: Effect) -> tuple[str, ...]:
    """Names of the fields that are one number."""
    return tuple(entry.name for entry in fields(effect) if isinstance(getattr(effect, entry.name), float))


def checked_numbers(free: Sequence[str | Number], model: Model) -> tuple[Free, ...]:
    """The numbers that are free, with start and bounds. Raises InvalidValueError."""
    bound = "must be a sequence of names, or of omniroll.Number"
    given = validation.sequence("free", free, bound)
    if not given or not all(isinstance(number, str | Number) for number in given):
        raise InvalidValueError("free", free, bound)
    numbers = [number if isinstance(number, Number) else Number(number) for number in given]
    names = [number.name for number in numbers]
    if len(set(names)) < len(names):
        raise InvalidValueError("free", names, "must name each number once")
    return tuple(_completed(number, model) for number in numbers)


def _completed(number: Number, model: Model) -> Free:
    name = number.name
    start = model.value(name) if number.start is None else number.start
    least = model.least(name) if number.least is None else number.least
    most = model.most(name) if number.most is None else number.most
    if name.endswith("_delay"):
        least, most = max(least, -LONGEST_DELAY), min(most, LONGEST_DELAY)
    if not least <= start <= most:
        raise InvalidValueError(f"start of {name}", start, f"must lie between {least:g} and {most:g}")
    size = model.with_values({name: start}).size(name)
    if not size:
        raise InvalidValueError(f"start of {name}", start, "must not be 0: changes are counted in its size")
    return Free(name, start, least, most, number.prior, size)
