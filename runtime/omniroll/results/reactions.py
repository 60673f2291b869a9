"""Reactions: what the ground did to the wheels during a run, and whether it could have."""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects import Slope
from omniroll.effects.motor import spin_inertia_of
from omniroll.errors import InvalidValueError, RollingWarning
from omniroll.results.accelerations import call_named, torques_of_free_rollers, turning, with_accelerations
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.checks import refuse_kinds, refuse_two_rows
from omniroll.vehicles.loads import SupportPolygon, contact_loads, refuse_collinear
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import REACTIONS, STANDARD_GRAVITY, by_name, documented

ENTRIES = by_name(REACTIONS)
LIFTED = 1e-9  # of the weight: a load of a contact that may slip is zero within this
CENTRED = 1e-12  # distance, per R, within which the wheels' centroid is the centre of mass


@dataclass(frozen=True)
class Doubt:
    """Rows in a row in which a wheel could not have rolled without slip.

    wheel            number of the wheel
    reason           "load": the ground would have to pull; "slip": the force is beyond friction
    t_first, t_last  times of the rows
    worst            smallest load in N, or largest coefficient of friction that rolling needs
    motion           what needs it: rolling, or the motion of wheels that slip
    """

    wheel: int
    reason: str
    t_first: float
    t_last: float
    worst: float
    motion: str = "rolling"

    def __str__(self) -> str:
        at = f"t = {self.t_first:.6g}" + (f" to {self.t_last:.6g}" if self.t_last > self.t_first else "")
        needs = "a load of {:.4g} N, and the ground only pushes" if self.reason == "load" else "friction {:.4g}"
        return f"{at}, wheel {self.wheel + 1}: {self.motion} needs {needs.format(self.worst)}"


@dataclass(frozen=True, eq=False, repr=False)
class Reactions:
    """Reactions in the T rows of a trajectory; N wheels, numbered from 0. Arrays are read-only.

    t                (T,) time
    contact_force    (T, N, 2) in N, of the ground on a wheel: along its axle, and along its rolling direction,
                     which is the axle turned by a right angle against the clock seen from above
    load             (T, N) in N, positive where the ground pushes
    load_rule        "determinate" (three wheels), or "least norm": of the loads >= 0 that balance, those with the
                     least sum of squares; rigid bodies do not determine the loads of more than three wheels. Where no
                     loads >= 0 balance, the vehicle tips, and the loads are the least of any sign
    needed_friction  (T, N) coefficient of friction that rolling needs, |force|/load; infinite where the load is not
                     positive
    slip_margin      (T, N) in N, friction * load - |force|: negative where rolling needs more; None without friction
    contact_places   (N, 2) in m, places of the contacts in the platform's axes
    pressure_point   (T, 2) in m, where the resultant load acts, in the platform's axes
    tip_margin       (T,) in m, distance of the pressure point to the edge of the polygon of the contacts; negative
                     outside, where the vehicle tips
    doubts           every Doubt, in the order of time

    At a switch the rows before and after it have the forces of the motion there; the impulse of an impact is not a
    force, and is not in them. Of wheels that may slip contact_force is the ground's force in the run, needed_friction
    the coefficient that it takes of the load, and a Doubt tells of a load that the ground does not have.
    """

    t: np.ndarray
    contact_force: np.ndarray
    load: np.ndarray
    load_rule: str
    needed_friction: np.ndarray
    slip_margin: np.ndarray | None
    contact_places: np.ndarray
    pressure_point: np.ndarray
    tip_margin: np.ndarray
    doubts: tuple[Doubt, ...]

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def warnings(self) -> tuple[RollingWarning, ...]:
        """What reactions() warns of."""
        if not self.doubts:
            return ()
        more = f" (and {len(self.doubts) - 1} more, in Reactions.doubts)" if len(self.doubts) > 1 else ""
        of = "rolling without slip" if self.doubts[0].motion == "rolling" else "the motion"
        return (RollingWarning(f"{of} could not have held: {self.doubts[0]}{more}"),)

    def __repr__(self) -> str:
        wheels = self.load.shape[1]
        return f"<Reactions: N={wheels}, {len(self.t)} rows, {self.load_rule} loads, {len(self.doubts)} doubts>"


