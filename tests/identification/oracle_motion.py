"""Motions of the independent oracle: what a fit is tested with must not come from the simulator that fits.

Between switches SciPy's DOP853 integrates what oracle.lagrange finds, rigid bodies with multipliers; at a switch the
oracle's impact gives the new speeds. The axles have viscous friction, and the torques are given over time.

`python -m identification.oracle_motion`, from tests/, writes the motions into tests/data/oracle-motions/ (20 s): what
the wheels' rates are without noise. A test makes the start of each again.
"""

from functools import cache
from pathlib import Path

import numpy as np
from oracle import lagrange
from oracle.balls import working_precision
from oracle.bridge import floats, oracle_vehicle
from oracle.lagrange import Speeds
from oracle.switch import after_switch, nu_of
from scipy.integrate import solve_ivp

import omniroll

WHEELS, ROLLERS = 3, 4
VEHICLE = omniroll.Vehicle(  # drawn once by chance
    wheels=WHEELS, rollers_per_wheel=ROLLERS, wheel_angles=(4.216435833492329, 6.310830935885525, 8.40522603827872),
    platform_radius=0.18309833188891114, wheel_radius=0.054437866673370264, roller_axis_radius=0.03349214372553513,
    mass=3.396913923928562, yaw_inertia=0.050379504614739494, wheel_inertia=0.0004778023629298964,
    roller_inertia=3.2081714286872323e-06, yaw_scale=1.3,
)  # fmt: skip
ORACLE = oracle_vehicle(VEHICLE)
CHI, SPINS = slice(3, 3 + WHEELS), slice(3 + WHEELS, None)  # in y, behind nu
JOINT = np.pi / ROLLERS
FRICTION = 4e-3  # N m s
RTOL, ATOL, FIRST_STEP = 1e-7, 1e-9, 0.02

KNOTS = np.arange(11.0)  # s
# After the start every wheel keeps its sense of rotation. Where one turns back at a joint, or two change the order of
# their switches, a small change of the numbers makes the motion under impact jump; here that is rare.
FORCE = 0.05 * np.array([0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1])  # N m, torques along a direction of the platform
DIRECTION = np.array([0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9])  # rad
YAW = 0.05 * np.array([0, 1, 1.2, 0.8, 1.1, 0.9, 1.2, 0.8, 1, 1.1, 1])  # N m, torques of all wheels alike


def torques(force, yaw, direction):
    """(K, N) in N m, at the knots."""
    return -force[:, None] * np.sin(np.array(VEHICLE.wheel_angles) - direction[:, None]) - yaw[:, None]


STEP = 0.01  # s, between two rows of a motion
FILES = Path(__file__).parent.parent / "data" / "oracle-motions"
SCHEDULES = {
    "turning while driving": torques(FORCE, YAW, DIRECTION),
    "straight": torques(FORCE, 0 * YAW, np.full(11, VEHICLE.wheel_angles[0])),
    "on the spot": torques(0 * FORCE, YAW, 0 * DIRECTION),
}


def effects(name):
    """What acts in the motion of this name, as the simulator has it."""
    return [omniroll.TorqueTable(KNOTS, SCHEDULES[name]), omniroll.Bearings(wheel_viscous=FRICTION)]


def wheel_rates(nu, chi):
    """(N,) by the oracle's constraints."""
    return floats(lagrange.speeds(ORACLE, nu, chi, model="free").chi)


@working_precision
def rates(time, y, schedule):
    """y' = (nu', chi', spins')."""
    nu, chi, spins = y[:3], y[CHI], y[SPINS].reshape(WHEELS, -1)
    chi_dot = wheel_rates(nu, chi)
    forces = Speeds.zero(ORACLE)
    forces.chi = [np.interp(time, KNOTS, column) for column in schedule.T] - FRICTION * chi_dot
    found = lagrange.accelerations(ORACLE, nu, chi, spins.tolist(), forces=forces)
    return np.concatenate([floats(found.nu_dot), chi_dot, *map(floats, found.spins_dot)])


@working_precision
def switched(y):
    """y after the wheels at their joints have passed them."""
    nu, chi, spins = y[:3], y[CHI], y[SPINS].reshape(WHEELS, -1)
    dq = lagrange.speeds(ORACLE, nu, chi, spins.tolist(), model="free")
    out = (np.abs(chi) > JOINT * (1 - 1e-9)) & (chi * floats(dq.chi) > 0)
    moves = {int(i): int(np.sign(chi[i])) for i in np.flatnonzero(out)}
    chi, dq = after_switch(ORACLE, 0, chi, dq, moves, model="free", law="impact")
    spins = [floats(wheel[1:]) for wheel in dq.phi]
    return np.concatenate([floats(nu_of(ORACLE, lagrange.exact(0), dq)), floats(chi), *spins])


def joint_of(wheel):
    """The event of a wheel at either joint, moving out."""

    def reached(time, y, schedule):
        return abs(y[3 + wheel]) - JOINT

    reached.terminal, reached.direction = True, 1
    return reached


ROWS = {"turning while driving": 1001, "straight": 301, "on the spot": 301}


def file_of(name):
    return FILES / f"{name.replace(' ', '-')}.csv"


@cache
def recorded(name):
    """(T, N) the wheels' rates of a motion, from its file."""
    return np.loadtxt(file_of(name), delimiter=",", skiprows=1)[:, 1:]


def motion(name, count):
    """(T, N) the wheels' rates at T = count times from 0 on, from rest; the times are apart by STEP."""
    times, schedule = STEP * np.arange(count), SCHEDULES[name]
    y, now, found = np.zeros(3 + WHEELS * ROLLERS), 0.0, np.empty((0, WHEELS))
    while now < times[-1]:
        end = min(float(KNOTS[np.searchsorted(KNOTS, now, side="right")]), float(times[-1]))
        wanted = times[(times >= now) & (times < end)]
        part = solve_ivp(
            rates, (now, end), y, "DOP853", wanted, rtol=RTOL, atol=ATOL, args=(schedule,), dense_output=True,
            events=[joint_of(i) for i in range(WHEELS)], first_step=min(FIRST_STEP, end - now),
        )  # fmt: skip
        assert part.status >= 0, part.message
        if len(part.t):
            found = np.concatenate([found, [wheel_rates(state[:3], state[CHI]) for state in part.y.T]])
        now = float(part.sol.t_max)
        y = switched(part.sol(now)) if part.status == 1 else part.sol(now)
    found = np.concatenate([found, [wheel_rates(y[:3], y[CHI])]])
    assert len(found) == count
    return found


if __name__ == "__main__":
    FILES.mkdir(parents=True, exist_ok=True)
    for name, count in ROWS.items():
        rates_over_time = motion(name, count)
        rows = np.column_stack([STEP * np.arange(count), rates_over_time])
        header = ",".join(["t", *(f"wheel_rate_{i + 1}" for i in range(WHEELS))])
        np.savetxt(file_of(name), rows, fmt="%.17g", delimiter=",", header=header, comments="")
