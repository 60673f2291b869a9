"""The vehicle: an immutable, validated set of numbers."""

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, asdict, dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from omniroll import generated_data, validation, vocabulary
from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts

ENTRIES = vocabulary.by_name(vocabulary.VEHICLE)


@vocabulary.documented(*vocabulary.VEHICLE)
@dataclass(frozen=True)
class Vehicle:
    """A vehicle on omni-wheels, section 2 of the paper. Any coherent system of units; SI is shown.

    {entries}

    Raises InvalidValueError (a ValueError), which names the field, its value and the bound: all numbers
    finite, the scalars positive with squares in the number range, and what the derivation demands
    (generated/data, bounds): for instance roller_axis_radius < wheel_radius cos(pi/n), yaw_inertia > N n B/2.
    """

    _: KW_ONLY
    wheels: int
    rollers_per_wheel: int
    wheel_angles: tuple[float, ...] | None = None
    platform_radius: float
    wheel_radius: float
    roller_axis_radius: float | None = None
    mass: float
    yaw_inertia: float
    wheel_inertia: float
    roller_inertia: float
    yaw_scale: float = 1.0
    wheel_places: tuple[tuple[float, float], ...] | None = None
    center_of_mass: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        def put(field: str, value: Any) -> None:
            object.__setattr__(self, field, value)  # the dataclass is frozen for everybody else

        for name in ("wheels", "rollers_per_wheel", "wheel_radius"):  # the others need these
            put(name, ENTRIES[name].checked(getattr(self, name)))
        put("wheel_angles", _wheel_angles(self.wheel_angles, self.wheels))
        if self.roller_axis_radius is None:
            put("roller_axis_radius", parts.truncated_axis_radius(self.wheel_radius, self.rollers_per_wheel))
        for entry in vocabulary.VEHICLE:
            if entry.kind == vocabulary.POSITIVE:
                put(entry.name, entry.checked(getattr(self, entry.name)))
        if self.wheel_places is not None:
            places = validation.real_array("wheel_places", self.wheel_places, (self.wheels, 2))
            put("wheel_places", tuple(map(tuple, _in_range("wheel_places", places).tolist())))
        center = validation.real_array("center_of_mass", self.center_of_mass, (2,))
        put("center_of_mass", tuple(_in_range("center_of_mass", center).tolist()))
        _check_bounds(self)
        if not math.isfinite(self.sharpness()):
            bound = "roller axis too close to the ground at the joint: 1/rho^2 leaves the number range"
            raise InvalidValueError("roller_axis_radius", self.roller_axis_radius, bound)

    @classmethod
    def paper(cls, wheels: int = 3, rollers_per_wheel: int = 5) -> "Vehicle":
        """The vehicle of the paper, with other numbers of wheels and rollers if they are wanted.

        The paper leaves its numbers out; omniroll.vehicles.parts.paper_numbers says where these come from.

        wheels             N, at least 1
        rollers_per_wheel  n, at least 4

        Raises InvalidValueError for smaller numbers.
        """
        return cls(**parts.paper_numbers(wheels, rollers_per_wheel))

    @classmethod
    @vocabulary.documented(
        vocabulary.WHEELS,
        vocabulary.ROLLERS_PER_WHEEL,
        vocabulary.WHEEL_ANGLES,
        *vocabulary.LENGTHS,
        vocabulary.YAW_SCALE,
        *vocabulary.PARTS,
    )
    def from_parts(
        cls,
        *,
        wheels: int,
        rollers_per_wheel: int,
        wheel_angles: Sequence[float] | None = None,
        platform_radius: float,
        wheel_radius: float,
        roller_axis_radius: float | None = None,
        yaw_scale: float = 1.0,
        platform_mass: float,
        platform_inertia: float,
        hub_mass: float,
        hub_axial_inertia: float,
        hub_transverse_inertia: float,
        roller_mass: float,
        roller_axial_inertia: float,
        roller_transverse_inertia: float,
        rotor_mass: float = 0.0,
        rotor_axial_inertia: float = 0.0,
        rotor_transverse_inertia: float = 0.0,
        rotor_distance: float = 0.0,
        gear_ratio: float = 1.0,
    ) -> "Vehicle":
        """A vehicle from a platform, and for each wheel a hub, n rollers and a motor's rotor; SI units.

        The inertias of the whole follow from the parts by the generated function `inertias` (section 4).

        {entries}

        Raises InvalidValueError for numbers out of their bounds, and where the vehicle that they give breaks a bound
        of Vehicle.
        """
        wheels = vocabulary.WHEELS.checked(wheels)
        rollers_per_wheel = vocabulary.ROLLERS_PER_WHEEL.checked(rollers_per_wheel)
        if roller_axis_radius is None:
            roller_axis_radius = parts.truncated_axis_radius(wheel_radius, rollers_per_wheel)
        whole = parts.inertias(
            wheels,
            rollers_per_wheel,
            platform_radius=platform_radius,
            roller_axis_radius=roller_axis_radius,
            gear_ratio=gear_ratio,
            platform_mass=platform_mass,
            platform_inertia=platform_inertia,
            hub_mass=hub_mass,
            hub_axial_inertia=hub_axial_inertia,
            hub_transverse_inertia=hub_transverse_inertia,
            roller_mass=roller_mass,
            roller_axial_inertia=roller_axial_inertia,
            roller_transverse_inertia=roller_transverse_inertia,
            rotor_mass=rotor_mass,
            rotor_axial_inertia=rotor_axial_inertia,
            rotor_transverse_inertia=rotor_transverse_inertia,
            rotor_distance=rotor_distance,
        )
        return cls(
            wheels=wheels,
            rollers_per_wheel=rollers_per_wheel,
            wheel_angles=wheel_angles,
            platform_radius=platform_radius,
            wheel_radius=wheel_radius,
            roller_axis_radius=roller_axis_radius,
            yaw_scale=yaw_scale,
            **whole,
        )

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, in plain Python types."""
        return asdict(self)

    @property
    def has_layout(self) -> bool:
        """Whether wheels stand elsewhere than on rays at platform_radius, or the centre of mass beside S."""
        return self.wheel_places is not None or self.center_of_mass != (0.0, 0.0)

    def sharpness(self) -> float:
        """How much a contact roller's inertia at the joint outgrows the vehicle's mass (generated/data).

        Large where the rollers are cut close to their tips, so that their axes nearly touch the ground at the
        joint.
        """
        return _sharpness(self)

    def replace(self, **changes: Any) -> "Vehicle":
        """A vehicle with some fields changed.

        changes  fields of Vehicle by name

        Raises InvalidValueError where the new numbers break a bound; they are checked as those of any vehicle.
        """
        return type(self)(**(self.as_dict() | changes))

    def __repr__(self) -> str:
        shown = []
        for field in fields(self):
            unit = ENTRIES[field.name].unit
            shown.append(f"    {field.name}={getattr(self, field.name)!r}," + (f"  # {unit}" if unit else ""))
        return "Vehicle(\n" + "\n".join(shown) + "\n)"


@lru_cache(maxsize=4096)
def _sharpness(vehicle: Vehicle) -> float:
    expression = generated_data.load("bounds").get("sharpness")
    return generated_data.evaluate(expression, _symbols_of(vehicle)) if expression is not None else 0.0


def _in_range(field: str, places: np.ndarray) -> np.ndarray:
    if np.abs(places).max() > validation.LARGEST:
        raise InvalidValueError(field, places.tolist(), f"must not be beyond {validation.LARGEST:.3g}")
    return places


def _wheel_angles(angles: Sequence[float] | None, wheels: int) -> tuple[float, ...]:
    if angles is None:
        return tuple(2 * np.pi * i / wheels for i in range(wheels))
    return tuple(validation.real_array("wheel_angles", angles, (wheels,)).tolist())


def _symbols_of(vehicle: Vehicle) -> dict[str, float]:
    """The vehicle's numbers by the paper's symbols: N, n, R, l, r, M, I_S, J, B, Lambda."""
    values = {field.name: getattr(vehicle, field.name) for field in fields(vehicle)}
    values |= {f"center_of_mass[{k}]": number for k, number in enumerate(vehicle.center_of_mass)}
    return {
        symbol: values[code]
        for symbol, code in generated_data.code_names().items()
        if isinstance(values.get(code), (int, float))
    }


def _check_bounds(vehicle: Vehicle) -> None:
    """The bounds of the derivation on several numbers together: each expression must be positive."""
    values = _symbols_of(vehicle)
    symbol_of = {code: symbol for symbol, code in generated_data.code_names().items()}
    for bound in generated_data.load("bounds")["bounds"]:
        field, expression = bound["field"], bound.get("positive")
        if not isinstance(expression, list):  # of one number by itself: its entry in the vocabulary
            continue
        margin = generated_data.evaluate(expression, values)
        if margin > 0:
            continue
        # Every bound is linear in its field, so that two values give the limit; the second one is of its size.
        value, symbol = getattr(vehicle, field), symbol_of[field]
        at_zero = generated_data.evaluate(expression, values | {symbol: 0.0})
        slope = generated_data.evaluate(expression, values | {symbol: abs(at_zero)}) / abs(at_zero)
        slope -= math.copysign(1.0, at_zero)
        side = "above" if slope > 0 else "below"
        raise InvalidValueError(field, value, f"must be {side} {-at_zero / slope!r}: {bound['reason']}")
