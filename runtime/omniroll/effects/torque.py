"""Torques at the wheels' axles, given in advance: constant, or a table over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect, Influence, Process, Signal, Table
from omniroll.effects.numbers import Curve, driven_alone, per_wheel, refuse_undriven, table
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INTERPOLATION, ONE_OR_PER_WHEEL, ROW_TIMES, ROWS, TORQUE, documented


class Drive(Effect):
    """What the effects that turn the wheels share: the kernel's torque, the work that it does, and tables over time."""

    def kernel_effects(self) -> tuple[str, ...]:
        return ("drive",)

    def _keep_table(self, name: str, width: int | None = None) -> None:
        """Put times and the values of this name, checked, in place of what was given. Raises InvalidValueError."""
        interpolation = getattr(self, "interpolation", "linear")
        times, values = table(name, self.times, getattr(self, name), interpolation, width)
        self._put(times=times, **{name: values})

    def _curve(self, name: str, start_time: float, wheels: int | None = None) -> Curve:
        """The table of this name over the time since the start of a run. Raises InvalidValueError where it has not a
        column for each of so many wheels."""
        values = getattr(self, name)
        if wheels is not None and len(values[0]) != wheels:
            raise InvalidValueError(name, values, f"must have {wheels} columns, one for each wheel")
        return Curve(np.array(self.times) - start_time, np.array(values), self.interpolation)


class Following(Process):
    """Follows a curve (K, N) over time as an input of the given name."""

    remembers: ClassVar[tuple[str, ...] | None] = ("knot",)

    def __init__(self, name: str, curve: Curve):
        self.name, self.curve = name, curve
        self.knot = curve.next_knot(0.0)

    def compiled(self) -> tuple[Table, ...] | None:
        return (Table(self.name, self.curve),) if type(self) is Following else None

    def next_time(self) -> float:
        return self.knot

    def pass_time(self, state: State) -> None:
        self.knot = self.curve.next_knot(self.knot)

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        return Influence({self.name: Signal(*self.curve.after(elapsed))})

    def held(self) -> Mapping[str, np.ndarray]:
        return {self.name: self.curve.values[0]} if self.curve.is_constant else {}


@documented(replace(TORQUE, kind=ONE_OR_PER_WHEEL))
@dataclass(frozen=True)
class Torque(Drive):
    """Constant torques at the wheels' axles.

    {entries}

    Raises InvalidValueError for what is not such numbers; simulate raises it for a number of torques that is not N.
    """

    signals: ClassVar[tuple[str, ...]] = ("torque",)

    torque: ArrayLike

    def __post_init__(self) -> None:
        self._put(torque=per_wheel("torque", self.torque))

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        driven_alone("torque", self.torque, vehicle)

    def process(self, kernel: Kernel, start_time: float) -> Process:
        return Following("torque", Curve.constant(driven_alone("torque", self.torque, kernel.vehicle)))


def with_torque(effects: Sequence[Effect]) -> Sequence[Effect]:
    """The effects with a constant torque among them: one of 0 where there is none, for a session to replace."""
    if not isinstance(effects, Sequence) or any(isinstance(effect, Torque) for effect in effects):
        return effects
    return (*effects, Torque(0.0))


@documented(ROW_TIMES, replace(TORQUE, kind=ROWS), INTERPOLATION)
@dataclass(frozen=True)
class TorqueTable(Drive):
    """Torques at the wheels' axles over time.

    {entries}

    With interpolation "hold" each row holds until the time of the next. Raises InvalidValueError for times that do not
    increase and rows that do not fit them; simulate raises it for rows of a length that is not N.
    """

    signals: ClassVar[tuple[str, ...]] = ("torque", "times")

    times: ArrayLike
    torque: ArrayLike
    interpolation: str = "linear"

    def __post_init__(self) -> None:
        self._keep_table("torque")

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        refuse_undriven("torque", self._curve("torque", 0.0, vehicle.wheels).values, vehicle)

    def events(self) -> tuple[str, ...]:
        return (f"knots of the torques, {len(self.times)}",)

    def process(self, kernel: Kernel, start_time: float) -> Process:
        return Following("torque", self._curve("torque", start_time))
