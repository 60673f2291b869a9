"""From the oracle's data to the project's interface and back. omniroll is imported only when it is called
for.
"""

from itertools import pairwise

import numpy as np

from . import lagrange
from .balls import exact, working_precision
from .vehicle import SCALARS, OracleVehicle


def project_vehicle(vehicle):
    """omniroll.Vehicle with the same floats."""
    import omniroll

    return omniroll.Vehicle(**vehicle.fields())


def simulated(vehicle, nu, chi, spins, model, law="impact", **options):
    """The motion of omniroll.Vehicle from a start of the oracle's; spins are those of free rollers."""
    import omniroll

    if model == "free":
        options["spins"] = spins
    return omniroll.simulate(project_vehicle(vehicle), nu=nu, chi=chi, roller_model=model, switching=law, **options)


def oracle_vehicle(vehicle):
    """OracleVehicle with the floats of an omniroll.Vehicle."""
    fields = {name: float(getattr(vehicle, name)) for name in SCALARS}
    angles = tuple(float(a) for a in vehicle.wheel_angles)
    return OracleVehicle(**fields, wheel_angles=angles, rollers_per_wheel=int(vehicle.rollers_per_wheel))


def floats(values):
    """Balls as an array of floats."""
    return np.array([float(v) for v in values])


@working_precision
def row_speeds(vehicle, trajectory, row, model):
    """(theta, chi, q') of one row of a Trajectory; contact rollers take the spin that the row states."""
    theta, chi = exact(trajectory.pose[row][2]), [exact(c) for c in trajectory.chi[row]]
    spins = trajectory.spins[row] if model == "free" else None
    dq = lagrange.speeds(vehicle, trajectory.nu[row], chi, spins, model=model, theta=theta)
    if model != "massless":
        for i, spin in enumerate(trajectory.contact_spin[row]):
            dq.phi[i][0] = exact(spin)
    return theta, chi, dq


def switch_table(trajectory):
    """The switches of a Trajectory as a list of (t, wheel, direction, energy_jump), one for each wheel."""
    names = ("t", "wheel", "direction", "energy_jump")
    return [tuple(row[name].item() for name in names) for row in trajectory.switches]


def switch_rows(trajectory):
    """[(row before, row after, {wheel: direction})] for every switch of a Trajectory, by its doubled rows."""
    found, table, used = [], switch_table(trajectory), 0
    t, contact = np.asarray(trajectory.t), np.asarray(trajectory.contact)
    for row in range(len(t) - 1):
        changed = np.flatnonzero(contact[row] != contact[row + 1])
        if len(changed) == 0:
            continue
        assert t[row] == t[row + 1], "a switch has two rows at one time"
        moves = {int(w): int(d) for _, w, d, _ in table[used : used + len(changed)]}
        assert sorted(moves) == changed.tolist(), "the list of switches names the wheels whose contact changes"
        used += len(changed)
        found.append((row, row + 1, moves))
    assert used == len(table), "every listed switch has its two rows"
    return found


def phases(trajectory):
    """Slices of the rows between switches."""
    edges = [0, *(after for _, after, _ in switch_rows(trajectory)), len(trajectory.t)]
    return [slice(a, b) for a, b in pairwise(edges)]


def error(vehicle, nu_start, pose, nu, pose_wanted, nu_wanted):
    """The max-norm in which `accuracy` is stated: ((x, y)/R, theta, nu/|nu(0)|)."""
    radius = float(vehicle.platform_radius)
    places = np.abs(np.asarray(pose) - pose_wanted) / np.array([radius, radius, 1.0])
    return float(max(places.max(), np.abs(np.asarray(nu) - nu_wanted).max() / np.linalg.norm(nu_start)))
