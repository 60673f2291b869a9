"""Runs that pages are made of: each stands for something that the page must show rightly."""

from functools import cache
from pathlib import Path

import numpy as np

import omniroll

ROOT = Path(__file__).resolve().parents[2]
KIT = ROOT / "scenes/robot-soccer-kit.toml"


@cache
def soccer_kit(duration: float) -> omniroll.Trajectory:
    return omniroll.run(omniroll.load_scene(KIT), duration=duration)


@cache
def layout() -> omniroll.Trajectory:
    """Four wheels at places of their own; it starts late, and friction slows wheels and rollers.

    The Python engine makes it: nothing has to be compiled, and its polynomials have another degree.
    """
    vehicle = omniroll.Vehicle.paper(4, 6).replace(
        wheel_places=((0.2, 0.12), (-0.2, 0.12), (-0.2, -0.12), (0.2, -0.12)), wheel_angles=(0.7, 2.4, 3.9, 5.5)
    )
    friction = omniroll.Bearings(wheel_viscous=1e-3, roller_viscous=1e-6)
    motion = {"nu": (1, 0.3, 0.5), "duration": 4, "start_time": 3.0, "engine": "python", "accuracy": 1e-7}
    return omniroll.simulate(vehicle, **motion, effects=[friction])


@cache
def locked() -> omniroll.Trajectory:
    return omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=10, roller_model="locked")


@cache
def massless() -> omniroll.Trajectory:
    return omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=10, roller_model="massless")


@cache
def slipping() -> omniroll.Trajectory:
    """Wheels that stand at first while the vehicle moves."""
    ground = omniroll.Contact(30, wheel_rates=0)
    return omniroll.simulate(omniroll.Vehicle.paper(), nu=(2, 1, 0), duration=0.6, effects=[ground])


RUNS = {
    "soccer kit": lambda: soccer_kit(3.0),
    "layout": layout,
    "locked": locked,
    "massless": massless,
    "slipping": slipping,
}


def times(run: omniroll.Trajectory, count: int) -> np.ndarray:
    """Times since the start: at random, and a little before and after switches."""
    random = np.random.default_rng(1).uniform(0, run.elapsed[-1], count)
    switched = run.elapsed[1:][(run.contact[1:] != run.contact[:-1]).any(axis=1)][: count // 2]
    near = np.concatenate([switched - 1e-9, switched + 1e-9])
    return np.concatenate([[0.0, run.elapsed[-1]], random, near[(near > 0) & (near < run.elapsed[-1])]])
