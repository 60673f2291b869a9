"""The mechanics once more, in numbers: no symbols, no parts, nothing of maxima/.

No slip is solved at every contact point from the bodies' velocities; (3.2) is summed roller by roller; derivatives
are complex steps, exact to rounding. kappa_1 may differ from zero, as the paper's (3.2) has it, and then (2.1)
stays as printed, unless `tilted` asks for the geometry of a contact roller at chi + kappa_1.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

STEP = 1e-30
UP = np.array([0, 0, 1.0])


@dataclass
class NumericVehicle:
    """N wheels of n rollers in a random state. kappa_1 and alphas are given; all else comes from rng."""

    rng: np.random.Generator
    alphas: np.ndarray
    rollers: int
    kappa_1: float = 0.0
    tilted: bool = False
    numbers: dict = field(default_factory=dict)

    def __post_init__(self):
        draw = lambda: float(self.rng.uniform(0.5, 1.5))  # noqa: E731
        self.numbers = {name: draw() for name in ("M", "I_S", "J", "B", "Lambda", "R")} | {"l": 2.0, "r": 0.9}
        self.wheels = len(self.alphas)
        self.chi = self.rng.uniform(-0.9, 0.9, self.wheels) * np.pi / self.rollers
        self.kappa = self.kappa_1 + 2 * np.pi * np.arange(self.rollers) / self.rollers
        self.theta = float(self.rng.uniform(0, 6))
        self.nu = self.rng.normal(size=3 + self.wheels * (self.rollers - 1))
        self.p = self.rng.normal(size=self.size)

    @property
    def size(self):
        return 3 + self.wheels * (self.rollers + 1)

    @property
    def q(self):
        """theta and chi, all that anything depends on."""
        return np.array([self.theta, *self.chi])

    def place(self, wheel, roller=None):
        """Number of a coordinate: the wheel's, or a roller's, 0 in contact."""
        if roller is None:
            return 3 + wheel
        free = 3 + 2 * self.wheels + wheel * (self.rollers - 1) + roller - 1
        return 3 + self.wheels + wheel if roller == 0 else free

    def speed_place(self, wheel, roller):
        return 3 + wheel * (self.rollers - 1) + roller - 1

    def contact(self, wheel, chi):
        """(chi', phi') per unit of nu_1, nu_2, nu_3 by no slip: two vectors of 3."""
        c = self.numbers
        angle = chi + self.kappa_1 if self.tilted else chi
        axle = np.array([np.cos(self.alphas[wheel]), np.sin(self.alphas[wheel]), 0])
        along = np.cross(UP, axle)
        axis = np.cos(angle) * along + np.sin(angle) * UP
        roller = c["r"] * (np.sin(angle) * along - np.cos(angle) * UP)
        ground = -c["l"] * UP
        given = [np.array([c["R"], 0, 0]), np.array([0, c["R"], 0]), np.cross(UP, c["R"] * axle) / c["Lambda"]]
        disk, spin = np.cross(axle, ground), np.cross(axis, ground - roller)
        det = disk[0] * spin[1] - disk[1] * spin[0]
        rates = [(spin[0] * g[1] - spin[1] * g[0]) / det for g in given]
        spins = [(disk[1] * g[0] - disk[0] * g[1]) / det for g in given]
        return rates, spins

    def V(self, q):
        theta, chi = q[0], q[1:]
        V = np.zeros((self.size, len(self.nu)), dtype=complex)
        sin, cos, radius = np.sin(theta), np.cos(theta), self.numbers["R"]
        V[0, :2], V[1, :2] = [radius * cos, -radius * sin], [radius * sin, radius * cos]
        V[2, 2] = 1 / self.numbers["Lambda"]
        for i in range(self.wheels):
            V[self.place(i), :3], V[self.place(i, 0), :3] = self.contact(i, chi[i])
            for j in range(1, self.rollers):
                V[self.place(i, j), self.speed_place(i, j)] = 1
        return V

    def Mq(self, q):
        c, chi = self.numbers, q[1:]
        A = np.zeros((self.size, self.size), dtype=complex)
        A[0, 0] = A[1, 1] = c["M"]
        A[2, 2] = c["I_S"]
        for i in range(self.wheels):
            A[self.place(i), self.place(i)] = c["J"]
            for j in range(self.rollers):
                k = self.place(i, j)
                A[k, k] = c["B"]
                A[2, k] = A[k, 2] = c["B"] * np.sin(self.kappa[j] + chi[i])
        return A

    def slope(self, function, direction):
        """Derivative of function(q) along direction."""
        return np.imag(function(self.q + 1j * STEP * np.asarray(direction))) / STEP

    def slopes(self, function):
        return [self.slope(function, row) for row in np.eye(len(self.q))]

    @cached_property
    def V0(self):
        return self.V(self.q).real

    def Ms(self, q):
        V = self.V(q)
        return V.T @ self.Mq(q) @ V

    @cached_property
    def Ms0(self):
        return self.Ms(self.q).real

    @cached_property
    def Mi(self):
        """dM* / dchi_i."""
        return self.slopes(self.Ms)[1:]

    @cached_property
    def star(self):
        """p = Mq V nu."""
        return (self.Mq(self.q) @ self.V(self.q) @ self.nu).real

    def P(self, p):
        return self.V0.T @ p

    @cached_property
    def V_slopes(self):
        return self.slopes(self.V)

    def bracket(self, a, b, p):
        """{P_a, P_b} over theta and chi; nothing depends on the other coordinates."""
        places = [2, *(self.place(i) for i in range(self.wheels))]
        return sum(
            (dV[:, a] @ p) * self.V0[k, b] - self.V0[k, a] * (dV[:, b] @ p)
            for k, dV in zip(places, self.V_slopes, strict=True)
        )

    def PL(self, a):
        slopes = self.slopes(lambda q: self.nu @ self.Ms(q) @ self.nu / 2)
        return -sum(self.V0[k, a] * s for k, s in zip([2, *map(self.place, range(self.wheels))], slopes, strict=True))

    @cached_property
    def rates(self):
        return self.V0 @ self.nu

    @cached_property
    def force(self):
        """M* nu' by Lagrange's equations on the columns of V: -V^T (d/dt (Mq V nu) - dT/dq) at nu' = 0."""
        way = [self.rates[2], *(self.rates[self.place(i)] for i in range(self.wheels))]
        moved = self.slope(lambda q: self.Mq(q) @ self.V(q) @ self.nu, way)
        slopes = self.slopes(lambda q: self.rates @ self.Mq(q) @ self.rates / 2)
        moved[2] -= slopes[0]
        for i in range(self.wheels):
            moved[self.place(i)] -= slopes[1 + i]
        return -self.V0.T @ moved
