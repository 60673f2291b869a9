"""The vehicle: an immutable, validated set of numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, field, fields
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from omniroll import generated_data, validation, vocabulary
from omniroll.errors import InvalidValueError
from omniroll.vehicles import kinds_of_wheels, parts, profiles, wheel_kind
from omniroll.vehicles.data_sheet import DERIVED, Origin, completed

ENTRIES = vocabulary.by_name(vocabulary.VEHICLE)
SHEET_ENTRIES = {
    "mass",
    *vocabulary.by_name(vocabulary.LENGTHS, vocabulary.PARTS, vocabulary.SOLIDS, vocabulary.DATA_SHEET),
}


@vocabulary.documented(*vocabulary.VEHICLE)
@dataclass(frozen=True)
class Vehicle:
    """A vehicle on omni-wheels, section 2 of the paper. Any coherent system of units; SI is shown.

    {entries}
    origins             of a vehicle from parts: an Origin for each number, which says how it came about. No part of
                        what the vehicle is: it is neither compared nor saved

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
    roller_angle: float | tuple[float, ...] = 0.0
    rows: int = 1
    row_offset: float = 0.0
    meridian_radius: float | None = None
    roller_profile: tuple[tuple[float, float, float], ...] | None = None
    wheel_kinds: tuple[str, ...] | None = None
    kinds: Mapping[str, Mapping[str, Any]] | kinds_of_wheels.Kinds = ()
    origins: tuple[Origin, ...] = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        def put(field: str, value: Any) -> None:
            object.__setattr__(self, field, value)  # the dataclass is frozen for everybody else

        for name in ("wheels", "rollers_per_wheel", "wheel_radius"):  # the others need these
            put(name, ENTRIES[name].checked(getattr(self, name)))
        put("wheel_angles", _wheel_angles(self.wheel_angles, self.wheels))
        kind = {name: getattr(self, name) for name in wheel_kind.ENTRIES}
        for name, value in wheel_kind.checked(self.wheels, self.rollers_per_wheel, **kind).items():
            put(name, value)
        if self.roller_axis_radius is None:
            sizes = self.wheel_radius, self.rollers_per_wheel, wheel_kind.size_of(self.roller_angle)
            put("roller_axis_radius", wheel_kind.assumed_axis_radius(*sizes)[0])
        for entry in vocabulary.VEHICLE:
            if entry.kind == vocabulary.POSITIVE:
                put(entry.name, entry.checked(getattr(self, entry.name)))
        if self.wheel_places is not None:
            places = validation.real_array("wheel_places", self.wheel_places, (self.wheels, 2))
            put("wheel_places", tuple(map(tuple, _in_range("wheel_places", places).tolist())))
        center = validation.real_array("center_of_mass", self.center_of_mass, (2,))
        put("center_of_mass", tuple(_in_range("center_of_mass", center).tolist()))
        if self.has_profile:
            profiles.check(self)
        whole = {name: getattr(self, name) for name in kinds_of_wheels.LARGEST_OF_THE_VEHICLE}
        kinds, names = kinds_of_wheels.checked(self.kinds, self.wheel_kinds, self.wheels, whole)
        put("kinds", kinds)
        put("wheel_kinds", names)
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
        *vocabulary.SOLIDS,
        vocabulary.INERTIAS[0],
        *vocabulary.DATA_SHEET,
        *vocabulary.WHEEL_KIND,
    )
    def from_parts(
        cls,
        *,
        wheels: int,
        rollers_per_wheel: int,
        wheel_angles: Sequence[float] | None = None,
        platform_radius: float,
        wheel_radius: float | None = None,
        roller_axis_radius: float | None = None,
        yaw_scale: float = 1.0,
        platform_mass: float | None = None,
        platform_inertia: float | None = None,
        hub_mass: float | None = None,
        hub_axial_inertia: float | None = None,
        hub_transverse_inertia: float | None = None,
        roller_mass: float | None = None,
        roller_axial_inertia: float | None = None,
        roller_transverse_inertia: float | None = None,
        rotor_mass: float | None = None,
        rotor_axial_inertia: float | None = None,
        rotor_transverse_inertia: float | None = None,
        rotor_distance: float | None = None,
        gear_ratio: float | None = None,
        platform_disk_radius: float | None = None,
        hub_radius: float | None = None,
        hub_width: float | None = None,
        roller_radius: float | None = None,
        roller_length: float | None = None,
        mass: float | None = None,
        wheel_diameter: float | None = None,
        roller_diameter: float | None = None,
        wheel_width: float | None = None,
        wheel_mass: float | None = None,
        roller_angle: float | Sequence[float] = 0.0,
        rows: int = 1,
        row_offset: float = 0.0,
        meridian_radius: float | None = None,
        roller_profile: Sequence[Sequence[float]] | None = None,
    ) -> "Vehicle":
        """A vehicle from a platform, and for each wheel a hub, n rollers and a motor's rotor; SI units.

        An inertia that is not given follows from the sizes of the body as a solid one. With mass, that of the whole,
        in the place of platform_mass, what data sheets print is enough: wheel_diameter, roller_diameter and
        roller_length; of mecanum wheels wheel_diameter alone. The rest is assumed where it is not given. `origins` of
        the vehicle says of each number whether
        it was given, derived or assumed, and why. The inertias of the whole follow from the parts by the generated
        function `inertias` (section 4).

        {entries}

        Raises InvalidValueError for numbers out of their bounds or missing, and where the vehicle that they give
        breaks a bound of Vehicle.
        """
        given = {name: value for name, value in locals().items() if name in SHEET_ENTRIES and value is not None}
        wheels = vocabulary.WHEELS.checked(wheels)
        rollers_per_wheel = vocabulary.ROLLERS_PER_WHEEL.checked(rollers_per_wheel)
        kind = {"roller_angle": roller_angle, "rows": rows, "row_offset": row_offset}
        kind |= {"meridian_radius": meridian_radius, "roller_profile": roller_profile}
        kind = wheel_kind.checked(wheels, rollers_per_wheel, **kind)
        axis_angle = wheel_kind.size_of(kind["roller_angle"])
        sheet = completed(wheels, rollers_per_wheel, given, axis_angle)
        whole = parts.inertias(wheels, rollers_per_wheel, **sheet.values)
        if axis_angle or row_offset:
            more = wheel_kind.inertias_beyond(wheels, rollers_per_wheel, sheet.values, axis_angle, row_offset)
            whole |= {name: whole[name] + value for name, value in more.items()}
        for name, value in whole.items():
            if name not in given:
                sheet.put(name, value, DERIVED, "of all parts together")
        lengths = {entry.name: sheet.values[entry.name] for entry in vocabulary.LENGTHS}
        given_or_whole = whole | {name: given[name] for name in ("mass",) if name in given}
        try:
            return cls(
                wheels=wheels,
                rollers_per_wheel=rollers_per_wheel,
                wheel_angles=wheel_angles,
                yaw_scale=yaw_scale,
                origins=tuple(sheet.origins),
                **lengths,
                **given_or_whole,
                **kind,
            )
        except InvalidValueError as error:
            if error.field != "roller_axis_radius" or error.field in given or "roller_radius" not in sheet.values:
                raise
            bound = f"gives roller_axis_radius = {error.value!r}, which {error.bound}; give roller_axis_radius too"
            raise InvalidValueError("roller_radius", sheet.values["roller_radius"], bound) from None

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, in plain Python types; without the origins, and without the kind of wheels where they
        are the paper's."""
        numbers = asdict(self)
        del numbers["origins"]
        numbers["kinds"] = {name: dict(own) for name, own in self.kinds}
        if self.wheel_kinds is None:
            del numbers["kinds"], numbers["wheel_kinds"]
        for name, usual in wheel_kind.of_the_paper(self.wheels).items():
            if numbers[name] == usual:
                del numbers[name]
        return numbers

    @property
    def rotor(self) -> tuple[float, float] | None:
        """Axial inertia in kg m^2 and gear ratio of the rotors that wheel_inertia holds as from_parts made it."""
        known = {origin.name: origin.value for origin in self.origins}
        if known.get("wheel_inertia") != self.wheel_inertia or not known.get("rotor_axial_inertia"):
            return None
        return known["rotor_axial_inertia"], known.get("gear_ratio", 1.0)

    @property
    def has_layout(self) -> bool:
        """Whether wheels stand elsewhere than on rays at platform_radius, or the centre of mass beside S."""
        return self.wheel_places is not None or self.center_of_mass != (0.0, 0.0)

    @cached_property
    def by_wheel(self) -> dict[str, tuple]:
        """What a kind of wheels may have otherwise, by name, for each wheel: wheel_radius, rollers_per_wheel, ..."""
        return kinds_of_wheels.by_wheel(self)

    @property
    def has_kinds(self) -> bool:
        """Whether kinds of wheels have numbers of their own."""
        return any(numbers for _, numbers in self.kinds)

    @property
    def rollers(self) -> tuple[int, ...]:
        """The number of rollers of each wheel."""
        return self.by_wheel["rollers_per_wheel"]

    @property
    def driven(self) -> np.ndarray:
        """(N,) whether each wheel has a drive."""
        return np.array(self.by_wheel[kinds_of_wheels.DRIVEN])

    def with_drives(self, geared: Callable[[float], float]) -> "Vehicle":
        """The vehicle with another inertia of the wheels that have a drive, which `geared` makes of that of a wheel."""
        kinds = {name: dict(numbers) for name, numbers in self.kinds}
        for numbers in kinds.values():
            inertia = numbers.get("wheel_inertia", self.wheel_inertia)
            numbers["wheel_inertia"] = geared(inertia) if numbers.get(kinds_of_wheels.DRIVEN, True) else inertia
        return self.replace(wheel_inertia=geared(self.wheel_inertia), kinds=kinds)

    @property
    def has_wheels_of_the_paper(self) -> bool:
        """Whether the rollers lie in one row, in the planes of their wheels, which they keep round."""
        return self.rows == 1 and not self.rows_move

    @property
    def rows_move(self) -> bool:
        """Whether the wheels' rates for a motion go by their angles: of mecanum wheels, and of profiles."""
        return any(self.roller_angle) or self.has_profile

    @property
    def has_profile(self) -> bool:
        """Whether the rollers have a meridian of their own, so that the wheels rise and fall."""
        return self.meridian_radius is not None or self.roller_profile is not None

    def with_wheels_of_the_paper(self) -> "Vehicle":
        """The vehicle as if its rollers lay so; itself where they do."""
        return self if self.has_wheels_of_the_paper else self.replace(**wheel_kind.of_the_paper(self.wheels))

    @property
    def roller_radius(self) -> float:
        """Radius of a roller in its middle, in m."""
        return self.wheel_radius - self.roller_axis_radius

    def places(self) -> np.ndarray:
        """(N, 2) places of the wheels' centres in the platform's frame, in m; section 2 where they are not given."""
        if self.wheel_places is not None:
            return np.array(self.wheel_places)
        counts = self.wheels, self.rollers_per_wheel
        return np.array(parts.places_on_rays(*counts, self.platform_radius, self.wheel_angles))

    def middle_rows(self) -> np.ndarray:
        """(N, 3) rates of the wheels in rad/s for a twist (vx, vy in m/s, wz in rad/s), with every contact in the
        middle of its wheel, and wheels round with their mean radius: the kinematics of those who count no rollers."""
        radii, places = profiles.mean_radii(self).tolist(), self.places().tolist()
        own = zip(radii, places, self.wheel_angles, self.roller_angle, strict=True)
        rows = [wheel_kind.middle_rows(radius, [place], [axle], [psi]) for radius, place, axle, psi in own]
        return np.concatenate(rows)

    def sharpness(self) -> float:
        """How much a contact roller's inertia at the joint outgrows the vehicle's mass (generated/data).

        Large where the rollers are cut close to their tips, so that their axes nearly touch the ground at the
        joint.
        """
        return _sharpness(self)

    def replace(self, **changes: Any) -> "Vehicle":
        """A vehicle with some fields changed.

        changes  fields of Vehicle by name, origins among them

        Raises InvalidValueError where the new numbers break a bound; they are checked as those of any vehicle.
        """
        validation.known(changes, (*ENTRIES, "origins"), "replace")
        kept = tuple(origin for origin in self.origins if origin.name not in changes)
        return type(self)(**({"origins": kept} | self.as_dict() | changes))

    def __repr__(self) -> str:
        shown = []
        for name, value in self.as_dict().items():
            unit = ENTRIES[name].unit
            shown.append(f"    {name}={value!r}," + (f"  # {unit}" if unit else ""))
        return "Vehicle(\n" + "\n".join(shown) + "\n)"


