"""A judge that knows no modes: what the laws of friction ask of each element in each row of a run.

Speeds of the elements and their rows are those of vehicles whose wheels stand on rays from the centre. Coordinates are
the centre's velocity along and across the platform, its yaw rate, the wheels' rates and the spins of the rollers in
contact. Written down from the geometry of paper.md; nothing of the package's rules is used.
"""

from typing import Any

import numpy as np

from omniroll import Bearings, Contact, Trajectory, Vehicle


def speeds_at(vehicle: Vehicle, at: Any) -> tuple[np.ndarray, np.ndarray]:
    """(T, N, 2) slips in m/s, which are zero where wheels cannot slip, and (T, N) rates of the wheels in rad/s.

    at  rows of a run, or samples, in one dimension of times
    """
    slip = np.zeros((*at.chi.shape, 2)) if at.slip is None else at.slip
    return slip, (slip[..., 1] - carried(vehicle, at.nu)) / vehicle.wheel_radius


def carried(vehicle: Vehicle, nu: np.ndarray) -> np.ndarray:
    """(T, N) in m/s, velocities of the wheels' centres along the rolling directions."""
    alpha = np.asarray(vehicle.wheel_angles)
    across = nu[..., 1, None] * np.cos(alpha) - nu[..., 0, None] * np.sin(alpha)
    return vehicle.platform_radius * (across + nu[..., 2, None] / vehicle.yaw_scale)


def contact_rows(vehicle: Vehicle, chi: np.ndarray) -> np.ndarray:
    """(4 N, 3 + 2 N) of slips along axles, along rolling directions, of the wheels' rates, of spins in contact."""
    wheels, alpha = vehicle.wheels, np.asarray(vehicle.wheel_angles)
    rho = vehicle.wheel_radius * np.cos(chi) - vehicle.roller_axis_radius
    none, each = np.zeros((wheels, 1)), np.eye(wheels)
    nothing = np.zeros((wheels, wheels))
    along = np.hstack([np.cos(alpha)[:, None], np.sin(alpha)[:, None], none, nothing, -np.diag(rho)])
    rolling = np.hstack([-np.sin(alpha)[:, None], np.cos(alpha)[:, None], none + vehicle.platform_radius,
                         vehicle.wheel_radius * each, nothing])  # fmt: skip
    axles, rollers = (np.hstack([np.zeros((wheels, 3)), *parts]) for parts in ((each, nothing), (nothing, each)))
    return np.vstack([along, rolling, axles, rollers])


# ---- the judge -------------------------------------------------------------------------------------------------------


def judged(run: Trajectory) -> dict[str, np.ndarray]:
    """(T, N) residuals of the law of each element in the rows of a run, relative; of static loads.

    No mode is read: an element obeys its law where it rests with a force that is admissible, or moves with the force
    that its motion has. Elements that a run does not have are not named. Free rollers off the ground are not judged:
    rows do not tell what their bearings take.
    """
    vehicle, effects = run.vehicle, run.effects.effects
    ground = next((effect for effect in effects if isinstance(effect, Contact)), None)
    bearings = [effect for effect in effects if isinstance(effect, Bearings)]
    slip, rates = speeds_at(vehicle, run)
    size = largest_so_far(run, slip, rates)
    series = run.roller_model == "massless" and "contact_bearing" not in run.effects.drives()
    part = slice(1 if series else 0, 2)  # massless rollers slip along their axles where their bearings stick
    found = {} if ground is None else {"contact": by_ground(run, ground, slip, size, part)}
    reach = vehicle.wheel_radius - vehicle.roller_axis_radius
    for name, column, turns, arm in (("axle", "bearing_torque", rates, vehicle.wheel_radius),
                                     ("roller in contact", "contact_bearing", run.contact_spin, reach)):  # fmt: skip
        if column in run.effects.drives():
            body = "wheel" if name == "axle" else "roller"
            sticking = next(one for one in bearings if getattr(one, f"{body}_coulomb") is not None)
            sliding, static = (getattr(sticking, f"{body}_{what}") for what in ("coulomb", "break_away"))
            torque = run.drive[:, run.effects.drives().index(column)]
            found[name] = by_bearing(torque, turns * arm / size, sliding, sliding if static is None else static)
    if run.pivots is not None and ground is not None:
        found["contact"] *= run.pivots == 0  # a wheel on its joint has two contacts
    if ground is not None and run.roller_model == "massless":
        found["series"] = in_series(run, bearings)
    return found


