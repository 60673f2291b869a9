"""Samples of vehicles and states for single kernel functions: log-uniform, and on the boundaries."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sample:
    """K states, each with a vehicle of its own, all with N wheels of n rollers.

    vehicle  the scalars (K,) by their names in omniroll.Vehicle, wheel_angles (K, N)
    state    what functions take, by name: nu (K, 3), chi (K, N), spins (K, N, n-1), ...
    """

    wheels: int
    rollers: int
    vehicle: dict[str, np.ndarray]
    state: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.vehicle["mass"])

    def at(self, rows: np.ndarray) -> "Sample":
        """Some of the states."""
        pick = lambda values: {name: array[rows] for name, array in values.items()}  # noqa: E731
        return Sample(self.wheels, self.rollers, pick(self.vehicle), pick(self.state))

    def rounded(self, dtype: type) -> "Sample":
        """The states next to these whose numbers are exact in a narrower type."""
        narrow = lambda values: {k: a.astype(dtype).astype(float) for k, a in values.items()}  # noqa: E731
        return Sample(self.wheels, self.rollers, narrow(self.vehicle), narrow(self.state))

    @property
    def joint(self) -> float:
        return math.pi / self.rollers

    def in_units(self, length: float, mass: float) -> "Sample":
        """The same vehicles and states in other units of length and mass."""
        power = {"mass": (0, 1), "yaw_scale": (0, 0), "wheel_angles": (0, 0)}
        power |= {name: (1, 0) for name in ("platform_radius", "wheel_radius", "roller_axis_radius")}
        size = {name: length**a * mass**b for name, (a, b) in power.items()}
        moment = length**2 * mass
        vehicle = {name: array * size.get(name, moment) for name, array in self.vehicle.items()}
        state = {name: array * (moment if name in ("momenta", "force") else 1) for name, array in self.state.items()}
        return Sample(self.wheels, self.rollers, vehicle, state)

    def sharpness(self) -> np.ndarray:
        """omniroll.Vehicle.sharpness of each vehicle."""
        v = self.vehicle
        half = np.sin(self.joint / 2)
        tip = v["wheel_radius"] - v["roller_axis_radius"] - 2 * v["wheel_radius"] * half**2
        return v["roller_inertia"] / v["mass"] / tip**2


class Draw:
    """Random numbers of the shapes that samples need."""

    def __init__(self, seed: int, count: int):
        self.rng, self.count = np.random.default_rng(seed), count

    def log(self, low: float, high: float, *shape: int) -> np.ndarray:
        """Log-uniform between two positive numbers."""
        return np.exp(self.rng.uniform(math.log(low), math.log(high), (self.count, *shape)))

    def signed(self, low: float, high: float, *shape: int, zeros: float = 0.1) -> np.ndarray:
        """Log-uniform with a random sign; a part of them zero."""
        sign = np.where(self.rng.random((self.count, *shape)) < 0.5, -1.0, 1.0)
        return np.where(self.rng.random((self.count, *shape)) < zeros, 0.0, sign * self.log(low, high, *shape))

    def one_of(self, *choices: np.ndarray) -> np.ndarray:
        """Each number from one of the arrays at random."""
        place = self.rng.integers(len(choices), size=np.shape(choices[0]))
        return np.choose(place, choices)

    def whole(self, *choices: np.ndarray) -> np.ndarray:
        """Each state's numbers from one of the arrays at random."""
        place = self.rng.integers(len(choices), size=self.count)
        return np.choose(place.reshape(-1, *[1] * (np.ndim(choices[0]) - 1)), choices)


def wheel_angles(draw: Draw, wheels: int) -> np.ndarray:
    """Regular, anywhere, on the axes of the platform."""
    regular = np.broadcast_to(2 * np.pi * np.arange(wheels) / wheels, (draw.count, wheels))
    anywhere = draw.rng.uniform(-np.pi, np.pi, (draw.count, wheels))
    quarters = draw.rng.integers(-2, 3, (draw.count, wheels)) * (np.pi / 2)
    return draw.whole(regular, anywhere, regular + draw.rng.uniform(-0.2, 0.2, (draw.count, wheels)), quarters)


