"""What people quote of a run whose wheels may slip: slip per distance, and the ground's force along each direction."""

from typing import Any

import numpy as np

from omniroll.results.trajectory import Trajectory

POINTS = 2001  # beside the rows, between which integrals go straight


def slip_in_short(run: Trajectory) -> dict[str, Any] | None:
    """In plain Python types; None where wheels cannot slip.

    distance           in m, of the centre S along its path
    slip_path          (N,) in m, of each contact over the ground
    slip_per_distance  the mean of these over the distance; None of a vehicle that stays where it is
    force              (2,) in N, the largest of all contacts together: ahead or back, and to the sides
    friction           (2,) the same over the loads of all contacts at that time; None under a law that knows no loads
    """
    if run.slip is None:
        return None
    times = np.unique(np.concatenate([np.linspace(run.t[0], run.t[-1], POINTS), run.t]))
    samples = run.sample(times)
    speed = run.vehicle.platform_radius * np.linalg.norm(samples.nu[:, :2], axis=-1)
    distance = float(np.trapezoid(speed, times))
    paths = np.trapezoid(np.linalg.norm(samples.slip, axis=-1), times, axis=0)
    force = np.abs(_on_platform(run))
    loads = None if run.ground_load is None else run.ground_load.sum(axis=-1)
    return {
        "distance": distance,
        "slip_path": paths.tolist(),
        "slip_per_distance": float(paths.mean() / distance) if distance > 0 else None,
        "force": force.max(axis=0).tolist(),
        "friction": None if loads is None else _over(force, loads).max(axis=0).tolist(),
    }


def _on_platform(run: Trajectory) -> np.ndarray:
    """(T, 2) in N, the ground's force on all wheels, ahead and to the left."""
    angles = np.array(run.vehicle.wheel_angles)
    axles = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    rolling = np.stack([-np.sin(angles), np.cos(angles)], axis=-1)  # e_z x n
    return run.ground_force[..., 0] @ axles + run.ground_force[..., 1] @ rolling


def _over(force: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """0 where no contact presses."""
    return np.divide(force, loads[:, None], out=np.zeros_like(force), where=loads[:, None] > 0)
