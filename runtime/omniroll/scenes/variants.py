"""Motions beside that of a scene, each with an effect that the scene leaves out, of a typical size."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from omniroll.effects import Bearings, Contact, Effect, Motor, Slope, Torque
from omniroll.effects.torque import Drive
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.loading import Scene
from omniroll.vocabulary import LAWS, ROLLER_MODELS, STANDARD_GRAVITY

STILL = 1e-9  # a roller that turns slower than this part of the fastest wheel's speed counts as not turning
LEVEL = 0.01  # rad, the inclination of a floor that looks level
BESIDE = 0.01  # distance of the centre of mass from S, over the platform radius: as well as it is known
SPIN_DOWN = 10.0  # s in which a good bearing stops what turns by itself
FADE = 0.05  # named speed of Coulomb's friction, over the fastest speed in the motion
GRIP = 0.6  # friction of wheels on a floor, where the scene says nothing of it


@dataclass(frozen=True)
class Variant:
    """A scene with an effect more, and the coefficient with its unit.

    changes   what simulate is given in place of the scene's; `layout` has fields of the vehicle
    """

    effect: str
    setting: str
    changes: dict[str, Any]
    coefficient: float | None = None
    unit: str = ""


def variants(scene: Scene, base: Trajectory) -> Iterator[Variant]:
    """Of every effect that is off and has a typical size; `base` is the scene's own motion."""
    yield from _other_models(scene)
    yield from _other_effects(scene, base)
    yield from _other_grounds(scene, base)


def _other_models(scene: Scene) -> Iterator[Variant]:
    model, law = scene.options.get("roller_model", "free"), scene.options.get("switching", "impact")
    for other in ROLLER_MODELS:
        if other != model:
            at_rest = {} if other == "free" else {"spins": 0}
            yield Variant(other, f"in place of {model}", {"roller_model": other} | at_rest)
    for other in () if scene.slips else LAWS:  # wheels that may slip ask for no law
        if other != law:
            yield Variant(other, f"in place of {law}", {"switching": other})


def _other_effects(scene: Scene, base: Trajectory) -> Iterator[Variant]:
    given, vehicle = scene.options.get("effects", ()), scene.vehicle
    if not any(isinstance(effect, Slope) for effect in given):
        setting, slope = f"a plane that falls by {LEVEL:g} rad ahead", Slope(LEVEL)
        on_slope = (*(_on_plane(effect, slope) for effect in given), slope)
        yield Variant("slope", setting, {"effects": on_slope}, LEVEL, "rad")
    if not vehicle.has_layout:
        away = BESIDE * vehicle.platform_radius
        setting = f"the centre of mass {away:.3g} m ahead of S"
        yield Variant("layout", setting, {"layout": {"center_of_mass": (away, 0.0)}}, away, "m")
    wheel_speed, roller_speed = _speeds(base)
    torque = vehicle.wheel_inertia * wheel_speed / SPIN_DOWN
    if torque > 0 and not any(isinstance(effect, Drive) for effect in given):
        setting = f"{torque:.2g} N m at the first wheel, which brings it alone to its speed in {SPIN_DOWN:g} s"
        torques = (torque, *[0.0] * (vehicle.wheels - 1))
        yield Variant("drive", setting, {"effects": (*given, Torque(torques))}, torque, "N m")
    if not any(isinstance(effect, Motor) for effect in given):
        damping = vehicle.wheel_inertia / SPIN_DOWN
        setting = f"motors without voltage: (gear ratio)^2 torque constant back-EMF/resistance = {damping:.2g} N m s"
        shorted = Motor(0.0, torque_constant=math.sqrt(damping), resistance=1.0)
        yield Variant("motor", setting, {"effects": (*given, shorted)}, damping, "N m s")
    if roller_speed < STILL * wheel_speed:
        roller_speed = 0.0
    yield from _frictions(given, "axle", "wheel", vehicle.wheel_inertia, wheel_speed)
    yield from _frictions(given, "roller", "roller", vehicle.roller_inertia, roller_speed)


def _speeds(base: Trajectory) -> tuple[float, float]:
    """The fastest rates in rad/s that wheels and rollers have in a motion, or would have if they rolled."""
    wheels, rollers = (float(np.abs(speeds).max()) for speeds in base.kernel.wheel_rates(base.nu, base.chi))
    return wheels, rollers


def _slope(scene: Scene) -> Slope | None:
    return next((effect for effect in scene.options.get("effects", ()) if isinstance(effect, Slope)), None)


