"""What instruments on a robot read of a motion, with their resolution, noise and bias.

omniroll.vocabulary.MEASUREMENTS is the one table of them.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omniroll import validation, vocabulary
from omniroll.effects import Motor, Slope
from omniroll.effects.effect_set import EffectSet
from omniroll.effects.motor import LINEAR, MODES
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.results.accelerations import torques_of_free_rollers, turning, with_accelerations
from omniroll.results.tracking import TrackingWheels, turns_of
from omniroll.vehicles import profiles
from omniroll.vehicles.checks import joint_angles
from omniroll.vehicles.vehicle import Vehicle

NAMES = tuple(entry.name for entry in vocabulary.MEASUREMENTS)
ANGLE_OF = {"encoder_count": "wheel_angle", "tracking_count": "tracking_angle"}  # what encoders count, by the counts
OF_TRACKING = tuple(entry.name for entry in vocabulary.INSTRUMENTS if entry.name.startswith("tracking_"))


@vocabulary.documented(*vocabulary.INSTRUMENTS)
@dataclass(frozen=True)
class Instruments:
    """The instruments of a robot. Without errors they read what is.

    {entries}
    resolution       dict: readings by name are rounded to multiples of this, in their unit
    noise            dict: standard deviation of normal noise, in the reading's unit
    bias             dict: what is added to every reading, in its unit

    The dicts have names of omniroll.vocabulary.WITH_ERRORS. Raises InvalidValueError.
    """

    counts_per_turn: float = 4096.0
    place: tuple[float, float] = (0.0, 0.0)
    seed: int = 0
    resolution: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    bias: Mapping[str, float] = field(default_factory=dict)
    tracking_places: tuple[tuple[float, float], ...] | None = None
    tracking_directions: tuple[float, ...] | None = None
    tracking_radius: float | None = None
    tracking_counts_per_turn: float = 2000.0
    place_height: float | None = None

    def __post_init__(self) -> None:
        for entry in vocabulary.INSTRUMENTS:
            object.__setattr__(self, entry.name, entry.checked(getattr(self, entry.name)))
        for name in vocabulary.KINDS_OF_ERROR:
            object.__setattr__(self, name, _checked(name, getattr(self, name)))
        tracking_of(self)

    def read(self, true: Mapping[str, np.ndarray], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Readings by name: bias, noise and resolution in this order.

        true  what ideal instruments read, by name
        rng   that the noise comes from
        """
        return {name: self._read(name, np.asarray(value), rng) for name, value in true.items()}

    def _read(self, name: str, value: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        value = value + self.bias.get(name, 0.0) if name in self.bias else value
        if self.noise.get(name):
            value = value + rng.normal(scale=self.noise[name], size=value.shape)
        step = self.resolution.get(name, 0.0)
        return np.round(value / step) * step if step else value

    def counts(self, wheel_angle: np.ndarray) -> np.ndarray:
        """Whole counts of the encoders, int64 of the same shape.

        wheel_angle  (...) in rad

        Raises InvalidValueError for what is no such array.
        """
        return _whole(validation.real_array("wheel_angle", wheel_angle), self.counts_per_turn)


def tracking_of(instruments: Instruments) -> TrackingWheels | None:
    """The tracking wheels; None where there are none. Raises InvalidValueError for some that do not fit together."""
    given = {name: getattr(instruments, name) for name in OF_TRACKING}
    there = [name for name in OF_TRACKING[:3] if given[name] is not None]
    return TrackingWheels(**given) if there else None


def counts_per_rad(instruments: Instruments, name: str) -> float:
    """How many of the counts of this name, one of ANGLE_OF, a rad is."""
    of = instruments
    return {"encoder_count": of.counts_per_turn, "tracking_count": of.tracking_counts_per_turn}[name] / (2 * math.pi)


def _whole(angle: np.ndarray, per_turn: float) -> np.ndarray:
    return np.floor(angle * (per_turn / (2 * math.pi))).astype(np.int64)


def checked_instruments(given: Any) -> Instruments:
    """Instruments, or None for those without errors. Raises InvalidValueError."""
    if given is None:
        return Instruments()
    if not isinstance(given, Instruments):
        raise InvalidValueError("instruments", given, "must be Instruments, or None")
    return given


def _checked(name: str, given: Any) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise InvalidValueError(name, given, "must be a dict of numbers by the names of readings")
    for reading, value in given.items():
        validation.choice(name, reading, vocabulary.WITH_ERRORS)
        if name == "bias":
            validation.real(f"bias of {reading}", value)
        else:
            validation.not_negative(f"{name} of {reading}", value)
    return {reading: float(value) for reading, value in given.items()}


@dataclass(frozen=True)
class Moments:
    """A motion at some times: nu (T, 3), chi (T, N), pose (T, 3), contact (T, N), spins (T, N, n-1) or None, which only
    the accelerometer needs, the inputs of the drives (T, N) by name, and how often each wheel has passed a joint since
    the start, (T, N).

    Of wheels that may slip also their rates (T, N), and what makes the accelerations by name: nu_dot (T, 3), and on
    springs beside tilt_rate_dot (T, 3) also tilt and tilt_rate. What makes nu integrated since the start (T, 3), for
    tracking wheels; None where that is not known."""

    nu: np.ndarray
    chi: np.ndarray
    pose: np.ndarray
    contact: np.ndarray
    spins: np.ndarray | None
    drives: Mapping[str, np.ndarray]
    passes: np.ndarray
    rates: np.ndarray | None = None
    accelerations: Callable[[], Mapping[str, np.ndarray]] | None = None
    ways: Callable[[], np.ndarray] | None = None


def readings_of(vehicle: Vehicle, effects: EffectSet, names: Sequence[str] | None) -> tuple[str, ...]:
    """The names of the wanted readings; None: of all that there are. Raises InvalidValueError for one that is not told.

    Where wheels may stand on the joint of two rollers, the acceleration depends on how these share the force.
    """
    has_loads = vehicle.has_wheels_of_the_paper and not vehicle.has_kinds
    untold = () if has_loads or effects.slips else ("accelerometer",)
    if names is None:
        return tuple(name for name in NAMES if name not in untold)
    for name in untold:
        if name in names:
            bound = "is told of omni-wheels in one row, all alike, and of wheels that may slip: ask for other readings"
            raise InvalidValueError("names", name, bound)
    return tuple(names)


def true_values(
    vehicle: Vehicle,
    roller_model: str,
    effects: EffectSet,
    moments: Moments,
    instruments: Instruments,
    wanted: Sequence[str],
    bound: Kernel | None = None,
) -> dict[str, np.ndarray]:
    """What ideal instruments of the wanted names read; without odometries, which depend on the readings before.

    bound  the kernel whose functions are taken, as `measuring_kernel` gives it; a TangentKernel of that where the
           moments carry tangents, which counts do not

    Raises InvalidValueError for wheels that may slip where the moments do not have their rates.
    """
    if effects.slips and moments.rates is None:
        given = [type(effect).__name__ for effect in effects.effects]
        raise InvalidValueError(
            "effects", given, "must be without Contact: a session's instruments know wheels that roll"
        )
    bound = bound or measuring_kernel(vehicle, roller_model, effects, wanted)
    rate = bound.wheel_speeds(moments.nu, moments.chi) if moments.rates is None else moments.rates
    angle = moments.chi + moments.passes * (2 * joint_angles(vehicle))
    found = {"wheel_angle": angle, "wheel_rate": rate}
    if "encoder_count" in wanted:
        found["encoder_count"] = instruments.counts(angle)
    found |= _of_drives(bound, effects, moments.drives, rate)
    found["gyro"] = moments.nu[..., 2] / bound.constant("yaw_scale")
    if "accelerometer" in wanted:
        found["accelerometer"] = _felt(bound, effects, moments, instruments)
    found["contact_roller"] = moments.contact
    if (wheels := tracking_of(instruments)) is not None:
        found |= _tracked(bound, moments, wheels, wanted)
    return {name: value for name, value in found.items() if name in wanted}


def measuring_kernel(vehicle: Vehicle, roller_model: str, effects: EffectSet, wanted: Sequence[str]) -> Kernel:
    """The kernel for the wanted readings: Python's, which works on all times at once.

    For the accelerometer reactions bring the functions of each roller's spin.
    """
    also = ("reactions",) if "accelerometer" in wanted and not effects.slips else ()
    return effects.kernel(vehicle, roller_model, "python", also=also)


def _tracked(bound: Kernel, moments: Moments, wheels: TrackingWheels, wanted: Sequence[str]) -> dict[str, np.ndarray]:
    """What the encoders of tracking wheels read; angles and counts where the moments know nu's integral."""
    found = {"tracking_rate": wheels.rates(bound, moments.nu)}
    if moments.ways is not None and {"tracking_angle", "tracking_count"}.intersection(wanted):
        found["tracking_angle"] = wheels.rates(bound, moments.ways())
        if "tracking_count" in wanted:
            found["tracking_count"] = _whole(found["tracking_angle"], wheels.tracking_counts_per_turn)
    return found


def _of_drives(
    bound: Kernel, effects: EffectSet, drives: Mapping[str, np.ndarray], rate: np.ndarray
) -> dict[str, np.ndarray]:
    torque = drives.get("torque", 0.0) - drives.get("damping", 0.0) * rate
    bearings = drives.get("bearing_torque", 0.0) + _smooth_friction(bound, rate)
    found = {"net_torque": torque + bearings + np.zeros_like(rate)}
    acting = [e for e in effects.effects if "drive" in e.kernel_effects() and getattr(e, "output", "") != "voltage"]
    if len(acting) == 1 and isinstance(acting[0], Motor):
        _, per_volt, lost_per_rate, _, margins_per_volt, _ = bound.motor_laws(np.full(bound.wheels, MODES[LINEAR]))
        found["motor_current"] = torque * (margins_per_volt[..., 0] / per_volt)  # the first margin is of the current
        found["motor_voltage"] = (torque + lost_per_rate * rate) / per_volt
    return found


def _smooth_friction(bound: Kernel, rate: np.ndarray) -> np.ndarray:
    """Torques (T, N) of axles' bearings that depend on the rate alone: viscous ones, and Coulomb's where they fade."""
    torque, known = np.zeros_like(rate), bound.constant_names
    if "axle_damping" in known:
        torque = torque - bound.constant("axle_damping") * rate
    if "axle_fade_speed" in known:
        slip = rate / np.sqrt(rate**2 + bound.constant("axle_fade_speed")[..., None] ** 2)
        torque = torque - bound.constant("axle_torque") * slip
    return torque


def _felt(bound: Kernel, effects: EffectSet, moments: Moments, instruments: Instruments) -> np.ndarray:
    """(T, 2) the accelerometer, by the generated functions."""
    heading = moments.pose[..., 2]
    values = {"nu": moments.nu, "chi": moments.chi, "heading": heading, "spins": moments.spins}
    if moments.accelerations is not None:
        values |= moments.accelerations()
    else:
        values |= moments.drives
        if "roller_sticking" in effects.names() and moments.spins is not None:
            modes = turning(bound.constant("yaw_scale"), moments.nu, moments.spins)
            values |= torques_of_free_rollers(bound, effects, values, modes)
        values = with_accelerations(bound, values)
    tilted = any(isinstance(effect, Slope) for effect in effects.effects)
    plane = map(bound.constant, Slope.numbers.values()) if tilted else Slope(0.0).constants(bound.vehicle).values()
    counts, motion = (bound.wheels, bound.rollers_per_wheel), [_axis_first(values, name) for name in ("nu", "nu_dot")]
    felt = parts.accelerometer(
        *counts, bound.constant("platform_radius"), bound.constant("yaw_scale"), *motion, list(instruments.place),
        heading, *plane,
    )  # fmt: skip
    if "tilt" in values:
        height = instruments.place_height
        height = bound.constant("tilt_height") if height is None else height
        tilt = [_axis_first(values, name) for name in ("tilt", "tilt_rate", "tilt_rate_dot")]
        by_tilt = parts.tilt_felt(
            *counts, bound.constant("yaw_scale"), *motion, *tilt, height, bound.constant("tilt_gravity")
        )
        felt = [level + more for level, more in zip(felt, by_tilt, strict=True)]
    return np.stack(np.broadcast_arrays(*felt), axis=-1)


def _axis_first(values: Mapping[str, np.ndarray], name: str) -> list[np.ndarray]:
    return list(np.moveaxis(values[name], -1, 0))


def axles_tell_all(bound: Kernel) -> bool:
    """Whether the wheels' rates determine nu, so that there is odometry."""
    fits = bool({"nu_from_wheels", "nu_from_wheels_at"} & bound.signatures.keys())
    return fits and np.linalg.matrix_rank(bound.wheel_speeds(np.eye(3))) == 3


def reckoned(vehicle: Vehicle, start: np.ndarray, counts: np.ndarray, instruments: Instruments) -> np.ndarray | None:
    """(T, 3) the pose by dead reckoning from the encoders' counts (T, N), the first at the pose `start`.

    None where the wheels do not tell all of the motion.
    """
    bound = kernel(vehicle, "massless", "python")
    if not axles_tell_all(bound):
        return None
    turns = np.diff(counts, axis=0) * (2 * math.pi / instruments.counts_per_turn)
    turns *= profiles.mean_radii(vehicle) / vehicle.by_wheel["wheel_radius"]
    return _along_arcs(vehicle, start, bound.nu_from_wheels(turns))


def reckoned_by_tracking(
    vehicle: Vehicle, start: np.ndarray, times: np.ndarray, read: Mapping[str, np.ndarray], instruments: Instruments
) -> np.ndarray | None:
    """(T, 3) the pose by dead reckoning from the tracking wheels' counts, and of the gyro where they alone do not tell
    all of the motion. None where both together do not."""
    wheels, bound = tracking_of(instruments), kernel(vehicle, "massless", "python")
    if wheels is None:
        return None
    ways = wheels.ways_reckoned(bound, read["tracking_count"], turns_of(read["gyro"], times))
    return None if ways is None else _along_arcs(vehicle, start, ways)


def _along_arcs(vehicle: Vehicle, start: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(T, 3) the poses after steps whose nu, integrated over each, is `ways` (T - 1, 3)."""
    chords = np.sinc(ways[:, 2] / vehicle.yaw_scale / (2 * math.pi))  # sinc(x) is sin(pi x)/(pi x)
    poses = [np.asarray(start, float)]
    sizes = vehicle.wheels, vehicle.rollers_per_wheel, vehicle.platform_radius, vehicle.yaw_scale
    for way, chord in zip(ways, chords, strict=True):
        poses.append(np.array(parts.dead_reckoning(*sizes, poses[-1].tolist(), way.tolist(), float(chord))))
    return np.array(poses)
