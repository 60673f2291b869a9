"""A state of a vehicle as rigid bodies in all coordinates (tests/mecanum/all_bodies.py), and what forces do to it.

The bodies know no modes, no laws and no constraints: they are given every force of the ground, every load and every
torque of a bearing, and answer with accelerations. What rolls, sticks or stands has to follow from the right forces.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from mecanum import all_bodies
from mecanum.all_bodies import Bodies, of_platform, turning_of_platform
from mecanum.vehicles import KINDS, contacts, free_places, own, vehicle_of

from omniroll import Vehicle
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.accelerations import call_named

CLOSE = 1e-10
STEP = 1e-30


def none_stands(count: int) -> dict[str, np.ndarray]:
    """What the kernels take of wheels that stand on their joints, where none does."""
    names = ("next_share", "next_omega", "next_before", "load", "slip_preload")
    return {name: np.zeros(count) for name in names} | {"friction": np.zeros((count, 2))}


def named(bound, name: str, known: dict) -> dict[str, np.ndarray]:
    """What a function gives, by name."""
    found, outputs = call_named(bound, name, known), bound.signatures[name].outputs
    found = found if isinstance(found, tuple) else (found,)
    return {a.name: np.asarray(v) for a, v in zip(outputs, found, strict=True)}


def across(vector):
    """A level vector (2, ...) turned back by a right angle."""
    return np.array([vector[1], -vector[0]])


def in_platform(q, vector):
    """(2, ...) components along the platform's axes of a level vector in fixed ones."""
    cosine, sine = np.cos(q[2]), np.sin(q[2])
    return np.array([cosine * vector[0] + sine * vector[1], cosine * vector[1] - sine * vector[0]])


