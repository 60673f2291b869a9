"""A robot: the numbers that others have published of it, and what had to be assumed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.motor import Motor
from omniroll.errors import InvalidValueError
from omniroll.vehicles.data_sheet import ASSUMED, DERIVED, GIVEN, PUBLISHED, Origin
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import BEARINGS, MOTOR, VEHICLE, by_name

UNITS = {name: entry.unit for name, entry in by_name(VEHICLE, MOTOR, BEARINGS).items()}


@dataclass(frozen=True)
class Stated:
    """A number and where it comes from: its kind as of an Origin, and the source or the reasoning."""

    value: float
    kind: str
    reason: str


def published(value: float, source: str) -> Stated:
    return Stated(value, PUBLISHED, source)


def derived(value: float, how: str) -> Stated:
    return Stated(value, DERIVED, how)


def assumed(value: float, why: str) -> Stated:
    return Stated(value, ASSUMED, why)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that others have built.

    name               what presets call it
    title              its name in full
    source             repository, files, commit, licence
    wheels, rollers_per_wheel
    wheel_angles       (N,) in rad
    numbers            Stated by name: arguments of Vehicle, or of Vehicle.from_parts
    motor_numbers      Stated by name: arguments of Motor, without the voltage; none where nothing is known
    bearing_numbers    Stated by name: arguments of Bearings
    row_offset         in m, how far the two rows of rollers lie from the wheel's middle along the axle; 0 for one row
    more               further arguments of Vehicle, not numbers of their own: places, centre of mass, roller_angle
    remarks            what the model leaves out or sources disagree on
    """

    name: str
    title: str
    source: str
    wheels: int
    rollers_per_wheel: int
    wheel_angles: tuple[float, ...]
    numbers: Mapping[str, Stated]
    motor_numbers: Mapping[str, Stated] = field(default_factory=dict)
    bearing_numbers: Mapping[str, Stated] = field(default_factory=dict)
    row_offset: float = 0.0
    more: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    @cached_property
    def vehicle(self) -> Vehicle:
        """The vehicle; its origins say of each number where it comes from."""
        values = {name: stated.value for name, stated in self.numbers.items()}
        layout = {name: getattr(self, name) for name in ("wheels", "rollers_per_wheel", "wheel_angles")} | self.more
        if "mass" in values:
            return Vehicle(**layout, **values, origins=self._origins(self.numbers))
        made = Vehicle.from_parts(**layout, **values)
        stated = {origin.name: origin for origin in self._origins(self.numbers, {o.name: o.unit for o in made.origins})}
        origins = tuple(stated[o.name] if o.kind == GIVEN else o for o in made.origins)
        return Vehicle(**made.as_dict(), origins=origins)

    def motor(self, voltage: ArrayLike, **others: Any) -> Motor:
        """The motors of the robot.

        voltage  as of a Motor
        others   further arguments of Motor, in place of the robot's own

        Raises InvalidValueError as Motor does, for an argument that Motor has not, and for numbers that nobody knows.
        """
        validation.known(others, [argument.name for argument in fields(Motor)], "Motor")
        numbers = {name: stated.value for name, stated in self.motor_numbers.items()} | others
        for name in ("torque_constant", "resistance"):
            if name not in numbers:
                raise InvalidValueError(name, None, f"must be given: nobody states it for {self.title}")
        return Motor(voltage, **numbers)

    @property
    def lever_change(self) -> float:
        """By how much the lever of yaw alternates from one row of rollers to the other, over its mean."""
        return 2 * self.row_offset / self.vehicle.platform_radius

    def motor_origins(self) -> tuple[Origin, ...]:
        """The numbers of its motors."""
        return self._origins(self.motor_numbers)

    def origins(self) -> tuple[Origin, ...]:
        """Every number: of the vehicle, of its motors, of its bearings."""
        return self.vehicle.origins + self.motor_origins() + self._origins(self.bearing_numbers)

    def _origins(self, numbers: Mapping[str, Stated], units: Mapping[str, str] = UNITS) -> tuple[Origin, ...]:
        return tuple(
            Origin(name, stated.value, units[name], stated.kind, stated.reason) for name, stated in numbers.items()
        )


def angles(*degrees: float) -> tuple[float, ...]:
    """Wheel angles in rad."""
    return tuple(np.radians(degrees).tolist())
