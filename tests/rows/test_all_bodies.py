"""Wheels with two rows of rollers against all bodies in all coordinates."""

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from rows.all_bodies import Bodies
from rows.reversals import MODELS

CLOSE = 1e-10  # of the largest number


class Subject:
    """A random vehicle as bodies and by its numbers, in a random state."""

    def __init__(self, seed, model, wheels=None):
        random = np.random.default_rng(seed)
        self.model, count, n = model, wheels or int(random.integers(3, 7)), 2 * int(random.integers(2, 6))
        radius, self.scale = random.uniform(0.1, 0.4), random.uniform(0.5, 2)
        wheel_radius = random.uniform(0.02, 0.08)
        angles = 2 * np.pi * np.arange(count) / count + random.normal(0, 0.2, count)
        offset, heavy = random.choice((1, -1)) * wheel_radius * random.uniform(0.1, 0.8), model != "massless"
        roller = random.uniform(0.5, 2, 3) * [0.05, 2e-5, 3e-5] if heavy else np.array([0.05, 0.0, 0.0])
        self.bodies = Bodies(
            places=radius * random.normal(0, 1, (count, 2)),
            angles=angles,
            rows=offset * np.where(np.arange(n) % 2, -1, 1),
            wheel_radius=wheel_radius,
            axis_radius=wheel_radius * np.cos(np.pi / n) * random.uniform(0.6, 0.9),
            platform=(random.uniform(2, 8), random.uniform(0.02, 0.1)),
            center=tuple(random.normal(0, 0.1, 2)),
            hub=tuple(random.uniform(0.5, 2, 3) * [0.3, 1e-3, 6e-4]),
            roller=tuple(roller),
        )
        b = self.bodies
        self.q = random.normal(0, 1, b.size)
        self.q[3 : 3 + count] = random.uniform(-0.9, 0.9, count) * np.pi / n
        self.contact = random.integers(0, n, count)
        self.turned = self.q.copy()  # as the bodies have it: with the roller in contact below
        self.turned[3 : 3 + count] -= 2 * np.pi * self.contact / n
        self.nu, self.radius = random.normal(0, 3, 3), radius
        self.torque, self.random = random.normal(0, 0.5, count), random
        mass = b.mass(np.zeros(b.size))
        self.vehicle = omniroll.Vehicle(
            wheels=count, rollers_per_wheel=n, rows=2, row_offset=offset, wheel_angles=tuple(angles),
            wheel_places=tuple(map(tuple, b.places)), center_of_mass=tuple(mass[:2, 2][::-1] * [1, -1] / mass[0, 0]),
            platform_radius=radius, wheel_radius=wheel_radius, roller_axis_radius=b.axis_radius,
            mass=mass[0, 0], yaw_inertia=mass[2, 2], wheel_inertia=mass[3, 3],
            roller_inertia=b.roller[1] if heavy else 1e-9, yaw_scale=self.scale,
        )  # fmt: skip

    def kernel(self, pivots=None, contact=None):
        pivots = np.zeros(self.vehicle.wheels, int) if pivots is None else pivots
        bound = kernel(self.vehicle, self.model, "python", effects=("drive",))
        return kernel_in_phase(bound, Carry(self.contact if contact is None else contact, pivots))

    @property
    def chi(self):
        return self.q[3 : 3 + self.vehicle.wheels]

    def spins(self):
        """(N, n) of all rollers: random where they are free; those in contact follow."""
        spins = np.zeros((self.vehicle.wheels, self.vehicle.rollers_per_wheel))
        return self.random.normal(0, 3, spins.shape) if self.model == "free" else spins

    def by_place(self, spins, contact=None):
        """(N, n-1) of the rollers j = 2..n."""
        contact = self.contact if contact is None else contact
        n = self.vehicle.rollers_per_wheel
        return np.array([np.roll(own, -c)[1:] for own, c in zip(spins, contact, strict=True)]).reshape(-1, n - 1)

    def rolling(self, spins, pivots=None):
        return self.bodies.rolling(self.turned, self.contact, self.nu, spins, self.radius, self.scale, pivots)

    def nu_dot(self, q_ddot):
        """Of accelerations in all coordinates."""
        c, s, yaw = np.cos(self.q[2]), np.sin(self.q[2]), self.nu[2] / self.scale
        along, across = c * q_ddot[0] + s * q_ddot[1], c * q_ddot[1] - s * q_ddot[0]
        found = [along / self.radius + yaw * self.nu[1], across / self.radius - yaw * self.nu[0]]
        return np.array([*found, self.scale * q_ddot[2]])

    def nu_of(self, qdot):
        c, s = np.cos(self.q[2]), np.sin(self.q[2])
        along, across = c * qdot[0] + s * qdot[1], c * qdot[1] - s * qdot[0]
        return np.array([along / self.radius, across / self.radius, self.scale * qdot[2]])

    def inputs(self, spins, bound, qdot):
        """What forward_dynamics takes beside nu and chi."""
        if self.model != "free":
            return (self.torque,)
        free = self.by_place(qdot[3 + self.vehicle.wheels :].reshape(spins.shape))
        return bound.momenta(bound.axial_speeds(self.nu, self.chi, free)), self.torque


