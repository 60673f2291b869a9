"""Random machines for the oracle, their omniroll.Vehicle, and states of both."""

from dataclasses import dataclass

import numpy as np
from flint import arb
from oracle.balls import exact, working_precision
from oracle.bodies import Solid

import omniroll
from reactions.newton_euler import Acting, Machine, centre_of_mass, energy, position, rolling, solve, total_mass, unit


def solid(mass, axial, transverse):
    return Solid(exact(mass), exact(axial), exact(transverse))


def random_machine(rng, wheels, rollers, *, has_layout=False, is_massless=False, rotor=None, gear=1.0):
    """A small robot. On rays: symmetric, centre of mass on the vertical through S; with a layout: nothing is."""
    radius, wheel_radius = float(rng.uniform(0.1, 0.2)), float(rng.uniform(0.04, 0.08))
    angles = 2 * np.pi * np.arange(wheels) / wheels + rng.uniform(0, 6)
    places = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    centre, sides = np.array([0, 0, rng.uniform(0.5, 2) * wheel_radius]), np.zeros(3)
    if has_layout:
        angles = angles + rng.uniform(-1, 1, wheels)
        places = places + rng.uniform(-0.3, 0.3, (wheels, 2)) * radius
        centre[:2] = rng.uniform(-0.2, 0.2, 2) * radius
        sides = rng.uniform(-2e-3, 2e-3, 3)  # products of inertia
    x, y, z = rng.uniform(0.01, 0.02, 3)
    tensor = ((x, sides[0], sides[1]), (sides[0], y, sides[2]), (sides[1], sides[2], z))
    return Machine(
        platform_mass=float(rng.uniform(1, 3)),
        platform_centre=tuple(centre.tolist()),
        platform_tensor=tensor,
        places=tuple(map(tuple, places.tolist())),
        axle_angles=tuple(angles.tolist()),
        wheel_radius=wheel_radius,
        roller_axis_radius=wheel_radius * np.cos(np.pi / rollers) * float(rng.uniform(0.8, 0.95)),
        rollers_per_wheel=rollers,
        hub=solid(*rng.uniform(0.5, 2, 3) * (0.15, 2e-4, 1e-4)),
        roller=solid(*rng.uniform(0.5, 2, 3) * (0.02, 0 if is_massless else 2e-6, 5e-6)),
        rotor=rotor,
        gear=gear,
    )


def wheel_mass(machine):
    """Of a wheel with its rollers, and the rotor that sits at its centre."""
    rotor = 0 if machine.rotor is None else machine.rotor.mass
    return float(exact(machine.hub.mass) + machine.rollers_per_wheel * exact(machine.roller.mass) + exact(rotor))


def platform_products(machine):
    """Integrals of z x and of z y: the tensor's entries with the other sign."""
    return -machine.platform_tensor[0][2], -machine.platform_tensor[1][2]


@working_precision
def vehicle_of(machine, *, scale=0.15, yaw_scale=1.3, has_layout=False):
    """The omniroll.Vehicle: inertias as kinetic energies of unit speeds."""
    count, n = machine.wheels, machine.rollers_per_wheel
    still = position(machine, 0, [0] * count)
    twice = lambda k: float(2 * energy(machine, still, unit(machine, k)))  # noqa: E731
    places = np.array(machine.places, float)
    layout = {}
    if has_layout:
        layout = {"wheel_places": machine.places, "center_of_mass": [float(c) for c in centre_of_mass(machine)[:2]]}
    else:
        scale = float(np.hypot(*places[0]))
    return omniroll.Vehicle(
        wheels=count,
        rollers_per_wheel=n,
        wheel_angles=machine.axle_angles,
        platform_radius=scale,
        wheel_radius=machine.wheel_radius,
        roller_axis_radius=machine.roller_axis_radius,
        mass=float(total_mass(machine)),
        yaw_inertia=twice(2),
        wheel_inertia=twice(3),
        roller_inertia=twice(3 + count) or 1e-6,  # of massless rollers it has no influence
        yaw_scale=yaw_scale,
        **layout,
    )


@dataclass
class Case:
    """A state of a machine and of its vehicle, and what acts on it."""

    machine: Machine
    vehicle: omniroll.Vehicle
    model: str
    nu: np.ndarray
    chi: np.ndarray
    spins: np.ndarray
    heading: float = 0.7

    @working_precision
    def oracle(self, acting=None, loads=None):
        """What Newton and Euler find; `acting` may be a function of q' that gives an Acting."""
        dq = self.speeds()
        acting = acting(dq) if callable(acting) else acting or Acting()
        q = position(self.machine, self.heading, self.chi)
        return solve(self.machine, q, dq, acting, model=self.model, loads=loads)

    @working_precision
    def speeds(self):
        sin, cos = arb(self.heading).sin(), arb(self.heading).cos()
        along, across = (exact(self.vehicle.platform_radius) * exact(v) for v in self.nu[:2])
        platform = (
            along * cos - across * sin,
            along * sin + across * cos,
            exact(self.nu[2]) / exact(self.vehicle.yaw_scale),
        )
        q = position(self.machine, self.heading, self.chi)
        return rolling(self.machine, q, platform, self.spins if self.model == "free" else None)

    def start(self):
        """Arguments of omniroll.simulate."""
        spins = {"spins": self.spins} if self.model == "free" else {}
        pose = (0, 0, self.heading)
        return {"nu": self.nu, "chi": self.chi, "pose": pose, "roller_model": self.model} | spins


def random_case(rng, wheels, rollers, model, *, has_layout=False, **options):
    machine = random_machine(rng, wheels, rollers, has_layout=has_layout, is_massless=model == "massless", **options)
    chi = rng.uniform(-0.95, 0.95, wheels) * np.pi / rollers
    spins = 5 * rng.normal(size=(wheels, rollers - 1))
    vehicle = vehicle_of(machine, has_layout=has_layout)
    return Case(machine, vehicle, model, 3 * rng.normal(size=3), chi, spins)


def height(machine):
    return float(centre_of_mass(machine)[2])


def contacts(found):
    """(forces (N, 2), loads (N,)) of what the oracle found."""
    values = np.array([[float(v) for v in wheel] for wheel in found.contact])
    return values[:, :2], values[:, 2]
