"""Random scenes of every effect, for tests that hold whole runs to something."""

from dataclasses import replace

import numpy as np

from omniroll import Bearings, Contact, Controller, Motor, Slope, Torque, TorqueTable, Vehicle

PAPER = Vehicle.paper()
PLACES = ((0.15, 0.01), (-0.07, 0.14), (-0.08, -0.12))
MODELS = ("massless", "locked", "free")


def torques(rng):
    return Torque(rng.normal(scale=0.01, size=3))


def linear_table(rng):
    return TorqueTable(np.sort(rng.uniform(0, 2, 4)), rng.normal(scale=0.02, size=(4, 3)))


def held_table(rng):
    return TorqueTable(np.sort(rng.uniform(0, 2, 4)), rng.normal(scale=0.02, size=(4, 3)), "hold")


def motors(rng):
    return Motor(rng.normal(scale=3, size=3), 0.02, 1.5, gear_ratio=rng.choice([-3.0, 4.0]), rotor_inertia=1e-6)


def limited_motors(rng):
    times = np.sort(rng.uniform(0, 2, 3))
    return Motor(rng.normal(scale=4, size=(3, 3)), 0.02, 1.5, gear_ratio=3, current_limit=0.7, times=times)


def controller(rng):
    return Controller(rng.normal(size=3) * 0.5, 0.01, rng.uniform(0.03, 0.2), integral=0.02, limit=0.02)


def voltage_controller(rng):
    target = rng.normal(size=(2, 3)) * 0.5
    return Controller(target, 1.0, 0.07, output="voltage", times=(0.3, 1.2))


def viscous(rng):
    return Bearings(wheel_viscous=rng.uniform(0, 2e-3, 3), roller_viscous=1e-5)


def coulomb(rng):
    return Bearings(wheel_coulomb=1e-3, wheel_speed=0.5, roller_coulomb=1e-5, roller_speed=0.5, roller_viscous=1e-6)


def sticking(rng):
    sliding = rng.uniform(0, 8e-3, 3)
    return Bearings(wheel_coulomb=sliding, wheel_break_away=sliding * rng.choice([1.0, 1.5]))


def sticking_with_viscous(rng):
    return Bearings(wheel_coulomb=rng.uniform(1e-3, 8e-3, 3), wheel_viscous=5e-4, roller_viscous=1e-5)


def sticking_rollers(rng):
    """Free rollers break away where their disks take them along fast enough."""
    sliding = rng.uniform(0, 2, 3) * 10 ** rng.uniform(-7, -4)
    return Bearings(roller_coulomb=sliding, roller_break_away=sliding * rng.choice([1.0, 1.5]))


def all_sticking(rng):
    rollers, axles = sticking_rollers(rng), sticking(rng)
    return replace(rollers, wheel_coulomb=axles.wheel_coulomb, wheel_break_away=axles.wheel_break_away)


def dry_ground(rng):
    return Contact(law="coulomb", friction=rng.uniform(0.1, 0.5, 2), normal_gravity=10, wheel_rates=rng.normal(0, 9, 3))


def slope(rng):
    return Slope(rng.uniform(0, 0.1), rng.uniform(-9, 9))


SCENES = {
    "torques": (torques,),
    "linear table": (linear_table,),
    "held table": (held_table,),
    "motors": (motors,),
    "limited motors": (limited_motors,),
    "controller": (controller,),
    "motors with a controller": (limited_motors, voltage_controller),
    "viscous friction": (viscous,),
    "Coulomb's friction": (coulomb,),
    "slope": (slope,),
    "all with viscous friction": (limited_motors, voltage_controller, torques, viscous, slope),
    "all with Coulomb's friction": (held_table, limited_motors, controller, coulomb, slope),
    "axles that stick": (linear_table, sticking),
    "all with axles that stick": (limited_motors, voltage_controller, torques, sticking_with_viscous, slope),
    "rollers that stick": (linear_table, sticking_rollers),
    "all with axles and rollers that stick": (limited_motors, voltage_controller, torques, all_sticking, slope),
}
ALL = SCENES | {"contacts that stick": (dry_ground,)}


def random_scene(name, model, seed):
    """A vehicle, with a layout of its own every second time, and the arguments of a run of 2 s without its accuracy."""
    rng = np.random.default_rng([seed, MODELS.index(model), list(ALL).index(name)])
    vehicle = PAPER.replace(wheel_places=PLACES, center_of_mass=(0.005, -0.01)) if seed % 2 else PAPER
    task = {
        "nu": (0.0, 0.0, 0.0) if seed % 3 == 2 else rng.normal(size=3),
        "chi": rng.uniform(-0.6, 0.6, 3),
        "pose": rng.normal(size=3),
        "duration": 2.0,
        "start_time": 0.25,
        "roller_model": model,
        "switching": ("impact", "smooth")[seed // 2 % 2],
        "effects": [make(rng) for make in ALL[name]],
    }
    if model == "free":
        task["spins"] = rng.normal(scale=0.5, size=(3, 4))
    return vehicle, task
