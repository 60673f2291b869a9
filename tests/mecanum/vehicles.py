"""Random vehicles with rollers at angles, in two rows, with a meridian of their own, or with wheels of two kinds, as
bodies and as Vehicle, with states of both."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from omniroll import Vehicle

from .all_bodies import Bodies, constraints, mass_matrix


def random_bodies(seed: int, wheels: int, rollers: int, is_massless: bool = False) -> Bodies:
    draw = np.random.default_rng(seed)
    angles = draw.uniform(0.3, 1.2, wheels) * draw.choice([-1, 1], wheels)
    angles[seed % wheels] = 0.0  # an omni-wheel among them
    radius = draw.uniform(0.04, 0.1)
    axis = radius * draw.uniform(0.6, 0.9) * np.cos(np.pi / rollers)
    return Bodies(
        draw.uniform(-0.4, 0.4, (wheels, 2)), draw.uniform(-np.pi, np.pi, wheels), angles, rollers, radius, axis,
        roller=(0.03, 0.0 if is_massless else 2.5e-6, 4e-6),
    )  # fmt: skip


def random_rows(seed: int, wheels: int, rollers: int, is_massless: bool = False) -> Bodies:
    draw, rollers = np.random.default_rng(seed), rollers + rollers % 2
    radius = draw.uniform(0.04, 0.08)
    axis = radius * draw.uniform(0.6, 0.9) * np.cos(np.pi / rollers)
    return Bodies(
        draw.normal(0, 0.2, (wheels, 2)), 2 * np.pi * np.arange(wheels) / wheels + draw.normal(0, 0.2, wheels),
        np.zeros(wheels), rollers, radius, axis, roller=(0.03, 0.0 if is_massless else 2.5e-6, 4e-6),
        row_offset=float(draw.choice((1, -1)) * radius * draw.uniform(0.1, 0.8)),
        contact=draw.integers(0, rollers, wheels),
    )  # fmt: skip


def random_omni(seed: int, wheels: int, rollers: int, is_massless: bool = False) -> Bodies:
    return replace(random_bodies(seed, wheels, rollers, is_massless), roller_angles=np.zeros(wheels))


def random_profile(seed: int, wheels: int, rollers: int, is_massless: bool = False) -> Bodies:
    """Rollers at angles whose meridian is an arc: thinner at their ends than those that keep the wheel round, or less
    thin."""
    bodies, draw = random_bodies(seed, wheels, rollers, is_massless), np.random.default_rng(seed)
    thick = bodies.wheel_radius - bodies.axis_radius
    least = thick / (1 - np.cos(np.pi / rollers) ** 2) if seed % 2 else 0.3 * thick
    radius = least * draw.uniform(0.3, 0.6)
    return replace(bodies, meridian=((0.0, thick - radius, radius),))


def random_arcs(seed: int, wheels: int, rollers: int, is_massless: bool = False) -> Bodies:
    """Rollers at angles of one size, with an arc in their middle and edges at their ends, sharp or round."""
    bodies, draw = random_bodies(seed, wheels, rollers, is_massless), np.random.default_rng(seed)
    thick = bodies.wheel_radius - bodies.axis_radius
    end, round_by = thick * draw.uniform(0.6, 0.9), thick * (0.0, 0.2)[seed % 2]
    ends = [(side * end, 0.95 * thick - round_by, round_by) for side in (-1, 1)]
    hands = draw.choice([-1, 1], wheels) * draw.uniform(0.3, 1.0)
    return replace(bodies, roller_angles=hands, meridian=(ends[0], (0.0, 0.6 * thick, 0.4 * thick), ends[1]))


def random_kinds(seed: int, wheels: int, rollers: int, is_massless: bool = False, is_slanted: bool = False) -> Bodies:
    """Every second wheel has a roller less and other numbers; its rollers have no inertia."""
    draw, rollers = np.random.default_rng(seed), max(rollers, 4)
    angles = draw.uniform(0.3, 1.1, wheels) * draw.choice([-1, 1], wheels) * is_slanted
    angles[seed % wheels] = 0.0
    whole = replace(random_bodies(seed, wheels, rollers), roller_angles=angles)
    kinds = []
    for count, axial in ((rollers, draw.uniform(1e-6, 5e-6)), (rollers - 1, 0.0)):
        radius, part = draw.uniform(0.04, 0.1), draw.uniform(0.6, 0.9)
        kinds.append(replace(
            whole, rollers=count, wheel_radius=radius, axis_radius=radius * part * np.cos(np.pi / count),
            hub=(0.4, draw.uniform(6e-4, 2e-3), 5e-4), roller=(0.03, 0.0 if is_massless else axial, 4e-6),
        ))  # fmt: skip
    return replace(whole, kinds=[kinds[i % 2] for i in range(wheels)])


KINDS = {
    "omni": random_omni, "mecanum": random_bodies, "rows": random_rows, "profile": random_profile, "arcs": random_arcs,
    "kinds": random_kinds, "mecanum kinds": partial(random_kinds, is_slanted=True),
}  # fmt: skip


def drawn(kind: str, seed: int, wheels: int, rollers: int, model: str):
    """Bodies, vehicle, nu, chi and spins of the free rollers."""
    draw = np.random.default_rng(1000 + seed)
    bodies = KINDS[kind](seed, wheels, rollers, model == "massless")
    vehicle = vehicle_of(bodies, 1e-6 if model == "massless" else None)
    nu, chi = draw.normal(size=3), draw.uniform(-1, 1, wheels) * joints(bodies)
    spins = draw.normal(size=(wheels, bodies.rollers - 1)) * (20 if model == "free" else 0)
    return bodies, vehicle, nu, chi, spins * turning_freely(bodies)


def joints(bodies: Bodies) -> np.ndarray:
    """(N,) the angles at which wheels stand between two rollers."""
    return np.pi / np.array([bodies.of(i).rollers for i in range(bodies.wheels)])


def turning_freely(bodies: Bodies) -> np.ndarray:
    """(N, n - 1) which free rollers are there and have an inertia, by which their spins stay."""
    found = np.zeros((bodies.wheels, bodies.rollers - 1), bool)
    for i in range(bodies.wheels):
        found[i, : bodies.of(i).rollers - 1] = bodies.kinds is None or bodies.of(i).roller[1] > 0
    return found


def held_places(bodies: Bodies, model: str) -> list[int]:
    """Of the free rollers that turn with their disks."""
    if model != "free":
        return free_places(bodies)
    of_wheels = [i for i in range(bodies.wheels) if not turning_freely(bodies)[i].any()]
    return [bodies.place(i, j) for i in of_wheels for j in range(1, bodies.of(i).rollers)]


def contacts(bodies: Bodies) -> np.ndarray:
    return np.zeros(bodies.wheels, int) if bodies.contact is None else np.asarray(bodies.contact)


def vehicle_of(bodies: Bodies, roller_inertia: float | None = None) -> Vehicle:
    """Its numbers are entries of the mass matrix of the bodies."""
    mass = mass_matrix(bodies, np.zeros(bodies.size)).real
    axial = bodies.roller[1] if roller_inertia is None else roller_inertia
    kind = {"rows": 2, "row_offset": bodies.row_offset} if bodies.row_offset else {
        "roller_angle": tuple(bodies.roller_angles)}  # fmt: skip
    if bodies.meridian is not None and len(bodies.meridian) == 1:
        kind |= {"meridian_radius": bodies.meridian[0][2]}
    elif bodies.meridian is not None:
        kind |= {"roller_profile": bodies.meridian}
    if bodies.kinds is not None:
        kind |= {"wheel_kinds": [f"of {own.rollers}" for own in bodies.kinds], "kinds": {}}
    for i, own in enumerate(bodies.kinds or ()):
        kind["kinds"][f"of {own.rollers}"] = {
            "wheel_radius": own.wheel_radius, "roller_axis_radius": own.axis_radius, "rollers_per_wheel": own.rollers,
            "roller_inertia": own.roller[1], "wheel_inertia": mass[bodies.place(i), bodies.place(i)],
        }  # fmt: skip
    return Vehicle(
        wheels=bodies.wheels, rollers_per_wheel=bodies.rollers, mass=mass[0, 0], yaw_inertia=mass[2, 2],
        wheel_inertia=mass[bodies.place(0), bodies.place(0)], roller_inertia=axial, platform_radius=0.3,
        wheel_radius=bodies.wheel_radius, roller_axis_radius=bodies.axis_radius, yaw_scale=1.7,
        wheel_angles=tuple(bodies.axles), wheel_places=tuple(map(tuple, bodies.places)),
        center_of_mass=(mass[1, 2] / mass[0, 0], -mass[0, 2] / mass[0, 0]), **kind,
    )  # fmt: skip


def platform_rates(vehicle: Vehicle, nu: np.ndarray) -> np.ndarray:
    """x', y' and the heading's rate, at the heading 0."""
    radius = vehicle.platform_radius
    return np.array([radius * nu[0], radius * nu[1], nu[2] / vehicle.yaw_scale])


