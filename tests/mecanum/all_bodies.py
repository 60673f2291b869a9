"""A vehicle as what it is: rigid bodies, in all coordinates, with points that touch the ground without slip. Rollers
stand at angles to their disks, or alternate in two rows.

Nothing here comes from the derivation. A roller is the envelope of the spheres on its axis that touch the ground while
the wheel's centre stays at its height; the contact is the lowest point of these. Or its meridian is the hull of
circles, whose centres make rings: the lowest point is under the lowest of a ring. The platform stays level all the
same; on springs it heaves and tilts a little, to first order. A wheel that stands on its joint (`stands`: their
numbers) does not turn; its roller 0 rolls along the axle. Kinetic energy is that of the bodies, derivatives are taken
along an imaginary step and are exact to rounding.

Coordinates: x, y, heading, then for each wheel its angle chi and the angles of its n rollers about their axes; roller 0
touches the ground. Behind them, where the platform tilts: the heave of the centre of mass, the tilt about the fixed
axes x and y.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

UP = np.array([0.0, 0.0, 1.0])
STEP = 1e-30


@dataclass(frozen=True)
class Bodies:
    """Masses in kg, lengths in m, inertias in kg m^2; places, angles and angles of rollers by wheel.

    platform    its mass, its centre of mass above S, and its tensor about that
    hub, roller, rotor  mass, inertia about the axis and across it; a rotor turns by `gear` times its wheel's angle
    row_offset  how far outward rollers of even numbers stand, and inward the others
    contact     by wheel, the number of the roller that touches the ground, which is roller 0 in the coordinates
    meridian    of its circles the centre along the roller's axis and from it, and the radius; None: wheels stay round
    carries     by wheel, the circle that touches the ground; None: the lowest
    kinds       by wheel, another one of Bodies with its numbers; None: all have those here
    tilts       whether the platform heaves and tilts
    """

    places: np.ndarray
    axles: np.ndarray
    roller_angles: np.ndarray
    rollers: int
    wheel_radius: float
    axis_radius: float
    platform: tuple[float, Sequence, Sequence] = (9.0, (0.0, 0.0, 0.1), np.diag([0.2, 0.3, 0.35]))
    hub: tuple[float, float, float] = (0.4, 9e-4, 5e-4)
    roller: tuple[float, float, float] = (0.03, 2.5e-6, 4e-6)
    row_offset: float = 0.0
    contact: Sequence[int] | None = None
    meridian: Sequence[tuple[float, float, float]] | None = None
    carries: Sequence[int] | None = None
    kinds: Sequence["Bodies"] | None = None
    rotor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gear: float = 1.0
    tilts: bool = False

    @property
    def wheels(self) -> int:
        return len(self.places)

    @property
    def size(self) -> int:
        return self.place(self.wheels) + 3 * self.tilts

    @property
    def mass_of_wheel(self) -> float:
        return self.hub[0] + self.rotor[0] + self.rollers * self.roller[0]

    @property
    def mass(self) -> float:
        return self.platform[0] + sum(self.of(i).mass_of_wheel for i in range(self.wheels))

    @property
    def center(self) -> np.ndarray:
        """(3,) of mass of the whole, above S where the heading is 0."""
        parts = self.platform[0] * np.array(self.platform[1], float)
        for i in range(self.wheels):
            parts += self.of(i).mass_of_wheel * np.array([*self.places[i], self.of(i).wheel_radius])
        return parts / self.mass

    def aside(self, wheel: int, roller: int) -> float:
        """How far outward a roller stands."""
        return self.row_offset * (-1) ** (roller + (0 if self.contact is None else int(self.contact[wheel])))

    def of(self, wheel: int) -> "Bodies":
        """The numbers of a wheel."""
        return self if self.kinds is None else self.kinds[wheel]

    def place(self, wheel: int, roller: int = -1) -> int:
        """Where a wheel's angle, or that of one of its rollers, stands among the coordinates."""
        return 3 + sum(1 + self.of(i).rollers for i in range(wheel)) + 1 + roller


