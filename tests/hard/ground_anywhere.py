"""Any vehicle on any ground: random scenes of all laws, slopes, drives and bearings; axles stick in them unless a
controller drives, and in scenes of their own rollers.

A scene follows from its number alone, so that one that fails is found again: `scene(number)`, `rollers_stick(number)`,
`rollers_stick_on_coulomb(number)`.
"""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from omniroll import Bearings, Contact, Controller, Motor, Slope, Torque, TorqueTable, simulate
from omniroll.effects.effect import Effect
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.vehicle import Vehicle

SEED = 97
GRAVITY = 9.7
DURATION = 0.05
ACCURACY = 1e-9
COMMON = {"duration": DURATION, "accuracy": ACCURACY, "control": False}
MISSES = 10  # times that: what the promise of `accuracy` allows
STEEP, COARSE, FINE = 1e6, 1e-7, 1e-10  # N s/m; accuracies
MODELS, LAWS = ("massless", "free"), ("coulomb", "coulomb", "regularised", "viscous")
LEAST_WITH_LOADS = 3  # wheels
KINDS = [kind for kind in itertools.product(MODELS, LAWS) for _ in range(2)]


def torques(random: np.random.Generator, wheels: int) -> tuple[Effect, ...]:
    return (Torque(tuple(0.2 * random.normal(size=wheels))),)


def motors(random: np.random.Generator, wheels: int) -> tuple[Effect, ...]:
    motor = Motor(tuple(random.normal(scale=4, size=wheels)), 0.02, 1.5, gear_ratio=4, current_limit=1.0)
    return motor, Bearings(wheel_viscous=1e-3, roller_viscous=1e-5)


def controller(random: np.random.Generator, wheels: int) -> tuple[Effect, ...]:
    target = tuple(random.normal(size=3))
    return Controller(target, 0.1, 0.02, limit=0.3), Bearings(wheel_coulomb=1e-3, wheel_speed=0.5)


def table(random: np.random.Generator, wheels: int) -> tuple[Effect, ...]:
    rising = TorqueTable((0.0, 0.02, 0.05), 0.3 * random.normal(size=(3, wheels)))
    return rising, Bearings(roller_coulomb=1e-5, roller_speed=0.5, roller_viscous=1e-6)


ACTING = (torques, motors, controller, table)


