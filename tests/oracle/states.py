"""Random admissible vehicles and states, as floats, and the paper's vehicle."""

import math

import numpy as np

from .balls import exact, working_precision
from .bodies import Parts, Solid, inertias
from .vehicle import OracleVehicle


def random_vehicle(rng, wheels, rollers, **changes):
    """Parameters of order one in scattered units: r < l cos(pi/n), I_S > N n B/2, wheel angles anywhere."""
    log = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))  # noqa: E731
    wheel_radius = log(0.03, 0.3)
    largest = wheel_radius * math.cos(math.pi / rollers)
    yaw_inertia = log(0.05, 5.0)
    heaviest = 2 * yaw_inertia / (wheels * rollers)
    fields = {
        "mass": log(0.5, 20.0),
        "yaw_inertia": yaw_inertia,
        "wheel_inertia": log(1e-4, 1e-1),
        "roller_inertia": heaviest * log(1e-4, 0.5),
        "yaw_scale": log(0.2, 5.0),
        "platform_radius": log(0.1, 1.0),
        "wheel_radius": wheel_radius,
        "roller_axis_radius": largest * float(rng.uniform(0.6, 0.98)),
        "wheel_angles": tuple(float(a) for a in rng.uniform(0, 2 * math.pi, wheels)),
        "rollers_per_wheel": rollers,
    }
    return OracleVehicle(**(fields | changes))


def random_state(rng, vehicle, filled=0.999):
    """(nu (3), chi (N), spins (N, n-1)) as arrays; |chi| <= filled pi/n."""
    n = vehicle.rollers_per_wheel
    chi = rng.uniform(-1, 1, vehicle.wheels) * filled * math.pi / n
    return rng.normal(size=3), chi, rng.normal(size=(vehicle.wheels, n - 1))


@working_precision
def paper_parts(wheels=3, rollers=5):
    """The parts behind the paper's vehicle, with exact decimal sizes: (Parts, wheel radius)."""
    r = exact("0.05")
    wheel_radius = r / (exact(0).acos() * 2 / (rollers - 1)).cos()
    turn = 4 * exact(0).acos()
    parts = Parts(
        platform=Solid.cylinder("1", "0.15", "0.1"),
        hub=Solid.cylinder("0.15", r, "0.01"),
        roller=Solid.cylinder("0.05", (wheel_radius - r) / 2, 2 * wheel_radius * (turn / 2 / rollers).sin()),
        platform_radius=exact("0.15"),
        roller_axis_radius=r,
        rollers_per_wheel=rollers,
        wheel_angles=tuple(turn * i / wheels for i in range(wheels)),
    )
    return parts, wheel_radius


@working_precision
def paper_vehicle(wheels=3, rollers=5):
    """The paper's vehicle, its inertias summed over bodies in space."""
    parts, wheel_radius = paper_parts(wheels, rollers)
    found = inertias(parts)
    return OracleVehicle(
        **found,
        yaw_scale=found["yaw_inertia"] / (found["mass"] * wheel_radius * wheel_radius),
        platform_radius=parts.platform_radius,
        wheel_radius=wheel_radius,
        roller_axis_radius=parts.roller_axis_radius,
        wheel_angles=parts.wheel_angles,
        rollers_per_wheel=rollers,
    )


def ordinary_vehicle(rng, wheels, rollers):
    """A robot of usual proportions with scattered numbers: rollers weigh a little, and end well before a
    point.
    """
    vary = lambda value: value * float(rng.uniform(0.7, 1.4))  # noqa: E731
    wheel_radius = vary(0.06)
    roller_radius = 0.15 * wheel_radius
    angles = 2 * np.pi * np.arange(wheels) / wheels + rng.uniform(-0.2, 0.2, wheels)
    return OracleVehicle(
        mass=vary(2.5),
        yaw_inertia=vary(0.05),
        wheel_inertia=vary(1e-3),
        roller_inertia=vary(0.02) * roller_radius * roller_radius,
        yaw_scale=vary(2.0),
        platform_radius=vary(0.15),
        wheel_radius=wheel_radius,
        roller_axis_radius=wheel_radius * math.cos(math.pi / rollers) * float(rng.uniform(0.8, 0.9)),
        wheel_angles=tuple(float(a) for a in angles),
        rollers_per_wheel=rollers,
    )


def time_for_switches(vehicle, nu, count):
    """About the time in which all wheels together pass `count` joints at their first speeds."""
    angles = np.asarray(vehicle.wheel_angles, float)
    turning = nu[0] * np.sin(angles) - nu[1] * np.cos(angles) - nu[2] / float(vehicle.yaw_scale)
    rates = np.abs(turning) * float(vehicle.platform_radius) / float(vehicle.wheel_radius)
    return float(count * 2 * np.pi / vehicle.rollers_per_wheel / rates.sum())
