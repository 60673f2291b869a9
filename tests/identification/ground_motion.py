"""Motions of a vehicle whose wheels slip, by a model of its own: what a fit to slip is tested with.

Three driven wheels with free rollers on a viscous ground, or on one with Coulomb's friction on which no contact ever
comes to rest. Lagrange's function by hand, from the geometry of paper.md; nothing of the package is used. With V the
velocity of S in the platform's axes, w the yaw rate, and for each wheel its rate u and the axial rates a_k of its
rollers k, whose angles are chi_k,

    T = M V^2/2 + (I - N n B/2) w^2/2 + sum (J u^2/2 + sum B a_k^2/2),    a_k = spin of roller k + w sin(chi_k),

where I is that of the whole with rollers at rest on their disks, of which sum B sin(chi_k)^2/2 is N n B/2 at any chi,

and the ground pushes at the contacts along the axle n and along the rolling direction t, where the slips are
V n - rho (spin of the roller in contact) and V t + R w + l u. Nothing jumps where a wheel passes to its next roller.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

RTOL, ATOL = 1e-9, 1e-11
STEP, ROWS = 0.01, 1001
R, L, AXIS = 0.15, 0.05, 0.035  # m: wheels from S, radius of a wheel, from its centre to a roller's axis
YAW_INERTIA, WHEEL_INERTIA, ROLLER_INERTIA, ROLLERS = 0.03, 3e-4, 2e-6, 5
ALPHA = np.array([0.3, 0.3 + 2 * np.pi / 3, 0.3 + 4 * np.pi / 3])
AXLES, ROLLING = np.stack([np.cos(ALPHA), np.sin(ALPHA)], 1), np.stack([-np.sin(ALPHA), np.cos(ALPHA)], 1)
GRAVITY, GEAR, TORQUE_CONSTANT, RESISTANCE = 9.80665, 4.0, 0.02, 1.5
KNOTS = np.arange(11.0)  # s
SENSES = np.array([1, -1, 1])  # in which the wheels turn all the time: under Coulomb's friction no contact sticks
VOLTS = SENSES * (2.5 + 1.2 * np.cos(2.6 * KNOTS[:, None] + 2.1 * np.arange(3)))  # at the knots, linear between them
START_RATES = 25.0 * SENSES  # rad/s


@dataclass(frozen=True)
class Truth:
    """What the fits seek: kg, N m s, and the law's number, N s/m (viscous) or 1 (coulomb)."""

    mass: float
    wheel_viscous: float
    ground: float


TRUTHS = {"viscous": Truth(2.4, 2e-3, 1.0), "coulomb": Truth(2.4, 2e-3, 0.01)}


def rates(time, y, law, truth, contact):
    """y' = (V', w', u', wheels' angles', axial rates', pose')."""
    V, w, u, angle, axial = y[:2], y[2], y[3:6], y[6:9], y[9 : 9 + 3 * ROLLERS].reshape(3, ROLLERS)
    chi = angle[:, None] - 2 * np.pi / ROLLERS * np.arange(ROLLERS)
    sine, cosine, own = np.sin(chi), np.cos(chi), (np.arange(3), contact)
    rho = L * cosine[own] - AXIS
    slip = np.stack([AXLES @ V - rho * (axial[own] - w * sine[own]), ROLLING @ V + R * w + L * u], 1)
    if law == "viscous":
        force = -truth.ground * slip
    else:
        force = -truth.ground * truth.mass * GRAVITY / 3 * slip / np.linalg.norm(slip, axis=1)[:, None]
    axial_dot = np.zeros((3, ROLLERS))
    axial_dot[own] = -rho * force[:, 0] / ROLLER_INERTIA
    knot = min(int(time), len(KNOTS) - 2)
    volts = VOLTS[knot] + (time - KNOTS[knot]) * (VOLTS[knot + 1] - VOLTS[knot])
    torque = GEAR * TORQUE_CONSTANT * (volts - TORQUE_CONSTANT * GEAR * u) / RESISTANCE - truth.wheel_viscous * u
    V_dot = (AXLES.T @ force[:, 0] + ROLLING.T @ force[:, 1]) / truth.mass + w * np.array([V[1], -V[0]])
    carried = ROLLER_INERTIA * (axial_dot * sine + axial * cosine * u[:, None]).sum()
    w_dot = (R * force[:, 1].sum() - carried) / (YAW_INERTIA - 3 * ROLLERS * ROLLER_INERTIA / 2)
    u_dot = (L * force[:, 1] + torque + ROLLER_INERTIA * w * (axial * cosine).sum(1)) / WHEEL_INERTIA
    c, s = np.cos(y[-1]), np.sin(y[-1])
    return np.concatenate([
        V_dot, [w_dot], u_dot, u, axial_dot.ravel(), [V[0] * c - V[1] * s, V[0] * s + V[1] * c, w]
    ])  # fmt: skip


def off_middle(angle, roller):
    """By how much a wheel has turned from where it stands on the middle of a roller, between -pi and pi."""
    return (angle - 2 * np.pi / ROLLERS * roller + np.pi) % (2 * np.pi) - np.pi


def joint_of(wheel):
    """The event of a wheel that leaves its roller, on either side."""

    def reached(time, y, law, truth, contact):
        return abs(off_middle(y[6 + wheel], contact[wheel])) - np.pi / ROLLERS

    reached.terminal, reached.direction = True, 1
    return reached


@cache
def motion(law, rows=ROWS):
    """(T, 3) the wheels' rates and (T, 3) the pose at T times, STEP apart; all but the wheels starts at rest."""
    truth, times = TRUTHS[law], STEP * np.arange(rows)
    y, contact = np.zeros(12 + 3 * ROLLERS), np.zeros(3, int)
    y[3:6] = START_RATES
    now, found = 0.0, []
    while now < times[-1]:
        end = min(float(KNOTS[np.searchsorted(KNOTS, now, side="right")]), float(times[-1]))
        part = solve_ivp(
            rates, (now, end), y, "DOP853", times[(times >= now) & (times < end)], rtol=RTOL, atol=ATOL,
            args=(law, truth, contact), dense_output=True, events=[joint_of(i) for i in range(3)],
        )  # fmt: skip
        assert part.status >= 0, part.message
        found += list(part.y.T) if len(part.t) else []
        now, y = float(part.sol.t_max), part.sol(part.sol.t_max)
        if part.status == 1:
            wheel = next(i for i, at in enumerate(part.t_events) if len(at))
            passed = int(np.sign(off_middle(y[6 + wheel], contact[wheel])))
            contact = (contact + passed * (np.arange(3) == wheel)) % ROLLERS
    found = np.array([*found, y])
    assert len(found) == rows
    return found[:, 3:6], found[:, -3:]
