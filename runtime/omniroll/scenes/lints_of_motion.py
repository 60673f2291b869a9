"""Speeds, torques, friction and motors of a scene that no such vehicle has."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from omniroll.effects import Bearings, Controller, Motor
from omniroll.kernels.kernel import kernel
from omniroll.scenes.lint import Lint
from omniroll.scenes.lints_of_vehicle import reach
from omniroll.scenes.loading import Scene
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import STANDARD_GRAVITY

FASTEST = 8.0  # m/s of a vehicle on omni-wheels
LEAST_FREE, MOST_FREE = 1e-3, 50.0  # m/s of a wheel's rim whose motor turns without load
LEAST_TORQUE, MOST_TORQUE = 0.9, 1.1 * math.sqrt(3)  # torque_constant over back_emf; 1.5 and sqrt(3) count in phases
QUICKEST_TURN = 30.0  # rad/s about the vertical axis
FRICTION = 1.0  # coefficient of rubber on a dry floor
HARD_DRIVEN = 5.0  # thrust of a wheel over its load, that no friction passes on
HEAVY_ROTOR = 100.0  # a rotor's part of a wheel's inertia, over the wheel's own
BRIEF = 0.02  # s in which viscous friction stops a vehicle
WALK = 1.0  # m/s


def of_motion(scene: Scene) -> Iterator[Lint]:
    """What acts, and how fast the vehicle goes."""
    vehicle, effects = scene.vehicle, scene.options.get("effects", ())
    yield from _of_speeds("start", "nu", [scene.options["nu"]], vehicle)
    for effect in effects:
        if isinstance(effect, Controller):
            yield from _of_speeds("controller", "target", effect.target, vehicle)
        elif isinstance(effect, Motor):
            yield from _of_motor(effect, effects, vehicle)
        elif isinstance(effect, Bearings):
            yield from _of_bearings(effect, vehicle)
    drive = scene.tables.get("drive", {})
    thrust = np.abs(drive.get("torque", 0.0)).max() / vehicle.wheel_radius
    if thrust > HARD_DRIVEN * _load(vehicle):
        text = f"pushes with {thrust:.3g} N at the ground, where a wheel carries {_load(vehicle):.3g} N"
        yield Lint("drive", "torque", f"{text}; is it in N m?")
    for table in ("reactions", "contact"):
        height = scene.tables.get(table, {}).get("height")
        if height is not None and not 0.1 * vehicle.wheel_radius < height < 5 * reach(vehicle):
            wheels = f"wheels of {vehicle.wheel_radius:g} m that reach {reach(vehicle):.3g} m out"
            yield Lint(table, "height", f"{height:g} m does not fit {wheels}; is it in m?")


def _load(vehicle: Vehicle) -> float:
    """The weight that a wheel carries, in N."""
    return vehicle.mass * STANDARD_GRAVITY / vehicle.wheels


def _of_speeds(table: str, key: str, nu: Any, vehicle: Vehicle) -> Iterator[Lint]:
    rows = np.reshape(np.asarray(nu, float), (-1, 3))
    speed = vehicle.platform_radius * np.hypot(rows[:, 0], rows[:, 1]).max()
    turn = np.abs(rows[:, 2]).max() / vehicle.yaw_scale
    if speed > FASTEST:
        yield Lint(table, key, f"is {speed:.3g} m/s, faster than any such vehicle; nu times platform_radius is in m/s")
    if turn > QUICKEST_TURN:
        text = f"turns at {turn:.3g} rad/s, {turn / (2 * math.pi):.3g} times a second"
        yield Lint(table, key, f"{text}; is it meant in degrees per second?")


def _of_motor(motor: Motor, effects: tuple, vehicle: Vehicle) -> Iterator[Lint]:
    limits = [e.limit for e in effects if isinstance(e, Controller) and e.output == "voltage" and e.limit is not None]
    volts = float(np.abs(motor.voltage).max()) + sum(limits)
    if volts and motor.back_emf:
        rate = abs(volts / (motor.back_emf * motor.gear_ratio))
        speed = rate * vehicle.wheel_radius
        if not LEAST_FREE <= speed <= MOST_FREE:
            text = (
                f"{volts:.3g} V turn a wheel without load at {rate:.3g} rad/s, which is {speed:.3g} m/s on the ground"
            )
            yield Lint("drive", "gear_ratio", f"{text}; are back_emf in V s and gear_ratio right?")
    if motor.back_emf and not LEAST_TORQUE <= (ratio := motor.torque_constant / motor.back_emf) <= MOST_TORQUE:
        text = f"torque_constant is {ratio:.3g} times this; in N m/A and V s the two are alike"
        yield Lint("drive", "back_emf", f"{text}; 1 V/rpm is 9.549 V s")
    added = motor.equipped(vehicle).wheel_inertia - vehicle.wheel_inertia
    if added > HEAVY_ROTOR * vehicle.wheel_inertia:
        text = f"behind its gear the rotor has {added / vehicle.wheel_inertia:.3g} times the wheel's own inertia"
        yield Lint("drive", "rotor_inertia", f"{text}; is it in kg m^2?")


def _of_bearings(bearings: Bearings, vehicle: Vehicle) -> Iterator[Lint]:
    radius, load = vehicle.roller_radius, _load(vehicle)
    coulomb, viscous = (np.max(value or 0.0) / radius for value in (bearings.roller_coulomb, bearings.roller_viscous))
    if coulomb > FRICTION * load:
        text = f"needs {coulomb:.3g} N at a roller's rim to turn it, where a wheel carries {load:.3g} N"
        yield Lint("bearings", "roller_coulomb", f"{text}: the rollers never turn")
    drag = viscous * WALK / radius
    if drag > FRICTION * load:
        text = f"brakes a roller's rim with {drag:.3g} N at {WALK:g} m/s, where a wheel carries {load:.3g} N"
        yield Lint("bearings", "roller_viscous", text)
    if bearings.wheel_viscous is not None and (damping := np.max(bearings.wheel_viscous)) > 0:
        bound = kernel(vehicle, "massless", "python")
        rates = np.linalg.eigvals(bound.nu_dot_per_torque @ bound.wheel_rows)
        if (time := 1 / (damping * rates.real.max())) < BRIEF:
            text = f"stops a motion of the vehicle within {time:.2g} s"
            yield Lint("bearings", "wheel_viscous", f"{text}; is it in N m s?")