def vehicles(draw: Draw, wheels: int, rollers: int, closest_tip: float, **changes: Callable) -> dict:
    """Vehicles in any units: masses, lengths and inertias log-uniform.

    closest_tip: how close the rollers' axes come to the ground at the joint, in wheel radii
    changes: by field, a function of the fields drawn so far and of the Draw
    """
    found = {"mass": draw.log(1e-6, 1e6), "wheel_radius": draw.log(1e-4, 1e4)}
    length = found["wheel_radius"] * draw.log(0.5, 50)
    found["platform_radius"] = length
    found["yaw_inertia"] = found["mass"] * length**2 * draw.log(1e-3, 1e3)
    found["wheel_inertia"] = found["mass"] * found["wheel_radius"] ** 2 * draw.log(1e-6, 10)
    bound = 2 * found["yaw_inertia"] / (wheels * rollers)
    usual = np.minimum(found["mass"] * found["wheel_radius"] ** 2, 0.5 * bound)
    found["roller_inertia"] = usual * draw.log(1e-9, 0.1)
    found["yaw_scale"] = draw.log(1e-2, 1e2)
    tip = draw.log(closest_tip, 0.4 * math.cos(math.pi / rollers))
    found["roller_axis_radius"] = found["wheel_radius"] * (math.cos(math.pi / rollers) - tip)
    found["wheel_angles"] = wheel_angles(draw, wheels)
    for name, change in changes.items():
        found[name] = change(found, draw)
    return found


def angles_on_a_roller(draw: Draw, wheels: int, rollers: int) -> np.ndarray:
    """chi: anywhere, close to the middle, close to a joint, on it."""
    joint = math.pi / rollers
    anywhere = draw.rng.uniform(-joint, joint, (draw.count, wheels))
    middle = draw.signed(1e-12, 1.0, wheels) * joint
    end = np.where(draw.rng.random((draw.count, wheels)) < 0.5, -joint, joint)
    return draw.one_of(anywhere, middle, end * (1 - draw.log(1e-12, 1.0, wheels)), end)


def states(draw: Draw, vehicle: dict[str, np.ndarray], wheels: int, rollers: int) -> dict[str, np.ndarray]:
    """What the functions take, each of its natural size times something log-uniform, or zero."""
    speed = draw.log(1e-9, 1e9)
    free = (wheels, rollers - 1)
    angular = lambda *shape: per_state(speed, shape) * draw.signed(1e-3, 1e3, *shape)  # noqa: E731
    momentum = per_state(speed * vehicle["roller_inertia"], (wheels, 2)) * draw.signed(1e-2, 1e3, wheels, 2)
    force = vehicle["mass"] * vehicle["platform_radius"] ** 2 * speed**2
    switching = draw.rng.random((draw.count, wheels)) < 0.5
    return {
        "nu": angular(3),
        "chi": angles_on_a_roller(draw, wheels, rollers),
        "spins": draw.whole(np.zeros((draw.count, *free)), angular(*free)),
        "axial": angular(*free),
        "momenta": draw.whole(np.zeros((draw.count, wheels, 2)), momentum),
        "theta": draw.signed(1e-6, 1e3),
        "chi_dot": angular(wheels),
        "contact_spin": angular(wheels),
        "nu_dot": per_state(speed**2, (3,)) * draw.signed(1e-2, 1e2, 3),
        "force": per_state(force, (3,)) * draw.signed(1e-2, 1e2, 3),
        "entering": np.where(switching, angular(wheels), 0.0),
        "leaving": np.where(switching, angular(wheels), 0.0),
    }


def per_state(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return values.reshape(-1, *[1] * len(shape))


def sample(seed: int, count: int, wheels: int, rollers: int, closest_tip: float = 1e-3, **changes: Callable) -> Sample:
    """K random states, each with a vehicle of its own; closest_tip and changes as in vehicles()."""
    draw = Draw(seed, count)
    found = vehicles(draw, wheels, rollers, closest_tip, **changes)
    return Sample(wheels, rollers, found, states(draw, found, wheels, rollers))
