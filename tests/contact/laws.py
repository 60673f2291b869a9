"""What Coulomb's friction as the set-valued law asks of each row of a run, as residuals.

They are computed from the speeds and the forces of a row by the formulas of docs/ground-contact.md and the geometry of
`Vehicle.paper()`; nothing of the package's own rules is used.

Forces are relative to coefficient times load, and where that is less, times the wheel's share of the weight: a load
may vanish. Slips are relative to the largest speed so far: a vehicle that comes to rest is left with roundings of the
speeds that it had. So is the slip across the force's normal to the ellipse: a slip that is rounding itself has no
direction that could be known, and any force of the ellipse is then one of maximal dissipation.
"""

from collections.abc import Mapping

import numpy as np

from omniroll import Contact, Vehicle
from omniroll.results.trajectory import Trajectory


def residuals(vehicle: Vehicle, ground: Contact, run: Trajectory, weight: float) -> Mapping[str, np.ndarray]:
    """(T, N) of each part of the law, by name; weight in N, of the whole vehicle across the ground."""
    free = run.roller_model == "free"
    own = slice(0, 2) if free else slice(1, 2)  # massless rollers do not slip along their axles
    slip, speeds = slips(vehicle, run)
    slip, force = slip[..., own], run.ground_force[..., own]
    sliding, static = (
        np.broadcast_to(friction, (*run.sticks.shape, 2))[..., own]
        for friction in (ground.friction, ground.static_friction or ground.friction)
    )
    carries, load, found = loads(vehicle, ground, run, weight)
    slides, off = carries & ~run.sticks, ~carries
    size = np.maximum(load, weight / vehicle.wheels)  # a load may vanish
    used, slid = (np.linalg.norm(force / friction, axis=-1) for friction in (static, sliding))
    normal = force / sliding**2  # of the ellipse, at the force
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    across = np.abs(slip[..., 0] * normal[..., -1] - slip[..., -1] * normal[..., 0]) if free else 0 * speeds
    along = (slip * normal).sum(axis=-1)

    def where(modes, values):
        return np.where(modes, values, 0.0)

    return found | {
        "off: no force": where(off, np.linalg.norm(force, axis=-1) / (sliding.max(axis=-1) * weight)),
        "sticks: within the ellipse": where(run.sticks & carries, np.maximum(used - load, 0) / size),
        "sticks: no slip": where(run.sticks, np.linalg.norm(slip, axis=-1) / speeds),
        "slips: on the ellipse": where(slides, np.abs(slid - load) / size),
        "slips: the normal is along the slip": where(slides, across / speeds),
        "slips: against it": where(slides, np.maximum(along, 0) / speeds),
    }


def slips(vehicle: Vehicle, run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """(T, N, 2) in m/s, of wheels on rays from the centre; (T, 1), the largest speed that has been in one so far."""
    radius, reach = vehicle.platform_radius, vehicle.wheel_radius
    alpha = np.asarray(vehicle.wheel_angles)
    nu_1, nu_2, nu_3 = (run.nu[:, k, None] for k in range(3))
    yaw, rates = nu_3 / vehicle.yaw_scale, run.quantity("rates")
    rolling = reach * rates - radius * (nu_1 * np.sin(alpha) - nu_2 * np.cos(alpha)) + radius * yaw
    platform = np.abs(np.column_stack([run.nu[:, :2], yaw])).max(axis=1)
    made_of = [radius * platform, reach * np.abs(rates).max(axis=1)]
    along = np.zeros_like(rolling)
    if run.roller_model == "free":
        rho, omega = reach * np.cos(run.chi) - vehicle.roller_axis_radius, run.quantity("contact_omega")
        along = radius * (nu_1 * np.cos(alpha) + nu_2 * np.sin(alpha)) - rho * (omega - yaw * np.sin(run.chi))
        made_of.append((np.abs(rho) * np.abs(omega)).max(axis=1))
    largest = np.maximum.accumulate(np.max(made_of, axis=0))[:, None]
    return np.stack([along, rolling], axis=-1), np.where(largest > 0, largest, 1.0)


def loads(
    vehicle: Vehicle, ground: Contact, run: Trajectory, weight: float
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Which contacts carry (T, N), the loads (T, N) in N, and the residuals of loads that follow the motion: they push,
    are together the weight, and share it as equal springs under a plane, which pulls where a contact is off."""
    load = run.ground_load
    if ground.loads == "static":
        return load > 0, load, {}
    names = run.effects.drives()
    carries = run.drive[:, names.index("carries")] > 0.5
    places = np.column_stack([np.ones(vehicle.wheels), vehicle.places()])
    planes = np.array([places @ np.linalg.lstsq(places[on], found[on], rcond=None)[0] for on, found in
                       zip(carries, load, strict=True)])  # fmt: skip
    return (
        carries,
        load,
        {
            "load: pushes": np.where(carries, np.maximum(-load, 0), np.abs(load)) / weight,
            "load: of a plane": np.where(carries, np.abs(load - planes), 0) / weight,
            "load: off where the plane pulls": np.where(carries, 0, np.maximum(planes, 0)) / weight,
            "load: the weight": np.abs(load.sum(axis=1, keepdims=True) - weight) / weight + 0 * load,
        },
    )
