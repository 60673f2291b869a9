"""Rigid-body kinematics of the contact points.

Bodies of wheel i: the platform turns with theta' Z about S; the disk turns with chi' n about the axle
through P; the roller turns with phi' a about its axis through c. The material point of the roller that is at
C, straight below P at depth l, has the speed

    v_C = v_S + theta' Z x (C - S) + chi' n x (C - P) + phi' a x (C - c).

Orientation. h = Z x n is the horizontal direction in the disk's plane. A turn by psi about n carries the
bottom direction -Z to u(psi) = sin(psi) h - cos(psi) Z and the axis h of the bottom roller to a(psi) =
cos(psi) h + sin(psi) Z. Every function takes balls or power series in time alike.
"""

from flint import arb

ZERO = arb(0)
UP = (0, 0, 1)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(*vectors):
    return tuple(sum(parts[1:], parts[0]) for parts in zip(*vectors, strict=True))


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def times(s, a):
    return (s * a[0], s * a[1], s * a[2])


def wheel_frame(vehicle, i, theta):
    """(SP, n, h) of wheel i in the fixed axes: S to the wheel's centre, the axle, the tangent Z x n."""
    px, py = vehicle.place(i)
    sin, cos = theta.sin(), theta.cos()
    centre = (cos * px - sin * py, sin * px + cos * py, ZERO)
    heading = theta + vehicle.axle_angle(i)
    axle = (heading.cos(), heading.sin(), ZERO)
    return centre, axle, cross(UP, axle)


def roller_axis(tangent, psi):
    """(u, a): direction from the wheel's centre to the roller's and the roller's axis, at the angle psi."""
    sin, cos = psi.sin(), psi.cos()
    return add(times(sin, tangent), times(-cos, UP)), add(times(cos, tangent), times(sin, UP))


def contact_columns(vehicle, i, theta, chi):
    """Speed of the contact point per unit of each generalised speed, and the tangent h.

    Returns ({"x", "y", "theta", "chi", "phi"} -> 3-vector, h).
    """
    centre, axle, tangent = wheel_frame(vehicle, i, theta)
    direction, axis = roller_axis(tangent, chi)
    down = times(-vehicle.number("wheel_radius"), UP)  # P to C
    contact = add(centre, down)  # S to C
    roller = times(vehicle.number("roller_axis_radius"), direction)  # P to the roller's centre
    columns = {
        "x": (arb(1), ZERO, ZERO),
        "y": (ZERO, arb(1), ZERO),
        "theta": cross(UP, contact),
        "chi": cross(axle, down),
        "phi": cross(axis, sub(down, roller)),
    }
    return columns, tangent


def constraint_rows(vehicle, i, theta, chi, model):
    """Rows of A for wheel i, one dict a row; A q' = 0.

    A massive contact roller gives both horizontal parts of v_C. A massless one yields freely along the axle,
    and only the part of v_C along h is constrained; the roller's own coordinate is dropped.
    """
    columns, tangent = contact_columns(vehicle, i, theta, chi)
    if model == "massless":
        return [{name: dot(tangent, columns[name]) for name in ("x", "y", "theta", "chi")}]
    return [{name: column[k] for name, column in columns.items()} for k in (0, 1)]


def platform_speeds(vehicle, nu, theta):
    """(x', y', theta') from nu: v_S = R nu_1 e_xi + R nu_2 e_eta, nu_3 = Lambda theta'."""
    sin, cos = theta.sin(), theta.cos()
    forward, left = (vehicle.number("platform_radius") * v for v in nu[:2])
    return cos * forward - sin * left, sin * forward + cos * left, nu[2] / vehicle.number("yaw_scale")


def contact_speeds(vehicle, i, theta, chi, platform):
    """(chi', phi') of wheel i from the platform's speeds (x', y', theta'): the two equations v_C = 0, by
    Cramer.
    """
    columns, _ = contact_columns(vehicle, i, theta, chi)
    given = add(*(times(s, columns[name]) for s, name in zip(platform, ("x", "y", "theta"), strict=True)))
    disk, roller = columns["chi"], columns["phi"]
    det = disk[0] * roller[1] - disk[1] * roller[0]
    return ((given[1] * roller[0] - given[0] * roller[1]) / det, (given[0] * disk[1] - given[1] * disk[0]) / det)