def scene(number: int) -> tuple[Vehicle, dict[str, Any]]:
    """A vehicle and the arguments of its run."""
    random = np.random.default_rng([SEED, number])
    place = int(random.integers(len(KINDS)))
    model, law = KINDS[place]
    wheels = int(random.choice((3, 4, 5, 6) if law == "coulomb" else (3, 5, 6)))
    friction = float(10 ** random.uniform(-3, 0.3))
    numbers: dict[str, Any] = {"coefficient": 20 * friction} if law == "viscous" else {"friction": friction}
    if law == "regularised":
        numbers["speed"] = float(10 ** random.uniform(-4, -1))
    if law == "coulomb":
        numbers["static_friction"] = friction * float(random.choice((1.0, 1.5)))
    if law != "viscous":
        numbers["normal_gravity"] = GRAVITY
    rates = tuple(random.normal(size=wheels)) if random.random() < 0.7 else None  # None: they roll
    kind = (place + place // 4) % 4
    acting = ACTING[kind](random, wheels)
    ground = Contact(law=law, **numbers, wheel_rates=rates)
    effects = (ground, *acting, Slope(float(random.uniform(0, 0.3)), 1.0))
    nu = tuple(random.normal(size=3)) if random.random() < 0.9 else (0.0, 0.0, 0.0)
    if ACTING[kind] is not controller:  # whose axles have a named speed
        sliding = 10 ** random.uniform(-3, -0.5) * random.uniform(0.5, 1.5, wheels)
        effects += (Bearings(wheel_coulomb=sliding, wheel_break_away=1.2 * sliding),)
    task = {"nu": nu, "roller_model": model, "effects": effects} | COMMON
    return Vehicle.paper(wheels, int(random.integers(4, 8))), task


def rollers_stick(number: int) -> tuple[Vehicle, dict[str, Any]]:
    """The same of a vehicle whose rollers stick on their disks, in half of the scenes beside axles that stick."""
    random = np.random.default_rng([SEED, 1, number])
    wheels, friction = int(random.choice((1, 2, 3, 5, 6))), float(10 ** random.uniform(-3, 0.3))
    law = "viscous" if wheels < LEAST_WITH_LOADS else str(random.choice(("viscous", "regularised")))
    numbers: dict[str, Any] = {"coefficient": float(20 * friction * random.choice((1.0, 100.0)))}
    if law == "regularised":
        numbers = {"friction": friction, "speed": float(10 ** random.uniform(-4, -1)), "normal_gravity": GRAVITY}
    vehicle = Vehicle.paper(wheels, int(random.integers(4, 8)))
    rates = tuple(random.normal(size=wheels)) if random.random() < 0.7 else None
    acting = (torques, motors, table)[number % 3](random, wheels)[:1]
    sliding = vehicle.roller_inertia * 10 ** random.uniform(0, 4) * random.uniform(0.5, 1.5, wheels)
    given = {"roller_coulomb": sliding, "roller_break_away": random.choice((1.0, 1.2)) * sliding}
    if number % 2:
        of_axles = 10 ** random.uniform(-3, -0.5) * random.uniform(0.5, 1.5, wheels)
        given |= {"wheel_coulomb": of_axles, "wheel_break_away": 1.2 * of_axles}
    slope = Slope(float(random.uniform(0, 0.3)), 1.0)
    effects = (Contact(law=law, **numbers, wheel_rates=rates), *acting, Bearings(**given), slope)
    return vehicle, moving_spins(random, vehicle, 0.9) | {"roller_model": "free", "effects": effects} | COMMON


def moving_spins(random: np.random.Generator, vehicle: Vehicle, moving: float) -> dict[str, Any]:
    """A start at which free rollers spin, and of so many vehicles a part moves."""
    return {
        "nu": tuple(random.normal(size=3)) if random.random() < moving else (0.0, 0.0, 0.0),
        "spins": random.normal(size=(vehicle.wheels, vehicle.rollers_per_wheel - 1)) * random.choice((0.0, 1.0, 100.0)),
    }


def rollers_stick_on_coulomb(number: int) -> tuple[Vehicle, dict[str, Any]]:
    """The same where contacts may stick, too."""
    random = np.random.default_rng([SEED, 2, number])
    wheels, friction = int(random.choice((3, 4, 5))), float(10 ** random.uniform(-2, 0.3))
    vehicle = Vehicle.paper(wheels, int(random.integers(4, 7)))
    static = friction * float(random.choice((1.0, 1.5)))
    ground = Contact(law="coulomb", friction=friction, static_friction=static, normal_gravity=GRAVITY,
                     wheel_rates=tuple(random.normal(size=wheels)) if random.random() < 0.5 else None)  # fmt: skip
    of_contact = friction * vehicle.mass * GRAVITY / wheels  # N
    reach = vehicle.wheel_radius - vehicle.roller_axis_radius
    of_rollers = of_contact * reach * 10 ** random.uniform(-3, 0.5) * random.uniform(0.5, 1.5, wheels)
    given = {"roller_coulomb": of_rollers, "roller_break_away": random.choice((1.0, 1.2)) * of_rollers}
    if number % 2:
        of_axles = of_contact * vehicle.wheel_radius * 10 ** random.uniform(-2, 0.5) * random.uniform(0.5, 1.5, wheels)
        given |= {"wheel_coulomb": of_axles, "wheel_break_away": random.choice((1.0, 1.2)) * of_axles}
    acting = (torques, motors, table)[number % 3](random, wheels)[:1]
    start = moving_spins(random, vehicle, 0.8)
    effects = (ground, *acting, Bearings(**given), Slope(float(random.uniform(0, 0.3)), 1.0))
    return vehicle, start | {"roller_model": "free", "effects": effects} | COMMON


def unbalanced(run: Trajectory) -> float:
    """The energy that the ledger does not account for, relative to all that moves."""
    energy = run.energy.max() + sum(map(abs, run.ledger.contributions.values()))
    return abs(run.ledger.residual) / energy if energy > 0 else 0.0


def on_steep_ground(number: int) -> tuple[Vehicle, dict[str, Any]]:
    """A scene of a smooth law on ground that makes it stiff; a named speed is as low as makes it so at rest."""
    vehicle, task = scene(number)
    ground, *others = task["effects"]
    if ground.law == "viscous":
        steep = replace(ground, coefficient=STEEP)
    else:
        steep = replace(ground, speed=ground.friction * vehicle.mass * GRAVITY / vehicle.wheels / STEEP)
    return vehicle, task | {"effects": (steep, *others)}


def missed_on_steep_ground(number: int) -> tuple[float, float]:
    """Over the accuracy: the energy that the ledger does not account for, and how far nu is at the end from that of a
    finer run."""
    vehicle, task = on_steep_ground(number)
    run, finer = (simulate(vehicle, **task | {"accuracy": accuracy}) for accuracy in (COARSE, FINE))
    apart = np.abs(run.nu[-1] - finer.nu[-1]).max() / np.abs(finer.nu).max()
    return unbalanced(run) / COARSE, float(apart) / COARSE