@documented(*REACTIONS)
def reactions(
    trajectory: Trajectory,
    *,
    height: float,
    friction: float | None = None,
    gravity: float | None = None,
    wheel_mass: float | None = None,
    platform_products: ArrayLike = (0.0, 0.0),
    spin_inertia: ArrayLike | None = None,
) -> Reactions:
    """Contact forces, loads, and the margins to slipping and tipping, for every row of a trajectory.

    trajectory  Trajectory, of a vehicle with three wheels or more
    {entries}

    Returns Reactions, whose arrays have a row for each row of the trajectory. The forces and the sums of the loads are
    generated functions (maxima, reactions, contact_loads). Warns with RollingWarning where rolling without slip could
    not have held, or the ground would have to pull on wheels that slip.
    Raises InvalidValueError for fewer than three wheels, for contacts on one line, and for numbers that make no sense.
    """
    if not isinstance(trajectory, Trajectory):
        raise InvalidValueError("trajectory", trajectory, "must be a Trajectory")
    result = judged_reactions(
        trajectory, height=height, friction=friction, gravity=gravity, wheel_mass=wheel_mass,
        platform_products=platform_products, spin_inertia=spin_inertia,
    )  # fmt: skip
    for warning in result.warnings():
        warnings.warn(warning, stacklevel=2)
    return result


def judged_reactions(
    trajectory: Trajectory,
    *,
    height: float,
    friction: float | None = None,
    gravity: float | None = None,
    wheel_mass: float | None = None,
    platform_products: ArrayLike = (0.0, 0.0),
    spin_inertia: ArrayLike | None = None,
) -> Reactions:
    """What reactions() gives, without a warning: the global filters of warnings are not for threads."""
    vehicle = trajectory.vehicle
    refuse_two_rows(vehicle, "trajectory", "reactions", "take rows = 1")
    refuse_kinds(vehicle, "trajectory", "reactions", "take wheels that are all alike")
    friction = ENTRIES["friction"].checked(friction)
    effects = trajectory.effects
    numbers = _balance_numbers(vehicle, height, wheel_mass, platform_products) | {
        "normal_gravity": _normal_gravity(trajectory, gravity),
        "spin_inertia": spin_inertia_of(effects.equipped(vehicle), effects.effects, spin_inertia),
    }
    slips = effects.slips
    contact_force, sums, places = (_of_slipping if slips else _forces_and_sums)(trajectory, numbers)
    return _judged(trajectory.t, contact_force, sums, places, friction, "the motion" if slips else "rolling")


def _balance_numbers(
    vehicle: Vehicle, height: float, wheel_mass: float | None, platform_products: ArrayLike
) -> dict[str, Any]:
    """height, wheel_mass and platform_products as the functions of the balance take them.

    vehicle  Vehicle with three wheels or more

    Raises InvalidValueError for numbers that make no sense, for fewer than three wheels, for contacts on one line, and
    where wheel_mass is needed and None.
    """
    places = vehicle.places()
    refuse_collinear(places)
    if wheel_mass is None:
        _refuse_unless_centred(vehicle, places)
    return {
        "height": ENTRIES["height"].checked(height),
        "platform_products": np.array(ENTRIES["platform_products"].checked(platform_products)),
        "wheel_mass": 0.0 if wheel_mass is None else _wheel_mass(vehicle, wheel_mass),
    }


def _wheel_mass(vehicle: Vehicle, wheel_mass: float) -> float:
    wheel_mass = ENTRIES["wheel_mass"].checked(wheel_mass)
    if vehicle.wheels * wheel_mass >= vehicle.mass:
        bound = f"wheels must be lighter than the whole vehicle, {vehicle.mass!r} kg"
        raise InvalidValueError("wheel_mass", wheel_mass, bound)
    return wheel_mass


def _refuse_unless_centred(vehicle: Vehicle, places: np.ndarray) -> None:
    beside = np.abs(places.mean(axis=0) - vehicle.center_of_mass).max()
    if beside > CENTRED * vehicle.platform_radius:
        bound = "must be given: the wheels' centroid is not below the centre of mass, so that their height matters"
        raise InvalidValueError("wheel_mass", None, bound)