@lru_cache(maxsize=4096)
def _sharpness(vehicle: Vehicle) -> float:
    expression = generated_data.load("bounds").get("sharpness")
    if expression is None:
        return 0.0
    bounds = generated_data.load("bounds")["bounds"]
    of_axis = [bound["positive"] for bound in bounds if bound["field"] == "roller_axis_radius"]
    tip = next(expression for expression in of_axis if isinstance(expression, list))  # rho at the joint
    found = []
    for values in _symbols_by_wheel(vehicle):
        least = profiles.least_contact(vehicle) if vehicle.has_profile else generated_data.evaluate(tip, values)
        found.append(generated_data.evaluate(expression, values | {"least_rho": least}))
    return max(found)


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
    known = generated_data.code_names().items()
    numbers = {symbol: values[code] for symbol, code in known if isinstance(values.get(code), (int, float))}
    axis_angle = max(map(abs, vehicle.roller_angle))
    return numbers | {"axis_angle": axis_angle, "sin_psi": math.sin(axis_angle)}


def _symbols_by_wheel(vehicle: Vehicle) -> list[dict[str, float]]:
    """The same for each wheel with the numbers of its kind; once where wheels are all alike."""
    whole = _symbols_of(vehicle)
    if not vehicle.has_kinds:
        return [whole]
    code = {code: symbol for symbol, code in generated_data.code_names().items()}
    own = [name for name in vehicle.by_wheel if name in code]
    found = []
    for k, psi in enumerate(vehicle.roller_angle):
        numbers = {code[name]: float(vehicle.by_wheel[name][k]) for name in own}
        found.append(whole | numbers | {"axis_angle": abs(psi), "sin_psi": math.sin(abs(psi))})
    return found


def _check_kinds(vehicle: Vehicle) -> None:
    """The same bounds for the numbers of each kind; that on the yaw inertia for their sum over the wheels."""
    by_wheel = _symbols_by_wheel(vehicle)
    for bound in generated_data.load("bounds")["bounds"]:
        field, expression = bound["field"], bound.get("positive")
        if not isinstance(expression, list):
            continue
        margins = [generated_data.evaluate(expression, values) for values in by_wheel]
        if field not in kinds_of_wheels.ENTRIES:  # linear in what the wheels add
            if sum(margins) <= 0:
                raise InvalidValueError(field, getattr(vehicle, field), f"is too small: {bound['reason']}")
            continue
        for name, own, margin in zip(vehicle.wheel_kinds, vehicle.by_wheel[field], margins, strict=True):
            if margin <= 0:
                raise InvalidValueError(f"kinds.{name}.{field}", own, bound["reason"])


def _check_bounds(vehicle: Vehicle) -> None:
    """The bounds of the derivation on several numbers together: each expression must be positive."""
    if vehicle.has_kinds:
        return _check_kinds(vehicle)
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
