"""A vehicle with two rows of rollers as rigid bodies, in all coordinates, by Lagrange's equations with multipliers.

q = (x, y, theta, chi_1 ... chi_N, phi_11 ... phi_Nn). A body has a Jacobian of its centre and of its angular velocity;
the ground holds the point of the roller in contact that is below its wheel's centre, or where that wheel stands on its
joint, the point across the axle between both rows that has no speed (across), and its roller (along). Nothing of the
derivation is used. Derivatives of the mass matrix are those of its complex steps.
"""

from dataclasses import dataclass

import numpy as np

STEP = 1e-30


@dataclass(frozen=True)
class Bodies:
    """A platform, N wheels of n rollers, and their places.

    rows  (n,) how far outward of its wheel's middle each roller stands
    """

    places: np.ndarray
    angles: np.ndarray
    rows: np.ndarray
    wheel_radius: float
    axis_radius: float
    platform: tuple[float, float]  # mass, yaw inertia
    center: tuple[float, float]  # of the platform's mass
    hub: tuple[float, float, float]  # mass, axial and transverse inertia
    roller: tuple[float, float, float]

    @property
    def wheels(self):
        return len(self.angles)

    @property
    def rollers(self):
        return len(self.rows)

    @property
    def size(self):
        return 3 + self.wheels * (1 + self.rollers)

    def phi(self, i, j):
        return 3 + self.wheels + i * self.rollers + j

    def frames(self, q):
        """Of each wheel: its centre from S, axle and direction across, in fixed axes."""
        turned = np.array([[np.cos(q[2]), -np.sin(q[2])], [np.sin(q[2]), np.cos(q[2])]])
        for place, angle in zip(self.places, self.angles, strict=True):
            n = turned @ [np.cos(angle), np.sin(angle)]
            yield np.append(turned @ place, 0), np.append(n, 0), np.array([-n[1], n[0], 0])

    def roller_place(self, q, i, j, n, across):
        """The roller's middle from the wheel's centre, and its axis."""
        beta = q[3 + i] + 2 * np.pi * j / self.rollers
        up = np.array([0, 0, 1])
        inward = -np.sin(beta) * across + np.cos(beta) * up
        return self.rows[j] * n - self.axis_radius * inward, np.cos(beta) * across + np.sin(beta) * up

    def speed_rows(self, place, wheel=None, n=None, own=None, roller=None):
        """(3, size) what q' does to the velocity of a point `place` from S; `own` from its wheel's centre; `roller` is
        the column of its phi, its axis, and the point from the roller's middle."""
        rows = np.zeros((3, self.size), np.result_type(place, 1.0))
        rows[0, 0] = rows[1, 1] = 1
        rows[:, 2] = np.cross([0, 0, 1], place)
        if wheel is not None:
            rows[:, 3 + wheel] = np.cross(n, own)
        if roller is not None:
            column, axis, arm = roller
            rows[:, column] = np.cross(axis, arm)
        return rows

    def mass(self, q):
        """(size, size), the kinetic energy's."""
        found = np.zeros((self.size, self.size), np.result_type(q, 1.0))

        def add(mass, speed, turning, axis, axial, transverse):
            found[...] += mass * speed.T @ speed + transverse * turning.T @ turning
            along = axis @ turning
            found[...] += (axial - transverse) * np.outer(along, along)

        turning = np.zeros((3, self.size), found.dtype)
        turning[2, 2] = 1
        turned = np.array([[np.cos(q[2]), -np.sin(q[2])], [np.sin(q[2]), np.cos(q[2])]])
        center = np.append(turned @ self.center, 0)
        add(self.platform[0], self.speed_rows(center), turning, np.array([0, 0, 1]), self.platform[1], 0)
        for i, (place, n, across) in enumerate(self.frames(q)):
            of_hub = turning.copy()
            of_hub[:, 3 + i] = n
            add(self.hub[0], self.speed_rows(place), of_hub, n, *self.hub[1:])
            for j in range(self.rollers):
                own, axis = self.roller_place(q, i, j, n, across)
                spinning = of_hub.copy()
                spinning[:, self.phi(i, j)] = axis
                add(self.roller[0], self.speed_rows(place + own, i, n, own), spinning, axis, *self.roller[1:])
        return found

    def held(self, q, contact, pivots=None, arms=None):
        """(2 N, size) the rows of the ground: of each wheel along its axle and across it. A wheel that stands (pivots)
        has chi' = 0 for the second."""
        rows = []
        for i, (place, n, across) in enumerate(self.frames(q)):
            own, axis = self.roller_place(q, i, contact[i], n, across)
            below = np.array([0, 0, -self.wheel_radius]) + self.rows[contact[i]] * n
            of_point = self.speed_rows(place + below, i, n, below, (self.phi(i, contact[i]), axis, below - own))
            stands = np.zeros(self.size, of_point.dtype)
            stands[3 + i] = 1
            rows += [n @ of_point, stands if pivots is not None and pivots[i] else across @ of_point]
        return np.array(rows)

    def locks(self, contact):
        """The rows of rollers that stay on their disks: all that are not in contact."""
        rows = np.eye(self.size)
        return [rows[self.phi(i, j)] for i in range(self.wheels) for j in range(self.rollers) if j != contact[i]]

    def slopes(self, q, qdot):
        """(size,) M' q' - grad T: what stands beside M q'' in Lagrange's equations."""
        along = self.mass(q + 1j * STEP * qdot).imag / STEP
        found = along @ qdot
        for k in range(self.size):
            moved = q.astype(complex)
            moved[k] += 1j * STEP
            found[k] -= 0.5 * qdot @ (self.mass(moved).imag / STEP) @ qdot
        return found

    def accelerations(self, q, qdot, contact, torque, locked=False, forces=()):
        """q'' where all wheels turn; torque (N,) at the axles; forces: further generalised ones (size,)."""
        rows = [*self.held(q, contact)] + (self.locks(contact) if locked else [])
        rates = [*(self.held(q + 1j * STEP * qdot, contact).imag / STEP)]
        rates += [np.zeros(self.size)] * (len(rows) - len(rates))
        return self._solved(q, qdot, np.array(rows), np.array(rates), self._pushed(torque) + sum(forces))

    def _pushed(self, torque):
        pushed = np.zeros(self.size)
        pushed[3 : 3 + self.wheels] = torque
        return pushed

    def _solved(self, q, qdot, rows, rates, pushed):
        """q'' with ideal constraints rows q' = 0, whose rows change at `rates`."""
        count, mass = len(rows), self.mass(q)
        scale = np.linalg.norm(mass)
        whole = np.block([[mass, scale * rows.T], [scale * rows, np.zeros((count, count))]])
        right = np.append(pushed - self.slopes(q, qdot), -scale * rates @ qdot)
        return np.linalg.lstsq(whole, right, rcond=1e-15)[0][: self.size]

    def standing_accelerations(self, q, qdot, contact, pivots, torque, locked=False):
        """The same where wheels stand: the ground pushes each across at the point of its axle's line over the ground
        that has no speed across; chi'' = 0 asks for as much push as it takes."""
        rows = [*self.held(q, contact, pivots)] + (self.locks(contact) if locked else [])
        rates = [*(self.held(q + 1j * STEP * qdot, contact, pivots).imag / STEP)]
        rates += [np.zeros(self.size)] * (len(rows) - len(rates))
        columns = np.array(rows, float)
        for i, (place, n, across) in enumerate(self.frames(q)):
            if pivots[i]:
                columns[2 * i + 1] = self._at_rest(qdot, i, place, n, across)
        count, mass = len(rows), self.mass(q)
        scale = np.linalg.norm(mass)
        whole = np.block([[mass, scale * columns.T], [scale * np.array(rows), np.zeros((count, count))]])
        right = np.append(self._pushed(torque) - self.slopes(q, qdot), -scale * np.array(rates) @ qdot)
        return np.linalg.solve(whole, right)[: self.size]

    def _at_rest(self, qdot, i, place, n, across):
        """(size,) the row of the speed across of the wheel's point on the ground that has none."""

        def speed_at(aside):
            below = np.array([0, 0, -self.wheel_radius]) + aside * n
            return across @ self.speed_rows(place + below, i, n, below)

        at_zero, slope = speed_at(0.0) @ qdot, (speed_at(1.0) - speed_at(0.0)) @ qdot
        return speed_at(-at_zero / slope)

    def after_impact(self, q, before, contact, pivots=None, locked=False):
        """q' after the constraints of these contacts are imposed perfectly inelastically on q' before."""
        rows = np.array([*self.held(q, contact, pivots)] + (self.locks(contact) if locked else []))
        mass = self.mass(q)
        allowed = np.linalg.svd(rows)[2][len(rows) :].T
        return allowed @ np.linalg.solve(allowed.T @ mass @ allowed, allowed.T @ mass @ before)

    def energy(self, q, qdot):
        return 0.5 * qdot @ self.mass(q) @ qdot

    def rolling(self, q, contact, nu, spins, radius, scale, pivots=None):
        """q' of speeds nu that obey the ground; spins (N, n) of the rollers that are not in contact."""
        qdot = np.zeros(self.size)
        cosine, sine = np.cos(q[2]), np.sin(q[2])
        qdot[:2] = radius * np.array([cosine * nu[0] - sine * nu[1], sine * nu[0] + cosine * nu[1]])
        qdot[2] = nu[2] / scale
        qdot[3 + self.wheels :] = np.asarray(spins).ravel()
        unknown = [3 + i for i in range(self.wheels)] + [self.phi(i, c) for i, c in enumerate(contact)]
        qdot[unknown] = 0
        rows = self.held(q, contact, pivots)
        qdot[unknown] = np.linalg.solve(rows[:, unknown], -rows @ qdot)
        return qdot
