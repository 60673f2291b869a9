"""How much an effect that a scene leaves out would change its motion.

The scene runs for a short time as it is and once more with the effect, the coefficient a typical one. The
estimate is the largest distance of the two in the norm of `accuracy`, ((x, y)/R, theta, nu/|nu(0)|). For effects with
a coefficient, the coefficient of one per cent follows by proportion.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from omniroll.effects import Bearings, Effect, Motor, Slope, Torque
from omniroll.effects.torque import Drive
from omniroll.engine.simulate import checked_task, one_run
from omniroll.errors import OmnirollError, SimulationStopped
from omniroll.results.comparison import distance_at
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.allowance import Allowance, limited
from omniroll.scenes.loading import Scene
from omniroll.vocabulary import LAWS, ROLLER_MODELS

PROBE = 2.0  # s, the simulated time over which two motions are compared, at most
TIMES = 101  # the number of times at which they are compared
ACCURACY = 1e-8  # of the runs
FELT = 1e-7  # a smaller distance may be the error of the two runs
STILL = 1e-9  # a roller that turns slower than this part of the fastest wheel's speed counts as not turning
LEVEL = 0.01  # rad, the inclination of a floor that looks level
BESIDE = 0.01  # distance of the centre of mass from S, over the platform radius: as well as it is known
SPIN_DOWN = 10.0  # s in which a good bearing stops what turns by itself
FADE = 0.05  # named speed of Coulomb's friction, over the fastest speed in the motion


@dataclass(frozen=True)
class Estimate:
    """How far an effect takes the motion away.

    effect    its name in the registry
    setting   the coefficients that were taken, in words
    distance  in the norm of `accuracy`; None where the motion with the effect could not be run, or not within LONGEST.
              Below FELT it is zero as far as the runs can tell
    percent   the coefficient that would make it 0.01, by proportion, in words; empty where there is none
    """

    effect: str
    setting: str
    distance: float | None
    percent: str = ""


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


def estimates(scene: Scene, allowance: Allowance | None = None) -> tuple[float, list[Estimate]]:
    """The time compared, in s, and an estimate for every effect that is off and has one, as far as there is time."""
    allowance = allowance or Allowance()
    duration = min(PROBE, scene.options["duration"])
    try:
        base = _simulated(scene, duration, {})
    except OmnirollError as error:
        allowance.left_out.append(f"all estimates, since the motion itself {_why(error)}")
        base = None
    if base is None or duration == 0:
        return duration, []
    made = [
        _estimate(variant, base, _motion(scene, duration, variant.changes))
        for variant in chain(_other_models(scene), _other_effects(scene, base))
        if allowance.has_time(f"the estimate of {variant.effect}")
    ]
    if "reactions" not in scene.tables:
        made.append(Estimate("reactions", "an output, which changes no motion", 0.0))
    return duration, made


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
        setting = f"a plane that falls by {LEVEL:g} rad ahead"
        yield Variant("slope", setting, {"effects": (*given, Slope(LEVEL))}, LEVEL, "rad")
    if not vehicle.has_layout:
        away = BESIDE * vehicle.platform_radius
        setting = f"the centre of mass {away:.3g} m ahead of S"
        yield Variant("layout", setting, {"layout": {"center_of_mass": (away, 0.0)}}, away, "m")
    wheel_speed, roller_speed = (float(np.abs(speeds).max()) for speeds in base.kernel.wheel_rates(base.nu, base.chi))
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


def _why(error: OmnirollError) -> str:
    return f"stopped: {error.reason}" if isinstance(error, SimulationStopped) else str(error)


def _motion(scene: Scene, duration: float, changes: dict[str, Any]) -> Trajectory | None:
    try:
        return _simulated(scene, duration, changes)
    except OmnirollError:
        return None


def _simulated(scene: Scene, duration: float, changes: dict[str, Any]) -> Trajectory:
    arguments = scene.options | {"duration": duration} | changes
    layout = arguments.pop("layout", {})
    return one_run(limited(checked_task(scene.vehicle.replace(**layout), **arguments)), ACCURACY)


def _estimate(variant: Variant, base: Trajectory, other: Trajectory | None) -> Estimate:
    if other is None:
        return Estimate(variant.effect, variant.setting, None)
    distance = distance_at(other, base, np.linspace(base.t[0], base.t[-1], TIMES))
    if not np.isfinite(distance):
        return Estimate(variant.effect, variant.setting, None)
    percent = ""
    if variant.coefficient is not None and distance > FELT:
        percent = f"{variant.coefficient * 0.01 / distance:.2g} {variant.unit}"
    return Estimate(variant.effect, variant.setting, distance, percent)