def _on_plane(effect: Effect, slope: Slope | None) -> Effect:
    """The effect on a slope: a ground whose loads follow from gravity has what there is of it across the plane."""
    ground = effect if isinstance(effect, Contact) and slope is not None else None
    if ground is None or ground.load is not None or ground.law == "viscous":
        return effect
    return replace(ground, normal_gravity=slope.normal_gravity)


def _frictions(given: Sequence[Effect], effect: str, body: str, inertia: float, speed: float) -> Iterator[Variant]:
    """Friction that by itself stops a body with this inertia, as fast as any in the motion, in about SPIN_DOWN."""
    others = tuple(other for other in given if not isinstance(other, Bearings))
    present = next((other.as_dict() for other in given if isinstance(other, Bearings)), {})
    present.pop("kind", None)
    viscous, coulomb = inertia / SPIN_DOWN, inertia * speed / SPIN_DOWN
    laws = [
        ("viscous", {f"{body}_viscous": viscous}, viscous, "N m s"),
        ("coulomb", {f"{body}_coulomb": coulomb, f"{body}_speed": FADE * speed}, coulomb, "N m"),
    ]
    laws.append(("sticking", {f"{body}_coulomb": coulomb}, coulomb, "N m"))
    for law, own, coefficient, unit in laws:
        if coefficient > 0 and present.get(next(iter(own))) is None:
            setting = f"{coefficient:.2g} {unit}, which stops a {body} alone in about {SPIN_DOWN:g} s"
            changes = {"effects": (*others, Bearings(**present | own))}
            yield Variant(f"{effect}_{law}", setting, changes, coefficient, unit)


def coulomb_ground(scene: Scene) -> Contact | None:
    """The ground on which wheels would slip by Coulomb's friction; None where they may slip already, or cannot."""
    if scene.slips or scene.options.get("roller_model") == "locked":
        return None
    friction = scene.tables.get("reactions", {}).get("friction", GRIP)
    return _on_plane(Contact(law="coulomb", friction=friction), _slope(scene))


def _other_grounds(scene: Scene, base: Trajectory) -> Iterator[Variant]:
    """Wheels that may slip, under each law; where they may already, under the others, from the same start."""
    given = scene.options.get("effects", ())
    present = next((effect for effect in given if isinstance(effect, Contact)), None)
    others = tuple(effect for effect in given if effect is not present)
    on = () if present is None else present.kernel_effects()
    if scene.options.get("roller_model") == "locked":  # refused; the estimate says why, once for all laws
        yield Variant("contact", f"friction {GRIP:g}", {"effects": (*given, Contact(law="coulomb", friction=GRIP))})
        return
    for effect, setting, numbers in _grounds(scene, _speeds(base)[0] * scene.vehicle.wheel_radius, present):
        if effect not in on:
            yield Variant(effect, setting, {"effects": (*others, _on_plane(Contact(**numbers), _slope(scene)))})


def _grounds(scene: Scene, fastest: float, present: Contact | None) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Laws of the ground: the effect, its numbers in words, and all numbers of a Contact.

    fastest  speed in m/s of a wheel's rim, at most
    present  the ground that the scene has
    """
    own = {} if present is None else {name: value for name, value in vars(present).items() if value is not None}
    assumed = scene.tables.get("reactions", {})
    friction = own.get("friction", assumed.get("friction", GRIP))
    kept = {name: own[name] for name in ("wheel_rates", "contact_spins") if name in own}
    loaded = kept | {name: own[name] for name in ("load",) if name in own}
    said, slow = f"friction {_shown(friction)}", FADE * fastest
    if slow > 0:
        coefficient = float(np.max(friction)) * scene.vehicle.mass * STANDARD_GRAVITY / scene.vehicle.wheels / slow
        setting = f"{coefficient:.2g} N s/m, {said} of an equal share of the weight at a slip of {slow:.2g} m/s"
        yield "contact_viscous", setting, kept | {"coefficient": coefficient}
        numbers = loaded | {"law": "regularised", "friction": friction, "speed": slow}
        yield "contact_regularised", f"{said}, which fades below {slow:.2g} m/s", numbers
    coulomb = {"law": "coulomb", "friction": friction}
    yield "contact_coulomb", said, loaded | coulomb


def _shown(friction: float | Sequence[float]) -> str:
    return " and ".join(f"{number:g}" for number in np.atleast_1d(friction))
