"""The vehicle of a scene: from a preset, from numbers, or from parts."""

from collections.abc import Callable
from typing import Any

from omniroll.errors import InvalidValueError
from omniroll.robots.catalogue import ROBOTS
from omniroll.scenes.checking import Findings
from omniroll.scenes.problems import shown
from omniroll.scenes.schema import HANDEDNESS, KINDS, NUMBERS, PARTS, SHARED, SHEET, SIZES, WHEEL_KINDS
from omniroll.vehicles.data_sheet import BODIES, INSTEAD
from omniroll.vehicles.vehicle import Vehicle

ALWAYS = ("wheels", "rollers_per_wheel", "platform_radius", "wheel_radius")
SIZE_NAMES = tuple(key.name for key in SIZES)
NUMBER_NAMES = tuple(key.name for key in NUMBERS)
PART_NAMES = tuple(key.name for key in PARTS + SHEET)
SHEET_NEEDS = (*ALWAYS, "roller_radius", "roller_length")
# Numbers that break no bound of the derivation. They take the place of numbers that are missing or wrong, so that the
# bounds judge the numbers that are there.
LENIENT = {
    "wheels": 1, "platform_radius": 1.0, "wheel_radius": 1e100, "roller_axis_radius": 1e-100, "mass": 1e-100,
    "yaw_inertia": 1e100, "wheel_inertia": 1.0, "roller_inertia": 1e-100,
}  # fmt: skip
MANY_ROLLERS = {"rollers_per_wheel": 10_000, "roller_inertia": 1e-100}  # so many rollers fit only if they are light
REPAIRS = (1e-9, 1e9)  # a number that breaks a bound is multiplied by one of these to see which bounds the others break


def vehicle_of(content: dict[str, Any], findings: Findings) -> Vehicle | None:
    """The vehicle; None where [vehicle] has problems, which go into `findings`.

    `content` has the keys that are good by themselves.
    """
    content = _with_hands(content, findings)
    make, needed, strangers, beside = _way(content, set(content) | findings.keys_in("vehicle"))
    for name in strangers:
        if name in content:
            findings.add("vehicle", name, f"cannot stand beside {beside}", shown(content[name]))
    if "preset" not in findings.keys_in("vehicle"):
        _say_what_is_missing(content, needed, findings)
    wrong = findings.keys_in("vehicle")
    try:
        if wrong:
            make, content = _make_numbers, _judged_alone(content, wrong)
        vehicle = make(content)
    except InvalidValueError as error:
        _say_all_bounds(make, content, error, findings)
        return None
    return None if wrong else vehicle


def _with_hands(content: dict[str, Any], findings: Findings) -> dict[str, Any]:
    """The table with the signs of roller_angle in that."""
    hands, angle = content.get(HANDEDNESS.name), content.get("roller_angle", 0.0)
    rest = {name: value for name, value in content.items() if name != HANDEDNESS.name}
    if hands is None or "roller_angle" in findings.keys_in("vehicle"):
        return rest
    if not set(hands) <= {1, -1}:
        findings.add("vehicle", HANDEDNESS.name, "must be 1 or -1 for each wheel", shown(hands))
    elif isinstance(angle, list):
        bound = "cannot stand beside roller_angle by wheel, which has signs of its own"
        findings.add("vehicle", HANDEDNESS.name, bound, shown(hands))
    elif angle <= 0:
        findings.add("vehicle", HANDEDNESS.name, "needs a roller_angle above 0 for its signs", shown(hands))
    else:
        return rest | {"roller_angle": [hand * angle for hand in hands]}
    return rest