@dataclass
class Moving:
    """q and rates (size,) of all coordinates; wheels, contacts, frees: places in q of the wheels' angles, of those of
    the rollers in contact, and of the other rollers."""

    bodies: Bodies
    vehicle: Vehicle
    model: str
    q: np.ndarray
    rates: np.ndarray

    def __post_init__(self):
        places = own(self.bodies)
        self.count = self.bodies.wheels
        self.wheels, self.contacts, self.frees = places[: self.count], places[self.count :], free_places(self.bodies)
        without = {"free": [], "locked": self.frees, "massless": [*self.frees, *self.contacts]}[self.model]
        self.kept = np.setdiff1d(np.arange(self.bodies.size), without)  # rollers without inertia have no equation
        self.mass = all_bodies.mass_matrix(self.bodies, self.q).real

    # ---- functions of q and rates ----

    def rows(self, q):
        """(N, 2, size) of the velocities of the points that touch the ground, across the rollers' axes and along
        them."""
        velocity, found = all_bodies.constraints(self.bodies, q), []
        for i in range(self.count):
            axle, beside, _ = all_bodies._frame(self.bodies, q, i)
            axis, _ = all_bodies._roller(self.bodies, q, i, 0)
            along = np.array([axle @ axis, beside @ axis])
            along = along / np.sqrt(along @ along)
            found.append(np.array([across(along), along]) @ velocity[2 * i : 2 * i + 2])
        return np.array(found)

    def slip(self, q, rates):
        return self.rows(q) @ rates

    def nu(self, q, rates):
        radius = self.vehicle.platform_radius
        return np.array([*in_platform(q, rates[:2]) / radius, self.vehicle.yaw_scale * rates[2]])

    def axial(self, q, rates):
        """(N, n) absolute speeds of the rollers about their axes, that in contact first."""
        found = []
        for i in range(self.count):
            axle, _, _ = all_bodies._frame(self.bodies, q, i)
            disk = turning_of_platform(self.bodies) @ rates + axle * rates[self.wheels[i]]
            for j in range(self.bodies.rollers):
                axis, _ = all_bodies._roller(self.bodies, q, i, j)
                found.append(axis @ disk + rates[self.bodies.place(i, j)])
        return np.array(found).reshape(self.count, -1)

    def tilt_rate(self, q, rates):
        """Of the heave, and of the tilt by its components along the platform's axes."""
        tilt = in_platform(q, q[-2:])
        return np.array([rates[-3], *in_platform(q, rates[-2:]) + rates[2] * across(tilt)])

    def change(self, function: Callable, second: np.ndarray) -> np.ndarray:
        """The rate of such a function under accelerations."""
        return function(self.q + 1j * STEP * self.rates, self.rates + 1j * STEP * second).imag / STEP

    # ---- forces and accelerations ----

    def second(self, force, torque=0, of_rollers=0, loads=0, gravity=(0, 0, 0)):
        """Accelerations (size,), and how large each would be by one of the forces alone.

        force (N, 2) of the ground, across the rollers' axes and along them; torque (N,) on the wheels, of_rollers
        (N, n) on the rollers, about their axes; loads (N,), gravity (3,) in the fixed axes, the last downwards: where
        the platform tilts
        """
        parts = np.zeros((5, self.bodies.size))
        parts[0] = -all_bodies.inertial_force(self.bodies, self.q, self.rates)
        parts[1] = np.einsum("id,idq->q", force, self.rows(self.q).real)
        parts[2, self.wheels] += torque
        rollers = [self.bodies.place(i, j) for i in range(self.count) for j in range(self.bodies.rollers)]
        parts[2, rollers] += np.ravel(of_rollers)
        parts[3] = self.weight(np.array(gravity))
        if self.bodies.tilts:
            parts[4] = [loads @ all_bodies.along_motion(self.rises, self.q, unit) for unit in np.eye(self.bodies.size)]
        if self.model == "massless":  # the bearing passes on what the ground does
            passed = parts[1:3, self.contacts].sum(axis=0)
            assert np.abs(passed).max() <= CLOSE * self.vehicle.wheel_radius * np.abs(force).max()
        kept, found = np.ix_(self.kept, self.kept), np.zeros((2, self.bodies.size))
        found[0, self.kept] = np.linalg.solve(self.mass[kept], parts.sum(axis=0)[self.kept])
        found[1, self.kept] = np.abs(np.linalg.solve(self.mass[kept], parts[:, self.kept].T)).sum(axis=1)
        return found

    def weight(self, gravity):
        x, y, height = self.bodies.center
        heading = all_bodies._heading(self.q).real
        force = self.bodies.mass * gravity[:2] @ of_platform(self.bodies, self.q, heading @ [x, y, height])[:2].real
        if self.bodies.tilts:
            force[-3] -= self.bodies.mass * gravity[2]
            force[-2:] += self.bodies.mass * gravity[2] * height * self.q[-2:]
        return force

    def rises(self, q):
        """(N,) how far the platform is above where it stands, over the contacts."""
        places = [all_bodies._heading(q) @ [*place, 0] for place in self.bodies.places]
        return np.array([of_platform(self.bodies, q, place)[2, -3:] @ q[-3:] for place in places])

    def assert_moves(self, found: dict, second: np.ndarray, size: np.ndarray, rests=(), sticks=()) -> None:
        """Accelerations by name are those of the bodies, and what rests stays at rest: coordinates, and contacts,
        which are bools by wheel."""
        reach = self.vehicle.wheel_radius * (size[self.wheels].max() + size[self.contacts].max()) + size[:3].max()
        slip_dot = self.change(self.slip, second)
        if self.model == "massless":  # they do not slip across their axes but by their bearings
            slip_dot[:, 0] = 0
        of_rollers = self.contacts + self.frees
        wanted = {
            "nu_dot": (self.change(self.nu, second), size[:3].max() / self.vehicle.platform_radius),
            "rates_dot": (second[self.wheels], size[self.wheels].max()), "slip_dot": (slip_dot, reach),
        }  # fmt: skip
        if self.model == "free":
            axial, most = self.change(self.axial, second), size[of_rollers].max()
            wanted |= {"contact_omega_dot": (axial[:, 0], most), "axial_dot": (axial[:, 1:], most)}
            wanted |= {"contact_spin_dot": (second[self.contacts], most)}
            wanted |= {"spins_dot": (second[self.frees].reshape(self.count, -1), most)}
        if self.bodies.tilts:
            wanted["tilt_rate_dot"] = self.change(self.tilt_rate, second), size[-3:].max()
        for name in found.keys() & wanted.keys():
            value, most = wanted[name]
            own = found[name] * [0, 1] if name == "slip_dot" and self.model == "massless" else found[name]
            assert np.abs(own - value).max() <= CLOSE * most, name
        for place in rests:
            assert abs(second[place]) <= CLOSE * size[place]
        assert np.abs(slip_dot[list(sticks)]).max(initial=0.0) <= CLOSE * reach

    # ---- what the package takes ----

    def known(self):
        """What kernels' functions take of the state, by name."""
        chi, axial = self.q[self.wheels], self.axial(self.q, self.rates).real
        known = {"nu": self.nu(self.q, self.rates), "chi": chi, "rates": self.rates[self.wheels], "heading": self.q[2]}
        if self.model == "free":
            known |= {"contact_omega": axial[:, 0], "axial": axial[:, 1:]}
            known |= {"momenta": self.bound().momenta(axial[:, 1:])}
            known |= {"spins": self.rates[self.frees].reshape(self.count, -1)}
        if self.bodies.tilts:
            known |= {"tilt": np.array([self.q[-3], *in_platform(self.q, self.q[-2:])])}
            known |= {"tilt_rate": self.tilt_rate(self.q, self.rates)}
        return known | none_stands(self.count)

    def bound(self, effects=(), **constants):
        numbers = tuple(constants.items())
        found = kernel(self.vehicle, self.model, "python", effects=("drive", *effects), constants=numbers)
        return kernel_in_phase(found, Carry(contacts(self.bodies), np.zeros(self.count, int)))

    def at_rest(self, rows):
        """The state whose rates have nothing along these rows (K, size)."""
        rows = np.reshape(rows, (-1, self.bodies.size))
        return replace(self, rates=self.rates - np.linalg.pinv(rows) @ (rows @ self.rates)) if len(rows) else self

    def rolling(self, which=None):
        """The state in which wheels `which` (N,) bool, or all, roll without slip."""
        which = np.arange(self.count) if which is None else np.flatnonzero(which)
        places = [place for i in which for place in (self.wheels[i], self.contacts[i])]
        held, rates = self.rows(self.q).real[which].reshape(len(places), self.bodies.size), self.rates.copy()
        rates[places] = 0
        rates[places] = np.linalg.solve(held[:, places], -held @ rates) if places else []
        return replace(self, rates=rates)


