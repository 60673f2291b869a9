"""Random vehicles at an instant at which some of their contacts, axles and rollers are at rest."""

import numpy as np

from .solver import ELLIPSE, FIXED, INTERVAL, Element, Problem


class Wheels:
    """Wheels that slip, and what pushes them: random, or all alike."""

    def __init__(self, seed, count, roller_inertia, symmetric):
        self.rng, self.count, self.symmetric = np.random.default_rng(seed), count, symmetric
        self.angles = 2 * np.pi * np.arange(count) / count + self.random(0, -0.3, 0.3)
        self.radius, self.wheel, self.rho = self.rng.uniform((0.1, 0.03, 0.005), (0.5, 0.1, 0.03))
        mass, inertia, spin = (10 ** self.rng.uniform(*ends) for ends in ((0, 1.5), (-1, 0.5), (-4, -2)))
        self.load = mass * 9.81 / count
        one_each = np.full(count, 1 / spin), np.full(count, 1 / roller_inertia)
        self.mobility = np.concatenate([[1 / mass, 1 / mass, 1 / inertia], *one_each])

    def random(self, alike, *ends):
        """A number for each wheel, the same where all are alike."""
        numbers = self.rng.uniform(*ends, self.count)
        return np.full(self.count, float(alike)) if self.symmetric else numbers

    def rows(self, i, massless):
        """Speeds of a contact along the wheel and along its axle, of the axle, and of the roller on its disk."""
        one, two, axle, roller = np.zeros((4, len(self.mobility)))
        angle, turn, roll = self.angles[i], 3 + i, 3 + self.count + i
        one[:2], one[2], one[turn] = (-np.sin(angle), np.cos(angle)), self.radius, self.wheel
        two[:2], two[roll] = (np.cos(angle), np.sin(angle)), 0 if massless else self.rho
        axle[turn] = roller[roll] = 1
        roller[2] = 0.1 if self.symmetric else self.rng.uniform(-1, 1)
        return one, two, axle, roller

    def push(self, size):
        """Forces along all speeds; only the wheels are driven where all are alike."""
        force = size * self.load * self.rng.standard_normal(len(self.mobility))
        force[2] *= self.radius
        force[3:] *= self.wheel if self.symmetric else 0.3 * self.wheel
        force[3 + self.count :] *= self.rho / self.wheel
        if self.symmetric:
            force[:2] = force[3 + self.count :] = 0
            force[3 : 3 + self.count] = force[3]
        return force


def mixture(seed, wheels=4, roller_inertia=1e-5, rollers=6, symmetric=False, all_at_rest=False, push=1.0):
    """Contacts, axles, bearings of rollers in contact and free rollers, any of them at rest, where wheels slip: speeds
    are those of the platform, of the wheels and of the rollers, and the kinetic energy is diagonal in them."""
    made = Wheels(seed, wheels, roller_inertia, symmetric)
    rows, elements = [], []
    resting = all_at_rest | (made.rng.random((3, wheels)) < 0.8)
    friction, across = made.random(0.4, 0.1, 1), made.random(1, 0.5, 1)
    axle, roller = 0.05 * made.wheel * made.random(1, 0.1, 2), 0.02 * made.rho * made.random(1, 0.1, 2)
    for i in range(wheels):
        found = made.rows(i, massless=False)
        if resting[0, i]:
            rows += found[:2]
            elements.append(Element(ELLIPSE, (friction[i] * made.load, friction[i] * across[i] * made.load)))
        if resting[1, i]:
            rows.append(found[2])
            elements.append(Element(INTERVAL, (axle[i] * made.load,)))
        if resting[2, i]:
            rows.append(found[3])
            elements.append(Element(INTERVAL, (roller[i] * made.load,)))
    jacobian, force = np.array(rows).reshape(-1, len(made.mobility)), made.push(push)
    apart = wheels * (rollers - 1)
    free = all_at_rest | (made.rng.random(apart) < 0.8)
    sine = np.sin(np.resize(2 * np.pi * np.arange(1, rollers) / rollers, apart))[free]
    bounds = np.ones(len(sine)) if symmetric else made.rng.uniform(0, 2, len(sine))
    return Problem(
        elements,
        (jacobian * made.mobility) @ jacobian.T,
        jacobian @ (made.mobility * force),
        mobility=np.full(len(sine), 1 / roller_inertia),
        yaw=-sine,
        apart_given=-sine * made.mobility[2] * force[2],
        bound=0.02 * made.load * made.rho * bounds,
        yaw_rows=jacobian[:, 2] * made.mobility[2],
        yaw_yaw=made.mobility[2],
    )


def in_series(seed, wheels=4, symmetric=False, push=1.0):
    """Massless rollers in series between ground and bearing, their ellipses cut by strips, and axles."""
    made = Wheels(seed, wheels, 1.0, symmetric)
    rows, elements = [], []
    strips = made.rng.choice([0, 0.05, 0.4, 0.9, 2], wheels, p=[0.05, 0.3, 0.3, 0.2, 0.15])
    friction, axle = made.random(0.4, 0.1, 1), 0.05 * made.wheel * made.random(1, 0.1, 2)
    for i in range(wheels):
        one, two, turn, _ = made.rows(i, massless=True)
        rows += [two, one, turn]
        size = friction[i] * made.load
        elements.append(Element(ELLIPSE, (size, size), size * (0.4 if symmetric else strips[i])))
        elements.append(Element(INTERVAL, (axle[i] * made.load,)))
    jacobian = np.array(rows)
    return Problem(elements, (jacobian * made.mobility) @ jacobian.T, jacobian @ (made.mobility * made.push(push)))


def rolling(seed, wheels=4, fixed=False):
    """Axles and rollers of wheels that roll: all move with three speeds, and the Delassus matrix has rank 3."""
    rng = np.random.default_rng(seed)
    count = 2 * wheels - int(rng.integers(0, wheels))
    rows = rng.standard_normal((count, 3)) * 10 ** rng.uniform(-0.5, 1, (count, 1))
    rows = rows @ (rng.standard_normal((3, 3)) + 2 * np.eye(3))
    elements = [Element(INTERVAL, (10 ** rng.uniform(-2, 0),)) for _ in range(count)]
    if fixed:
        rows = np.vstack([rows, rng.standard_normal((2, 3))])
        elements.append(Element(FIXED))
    return Problem(elements, rows @ rows.T, rows @ rng.standard_normal(3) * 10 ** rng.uniform(-1, 1.5))