def _judged_alone(content: dict[str, Any], wrong: set[str | None]) -> dict[str, Any]:
    """The numbers of a vehicle as far as they are good, of its preset too; lenient ones in place of the rest."""
    numbers = {key.name for key in SIZES + SHARED + NUMBERS} - {"wheel_angles"}
    good = {name: value for name, value in content.items() if name in numbers}
    if "preset" in content and not wrong & {"wheels", "rollers_per_wheel"}:
        preset = _make_preset(
            {name: content[name] for name in ("preset", "wheels", "rollers_per_wheel") if name in content}
        )
        good = {name: value for name, value in preset.as_dict().items() if name in numbers - wrong} | good
    return LENIENT | good | ({} if "rollers_per_wheel" in good else MANY_ROLLERS)


def _way(content: dict[str, Any], given: set[str | None]) -> tuple[Callable, tuple[str, ...], tuple[str, ...], str]:
    """How the table gives the vehicle: what makes it, the keys that it needs, those that it excludes, and why.

    given  the keys that are in the table, those that are not good as well: they are not missing
    """
    if content.get("preset") in ROBOTS:
        return _make_preset, (), (*SIZE_NAMES, *PART_NAMES), "the preset of a robot"
    if "preset" in content:
        return _make_preset, (), PART_NAMES, "a preset"
    if given.intersection(PART_NAMES):
        if "mass" in given and "platform_mass" not in given:
            needs = ALWAYS if "roller_angle" in given and content.get("roller_angle", 1) else SHEET_NEEDS
            return _make_parts, needs, NUMBER_NAMES[1:], "parts, which give it"
        return _make_parts, ALWAYS + tuple(BODIES), NUMBER_NAMES, "parts, which give it"
    return _make_numbers, ALWAYS + NUMBER_NAMES, (), ""


def _say_what_is_missing(content: dict[str, Any], needed: tuple[str, ...], findings: Findings) -> None:
    already = findings.keys_in("vehicle")
    instead = {radius: diameter for diameter, radius in INSTEAD} | {"platform_mass": "mass"}
    for name in needed:
        other = instead.get(name)
        if not {name, other} & (set(content) | already):
            alternative = f"; give it, or {other}" if other and needed != ALWAYS + NUMBER_NAMES else ""
            if other == "mass":
                alternative += ", beside which the other masses are assumed"
            findings.add(
                "vehicle",
                name,
                "is missing" + ("; give it, a preset, or parts" if name in NUMBER_NAMES else alternative),
            )
    for mass, (inertias, sizes) in BODIES.items():
        for name in inertias if mass in needed else ():
            if not (name in content or set(sizes) <= set(content) or already & {name, *sizes}):
                findings.add("vehicle", name, f"is missing; give it, or {' and '.join(sizes)}")


def _make_preset(content: dict[str, Any]) -> Vehicle:
    sizes = {key: content[key] for key in SIZE_NAMES if key in content}
    numbers = {key: value for key, value in content.items() if key not in ("preset", *sizes)}
    robot = ROBOTS.get(content["preset"])
    vehicle = Vehicle.paper(**sizes) if robot is None else robot.vehicle
    return vehicle.replace(**numbers) if numbers else vehicle


def _make_numbers(content: dict[str, Any]) -> Vehicle:
    return Vehicle(**content)


def _make_parts(content: dict[str, Any]) -> Vehicle:
    kinds = {name: value for name, value in content.items() if name in (WHEEL_KINDS[0].name, KINDS)}
    made = Vehicle.from_parts(**{name: value for name, value in content.items() if name not in kinds})
    return made.replace(**kinds) if kinds else made


def _say_all_bounds(make: Callable, content: dict[str, Any], error: InvalidValueError, findings: Findings) -> None:
    """Every bound that the numbers break together: each is told, then mended to see the next."""
    while True:
        findings.add("vehicle", error.field, error.bound, shown(error.value))
        if not isinstance(content.get(error.field), (int, float)):
            return
        for factor in REPAIRS:
            mended = content | {error.field: content[error.field] * factor}
            try:
                make(mended)
                return
            except InvalidValueError as other:
                if other.field != error.field:
                    content, error = mended, other
                    break
        else:
            return
