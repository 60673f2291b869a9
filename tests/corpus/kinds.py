"""Seeded scenes of every kind of friction under static loads: a law of the ground, a roller model, bearings.

A scene follows from its kind and its number alone. The vehicle starts on a slope with some speed, or at rest, under
torques that grow, turn and fade, so that contacts and bearings let go and come to rest.
"""

import itertools
from typing import Any

import numpy as np

from omniroll import Bearings, Contact, Slope, TorqueTable, Vehicle
from omniroll.effects.effect import Effect

SEED = 2036
GRAVITY = 9.7  # across the slope
DURATION = 0.15
KNOTS = (0.0, 0.4, 0.7, 1.0)  # of the duration
ACCURACY = 1e-12
NONE, VISCOUS, AXLES, ROLLERS, BOTH, DRAG = "none", "viscous", "axles", "rollers", "both", "both and viscous"
LAWS = ("rolling", "viscous", "regularised", "coulomb")
MODELS = ("free", "massless", "locked")
BEARINGS = (NONE, VISCOUS, AXLES, ROLLERS, BOTH, DRAG)
STICKING = {AXLES, ROLLERS, BOTH, DRAG}


def is_kind(law: str, model: str, bearings: str) -> bool:
    if model == "locked":  # rollers do not turn, and contacts do not slip
        return law == "rolling" and bearings == AXLES
    if law == "rolling":  # what does not stick is no kind of friction here
        return bearings in STICKING
    return (law, model, bearings) != ("coulomb", "massless", DRAG)


KINDS = [kind for kind in itertools.product(LAWS, MODELS, BEARINGS) if is_kind(*kind)]


def name_of(kind: tuple[str, str, str]) -> str:
    return ", ".join(kind)


def scene(kind: tuple[str, str, str], number: int) -> tuple[Vehicle, dict[str, Any]]:
    """The vehicle and the task of `simulate`."""
    law, model, bearings = kind
    rng = np.random.default_rng([SEED, LAWS.index(law), MODELS.index(model), BEARINGS.index(bearings), number])
    wheels = (4, 4, 3, 5)[number % 4] if law == "coulomb" and bearings in (NONE, BOTH) else 4
    vehicle = Vehicle.paper(wheels, int(rng.integers(4, 7)))
    friction = 10 ** rng.uniform(-1.3, -0.1)
    force = friction * vehicle.mass * GRAVITY / wheels  # N, what a contact takes
    growth = rng.choice((1.0, 1.4))
    effects = [
        *ground(rng, law, friction, force, growth, wheels),
        *friction_of(rng, bearings, force, growth, vehicle),
        TorqueTable(tuple(DURATION * np.array(KNOTS)), torques(rng, force * vehicle.wheel_radius, wheels)),
        Slope(rng.uniform(0, 0.3) * min(1, 2 * friction), rng.uniform(0, 6), gravity=10.0),
    ]
    moves = rng.random() < 0.7
    task = {
        "nu": tuple(force * 3 * rng.normal(size=3)) if moves else (0.0, 0.0, 0.0),
        "chi": tuple(rng.uniform(-0.5, 0.5, wheels)),
        "roller_model": model,
        "effects": effects,
        "duration": DURATION,
        "accuracy": ACCURACY,
        "control": False,
    }
    if model == "free" and rng.random() < 0.6:
        task["spins"] = rng.normal(scale=rng.choice((1.0, 20.0)), size=(wheels, vehicle.rollers_per_wheel - 1))
    return vehicle, task


def torques(rng: np.random.Generator, size: float, wheels: int) -> np.ndarray:
    """(4, N) in N m, of a table: some ask for more than the ground gives."""
    of_knots = rng.uniform(0, 2, (4, 1)) * (rng.random((4, 1)) < 0.8)
    return size * of_knots * rng.normal(size=(4, wheels))


def ground(
    rng: np.random.Generator, law: str, friction: float, force: float, growth: float, wheels: int
) -> tuple[Effect, ...]:
    if law == "rolling":
        return ()
    rates = tuple(10 * force * rng.normal(size=wheels)) if rng.random() < 0.6 else None  # None: they roll
    if law == "viscous":
        return (Contact(coefficient=tuple(force * 10 ** rng.uniform(0.5, 2, 2)), wheel_rates=rates),)
    ratio = np.array([1.0, rng.uniform(0.5, 2) if rng.random() < 0.5 else 1.0])
    numbers: dict[str, Any] = {"law": law, "friction": friction * ratio, "normal_gravity": GRAVITY}
    if law == "regularised":
        return (Contact(**numbers, speed=10 ** rng.uniform(-2.5, -1), wheel_rates=rates),)
    return (Contact(**numbers, static_friction=growth * friction * ratio, wheel_rates=rates),)


def friction_of(
    rng: np.random.Generator, bearings: str, force: float, growth: float, vehicle: Vehicle
) -> tuple[Effect, ...]:
    """Friction in the bearings; in half of the scenes static above sliding."""
    wheels, numbers = vehicle.wheels, {}
    reach = vehicle.wheel_radius - vehicle.roller_axis_radius
    if bearings in (VISCOUS, DRAG):
        numbers |= {"wheel_viscous": 10 ** rng.uniform(-4, -2.5), "roller_viscous": 10 ** rng.uniform(-7, -5)}
    if bearings in (AXLES, BOTH, DRAG):
        torque = force * vehicle.wheel_radius * 10 ** rng.uniform(-1.5, 0.2) * rng.uniform(0.7, 1.3, wheels)
        numbers |= {"wheel_coulomb": torque, "wheel_break_away": growth * torque}
    if bearings in (ROLLERS, BOTH, DRAG):
        torque = force * reach * 10 ** rng.uniform(-2, 0.1) * rng.uniform(0.7, 1.3, wheels)
        numbers |= {"roller_coulomb": torque, "roller_break_away": growth * torque}
    return (Bearings(**numbers),) if numbers else ()


def numbers_of(kind: tuple[str, str, str]) -> tuple[str, ...]:
    """By which the derivatives of a kind are kept: of the start, of the vehicle, of friction."""
    law, _, bearings = kind
    of_ground = {"viscous": "coefficient", "regularised": "friction", "coulomb": "friction"}
    of_bearings = {AXLES: "wheel_coulomb", ROLLERS: "roller_coulomb", BOTH: "wheel_coulomb", DRAG: "roller_viscous"}
    return "nu[1]", "mass", of_bearings[bearings] if law == "rolling" else of_ground[law]
