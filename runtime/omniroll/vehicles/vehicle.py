"""The vehicle: an immutable, validated set of numbers."""

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, asdict, dataclass, fields
from typing import Any

import numpy as np

from omniroll import generated_data, validation
from omniroll.errors import InvalidValueError
from omniroll.vehicles import parts

POSITIVE_FIELDS = (
    "platform_radius",
    "wheel_radius",
    "roller_axis_radius",
    "mass",
    "yaw_inertia",
    "wheel_inertia",
    "roller_inertia",
    "yaw_scale",
)
UNITS = {
    "wheel_angles": "rad",
    "platform_radius": "m",
    "wheel_radius": "m",
    "roller_axis_radius": "m",
    "mass": "kg",
    "yaw_inertia": "kg m^2",
    "wheel_inertia": "kg m^2",
    "roller_inertia": "kg m^2",
    "yaw_scale": "1",
    "wheel_places": "m",
    "center_of_mass": "m",
}


@dataclass(frozen=True)
class Vehicle:
    """A vehicle on omni-wheels, section 2 of the paper. Any coherent system of units; SI is shown.

    wheels              N, at least 1
    rollers_per_wheel   n, at least 3
    wheel_angles        alpha_i, N angles in rad; by default evenly spaced, the first 0
    platform_radius     R in m, centre of the vehicle to the wheels' centres
    wheel_radius        l in m, wheel centre to the ground
    roller_axis_radius  r in m, wheel centre to a roller's axis; by default that of section 4 (n >= 4)
    mass                M in kg, of the whole
    yaw_inertia         I_S in kg m^2, of the whole about the vertical through S
    wheel_inertia       J in kg m^2, of a wheel with its rollers about its axle
    roller_inertia      B in kg m^2, of a roller about its own axis
    yaw_scale           Lambda, nu_3 = Lambda theta'; by default 1
    wheel_places        (x, y) in m of each wheel's centre from S; by default on the rays of wheel_angles at
                        platform_radius. With places, wheel_angles are the directions of the axles and platform_radius
                        is only the scale of nu
    center_of_mass      (x, y) in m of the whole from S; yaw_inertia stays that about S

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

        put("wheels", validation.integer("wheels", self.wheels, 1))
        put("rollers_per_wheel", validation.integer("rollers_per_wheel", self.rollers_per_wheel, 3))
        put("wheel_angles", _wheel_angles(self.wheel_angles, self.wheels))
        put("wheel_radius", validation.positive("wheel_radius", self.wheel_radius))
        if self.roller_axis_radius is None:
            put("roller_axis_radius", parts.truncated_axis_radius(self.wheel_radius, self.rollers_per_wheel))
        for field in POSITIVE_FIELDS:
            put(field, validation.positive(field, getattr(self, field)))
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

        platform_mass, platform_inertia    yaw inertia about S
        hub_mass, hub_axial_inertia, hub_transverse_inertia    about the axle and across it
        roller_mass, roller_axial_inertia, roller_transverse_inertia    about the roller's axis and across it
        rotor_mass, rotor_axial_inertia, rotor_transverse_inertia    about the rotor's axis, parallel to the axle
        rotor_distance    from S to the rotor's centre
        gear_ratio        turns of the rotor per turn of the wheel, negative where it turns the other way

        The other arguments are fields of Vehicle. Raises InvalidValueError: the roller's numbers must be
        positive, the others not negative, and the vehicle that comes out must be a vehicle.
        """
        wheels = validation.integer("wheels", wheels, 1)
        rollers_per_wheel = validation.integer("rollers_per_wheel", rollers_per_wheel, 3)
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
        expression = generated_data.load("bounds").get("sharpness")
        return generated_data.evaluate(expression, _symbols_of(self)) if expression is not None else 0.0

    def replace(self, **changes: Any) -> "Vehicle":
        """A vehicle with some fields changed; it is validated again."""
        return type(self)(**(self.as_dict() | changes))

    def __repr__(self) -> str:
        lines = (f"    {field.name}={getattr(self, field.name)!r}," for field in fields(self))
        shown = (
            (line + "  # " + UNITS[name]) if (name := line.split("=")[0].strip()) in UNITS else line for line in lines
        )
        return "Vehicle(\n" + "\n".join(shown) + "\n)"


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
    values |= dict(zip(("com_x", "com_y"), vehicle.center_of_mass, strict=True))
    return {
        symbol: values[code]
        for symbol, code in generated_data.code_names().items()
        if isinstance(values.get(code), (int, float))
    }


def _check_bounds(vehicle: Vehicle) -> None:
    """The bounds of the derivation: each expression must be positive."""
    values = _symbols_of(vehicle)
    symbol_of = {code: symbol for symbol, code in generated_data.code_names().items()}
    for bound in generated_data.load("bounds")["bounds"]:
        field, expression = bound["field"], bound["positive"]
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
