"""A vehicle as what it is: rigid bodies, in all coordinates, with points that touch the ground without slip. Rollers
stand at angles to their disks, or alternate in two rows.

Nothing here comes from the derivation. A roller is the envelope of the spheres on its axis that touch the ground while
the wheel's centre stays at its height; the contact is the lowest point of these. Or its meridian is the hull of
circles, whose centres make rings: the lowest point is under the lowest of a ring. The platform stays level all the
same. A wheel that stands on its joint (`stands`: their numbers) does not turn; its roller 0 rolls along the axle.
Kinetic energy is that of the bodies, derivatives are taken along an imaginary step and are exact to rounding.

Coordinates: x, y, heading, then for each wheel its angle chi and the angles of its n rollers about their axes; roller 0
touches the ground.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

UP = np.array([0.0, 0.0, 1.0])
STEP = 1e-30


@dataclass(frozen=True)
class Bodies:
    """Masses in kg, lengths in m, inertias in kg m^2; places, angles and angles of rollers by wheel.

    row_offset  how far outward rollers of even numbers stand, and inward the others
    contact     by wheel, the number of the roller that touches the ground, which is roller 0 in the coordinates
    meridian    of its circles the centre along the roller's axis and from it, and the radius; None: wheels stay round
    carries     by wheel, the circle that touches the ground; None: the lowest
    """

    places: np.ndarray
    axles: np.ndarray
    roller_angles: np.ndarray
    rollers: int
    wheel_radius: float
    axis_radius: float
    platform: tuple[float, float] = (9.0, 0.35)
    hub: tuple[float, float, float] = (0.4, 9e-4, 5e-4)
    roller: tuple[float, float, float] = (0.03, 2.5e-6, 4e-6)
    row_offset: float = 0.0
    contact: Sequence[int] | None = None
    meridian: Sequence[tuple[float, float, float]] | None = None
    carries: Sequence[int] | None = None

    @property
    def wheels(self) -> int:
        return len(self.places)

    @property
    def size(self) -> int:
        return 3 + self.wheels * (1 + self.rollers)

    def aside(self, wheel: int, roller: int) -> float:
        """How far outward a roller stands."""
        return self.row_offset * (-1) ** (roller + (0 if self.contact is None else int(self.contact[wheel])))

    def of(self, wheel: int) -> "Bodies":
        """The numbers of a wheel: those of all."""
        return self

    def place(self, wheel: int, roller: int = -1) -> int:
        """Where a wheel's angle, or that of one of its rollers, stands among the coordinates."""
        return 3 + wheel * (1 + self.rollers) + 1 + roller


