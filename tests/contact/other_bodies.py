"""Wheels that slip, with rollers of any kind: rigid bodies in all coordinates, with forces on the ground.

The bodies are those of tests/mecanum, which know the velocity of the material point that touches the
ground. Here that point has no constraint but a force, across the roller and along it; a massless roller turns so that
the force across it vanishes, since nothing else acts on it about its axis.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mecanum import all_bodies
from mecanum.vehicles import contacts, coordinates, drawn, free_places, own, platform_rates

from omniroll import Vehicle
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.accelerations import call_named

STEP = 1e-30


def none_stands(count: int) -> dict[str, np.ndarray]:
    """What the kernels take of wheels that stand on their joints, where none does."""
    names = ("next_share", "next_omega", "next_before", "load", "slip_preload")
    return {name: np.zeros(count) for name in names} | {"friction": np.zeros((count, 2))}


def named(bound, name: str, known: dict) -> dict[str, np.ndarray]:
    """What a function gives, by name."""
    outputs = bound.signatures[name].outputs
    return {a.name: np.asarray(v) for a, v in zip(outputs, call_named(bound, name, known), strict=True)}


@dataclass
class Slipping:
    """A state in which wheels slip.

    rates     (size,) of the coordinates q; those of massless rollers follow
    rows      (2 N, size) of q: velocities of the points that touch the ground along axles and across them
    horizon   (N, 2) of q: the directions of the rollers over the ground, by the same components
    inertial  (size,) of rates: what stands beside M q'' in Lagrange's equations
    wheels, contacts, frees  places of the wheels' angles, of the angles of rollers in contact, and of the others
    nu_dot    of accelerations (size,)
    """

    vehicle: Vehicle
    model: str
    nu: np.ndarray
    chi: np.ndarray
    contact: np.ndarray
    q: np.ndarray
    rates: np.ndarray
    mass: np.ndarray
    rows_of: Callable
    horizon: Callable
    inertial_of: Callable
    wheels: list
    contacts: list
    frees: list
    nu_dot: Callable

    def __post_init__(self):
        self.rows, self.frame = self.rows_of(self.q).real, self.frame_of(self.q).real
        if self.model == "massless":
            self.rates[[*self.frees, *self.contacts]] = 0
            pushed = self.rows[:, self.contacts].reshape(self.count, 2, self.count)
            across = np.einsum("ic,ici->i", self.frame[:, 0], pushed)
            self.rates[self.contacts] = -self.slip[:, 0] / across
        moved = self.q + 1j * STEP * self.rates
        self.changed, self.turned = self.rows_of(moved).imag / STEP, self.frame_of(moved).imag / STEP
        self.inertial = self.inertial_of(self.rates)

    def frame_of(self, q):
        """(N, 2, 2) the directions across the rollers and along them, by components along the axle and across it."""
        along = np.array(self.horizon(q))
        along = along / np.sqrt((along**2).sum(axis=1))[:, None]
        return np.stack([np.stack([along[:, 1], -along[:, 0]], axis=1), along], axis=1)

    def slip_rates(self, second):
        """(N, 2) how the slip changes, across the rollers and along them."""
        speeds, changes = self.rows @ self.rates, self.changed @ self.rates + self.rows @ second
        turned = np.einsum("idc,ic->id", self.turned, speeds.reshape(-1, 2))
        return turned + np.einsum("idc,ic->id", self.frame, changes.reshape(-1, 2))

    @property
    def count(self):
        return len(self.wheels)

    @property
    def slip(self):
        """(N, 2) across the rollers and along them."""
        return np.einsum("idc,ic->id", self.frame, (self.rows @ self.rates).reshape(-1, 2))

    @property
    def in_frame(self):
        """(2 N, size) the rows across the rollers and along them."""
        return np.einsum("idc,icq->idq", self.frame, self.rows.reshape(self.count, 2, -1)).reshape(2 * self.count, -1)

    def moved(self, force, torque, sticks=None):
        """Accelerations (size,) under forces (N, 2), and those (N, 2) of contacts that stick, which have none given."""
        given = self.in_frame.T @ force.ravel() - self.inertial
        given[self.wheels] += torque
        sticks = np.zeros(self.count, bool) if sticks is None else sticks
        held = self.rows[np.repeat(sticks, 2)]
        drift = self.changed[np.repeat(sticks, 2)] @ self.rates
        if self.model == "massless":  # rollers have no equation of their own: along them alone the ground acts
            kept = np.setdiff1d(np.arange(len(given)), [*self.contacts, *self.frees])
            mixed = np.einsum("id,idq->iq", self.frame[:, 1], self.rows.reshape(self.count, 2, -1))[sticks]
            drift = np.einsum("id,id->i", self.frame[:, 1], (self.changed @ self.rates).reshape(-1, 2))[sticks]
            held = mixed
        else:
            kept = np.arange(len(given))
        count = len(held)
        whole = np.block([[self.mass[np.ix_(kept, kept)], -held[:, kept].T], [held[:, kept], np.zeros((count, count))]])
        found = np.linalg.solve(whole, np.append(given[kept], -drift))
        second = np.zeros(len(given))
        second[kept] = found[: len(kept)]
        forces = np.zeros((self.count, 2))
        if self.model == "massless":
            forces[sticks, 1] = found[len(kept) :]
        else:
            forces[sticks] = np.einsum("idc,ic->id", self.frame[sticks], found[len(kept) :].reshape(-1, 2))
        return second, forces

    def known(self):
        """What the kernels take, by name."""
        axial = self.axial()
        known = {"nu": self.nu, "chi": self.chi, "rates": self.rates[self.wheels], "contact_omega": axial[:, 0]}
        known |= {"momenta": self.bound().momenta(axial[:, 1:]) if self.model == "free" else None}
        return known | none_stands(self.count)

    def axial(self):
        """(N, n) absolute axial speeds, the roller in contact first."""
        n = self.vehicle.rollers_per_wheel
        psi, yaw = np.broadcast_to(self.vehicle.roller_angle, self.count)[:, None], self.nu[2] / self.vehicle.yaw_scale
        beta = self.chi[:, None] + 2 * np.pi * np.arange(n) / n
        carried = np.cos(psi) * np.sin(beta) * yaw + np.sin(psi) * self.rates[self.wheels][:, None]
        spins = np.append(self.rates[self.contacts][:, None], self.rates[self.frees].reshape(-1, n - 1), axis=1)
        return spins + carried

    def bound(self, effects=(), **constants):
        numbers = tuple((name, value) for name, value in constants.items())
        found = kernel(self.vehicle, self.model, "python", effects=("drive", *effects), constants=numbers)
        return kernel_in_phase(found, Carry(self.contact, np.zeros_like(self.contact)))


def slipping(kind, seed, wheels, rollers, model):
    """A random vehicle whose rollers stand at angles or in two rows, all of whose wheels slip."""
    draw = np.random.default_rng(seed)
    bodies, vehicle, nu, chi, _ = drawn(kind, seed, wheels, rollers, model)
    q, rates = coordinates(bodies, chi), draw.normal(size=bodies.size) * 10
    rates[:3] = platform_rates(vehicle, nu)

    def horizon(q):
        found = []
        for wheel in range(wheels):
            axle, across, _ = all_bodies._frame(bodies, q, wheel)
            axis, _ = all_bodies._roller(bodies, q, wheel, 0)
            found.append([axle @ axis, across @ axis])
        return found

    def nu_dot(second):
        turned = second[:3] - [-rates[1] * rates[2], rates[0] * rates[2], 0]
        radius = vehicle.platform_radius
        return turned * [1 / radius, 1 / radius, vehicle.yaw_scale]

    places = own(bodies)
    return Slipping(
        vehicle, model, nu, chi, contacts(bodies), q, rates, all_bodies.mass_matrix(bodies, q).real,
        lambda q: all_bodies.constraints(bodies, q), horizon, lambda rates: all_bodies.inertial_force(bodies, q, rates),
        places[:wheels], places[wheels:], free_places(bodies), nu_dot,
    )  # fmt: skip