def _judged(
    t: np.ndarray,
    contact_force: np.ndarray,
    sums: np.ndarray,
    places: np.ndarray,
    friction: float | None,
    motion: str,
) -> Reactions:
    """Loads and margins from the forces (T, N, 2) and the sums of the loads and their moments (T, 3)."""
    load = contact_loads(places, sums)
    size = np.linalg.norm(contact_force, axis=-1)
    needed = np.divide(size, load, out=np.full_like(load, np.inf), where=load > 0)
    pressure = sums[:, 1:] / sums[:, :1]
    rolls = motion == "rolling"  # a load that slips away is zero; one that rolls needs to be there
    doubts = _doubts(t, load <= 0 if rolls else load < -LIFTED * sums[:, :1], "load", load, np.min, motion)
    if friction is not None and rolls:
        doubts += _doubts(t, (load > 0) & (needed > friction), "slip", needed, np.max, motion)
    doubts.sort(key=lambda doubt: (doubt.t_first, doubt.wheel))
    return Reactions(
        t=t,
        contact_force=contact_force,
        load=load,
        load_rule="determinate" if len(places) == 3 else "least norm",
        needed_friction=needed,
        slip_margin=None if friction is None else friction * load - size,
        contact_places=places,
        pressure_point=pressure,
        tip_margin=SupportPolygon.of(places).margin(pressure),
        doubts=tuple(doubts),
    )


def _doubts(t: np.ndarray, holds: np.ndarray, reason: str, values: np.ndarray, worst: Any, motion: str) -> list[Doubt]:
    """One Doubt for each run of rows in which `holds` (T, N) holds for a wheel."""
    doubts = []
    for wheel in range(holds.shape[1]):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], holds[:, wheel], [False]])))
        for first, end in edges.reshape(-1, 2):
            extreme = float(worst(values[first:end, wheel]))
            doubts.append(Doubt(wheel, reason, float(t[first]), float(t[end - 1]), extreme, motion))
    return doubts


def _forces_and_sums(trajectory: Trajectory, numbers: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact forces (T, N, 2), sums of the loads and their moments (T, 3), places of the contacts (N, 2)."""
    # The Python kernel works on all rows at once.
    bound = trajectory.effects.kernel(trajectory.vehicle, trajectory.roller_model, "python", also=("reactions",))
    values = numbers | _drives(trajectory)
    values |= {"nu": trajectory.nu, "chi": trajectory.chi, "heading": trajectory.pose[:, 2], "spins": trajectory.spins}
    values |= torques_of_free_rollers(bound, trajectory.effects, values, modes_of_free_rollers(trajectory))
    values |= with_accelerations(bound, values)
    sums, places = call_named(bound, "load_balance", values)
    return call_named(bound, "contact_forces", values), sums, places[0]


def modes_of_free_rollers(trajectory: Trajectory) -> np.ndarray:
    """(T, N, n-1) the signs of the free rollers' spins in the phases that start with the rows, 0 where they rest.

    A roller that has broken away at a row has a spin in the next one.
    """
    if trajectory.spins is None:
        return np.zeros(0)
    signs = turning(trajectory.vehicle.yaw_scale, trajectory.nu, trajectory.spins)
    goes_on = np.diff(trajectory.elapsed)[:, None, None] > 0
    signs[:-1] = np.where((signs[:-1] == 0) & goes_on, signs[1:], signs[:-1])
    return signs


def _of_slipping(trajectory: Trajectory, numbers: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of wheels that may slip."""
    also = ("reactions", "contact_loads")
    bound = trajectory.effects.kernel(trajectory.vehicle, trajectory.roller_model, "python", also=also)
    values = numbers | trajectory.contacts.accelerations(trajectory.nu, trajectory.chi)
    if "coulomb_momenta" in bound.signatures:
        values["coulomb_momenta_dot"] = call_named(bound, "coulomb_momenta", values)
    sums, places = call_named(bound, "slip_load_balance", values)
    return trajectory.ground_force, sums, places[0]


def _drives(trajectory: Trajectory) -> dict[str, np.ndarray]:
    """The drives' inputs of the kernel in every row, by name."""
    if trajectory.drive is None:
        return {}
    return {name: trajectory.drive[:, k] for k, name in enumerate(trajectory.effects.drives())}


def _normal_gravity(trajectory: Trajectory, gravity: float | None) -> float:
    """Gravity across the plane of the run."""
    slope = next((effect for effect in trajectory.effects.effects if isinstance(effect, Slope)), None)
    if gravity is None:
        gravity = STANDARD_GRAVITY if slope is None else slope.gravity
    gravity = ENTRIES["gravity"].checked(gravity)
    if slope is None:
        return gravity
    if gravity != slope.gravity:
        raise InvalidValueError("gravity", gravity, f"must be that of the run's slope, {slope.gravity!r}")
    return slope.normal_gravity
