"""How far two trajectories of one motion are apart."""

import numpy as np

from omniroll.trajectory import Trajectory


def difference(coarse: Trajectory, fine: Trajectory) -> float:
    """The distance in the max-norm of ((x, y)/R, theta, nu/|nu(0)|), the norm of `accuracy`.

    Taken in the middle of each step of `fine` and at its end. Speeds jump at switches, whose times differ a
    little between the two: they are compared where both have the same rollers in contact.
    """
    times = (fine.t[fine.step_rows] + fine.t[np.minimum(fine.step_rows + 1, len(fine) - 1)]) / 2
    times = np.append(times, min(fine.t[-1], coarse.t[-1]))
    times = times[times <= coarse.t[-1]]
    one, other = coarse.sample(times), fine.sample(times)
    pose = np.abs(one.pose - other.pose) / [fine.vehicle.platform_radius, fine.vehicle.platform_radius, 1.0]
    speed = float(np.linalg.norm(fine.nu[0]))
    same = (one.contact == other.contact).all(axis=-1)
    nu = np.abs(one.nu - other.nu)[same] / (speed if speed > 0 else 1.0)
    return float(max(pose.max(), nu.max(initial=0.0)))
