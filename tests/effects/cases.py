"""Vehicles, states and numbers of every effect at random, and the generated Python kernels on balls."""

import numpy as np
from oracle.balls import exact
from oracle.states import random_state, random_vehicle

from omniroll import generated_data
from omniroll.kernels import sets

MODELS = ("massless", "locked", "free")
OPTIONAL = tuple(  # of wheels that roll and stay round, in one row
    e["name"]
    for e in generated_data.load("effects")["effects"]
    if e["neutral"] and e["table"] not in ("reactions", "contact", "springs", "vehicle", "weight")
)
WHEELS, ROLLERS = 3, 4


def random_case(rng, wheels=WHEELS, rollers=ROLLERS):
    """A vehicle with a layout, a state, and the numbers of all effects."""
    places = tuple((float(x), float(y)) for x, y in rng.normal(size=(wheels, 2)) * 0.3)
    center = (0.03, -0.05)
    vehicle = random_vehicle(rng, wheels, rollers, places=places, offset=center)
    vehicle = vehicle.with_(yaw_inertia=vehicle.yaw_inertia + vehicle.mass * sum(c * c for c in center))
    numbers = {
        "axle_damping": rng.uniform(0.1, 1, wheels), "axle_torque": rng.uniform(0.1, 1, wheels), "axle_fade_speed": 0.3,
        "roller_damping": rng.uniform(0.1, 1, wheels), "roller_torque": rng.uniform(0.1, 1, wheels),
        "roller_fade_speed": 0.2, "gravity": 9.8, "slope_angle": 0.2, "slope_direction": 0.7,
        "torque_constant": 0.02, "resistance": 1.5, "motor_gear_ratio": 20, "back_emf": 0.03, "current_limit": 4,
        "torque": rng.normal(size=wheels), "damping": rng.uniform(0.1, 1, wheels), "heading": 0.4,
        "bearing_torque": rng.normal(size=wheels),
    }  # fmt: skip
    state = random_state(rng, vehicle, 0.9)
    numbers |= {"contact_bearing": rng.normal(size=wheels), "free_bearing": rng.normal(size=(wheels, rollers - 1))}
    return vehicle, state, numbers


def balls(value):
    return [balls(v) for v in value] if np.ndim(value) else exact(float(value))


def prepared_kernel(vehicle, model, effects, numbers):
    """(module, model) of a generated Python kernel on balls."""
    module = sets.python_module(model, effects)
    (prepare,) = (f for f in sets.functions(model, effects) if f["name"] == "prepare")
    given = numbers | {
        "wheel_angles": vehicle.wheel_angles, "wheel_places": vehicle.places, "center_of_mass": vehicle.offset,
    }  # fmt: skip
    names = [a["name"] for a in prepare["arguments"] if a["role"] == "in"]
    values = [balls(given[name]) if name in given else vehicle.number(name) for name in names]
    return module, module.prepare(vehicle.wheels, vehicle.rollers_per_wheel, *values)


def without_layout(vehicle):
    return vehicle.with_(places=None, offset=(0, 0))