def _frame(bodies: Bodies, q: np.ndarray, wheel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The axle, the direction across it and the wheel's centre over the ground point of the platform, in fixed axes."""
    angle = bodies.axles[wheel] + q[2]
    x, y = bodies.places[wheel]
    axle = np.array([np.cos(angle), np.sin(angle), 0])
    across = np.array([-np.sin(angle), np.cos(angle), 0])
    height = bodies.of(wheel).wheel_radius
    turned = np.array([x * np.cos(q[2]) - y * np.sin(q[2]), x * np.sin(q[2]) + y * np.cos(q[2]), height])
    return axle, across, turned


def _roller(bodies: Bodies, q: np.ndarray, wheel: int, j: int) -> tuple[np.ndarray, np.ndarray]:
    """The axis of a roller and its middle, from the wheel's centre."""
    axle, across, _ = _frame(bodies, q, wheel)
    own, psi = bodies.of(wheel), bodies.roller_angles[wheel]
    beta = q[bodies.place(wheel)] + 2 * np.pi * j / own.rollers
    axis = np.cos(psi) * (np.cos(beta) * across + np.sin(beta) * UP) + np.sin(psi) * axle
    middle = -own.axis_radius * (np.cos(beta) * UP - np.sin(beta) * across)
    return axis, middle + bodies.aside(wheel, j) * axle


def _moving(bodies: Bodies, arm: np.ndarray, axle: np.ndarray, wheel: int, own: np.ndarray) -> np.ndarray:
    """(3, size) velocity, by the coordinates' rates, of a point that the wheel carries at `own` from its centre."""
    jacobian = np.zeros((3, bodies.size), complex)
    jacobian[0, 0] = jacobian[1, 1] = 1
    jacobian[:, 2] = np.cross(UP, arm + own)
    jacobian[:, bodies.place(wheel)] = np.cross(axle, own)
    return jacobian


def mass_matrix(bodies: Bodies, q: np.ndarray) -> np.ndarray:
    mass = np.zeros((bodies.size, bodies.size), complex)
    mass[0, 0] = mass[1, 1] = bodies.platform[0]
    mass[2, 2] = bodies.platform[1]

    def add(weight: float, axial: float, transverse: float, moving: np.ndarray, turning: np.ndarray, axis: np.ndarray):
        along = axis @ turning
        mass[:] += weight * moving.T @ moving + transverse * turning.T @ turning
        mass[:] += (axial - transverse) * np.outer(along, along)

    for wheel in range(bodies.wheels):
        axle, _, arm = _frame(bodies, q, wheel)
        turning = np.zeros((3, bodies.size), complex)
        turning[:, 2], turning[:, bodies.place(wheel)] = UP, axle
        own = bodies.of(wheel)
        weight, axial, transverse = own.hub
        psi = bodies.roller_angles[wheel]  # a vehicle has one wheel_inertia: the hubs make up for the rollers' angles
        axial -= own.rollers * (own.roller[1] * np.sin(psi) ** 2 + own.roller[2] * np.cos(psi) ** 2)
        add(weight, axial, transverse, _moving(bodies, arm, axle, wheel, np.zeros(3)), turning, axle)
        for j in range(own.rollers):
            axis, middle = _roller(bodies, q, wheel, j)
            spinning = turning.copy()
            spinning[:, bodies.place(wheel, j)] = axis
            add(*own.roller, _moving(bodies, arm, axle, wheel, middle), spinning, axis)
    return mass


def _touching(bodies: Bodies, q: np.ndarray, wheel: int, j: int) -> np.ndarray:
    """(3, size): velocity, by the coordinates' rates, of the point in which a roller touches the ground."""
    axle, _, arm = _frame(bodies, q, wheel)
    axis, middle = _roller(bodies, q, wheel, j)
    own, cosine = bodies.of(wheel), np.cos(bodies.roller_angles[wheel])
    beta = q[bodies.place(wheel)] + 2 * np.pi * j / own.rollers
    if own.meridian is None:
        along = -own.axis_radius * np.tan(beta) / cosine  # to the centre of the sphere that touches the ground
        radius = own.wheel_radius - np.sqrt(own.axis_radius**2 + (along * cosine) ** 2)
        touching = middle + along * axis - radius * UP
    else:
        downward = -(UP - axis[2] * axis) / np.sqrt(1 - axis[2] ** 2)  # from the roller's axis
        points = [middle + s * axis + away * downward - radius * UP for s, away, radius in own.meridian]
        lowest = int(np.argmin([point[2].real for point in points]))
        touching = points[lowest if bodies.carries is None else bodies.carries[wheel]]
    jacobian = _moving(bodies, arm, axle, wheel, touching)
    jacobian[:, bodies.place(wheel, j)] = np.cross(axis, touching - middle)
    return jacobian


def constraints(bodies: Bodies, q: np.ndarray, stands: Sequence[int] = ()) -> np.ndarray:
    """(2N, size): velocities of the material points that touch the ground, along the axle and across it; of a wheel
    that stands its rate for the latter."""
    rows = []
    for wheel in range(bodies.wheels):
        axle, across, _ = _frame(bodies, q, wheel)
        velocity = _touching(bodies, q, wheel, 0)
        rows += [axle @ velocity, np.eye(bodies.size)[bodies.place(wheel)] if wheel in stands else across @ velocity]
    return np.array(rows)


def pushes(bodies: Bodies, q: np.ndarray, rates: np.ndarray, stands: Sequence[int] = ()) -> np.ndarray:
    """(2N, size): the forces of the ground that hold these. It pushes a wheel that stands at both of its rollers, each
    along its axis, with shares by which that does no work."""
    found = constraints(bodies, q, stands).real
    for wheel in stands:
        sign = np.sign(q[bodies.place(wheel)])
        of_both = []
        for j in (0, -int(sign) % bodies.rollers):
            axis = _roller(bodies, q, wheel, j)[0]
            of_both.append((axis - (axis @ UP) * UP) @ _touching(bodies, q, wheel, j).real)
        here, there = of_both
        share = (there @ rates) / (there @ rates - here @ rates)
        found[2 * wheel + 1] = share * here + (1 - share) * there
    return found


def height_of_contact(bodies: Bodies, q: np.ndarray, wheel: int) -> float:
    """The height over the ground of the lowest point of the roller that carries, by looking at all its spheres; with a
    meridian its height over the wheel's centre, by looking at the whole meridian."""
    axis, middle = _roller(bodies, q, wheel, 0)
    if bodies.meridian is not None:
        centres, t = np.array(bodies.meridian)[:, :, None], np.linspace(-1.5, 1.5, 200001)
        along, away = centres[:, 0] + centres[:, 2] * np.sin(t), centres[:, 1] + centres[:, 2] * np.cos(t)
        return float(np.min(middle[2] + along * axis[2] - away * np.sqrt(1 - axis[2] ** 2)))
    s = np.linspace(-1, 1, 200001) * bodies.wheel_radius
    cosine = np.cos(bodies.roller_angles[wheel])
    radius = bodies.wheel_radius - np.sqrt(bodies.axis_radius**2 + (s * cosine) ** 2)
    return float(np.min(bodies.wheel_radius + middle[2] + s * axis[2] - radius))


def along_motion(function, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """The derivative in time of a function of the coordinates."""
    return function(q + 1j * STEP * rates).imag / STEP


def inertial_force(bodies: Bodies, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """d/dt(M) rates - d(rates . M rates/2)/dq."""
    found = along_motion(lambda q: mass_matrix(bodies, q), q, rates) @ rates
    wheels = [bodies.place(wheel) for wheel in range(bodies.wheels)]
    for k in range(2, bodies.size):  # nothing depends on x and y
        unit = np.eye(bodies.size)[k]
        if k == 2 or k in wheels:  # nor on the angles of the rollers about their axes
            found[k] -= rates @ along_motion(lambda q: mass_matrix(bodies, q), q, unit) @ rates / 2
    return found


def accelerations(
    bodies: Bodies, q: np.ndarray, rates: np.ndarray, force: np.ndarray, held: list[int], stands: Sequence[int] = ()
) -> np.ndarray:
    """Accelerations of all coordinates under a generalised force; `held` do not turn."""
    rows = np.vstack([constraints(bodies, q, stands).real, np.eye(bodies.size)[held]])
    columns = np.vstack([pushes(bodies, q, rates, stands), np.eye(bodies.size)[held]])
    changing = along_motion(lambda q: constraints(bodies, q, stands).astype(complex), q, rates)
    drift = np.concatenate([changing @ rates, np.zeros(len(held))])
    mass, count = mass_matrix(bodies, q).real, len(rows)
    whole = np.block([[mass, columns.T], [rows, np.zeros((count, count))]])
    asked = np.concatenate([force - inertial_force(bodies, q, rates), -drift])
    return np.linalg.solve(whole, asked)[: bodies.size]


def after_impact(
    bodies: Bodies, q: np.ndarray, rates: np.ndarray, held: list[int], stands: Sequence[int] = ()
) -> np.ndarray:
    """Rates after the constraints at q, and those that hold some coordinates, are imposed perfectly inelastically."""
    rows = np.vstack([constraints(bodies, q, stands).real, np.eye(bodies.size)[held]])
    mass, count = mass_matrix(bodies, q).real, len(rows)
    whole = np.block([[mass, rows.T], [rows, np.zeros((count, count))]])
    return np.linalg.solve(whole, np.concatenate([mass @ rates, np.zeros(count)]))[: bodies.size]
