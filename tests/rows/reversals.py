"""Random vehicles with two rows of rollers, or with mecanum wheels, that turn while their wheels reverse, with and
without torques."""

import numpy as np

import omniroll

MODELS = ("massless", "locked", "free")


def vehicle(random, is_mecanum: bool = False) -> omniroll.Vehicle:
    """Three to six wheels, at places near their rays, of 6 to 16 rollers in two rows; or of 3 to 10 at angles."""
    wheels, rollers = int(random.integers(3, 7)), 2 * int(random.integers(3, 9))
    kind = {"rows": 2}
    if is_mecanum:
        rollers = int(random.integers(3, 11))
        kind = {"roller_angle": tuple(random.choice((1, -1), wheels) * random.uniform(0.2, 1.3, wheels))}
    radius, wheel_radius = random.uniform(0.1, 0.4), random.uniform(0.02, 0.08)
    angles = 2 * np.pi * (np.arange(wheels) + random.uniform(-0.15, 0.15, wheels)) / wheels
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    mass = random.uniform(2, 20)
    wheel_inertia = random.uniform(0.2, 3) * 0.02 * mass * wheel_radius**2
    return omniroll.Vehicle(
        wheels=wheels,
        rollers_per_wheel=rollers,
        row_offset=0.0 if is_mecanum else random.choice((1, -1)) * wheel_radius * random.uniform(0.05, 0.6),
        wheel_angles=tuple(angles + random.normal(0, 0.1, wheels)),
        wheel_places=tuple(map(tuple, radius * rays + random.normal(0, 0.02 * radius, (wheels, 2)))),
        center_of_mass=tuple(random.normal(0, 0.1 * radius, 2)),
        platform_radius=radius,
        wheel_radius=wheel_radius,
        roller_axis_radius=wheel_radius * np.cos(np.pi / rollers) * random.uniform(0.7, 0.93),
        mass=mass,
        yaw_inertia=mass * radius**2 * random.uniform(0.4, 1.2),
        wheel_inertia=wheel_inertia,
        roller_inertia=wheel_inertia / rollers * random.uniform(0.01, 0.3),
        yaw_scale=random.uniform(0.5, 2),
        **kind,
    )


def task(random, driven: bool, is_mecanum: bool = False) -> dict:
    """Arguments of simulate for such a vehicle, which turns and whose wheels reverse some times."""
    found = vehicle(random, is_mecanum)
    yaw = random.choice((1, -1)) * random.uniform(1, 4)
    speed = abs(yaw) * random.uniform(0.3, 2)
    direction = random.uniform(0, 2 * np.pi)
    nu = [speed * np.cos(direction), speed * np.sin(direction), yaw * found.yaw_scale]
    chi = random.uniform(-1, 1, found.wheels) * np.pi / found.rollers_per_wheel
    effects = ()
    if driven:
        times = np.linspace(0, 3, 7)
        size = 0.1 * found.mass * found.platform_radius * found.wheel_radius * speed
        effects = (omniroll.TorqueTable(times, random.normal(0, size, (7, found.wheels))),)
    return {"vehicle": found, "nu": nu, "chi": chi, "duration": 3.0, "effects": effects, "accuracy": 1e-8}


def rises(run) -> float:
    """The largest rise of energy over a transition, over the largest energy."""
    same = np.flatnonzero(np.diff(run.elapsed) == 0)
    return float((run.energy[same + 1] - run.energy[same]).max(initial=0.0) / run.energy.max())


def most_at_once(run) -> int:
    """The most transitions at one instant, over the number of wheels."""
    _, counts = np.unique(run.t[np.flatnonzero(np.diff(run.t) == 0)], return_counts=True)
    return int(np.ceil(counts.max(initial=0) / run.vehicle.wheels))


def stood(run) -> float:
    """The time that wheels stand on their joints, in s, all added up."""
    return float((np.diff(run.elapsed)[:, None] * run.pivots[:-1]).sum())
