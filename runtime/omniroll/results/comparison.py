"""How far two trajectories of one motion are apart."""

import numpy as np

from omniroll.results.trajectory import Trajectory


def difference(coarse: Trajectory, fine: Trajectory) -> float:
    """The distance in the max-norm of ((x, y)/R, theta, nu/|nu|), the norm of `accuracy`.

    |nu| is that of the start; with effects, which may start from rest, the largest of the run.

    Taken in the middle of each step of `fine` and at its end. Speeds jump at switches, whose times differ a
    little between the two: they are compared where both have the same rollers in contact.
    """
    times = (fine.t[fine.step_rows] + fine.t[np.minimum(fine.step_rows + 1, len(fine) - 1)]) / 2
    times = np.append(times, min(fine.t[-1], coarse.t[-1]))
    return distance_at(coarse, fine, times[times <= coarse.t[-1]])


def distance_at(coarse: Trajectory, fine: Trajectory, times: np.ndarray) -> float:
    """The largest distance in that norm at given times (T,), which lie within both runs."""
    (one, one_contact), (other, other_contact) = coarse.state_at(times), fine.state_at(times)
    radius = fine.vehicle.platform_radius
    pose = np.abs(one[:, -3:] - other[:, -3:]) / [radius, radius, 1.0]
    speeds = np.linalg.norm(fine.nu if fine.effects else fine.nu[:1], axis=-1)
    speed = float(speeds.max())
    same = (one_contact == other_contact).all(axis=-1)
    nu = np.abs(one[:, :3] - other[:, :3])[same] / (speed if speed > 0 else 1.0)
    return float(max(pose.max(), nu.max(initial=0.0)))
