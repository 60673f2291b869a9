"""What rollers at an angle, in two rows or with a meridian of their own do, in closed forms, and what each level of the
model leaves out; of wheels of several kinds, what each has."""

import math
from typing import Any

import numpy as np

from omniroll.conventions.twists import twist_of_nu
from omniroll.scenes.loading import Scene
from omniroll.vehicles import profiles, wheel_kind
from omniroll.vehicles.vehicle import Vehicle

LEVELS = {
    "classical": "contacts held in the middle of each wheel, as ROS 2 and WPILib have them: no ripple, no lever that "
    "moves, no switches, no inertia of rollers",
    "massless": "the rollers' places and angles; rollers without inertia",
    "locked": "rollers with mass; those off the ground do not spin on their disk",
    "free": "all rollers with mass and spin; contacts that are points, and one roller of a wheel at a time",
    "contact": "wheels that may slip; contacts that are points, and a ground that is rigid",
}


def wheels_explained(scene: Scene) -> dict[str, Any]:
    """All of it in plain Python types; empty for wheels of the paper."""
    vehicle = scene.vehicle
    if vehicle.has_kinds:
        return {"kinds": _kinds(scene)}
    if vehicle.has_wheels_of_the_paper:
        return {}
    own = "contact" if scene.slips else scene.options.get("roller_model", "free")
    return {
        "levels": [{"level": name, "has": has, "on": name == own} for name, has in LEVELS.items()],
        "forms": [dict(zip(("name", "value", "unit", "meaning"), row, strict=True)) for row in _forms(scene)],
    }


def _forms(scene: Scene) -> list[tuple[str, float, str, str]]:
    vehicle = scene.vehicle
    if vehicle.has_profile:
        found = _of_profile(vehicle)
    else:
        found = [("forward_radius", vehicle.wheel_radius, "m", "way ahead per angle of the wheels: exact, no ripple")]
    if any(vehicle.roller_angle) and not vehicle.has_profile:
        rolling = _rolling(vehicle)
        angle = math.tan(wheel_kind.size_of(vehicle.roller_angle))
        sideways = vehicle.wheel_radius * rolling["strafe_factor"] / angle
        found += [
            ("strafe_factor", rolling["strafe_factor"], "1", "way sideways in a turn, over the classical one"),
            ("sideways_radius", sideways, "m", "way sideways per angle of the wheels, in the mean over a turn"),
            ("rate_ripple", rolling["rate_ripple"], "1", "how much faster a wheel turns at the joint, sideways"),
            ("spin_ratio", rolling["spin_ratio"], "1", "spin of a roller at the joint, over that in its middle"),
        ]
    shift = contact_shift(vehicle)
    found.append(("contact_shift", shift, "m", "how far the contact is from the wheel's middle when it changes"))
    found.append(("lever_jump", 2 * shift, "m", "by which the lever of yaw jumps there"))
    if rate := top_rate(scene):
        frequency = vehicle.rollers_per_wheel * rate / (2 * math.pi)
        found.append(
            ("roller_frequency", frequency, "Hz", f"of rollers, at {rate:.4g} rad/s, the scene's fastest wheel")
        )
    return found


def _of_profile(vehicle: Vehicle) -> list[tuple[str, float, str, str]]:
    """Of rollers with a meridian of their own."""
    riding = profiles.riding(vehicle)
    found = [("forward_radius", riding["forward_radius"], "m", "way ahead per angle of the wheels, in the mean")]
    if "sideways_radius" in riding:
        found.append(("sideways_radius", riding["sideways_radius"], "m", "the same sideways"))
    found += [
        ("highest", riding["highest"], "m", "of the wheel's centre over the ground"),
        ("lowest", riding["lowest"], "m", "the same"),
        ("ripple", riding["highest"] - riding["lowest"], "m", "by which the wheel rises and falls"),
    ]
    if math.isfinite(rate := profiles.rate_on_ground(vehicle)):
        found.append(("rate_on_ground", rate, "rad/s", "beyond it a wheel leaves the ground on its rollers"))
    return found


def _kinds(scene: Scene) -> list[dict[str, Any]]:
    """Each kind: its wheels, counted from 1, its numbers, and how often its rollers change at the largest rate that the
    start or a target asks of its wheels."""
    vehicle, names = scene.vehicle, np.array(scene.vehicle.wheel_kinds)
    rates, found = _top_rates(scene), []
    for name, _ in vehicle.kinds:
        wheels = np.flatnonzero(names == name)
        numbers = {key: values[wheels[0]] for key, values in vehicle.by_wheel.items()}
        rate = float(rates[wheels].max())
        changes = {"rate": rate, "roller_frequency": numbers["rollers_per_wheel"] * rate / (2 * math.pi)}
        found.append({"kind": name, "wheels": (wheels + 1).tolist(), **numbers, **changes})
    return found


def _kind_in_words(kind: dict[str, Any]) -> str:
    wheels = ", ".join(map(str, kind["wheels"]))
    radius, axis, count = (kind[name] for name in ("wheel_radius", "roller_axis_radius", "rollers_per_wheel"))
    sizes = f"radius {radius:.4g} m, {count} rollers on {axis:.4g} m"
    several = "s" * (len(kind["wheels"]) > 1)
    text = f"  {kind['kind']}: wheel{several} {wheels}; {sizes}{'' if kind['driven'] else ', no drive'}"
    if not kind["rate"]:
        return text
    return f"{text}, {kind['roller_frequency']:.4g} changes of rollers a second at {kind['rate']:.4g} rad/s"


def _rolling(vehicle: Vehicle) -> dict[str, float]:
    angle = wheel_kind.size_of(vehicle.roller_angle)
    sizes = vehicle.wheel_radius, vehicle.roller_axis_radius, vehicle.rollers_per_wheel
    return wheel_kind.rolling_of_kind(*sizes, angle)


def contact_shift(vehicle: Vehicle) -> float:
    """How far the contact is from the wheel's middle at the joint, in m, by the rollers' angle and their rows."""
    if vehicle.has_profile:
        return profiles.riding(vehicle)["contact_shift"]
    slanted = _rolling(vehicle)["contact_shift"] if any(vehicle.roller_angle) else 0.0
    return abs(vehicle.row_offset) + slanted


def top_rate(scene: Scene) -> float:
    """The largest rate of a wheel in rad/s that the start or a target asks for, with contacts in the middle."""
    return float(_top_rates(scene).max())


def _top_rates(scene: Scene) -> np.ndarray:
    """(N,) the same of each wheel."""
    asked = [scene.tables.get(table, {}).get(key) for table, key in (("start", "nu"), ("controller", "target"))]
    twists = [
        twist_of_nu(scene.vehicle.with_wheels_of_the_paper(), nu).reshape(-1, 3) for nu in asked if nu is not None
    ]
    if not twists:
        return np.zeros(scene.vehicle.wheels)
    return np.abs(np.concatenate(twists) @ scene.vehicle.middle_rows().T).max(axis=0)


def text(found: dict[str, Any]) -> list[str]:
    """Lines for people; none for wheels of the paper."""
    if not found:
        return []
    if "kinds" in found:
        return ["", "Kinds of wheels", *map(_kind_in_words, found["kinds"])]
    lines = ["", "What its rollers do, where wheels roll at a constant speed"]
    lines += [
        f"  {form['name']:<18}{form['value']:>12.6g} {form['unit']:<4} {form['meaning']}" for form in found["forms"]
    ]
    lines += ["", "Levels of the model, each with what those before it leave out"]
    return lines + [f"  {'*' if one['on'] else ' '} {one['level']:<10} {one['has']}" for one in found["levels"]]