def coordinates(bodies: Bodies, chi: np.ndarray) -> np.ndarray:
    q = np.zeros(bodies.size)
    q[[bodies.place(i) for i in range(bodies.wheels)]] = chi
    return q


def own(bodies: Bodies) -> list[int]:
    """The places of what the constraints give: the wheels' angles, then those of the rollers in contact."""
    wheels = range(bodies.wheels)
    return [bodies.place(i) for i in wheels] + [bodies.place(i, 0) for i in wheels]


def free_places(bodies: Bodies) -> list[int]:
    return [bodies.place(i, j) for i in range(bodies.wheels) for j in range(1, bodies.of(i).rollers)]


def rolling_rates(
    bodies: Bodies, vehicle: Vehicle, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray, stands: Sequence[int] = ()
) -> np.ndarray:
    """The rates of all coordinates of a motion without slip; `stands`: wheels that stand on their joints."""
    rates, place = np.zeros(bodies.size), own(bodies)
    rates[:3] = platform_rates(vehicle, nu)
    rates[free_places(bodies)] = np.concatenate([own[: bodies.of(i).rollers - 1] for i, own in enumerate(spins)])
    rows = constraints(bodies, coordinates(bodies, chi), stands).real
    rates[place] = np.linalg.solve(rows[:, place], -rows @ rates)
    return rates
