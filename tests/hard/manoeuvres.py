"""Ordinary manoeuvres: shipped robots on rays, and one with four wheels at 33, 147, 225 and 315 degrees, that start,
turn, brake, drive under a controller, climb and are shoved, on any ground with static loads; a third of them symmetric,
so that wheels break away and come to rest in pairs or all at once.

Ordinary scenes are the same with other masses and sizes, friction in bearings, springs at the contacts and accuracies
down to 1e-3; they obey the laws within ten times their accuracy.

Each is held to ten times its accuracy beside a run a thousand times finer, and to the laws of friction in each row. A
scene follows from its number: `scene(number)`, `ordinary(number)`.
"""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from contact.laws import carried, judged

import omniroll
from hard.case import Case, Measurement, Scale, counted
from omniroll import Bearings, Contact, Controller, Motor, SimulationStopped, Slope, Springs, Vehicle, simulate
from omniroll.results.comparison import distance_at

SEED, GRAVITY = 36, 9.80665
ROBOTS = ("tigers-2020", "open-base", "robot-soccer-kit", "skewed", "paper")
WITH_MOTORS = ("tigers-2020",)
MANOEUVRES = ("ramp", "brake", "controller", "climb", "shove")
LAWS = ("coulomb", "coulomb", "coulomb, static above", "regularised", "viscous")
MISSES, FINER, FINEST = 10, 1e-3, 1e-13
OFF = 1e-9  # of a law in a row
FULL, FEW = 2000, 5
Drawn = tuple[dict[str, str], Vehicle, dict[str, Any]]
SMALL = {"torque_constant": 0.02, "resistance": 12 * 0.02 * 3 / 0.78, "gear_ratio": 3.0}  # 0.78 N m at 12 V


def skewed() -> Vehicle:
    """Four wheels of 65 mm with 15 rollers, 2.6 kg."""
    angles = tuple(np.deg2rad((33.0, 147.0, 225.0, 315.0)))
    paper = Vehicle.paper(4, 15)
    size = 0.0325 / paper.wheel_radius
    return paper.replace(
        wheel_angles=angles, mass=2.6, wheel_radius=0.0325, roller_axis_radius=paper.roller_axis_radius * size,
        platform_radius=0.085, yaw_inertia=0.5 * 2.6 * 0.085**2, wheel_inertia=2e-5, roller_inertia=2e-8,
    )  # fmt: skip


def vehicle_of(name: str) -> tuple[Vehicle, dict[str, float]]:
    """The vehicle, and the numbers of its motors but for the voltage."""
    if name in ("skewed", "paper"):
        return skewed() if name == "skewed" else Vehicle.paper(4, 5), SMALL
    robot = omniroll.robot(name)
    if name not in WITH_MOTORS:  # nobody states those of the others
        return robot.vehicle, SMALL
    motor = robot.motor(0.0)
    names = ("torque_constant", "resistance", "gear_ratio", "back_emf", "rotor_inertia")
    return robot.vehicle, {one: getattr(motor, one) for one in names if getattr(motor, one) is not None}


def direction(rng: np.random.Generator, is_symmetric: bool) -> np.ndarray:
    """(3,) of the velocity of the centre and of R theta': ahead, sideways, on the spot, or anywhere."""
    if is_symmetric:
        return np.eye(3)[rng.integers(3)] * rng.choice((-1.0, 1.0))
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)


def scene(number: int) -> Drawn:
    """What it is, in words; the vehicle; the task of `simulate`."""
    rng = np.random.default_rng([SEED, number])
    name, manoeuvre, law = (str(rng.choice(words)) for words in (ROBOTS, MANOEUVRES, LAWS))
    is_symmetric = bool(rng.random() < 1 / 3)
    vehicle, motor = vehicle_of(name)
    friction = float(10 ** rng.uniform(-2 if is_symmetric else -1, 0))
    speed = float(rng.uniform(0.4, 2.0))
    along = direction(rng, is_symmetric) * speed / vehicle.platform_radius * np.array([1, 1, vehicle.yaw_scale])
    moves = manoeuvre in ("brake", "shove")
    numbers: dict[str, Any] = {"wheel_rates": 0.0} if manoeuvre == "shove" else {}
    if law == "viscous":
        numbers |= {"coefficient": friction * 100}
    else:
        numbers |= {"law": law.split(",")[0], "friction": friction, "normal_gravity": GRAVITY}
        numbers |= {"speed": float(10 ** rng.uniform(-4, -2))} if law == "regularised" else {}
        numbers |= {"static_friction": friction * float(rng.choice((1.05, 1.4)))} if "above" in law else {}
    effects = [Contact(**numbers), *acting(rng, manoeuvre, vehicle, motor, along)]
    task = {
        "nu": tuple(along) if moves else (0.0, 0.0, 0.0),
        "duration": 0.5,
        "roller_model": str(rng.choice(("free", "massless"))),
        "effects": effects,
        "accuracy": float(10 ** rng.uniform(-9, -5)),
        "control": False,
    }
    if not is_symmetric:
        task["chi"] = tuple(rng.uniform(-0.9, 0.9, vehicle.wheels) * np.pi / vehicle.rollers_per_wheel)
    words = {"robot": name, "manoeuvre": manoeuvre, "law": law, "rollers": task["roller_model"],
             "symmetric": "yes" if is_symmetric else "no"}  # fmt: skip
    return words, vehicle, task


