"""Vehicles with wheels of several kinds: as bodies (mecanum/all_bodies.py) and as Vehicle, with states of both."""

from dataclasses import dataclass, replace

import numpy as np

from omniroll import Vehicle
from tests.mecanum.all_bodies import Bodies, mass_matrix


@dataclass(frozen=True)
class BodiesOfKinds(Bodies):
    """kinds: the numbers of each wheel, those of another one of Bodies."""

    kinds: tuple[Bodies, ...] = ()

    @property
    def size(self) -> int:
        return 3 + sum(1 + kind.rollers for kind in self.kinds)

    def of(self, wheel: int) -> Bodies:
        return self.kinds[wheel]

    def place(self, wheel: int, roller: int = -1) -> int:
        return 3 + sum(1 + kind.rollers for kind in self.kinds[:wheel]) + 1 + roller


def random_bodies(seed: int, counts: tuple[int, ...], model: str, slanted: bool) -> BodiesOfKinds:
    """counts: rollers of each wheel; wheels of one count are of one kind."""
    draw, wheels = np.random.default_rng(seed), len(counts)
    angles = draw.uniform(0.3, 1.1, wheels) * draw.choice([-1, 1], wheels) * slanted
    angles[seed % wheels] = 0.0
    whole = BodiesOfKinds(
        draw.uniform(-0.4, 0.4, (wheels, 2)), draw.uniform(-np.pi, np.pi, wheels), angles, max(counts), 0.1, 0.05
    )
    kinds = {}
    for count in sorted(set(counts)):
        radius, part = draw.uniform(0.04, 0.1), draw.uniform(0.6, 0.9)
        axial = 0.0 if model == "massless" or (not kinds and model != "locked") else draw.uniform(1e-6, 5e-6)
        kinds[count] = replace(
            whole, rollers=count, wheel_radius=radius, axis_radius=radius * part * np.cos(np.pi / count),
            hub=(0.4, draw.uniform(6e-4, 2e-3), 5e-4), roller=(0.03, axial, 4e-6),
        )  # fmt: skip
    return replace(whole, kinds=tuple(kinds[count] for count in counts))


def vehicle_of(bodies: BodiesOfKinds) -> Vehicle:
    """Its numbers are entries of the mass matrix of the bodies."""
    mass = mass_matrix(bodies, np.zeros(bodies.size)).real
    kinds = {
        f"of {kind.rollers}": {
            "wheel_radius": kind.wheel_radius, "roller_axis_radius": kind.axis_radius,
            "rollers_per_wheel": kind.rollers, "roller_inertia": kind.roller[1],
            "wheel_inertia": mass[bodies.place(i), bodies.place(i)],
        }
        for i, kind in enumerate(bodies.kinds)
    }  # fmt: skip
    return Vehicle(
        wheels=bodies.wheels, rollers_per_wheel=bodies.rollers, mass=mass[0, 0], yaw_inertia=mass[2, 2],
        wheel_inertia=1e-3, roller_inertia=1e-6, platform_radius=0.3, wheel_radius=0.1, roller_axis_radius=0.05,
        yaw_scale=1.7,
        wheel_angles=tuple(bodies.axles), wheel_places=tuple(map(tuple, bodies.places)),
        center_of_mass=(mass[1, 2] / mass[0, 0], -mass[0, 2] / mass[0, 0]), roller_angle=tuple(bodies.roller_angles),
        kinds=kinds, wheel_kinds=[f"of {kind.rollers}" for kind in bodies.kinds],
    )  # fmt: skip
