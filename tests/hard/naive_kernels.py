"""The accelerations as one writes them down: rho = l cos(chi) - r, 1/rho^2 in M*, and a linear solver."""

import numpy as np

from hard.sampling import Sample

AS_WRITTEN = "rho = l cos(chi) - r, 1/rho^2 in M*, a linear solver"


def accelerations(sample: Sample, set_name: str) -> dict[str, np.ndarray]:
    """nu' (3, K) of the reduced form, by (7.1) and (3.4) with the rollers in contact summed as they stand."""
    with np.errstate(all="ignore"):
        matrix, force = system(sample, locked=set_name.startswith("locked"))
        solved = np.full(force.shape, np.nan)
        for row in np.flatnonzero(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(force).all(axis=1)):
            try:
                solved[row] = np.linalg.solve(matrix[row], force[row])
            except np.linalg.LinAlgError:
                pass  # it stays NaN: the matrix was singular to rounding
    return {"forward_dynamics": solved.T}


def system(sample: Sample, locked: bool) -> tuple[np.ndarray, np.ndarray]:
    """M* (K, 3, 3) and f (K, 3)."""
    v = {name: array if array.ndim == 2 else array[:, None] for name, array in sample.vehicle.items()}
    radius, R, scale, B, J = (
        v[k] for k in ("wheel_radius", "platform_radius", "yaw_scale", "roller_inertia", "wheel_inertia")
    )
    chi, nu = sample.state["chi"], sample.state["nu"][:, :, None]
    cos, sin = np.cos(v["wheel_angles"]), np.sin(v["wheel_angles"])
    rho = radius * np.cos(chi) - v["roller_axis_radius"]
    yaw = nu[:, 2] / scale
    chi_dot = R / radius * (nu[:, 0] * sin - nu[:, 1] * cos - yaw)
    rolling = R * (nu[:, 0] * cos + nu[:, 1] * sin) / rho
    row = np.stack([R * cos / rho, R * sin / rho, np.sin(chi) / scale + 0 * rho])
    rate = np.stack([R / radius * sin, -R / radius * cos, -R / radius / scale + 0 * cos])
    drift = chi_dot * (radius * np.sin(chi) * rolling / rho + np.cos(chi) * yaw)
    matrix = np.einsum("akn,bkn,kn->kab", row, row, B + 0 * rho) + np.einsum("akn,bkn,kn->kab", rate, rate, J + 0 * rho)
    force = -np.einsum("akn,kn->ka", row, B * drift)
    couple = B * rolling * np.cos(chi)
    rollers = sample.wheels * sample.rollers / 2 * sample.vehicle["roller_inertia"]
    yaw_inertia = sample.vehicle["yaw_inertia"] - (0 if locked else rollers)
    if locked:  # the rollers off the ground turn with their disk: I_S counts sin^2(chi) already
        matrix[:, 2, 2] -= (B * (row[2]) ** 2).sum(axis=1)
        force[:, 2] += (B * row[2] * np.cos(chi) * yaw * chi_dot).sum(axis=1)
    else:
        momenta = sample.state["momenta"]
        couple = couple + B * yaw * np.sin(chi) * np.cos(chi)
        couple = couple + momenta[:, :, 0] * np.cos(chi) - momenta[:, :, 1] * np.sin(chi)
    push = np.stack([sin * yaw, -cos * yaw, -(nu[:, 0] * sin - nu[:, 1] * cos) / scale]) * R / radius * couple
    mass = sample.vehicle["mass"] * sample.vehicle["platform_radius"] ** 2
    matrix[:, [0, 1, 2], [0, 1, 2]] += np.stack([mass, mass, yaw_inertia / sample.vehicle["yaw_scale"] ** 2], axis=1)
    turning = np.stack([nu[:, 1, 0] * nu[:, 2, 0], -nu[:, 0, 0] * nu[:, 2, 0], 0 * nu[:, 0, 0]], axis=1)
    return matrix, force + push.sum(axis=2).T + (mass / sample.vehicle["yaw_scale"])[:, None] * turning
