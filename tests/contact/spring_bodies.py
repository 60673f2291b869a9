"""A vehicle on springs as rigid bodies: platform, hubs and every roller by itself, in all coordinates.

The judge of maxima/effects/contact_springs.mac, with which it shares nothing. Each body has a velocity and a turning
rate that are linear in the rates of the coordinates; the kinetic energy is their sum, and Lagrange's equations follow
from it by complex steps. Coordinates: x, y, theta, tilt along the ground's x and y, heave of the centre of mass, the
wheels' angles, the rollers' angles on their disks.
"""

from dataclasses import dataclass

import numpy as np

STEP = 1e-40  # of a complex step, whose square is nothing beside it
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Revolution:
    """A body of revolution: mass, inertia about its axis and across it."""

    mass: float
    axial: float
    transverse: float


@dataclass(frozen=True)
class Bodies:
    """places (N, 2) of the wheels, angles (N,) of the axles; the platform's place above the ground, and its inertia."""

    places: np.ndarray
    angles: np.ndarray
    rollers: int
    wheel_radius: float
    roller_axis_radius: float
    hub: Revolution
    roller: Revolution
    platform_mass: float
    platform_place: np.ndarray
    platform_inertia: np.ndarray

    @property
    def wheels(self) -> int:
        return len(self.angles)

    @property
    def size(self) -> int:
        return 6 + self.wheels * (1 + self.rollers)

    @property
    def mass(self) -> float:
        return self.platform_mass + self.wheels * (self.hub.mass + self.rollers * self.roller.mass)

    @property
    def center(self) -> np.ndarray:
        """Of the whole, its height above the ground last."""
        each = self.hub.mass + self.rollers * self.roller.mass
        of_wheels = each * np.append(self.places.sum(axis=0), self.wheels * self.wheel_radius)
        return (self.platform_mass * self.platform_place + of_wheels) / self.mass

    # Motion: matrices that give velocities in the platform's axes from the rates of the coordinates

    def _rates(self, q):
        """Of S, of the turning and of the heave at the centre of mass: each (3, size)."""
        c, s = np.cos(q[2]), np.sin(q[2])
        velocity, turning = np.zeros((3, self.size), complex), np.zeros((3, self.size), complex)
        velocity[0, :2] = turning[0, 3:5] = c, s
        velocity[1, :2] = turning[1, 3:5] = -s, c
        turning[2, 2] = 1
        return velocity, turning

    def _velocity(self, q, place):
        """Of a point of the platform, its place from the ground point under S."""
        velocity, turning = self._rates(q)
        beside = np.array([*(place[:2] - self.center[:2]), 0.0])
        found = velocity + across(turning, place)
        found[2] = across(turning * np.array([[1], [1], [0]]), beside)[2]
        found[2, 5] += 1
        return found

    def _wheel(self, i):
        axle = np.array([np.cos(self.angles[i]), np.sin(self.angles[i]), 0.0])
        return axle, np.cross(UP, axle), np.append(self.places[i], self.wheel_radius)

    def _roller(self, q, i, j):
        """Its axis, and its middle from the wheel's centre."""
        _, along, _ = self._wheel(i)
        beta = q[6 + i] + 2 * np.pi * j / self.rollers
        axis = np.cos(beta) * along + np.sin(beta) * UP
        return axis, -self.roller_axis_radius * (-np.sin(beta) * along + np.cos(beta) * UP)

    def _place_of_roller(self, i, j):
        return 6 + self.wheels + i * self.rollers + j

    def matrix(self, q):
        """Of the kinetic energy in the rates of the coordinates."""
        q = np.asarray(q, complex)
        _, turning = self._rates(q)
        velocity = self._velocity(q, self.platform_place)
        found = self.platform_mass * velocity.T @ velocity + turning.T @ self.platform_inertia @ turning
        for i in range(self.wheels):
            axle, _, center = self._wheel(i)
            disk = turning.copy()
            disk[:, 6 + i] += axle
            velocity = self._velocity(q, center)
            found = found + energy_of(self.hub, velocity, disk, axle)
            for j in range(self.rollers):
                axis, middle = self._roller(q, i, j)
                spin = disk.copy()
                spin[:, self._place_of_roller(i, j)] += axis
                # height and place of the middle move with the disk; the tilt carries it along
                own = velocity + across(disk, middle)
                found = found + energy_of(self.roller, own, spin, axis)
        return found

    def slip_rows(self, q):
        """(N, 2, size) the velocities of the contact points on the ground, along axles and rolling directions."""
        found = np.zeros((self.wheels, 2, self.size))
        for i in range(self.wheels):
            axle, along, center = self._wheel(i)
            axis, middle = self._roller(q, i, 0)
            down = np.array([0.0, 0.0, -self.wheel_radius])
            velocity = self._velocity(np.asarray(q, complex), center + down)
            velocity[:, 6 + i] += np.cross(axle, down)
            velocity[:, self._place_of_roller(i, 0)] += np.cross(axis, down - middle)
            found[i] = (np.stack([axle, along]) @ velocity).real
        return found

    def rises(self, q):
        """(N,) how far the platform is above where it stands, over the contacts."""
        c, s = np.cos(q[2]), np.sin(q[2])
        beside = self.places - self.center[:2]
        placed = np.stack([c * beside[:, 0] - s * beside[:, 1], s * beside[:, 0] + c * beside[:, 1]], axis=-1)
        return q[5] + q[3] * placed[:, 1] - q[4] * placed[:, 0]

    def potential(self, q, gravity):
        """gravity (3,) in the plane's axes, the last downwards: of the weight, which the tilt moves and lowers."""
        c, s = np.cos(q[2]), np.sin(q[2])
        x, y, height = self.center
        foot = np.array([q[0] + c * x - s * y + height * q[4], q[1] + s * x + c * y - height * q[3]])
        rise = q[5] - height * (q[3] ** 2 + q[4] ** 2) / 2
        return self.mass * (gravity[2] * rise - gravity[:2] @ foot)

    def accelerations(self, q, rates, forces, loads, torques, gravity, known=None):
        """(known,) of the coordinates; forces (N, 2) of the ground, loads (N,), torques (N,) at the axles.

        known  so many coordinates, the first ones: those of rollers without inertia are none
        """
        along_motion = self.matrix(q + 1j * STEP * rates).imag / STEP @ rates
        kinetic = gradient(lambda at: rates @ self.matrix(at) @ rates / 2, q)
        given = -gradient(lambda at: self.potential(at, gravity), q) + kinetic - along_motion
        given += np.einsum("ik,ikq->q", forces, self.slip_rows(q)) + loads @ jacobian(self.rises, q)
        given[6 : 6 + self.wheels] += torques
        return np.linalg.solve(self.matrix(q).real[:known, :known], given[:known])


def across(turning, place):
    """The velocity (3, size) that a turning (3, size) gives a place (3,)."""
    return np.cross(turning, np.asarray(place), axisa=0, axisb=0, axisc=0)


def energy_of(body, velocity, spin, axis):
    about = axis @ spin
    turns = body.transverse * (spin.T @ spin - np.outer(about, about)) + body.axial * np.outer(about, about)
    return body.mass * velocity.T @ velocity + turns


def gradient(function, q):
    return jacobian(lambda at: np.atleast_1d(function(at)), q)[0]


def jacobian(function, q):
    steps = 1j * STEP * np.eye(len(q))
    return np.stack([function(q + step).imag / STEP for step in steps], axis=-1)
