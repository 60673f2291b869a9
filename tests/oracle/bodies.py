"""The vehicle as 1 + N (n + 1) rigid bodies in space (and motors' rotors), from the masses and sizes of its
parts.

Nothing of (3.2) is used. A body has a mass, a tensor in its own axes, and a placement: the position of its
centre and its rotation matrix as functions of q. Speeds are derivatives of the placement in time, taken by
power series: v = d(centre)/dt, and omega is read from the skew matrix (dA/dt) A^T.

Body axes. The disk of wheel i: turn by theta + beta about Z, then by chi about the axle (its first axis).
Roller j: the same with chi + kappa_j, then phi about its axis (its second axis); its centre is at (0, 0, -r)
before the last turn.
"""

from dataclasses import dataclass

from .balls import coefficient, exact, line, square, working_precision
from .lagrange import Speeds


@dataclass(frozen=True)
class Solid:
    """An axisymmetric body: mass, moment of inertia about its axis, and about a diameter through its
    centre.
    """

    mass: object
    axial: object
    transverse: object

    @classmethod
    def cylinder(cls, mass, radius, length):
        m, a, h = exact(mass), exact(radius), exact(length)
        return cls(m, m * a * a / 2, m * (3 * a * a + h * h) / 12)


@dataclass(frozen=True)
class Parts:
    """Parts of a vehicle. platform: its axis is vertical through S. Hub and rotor: along the axle. Roller:
    its own.

    rotor, gear, rotor_distance: one motor a wheel, rotor on the wheel's axle at that distance from S, turned
    by `gear` turns a turn of the wheel relative to the platform (negative: against it).
    """

    platform: Solid
    hub: Solid
    roller: Solid
    platform_radius: object
    roller_axis_radius: object
    rollers_per_wheel: int
    wheel_angles: tuple
    rotor: Solid | None = None
    gear: object = 1
    rotor_distance: object = 0


def product(a, b):
    return [[sum((a[i][k] * b[k][j] for k in range(1, 3)), a[i][0] * b[0][j]) for j in range(3)] for i in range(3)]


def apply(a, v):
    return [a[i][0] * v[0] + a[i][1] * v[1] + a[i][2] * v[2] for i in range(3)]


def turn(axis, angle):
    """Rotation matrix about the first, second or third axis."""
    sin, cos = angle.sin(), angle.cos()
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = [[exact(int(i == j)) for j in range(3)] for i in range(3)]
    matrix[a][a] = matrix[b][b] = cos
    matrix[a][b], matrix[b][a] = -sin, sin
    return matrix


def kappa(n, j):
    return 2 * exact(0).acos() * 2 * j / n


def bodies(parts, q):
    """(solid, index of its axis, centre, rotation) for every body at the coordinates q (series or balls)."""
    yield parts.platform, 2, [q.x, q.y, exact(0)], turn(2, q.theta)
    radius = exact(parts.platform_radius)
    for i, alpha in enumerate(parts.wheel_angles):
        steered = turn(2, q.theta + exact(alpha))
        base = [q.x, q.y, exact(0)]
        centre = [b + d for b, d in zip(base, apply(steered, [radius, 0, 0]), strict=True)]
        yield parts.hub, 0, centre, product(steered, turn(0, q.chi[i]))
        if parts.rotor is not None:
            place = [b + d for b, d in zip(base, apply(steered, [exact(parts.rotor_distance), 0, 0]), strict=True)]
            yield parts.rotor, 0, place, product(steered, turn(0, exact(parts.gear) * q.chi[i]))
        for j in range(parts.rollers_per_wheel):
            carried = product(steered, turn(0, q.chi[i] + kappa(parts.rollers_per_wheel, j)))
            offset = apply(carried, [0, 0, -exact(parts.roller_axis_radius)])
            place = [c + o for c, o in zip(centre, offset, strict=True)]
            yield parts.roller, 1, place, product(carried, turn(1, q.phi[i][j]))


def angular_velocity(rotation):
    """omega in fixed axes from a rotation matrix of series: (dA/dt) A^T is its skew matrix."""
    at = [[coefficient(v, 0) for v in row] for row in rotation]
    rate = [[coefficient(v, 1) for v in row] for row in rotation]
    skew = lambda i, j: sum((rate[i][k] * at[j][k] for k in range(1, 3)), rate[i][0] * at[j][0])  # noqa: E731
    return [skew(2, 1), skew(0, 2), skew(1, 0)]


def along(q, dq):
    """The coordinates q + dq t as series to first order."""
    place, rate = [exact(v) for v in q.flat()], [exact(v) for v in dq.flat()]
    moved = [line(p, v) for p, v in zip(place, rate, strict=True)]
    count, n = len(q.chi), len(q.phi[0])
    return Speeds.shaped(count, n, moved)


@working_precision
def kinetic_energy(parts, q, dq):
    """Sum over all bodies of m v.v/2 + omega . (A I A^T) omega / 2."""
    twice = exact(0)
    for solid, axis, centre, rotation in bodies(parts, along(q, dq)):
        speed = [coefficient(c, 1) for c in centre]
        omega = angular_velocity(rotation)
        at = [[coefficient(v, 0) for v in row] for row in rotation]
        local = [sum((at[i][k] * omega[i] for i in range(1, 3)), at[0][k] * omega[0]) for k in range(3)]
        twice += exact(solid.mass) * sum(square(v) for v in speed)
        for k in range(3):
            twice += exact(solid.axial if k == axis else solid.transverse) * square(local[k])
    return twice / 2


@working_precision
def inertias(parts):
    """M, I_S, J, B: twice the kinetic energy for a unit speed of x, theta, chi_1, phi_11 at rest
    elsewhere.
    """
    count, n = len(parts.wheel_angles), parts.rollers_per_wheel
    size = 3 + count * (n + 1)

    def twice(k):
        values = [exact(int(k == m)) for m in range(size)]
        return 2 * kinetic_energy(parts, Speeds.shaped(count, n, [exact(0)] * size), Speeds.shaped(count, n, values))

    return {"mass": twice(0), "yaw_inertia": twice(2), "wheel_inertia": twice(3), "roller_inertia": twice(3 + count)}