def largest_so_far(run: Trajectory, slip: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """(T, 1) in m/s, the largest speed that has been: what comes to rest is left with roundings of it."""
    vehicle = run.vehicle
    reach = vehicle.wheel_radius - vehicle.roller_axis_radius
    turning = np.abs(rates).max(axis=1) * vehicle.wheel_radius, np.abs(run.contact_spin).max(axis=1) * reach
    speeds = [np.abs(run.nu).max(axis=1) * vehicle.platform_radius, np.abs(slip).max(axis=(1, 2)), *turning]
    found = np.maximum.accumulate(np.max(speeds, axis=0))[:, None]
    return np.where(found > 0, found, 1.0)


def by_bearing(torque: np.ndarray, speed: np.ndarray, sliding: Any, static: Any) -> np.ndarray:
    """A torque of at most `static` at rest, of `sliding` against the motion; an interval."""
    sliding, static = (np.broadcast_to(value, torque.shape) for value in (sliding, static))
    rests = np.maximum(np.abs(speed), np.maximum(np.abs(torque) - static, 0) / sliding)
    return np.minimum(rests, np.abs(torque + sliding * np.sign(speed)) / sliding + (speed == 0))


def by_ground(run: Trajectory, ground: Contact, slip: np.ndarray, size: np.ndarray, part: slice) -> np.ndarray:
    """The law of the ground: a smooth one, or an ellipse of admissible forces to which the slip is normal.

    part  the directions, along the axle and along the rolling direction, in which friction acts
    """
    shape, load = run.ground_force.shape, run.ground_load
    force, slip = run.ground_force[..., part], slip[..., part]
    if ground.law == "viscous":
        damping = np.broadcast_to(ground.coefficient, shape)[..., part]
        return np.abs(force + damping * slip).max(axis=-1) / (damping.max() * size)
    both = np.broadcast_to(ground.friction, shape)
    sliding = both[..., part]
    grown = np.linalg.norm(sliding * slip, axis=-1)
    if ground.law == "regularised":
        grip = load / np.sqrt(grown**2 + both.prod(axis=-1) * ground.speed**2)
        return np.linalg.norm(force / sliding + grip[..., None] * sliding * slip, axis=-1) / load
    static = both if ground.static_friction is None else np.broadcast_to(ground.static_friction, shape)
    static = static[..., part]
    used, slid = (np.linalg.norm(force / friction, axis=-1) / load for friction in (static, sliding))
    rests = np.maximum(np.linalg.norm(slip, axis=-1) / size, np.maximum(used - 1, 0))
    normal = force / sliding**2
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    across = np.abs(slip[..., 0] * normal[..., -1] - slip[..., -1] * normal[..., 0]) / size
    along = np.maximum((slip * normal).sum(axis=-1), 0) / size
    return np.minimum(rests, np.maximum(np.abs(slid - 1), np.maximum(across, along)))


def in_series(run: Trajectory, bearings: list[Bearings]) -> np.ndarray:
    """A massless roller passes on what its bearing takes: the ground's force along the axle, at its arm."""
    vehicle, names = run.vehicle, run.effects.drives()
    rho = vehicle.wheel_radius * np.cos(run.chi) - vehicle.roller_axis_radius
    torque = run.drive[:, names.index("contact_bearing")] if "contact_bearing" in names else 0.0
    for one in bearings:
        if one.roller_viscous is not None:
            torque = torque - one.roller_viscous * run.contact_spin
        if one.roller_speed is not None:
            torque = torque - one.roller_coulomb * run.contact_spin / np.hypot(run.contact_spin, one.roller_speed)
    size = max(np.abs(run.ground_force).max(), 1e-300) * vehicle.wheel_radius
    return np.abs(torque - rho * run.ground_force[..., 0]) / size
