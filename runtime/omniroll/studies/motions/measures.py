"""Numbers read off a trajectory. Each is relative, so that a reader need not know the vehicle's units."""

import numpy as np


def spread(values: np.ndarray) -> float:
    """Largest minus smallest of `values`, shape (T,), in their unit."""
    return float(np.ptp(values))


def energy_spread(trajectory) -> float:
    """Spread of the kinetic energy over its first value."""
    return spread(trajectory.energy) / float(trajectory.energy[0])


def energy_change(trajectory) -> float:
    """Kinetic energy at the end over its first value, less 1."""
    return float(trajectory.energy[-1] / trajectory.energy[0]) - 1.0


def largest_energy_step(trajectory) -> float:
    """Largest energy step at a switch over the first energy; 0 where no wheel switches."""
    steps = np.abs(trajectory.switches["energy_jump"])
    return float(steps.max(initial=0.0) / trajectory.energy[0])


def energy_drift(trajectory) -> float:
    """Largest spread of the energy between two switches, over the first energy.

    A switch is recorded as rows of equal time, so that phases end where the time stands still.
    """
    ends = np.flatnonzero(np.diff(trajectory.t) == 0.0) + 1
    phases = np.split(trajectory.energy, ends)
    return max(spread(phase) for phase in phases) / float(trajectory.energy[0])


def path_length(trajectory) -> float:
    """Length of the centre's polygon through the rows, in m."""
    return float(np.hypot(*np.diff(trajectory.pose[:, :2], axis=0).T).sum())


def distance_from(trajectory, reference) -> float:
    """Largest distance between the two centres at equal times, in m."""
    other = reference.sample(trajectory.t).pose
    return float(np.hypot(*(trajectory.pose - other)[:, :2].T).max())


def angle_from(trajectory, reference) -> float:
    """Largest difference of the two headings at equal times, in rad."""
    other = reference.sample(trajectory.t).pose
    return float(np.abs((trajectory.pose - other)[:, 2]).max())


def circle(trajectory) -> tuple[float, float]:
    """Radius in m of the circle that fits the centre's path best, and the largest deviation over the radius.

    The fit is linear least squares in (a, b, c) of x^2 + y^2 = a x + b y + c.
    """
    x, y = trajectory.pose[:, 0], trajectory.pose[:, 1]
    unknowns = np.column_stack([x, y, np.ones_like(x)])
    a, b, c = np.linalg.lstsq(unknowns, x * x + y * y, rcond=None)[0]
    radius = float(np.sqrt(c + (a * a + b * b) / 4))
    deviation = np.hypot(x - a / 2, y - b / 2) - radius
    return radius, float(np.abs(deviation).max() / radius)