def acting(
    rng: np.random.Generator, manoeuvre: str, vehicle: Vehicle, motor: dict[str, float], along: np.ndarray
) -> list[omniroll.effects.effect.Effect]:
    """Motors and a slope."""
    if manoeuvre == "shove":
        return []
    rates = -carried(vehicle, along) / vehicle.wheel_radius  # of wheels that roll
    induced = (motor.get("back_emf") or motor["torque_constant"]) * motor["gear_ratio"]
    if manoeuvre == "ramp":
        ends = np.array([0 * rates, 1.5 * induced * rates])
        return [Motor(ends, **motor, times=(0.0, float(rng.uniform(0.05, 0.4))))]
    if manoeuvre == "controller":
        gain, driven = float(10 ** rng.uniform(-1, 0.5)) * abs(induced), Motor(0.0, **motor)
        while controller_of(along, gain).doubts(vehicle, (driven,)):  # nobody drives with one that is unstable
            gain /= 2
        return [driven, controller_of(along, gain)]
    slope = [Slope(float(rng.uniform(0.03, 0.3)), 0.0)] if manoeuvre == "climb" else []
    return [Motor(tuple(induced * rates) if slope else 0.0, **motor), *slope]


def controller_of(along: np.ndarray, gain: float) -> Controller:
    return Controller(tuple(along), gain, 0.01, output="voltage", limit=12.0)


def ordinary(number: int) -> Drawn:
    """A manoeuvre of a robot that is heavier or lighter, larger or smaller, with bearings or springs of real ones."""
    words, vehicle, task = scene(number)
    rng = np.random.default_rng([SEED, 1, number])
    heavier, larger = float(rng.uniform(0.7, 2.5)), float(10 ** rng.uniform(-0.3, 0.5))
    inertias = {name: getattr(vehicle, name) * heavier * larger**2
                for name in ("yaw_inertia", "wheel_inertia", "roller_inertia")}  # fmt: skip
    lengths = {name: getattr(vehicle, name) * larger
               for name in ("platform_radius", "wheel_radius", "roller_axis_radius")}  # fmt: skip
    vehicle = vehicle.replace(mass=vehicle.mass * heavier, **lengths, **inertias)
    kind, weight = str(rng.choice(("plain", "bearings", "springs"))), vehicle.mass * GRAVITY / vehicle.wheels
    effects = list(task["effects"])
    if kind == "bearings":
        torque = float(10 ** rng.uniform(-3, -2)) * weight * vehicle.wheel_radius
        rollers = {"roller_coulomb": torque / 100} if rng.random() < 1 / 2 else {"wheel_viscous": torque / 100}
        effects.append(Bearings(wheel_coulomb=torque, **rollers))
    if kind == "springs" and words["law"] != "viscous":
        height = float(rng.uniform(0.3, 1.0)) * vehicle.platform_radius
        deflection, damping = float(10 ** rng.uniform(-4.5, -3)), float(rng.uniform(0.2, 1.0))
        effects.append(Springs(height, deflection, damping, spin_inertia=vehicle.wheel_inertia))
    else:
        kind = kind if kind == "bearings" else "plain"
    return words | {"on": kind}, vehicle, task | {"effects": effects, "accuracy": float(10 ** rng.uniform(-9, -3))}


def outcome(number: int, drawn: Callable[[int], Drawn] = scene) -> tuple[dict[str, str], str]:
    """The words of a scene, and "ends", "tips" or what is wrong, without its numbers."""
    words, vehicle, task = drawn(number)
    try:
        run = simulate(vehicle, **task)
    except SimulationStopped as stopped:
        reason = str(stopped).split(": ", 1)[-1].split(" (nu")[0]
        if "the vehicle tips" in reason:
            return words, "tips"
        return words, "stops: " + re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "#", reason)[:110]
    try:
        finer = simulate(vehicle, **task | {"accuracy": max(task["accuracy"] * FINER, FINEST)})
    except SimulationStopped:
        return words, "ends; the finer run stops"
    off = distance_at(run, finer, np.linspace(0, task["duration"], 6)) / task["accuracy"]
    if off > MISSES:
        return words, "misses ten times its accuracy"
    lawful = task["accuracy"] * (FINER if drawn is scene else MISSES)
    if vehicle.wheel_places is None and max(map(np.max, judged(run).values())) > max(OFF, lawful):
        return words, "misses a law in a row"
    return words, "ends"


def wrong(drawn: Callable[[int], Drawn], scale: Scale) -> list[Measurement]:
    """How many stop, miss their accuracy or a law, with their numbers."""
    told = {number: outcome(number, drawn)[1] for number in range(scale.of(FEW, FULL))}
    parts = {"stop": "stops", "miss ten times their accuracy": "misses ten", "miss a law in a row": "misses a law",
             "stop a thousand times finer": "ends; the finer"}  # fmt: skip
    wrong = {what: [n for n, how in told.items() if how.startswith(begin)] for what, begin in parts.items()}
    return [counted(what, numbers, len(told)) for what, numbers in wrong.items()]


CASES = [
    Case(
        name=name,
        section="Effects",
        title=title,
        naive="turns the direction of a slip as its rounding does, and stops where wheels break away in pairs",
        promise="all end or tip, within ten times the accuracy asked beside a finer run, and obey the laws in each row",
        run=lambda scale, drawn=drawn: wrong(drawn, scale),
    )
    for name, drawn, title in (
        ("manoeuvres", scene, "2000 ordinary manoeuvres of shipped robots, symmetric ones too"),
        ("ordinary-scenes", ordinary, "2000 ordinary scenes: other masses and sizes, bearings, springs, 1e-9 to 1e-3"),
    )
]
