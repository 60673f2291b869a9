"""Kinds of wheels: wheels of one vehicle that have other numbers than the vehicle says for all."""

from collections.abc import Mapping, Sequence
from typing import Any

from omniroll import validation, vocabulary
from omniroll.errors import InvalidValueError
from omniroll.vehicles import wheel_kind

ENTRIES = vocabulary.by_name(vocabulary.KIND)
DRIVEN = "driven"
LARGEST_OF_THE_VEHICLE = {"rollers_per_wheel": "count", "rows": "number"}  # of what, and what it is

Kind = tuple[tuple[str, Any], ...]  # numbers by name, in a form that can be hashed
Kinds = tuple[tuple[str, Kind], ...]


def checked(kinds: Any, names: Any, wheels: int, whole: Mapping[str, int]) -> tuple[Kinds, tuple[str, ...] | None]:
    """The kinds, each with its numbers, and the name of each wheel's. Raises InvalidValueError.

    whole  rollers_per_wheel and rows of the vehicle
    """
    tables = _by_name("kinds", kinds, "must be numbers by name for each kind of wheel")
    found = tuple((name, _kind(name, table, whole)) for name, table in tables.items())
    if names is None:
        if found:
            raise InvalidValueError("wheel_kinds", None, "is missing; name the kind of each wheel")
        return (), None
    if isinstance(names, str) or not isinstance(names, Sequence) or len(names) != wheels:
        raise InvalidValueError("wheel_kinds", names, f"must be {wheels} names of kinds, one for each wheel")
    for name in names:
        validation.choice("wheel_kinds", name, [known for known, _ in found])
    unused = [name for name, _ in found if name not in names]
    if unused:
        raise InvalidValueError("kinds", unused[0], "is the kind of no wheel; name it in wheel_kinds, or leave it out")
    return found, tuple(names)


def _by_name(field: str, given: Any, bound: str) -> Mapping[str, Any]:
    """A mapping from texts, or the pairs that a vehicle keeps of one."""
    pairs = isinstance(given, tuple) and all(isinstance(pair, tuple) and len(pair) == 2 for pair in given)
    found = dict(given) if pairs else given
    if not isinstance(found, Mapping) or not all(isinstance(name, str) for name in found):
        raise InvalidValueError(field, given, bound)
    return found


def _kind(name: str, table: Any, whole: Mapping[str, int]) -> Kind:
    numbers = _by_name(f"kinds.{name}", table, "must be numbers by name")
    validation.known(numbers, ENTRIES, f"kinds.{name}")
    given = [entry for key, entry in ENTRIES.items() if key in numbers]
    found = {entry.name: entry.kind.checked(f"kinds.{name}.{entry.name}", numbers[entry.name]) for entry in given}
    for key, what in LARGEST_OF_THE_VEHICLE.items():
        if found.get(key, 0) > whole[key]:
            bound = f"must be at most {key} of the vehicle, {whole[key]}: give the vehicle the largest {what}"
            raise InvalidValueError(f"kinds.{name}.{key}", found[key], bound)
    if {**whole, **found}["rows"] == 2 and {**whole, **found}["rollers_per_wheel"] % 2:
        bound = "must be even with two rows: it counts the rollers of both rows together"
        raise InvalidValueError(f"kinds.{name}.rollers_per_wheel", found["rollers_per_wheel"], bound)
    return tuple(found.items())


def by_wheel(vehicle: Any) -> dict[str, tuple]:
    """What each wheel has, by name: the number of its kind, or else the vehicle's."""
    tables = {name: dict(numbers) for name, numbers in vehicle.kinds}
    own = [tables.get(name, {}) for name in vehicle.wheel_kinds or [""] * vehicle.wheels]
    usual = {DRIVEN: True} | {key: getattr(vehicle, key) for key in ENTRIES if key != DRIVEN}
    for numbers, psi in zip(own, vehicle.roller_angle, strict=True):
        sizes = [numbers.get(key, usual[key]) for key in ("wheel_radius", "rollers_per_wheel")]
        if "roller_axis_radius" not in numbers and {"wheel_radius", "rollers_per_wheel"} & numbers.keys():
            numbers.setdefault("roller_axis_radius", wheel_kind.assumed_axis_radius(*sizes, abs(psi))[0])
        if numbers.get("rows") == 1:
            numbers.setdefault("row_offset", 0.0)
    return {key: tuple(numbers.get(key, usual[key]) for numbers in own) for key in ENTRIES}