def assert_close(found, wanted, beside=0.0):
    assert np.abs(found - wanted).max() <= CLOSE * max(np.abs(wanted).max(), beside)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(4))
def test_a_phase_is_that_of_all_bodies(model, seed):
    subject = Subject(seed, model, wheels=3 + seed)
    spins, bound, locked = subject.spins(), subject.kernel(), model != "free"
    qdot = subject.rolling(spins)
    assert_close(bound.wheel_speeds(subject.nu), qdot[3 : 3 + subject.vehicle.wheels])
    wanted = subject.nu_dot(subject.bodies.accelerations(subject.turned, qdot, subject.contact, subject.torque, locked))
    found = bound.forward_dynamics(subject.nu, subject.chi, *subject.inputs(spins, bound, qdot))
    assert_close(found, wanted)
    free = (subject.by_place(qdot[3 + subject.vehicle.wheels :].reshape(spins.shape)),) * (model == "free")
    assert_close(bound.energy(subject.nu, subject.chi, *free), subject.bodies.energy(subject.turned, qdot))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(4))
def test_a_wheel_that_stands_is_that_of_all_bodies(model, seed):
    subject = Subject(10 + seed, model, wheels=3 + seed)
    pivots = np.arange(subject.vehicle.wheels) < 1 + seed % 2
    spins, bound, locked = subject.spins(), subject.kernel(pivots), model != "free"
    qdot = subject.rolling(spins, pivots)
    assert not bound.wheel_speeds(subject.nu)[pivots].any()
    wanted = subject.bodies.standing_accelerations(
        subject.turned, qdot, subject.contact, pivots, subject.torque, locked
    )
    found = bound.forward_dynamics(subject.nu, subject.chi, *subject.inputs(spins, bound, qdot))
    assert_close(found, subject.nu_dot(wanted))
    free = (subject.by_place(qdot[3 + subject.vehicle.wheels :].reshape(spins.shape)),) * (model == "free")
    assert_close(bound.energy(subject.nu, subject.chi, *free), subject.bodies.energy(subject.turned, qdot))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("what", ["passes on", "stops", "goes on"])
@pytest.mark.parametrize("seed", range(3))
def test_an_impact_is_that_of_all_bodies(model, what, seed):
    """One wheel passes on to its neighbour, stops at its joint, or goes on from there."""
    subject = Subject(20 + seed, model, wheels=3 + seed)
    n, count, locked = subject.vehicle.rollers_per_wheel, subject.vehicle.wheels, model != "free"
    spins, one = subject.spins(), np.arange(count) == seed
    subject.q[3 + seed] = np.pi / n
    subject.turned[3 + seed] = np.pi / n - 2 * np.pi * subject.contact[seed] / n
    was, stands = one & (what == "goes on"), one & (what == "stops")
    after = np.where(one & (what == "passes on"), (subject.contact - 1) % n, subject.contact)
    chi = np.where(one & (what == "passes on"), -subject.chi, subject.chi)
    before = subject.rolling(spins, was)
    wanted = subject.bodies.after_impact(subject.turned, before, after, stands, locked)
    bound, later = subject.kernel(was), subject.kernel(stands, after)
    excess = bound.wheel_speeds(subject.nu) - later.wheel_speeds(subject.nu)
    if model == "massless":
        found = later.call("impact", subject.nu, excess)
    else:
        phi = before[3 + count :].reshape(count, n)
        demanded = later.wheel_rates(subject.nu, chi)[1]
        entering = np.where(after != subject.contact, phi[np.arange(count), after] - demanded, 0)
        leaving = np.where(after != subject.contact, phi[np.arange(count), subject.contact], 0) * locked
        found = later.call("impact", subject.nu, chi, entering, leaving, excess)
    assert_close(found, subject.nu_of(wanted), beside=np.abs(subject.nu).max())
    assert (np.abs(found - subject.nu).max() > 1e-6) == (what != "stops")  # it loses its energy, and nu stays
    lost = before - wanted
    loss = subject.bodies.energy(subject.turned, before) - subject.bodies.energy(subject.turned, wanted)
    assert abs(loss - subject.bodies.energy(subject.turned, lost)) <= 1e-13 * subject.bodies.energy(
        subject.turned, before
    )