def _frame(bodies: Bodies, q: np.ndarray, wheel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The axle, the direction across it and the wheel's centre over the ground point of the platform, in fixed axes."""
    angle = bodies.axles[wheel] + q[2]
    x, y = bodies.places[wheel]
    axle = np.array([np.cos(angle), np.sin(angle), 0])
    across = np.array([-np.sin(angle), np.cos(angle), 0])
    height = bodies.of(wheel).wheel_radius
    return axle, across, _heading(q) @ [x, y, height]


def _heading(q: np.ndarray) -> np.ndarray:
    """(3, 3) from the platform's axes to the fixed ones."""
    cosine, sine = np.cos(q[2]), np.sin(q[2])
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def _roller(bodies: Bodies, q: np.ndarray, wheel: int, j: int) -> tuple[np.ndarray, np.ndarray]:
    """The axis of a roller and its middle, from the wheel's centre."""
    axle, across, _ = _frame(bodies, q, wheel)
    own, psi = bodies.of(wheel), bodies.roller_angles[wheel]
    beta = q[bodies.place(wheel)] + 2 * np.pi * j / own.rollers
    axis = np.cos(psi) * (np.cos(beta) * across + np.sin(beta) * UP) + np.sin(psi) * axle
    middle = -own.axis_radius * (np.cos(beta) * UP - np.sin(beta) * across)
    return axis, middle + bodies.aside(wheel, j) * axle


def _moving(
    bodies: Bodies, q: np.ndarray, arm: np.ndarray, axle: np.ndarray, wheel: int, own: np.ndarray
) -> np.ndarray:
    """(3, size) velocity, by the coordinates' rates, of a point that the wheel carries at `own` from its centre."""
    jacobian = of_platform(bodies, q, arm + own)
    jacobian[:, bodies.place(wheel)] += np.cross(axle, own)
    return jacobian


def of_platform(bodies: Bodies, q: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(3, size) velocity, by the coordinates' rates, of a point of the platform, from the ground point under S."""
    jacobian = np.zeros((3, bodies.size), complex)
    jacobian[0, 0] = jacobian[1, 1] = 1
    jacobian[:, 2] = np.cross(UP, point)
    if bodies.tilts:
        beside = point - _heading(q) @ [*bodies.center[:2], 0]
        jacobian[2, -3] = 1
        jacobian[:, -2:] = np.stack([np.cross(axis, beside) for axis in np.eye(3)[:2]], axis=-1)
    return jacobian


def turning_of_platform(bodies: Bodies) -> np.ndarray:
    """(3, size) its turning rate, by the coordinates' rates."""
    turning = np.zeros((3, bodies.size), complex)
    turning[:, 2] = UP
    if bodies.tilts:
        turning[:, -2:] = np.eye(3)[:, :2]
    return turning


def mass_matrix(bodies: Bodies, q: np.ndarray) -> np.ndarray:
    weight, place, tensor = bodies.platform
    moving, heading = of_platform(bodies, q, _heading(q) @ place), _heading(q)
    mass = weight * moving.T @ moving
    mass += turning_of_platform(bodies).T @ heading @ np.array(tensor) @ heading.T @ turning_of_platform(bodies)

    def add(weight: float, axial: float, transverse: float, moving: np.ndarray, turning: np.ndarray, axis: np.ndarray):
        along = axis @ turning
        mass[:] += weight * moving.T @ moving + transverse * turning.T @ turning
        mass[:] += (axial - transverse) * np.outer(along, along)

    for wheel in range(bodies.wheels):
        axle, _, arm = _frame(bodies, q, wheel)
        turning, geared = turning_of_platform(bodies), turning_of_platform(bodies)
        turning[:, bodies.place(wheel)], geared[:, bodies.place(wheel)] = axle, bodies.gear * axle
        own = bodies.of(wheel)
        weight, axial, transverse = own.hub
        psi = bodies.roller_angles[wheel]  # a vehicle has one wheel_inertia: the hubs make up for the rollers' angles
        axial -= own.rollers * (own.roller[1] * np.sin(psi) ** 2 + own.roller[2] * np.cos(psi) ** 2)
        middle = _moving(bodies, q, arm, axle, wheel, np.zeros(3))
        add(weight, axial, transverse, middle, turning, axle)
        add(*own.rotor, middle, geared, axle)
        for j in range(own.rollers):
            axis, middle = _roller(bodies, q, wheel, j)
            spinning = turning.copy()
            spinning[:, bodies.place(wheel, j)] = axis
            add(*own.roller, _moving(bodies, q, arm, axle, wheel, middle), spinning, axis)
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
    jacobian = _moving(bodies, q, arm, axle, wheel, touching)
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