def moving(kind, seed, wheels, rollers, model, tilts=False) -> Moving:
    """A random vehicle of a kind of wheels, all of whose wheels slip; massless rollers across their axes do not."""
    draw = np.random.default_rng([seed, 77])
    bodies = KINDS[kind](seed, wheels, rollers, model == "massless")
    inertia = draw.uniform(-0.02, 0.02, (3, 3))
    tensor = np.diag([0.2, 0.3, 0.35]) + inertia + inertia.T
    bodies = replace(bodies, platform=(5.0, (*draw.uniform(-0.03, 0.03, 2), 0.12), tensor), tilts=tilts)
    if tilts:  # it stands
        rays = 2 * np.pi * np.arange(wheels) / wheels + draw.uniform(0, 0.5, wheels)
        bodies = replace(bodies, places=draw.uniform(0.2, 0.3, (wheels, 1)) * np.stack([np.cos(rays), np.sin(rays)], 1))
    q, rates = np.zeros(bodies.size), draw.normal(size=bodies.size) * 10
    q[[bodies.place(i) for i in range(wheels)]] = draw.uniform(-1, 1, wheels) * np.pi / bodies.rollers
    q[2], rates[:3] = draw.normal(), draw.normal(size=3)
    found = Moving(bodies, vehicle_of(bodies, 1e-6 if model == "massless" else None), model, q, rates)
    if tilts:
        q[-3:], rates[-3:] = draw.normal(size=3) * [5e-4, 3e-3, 3e-3], draw.normal(size=3) * [0.02, 0.3, 0.3]
    if model != "free":
        rates[found.frees] = 0
    if model == "massless":
        rates[found.contacts] = 0
        rows = found.rows(q).real[:, 0]
        rates[found.contacts] = np.linalg.solve(rows[:, found.contacts], -rows @ rates)
    return found
