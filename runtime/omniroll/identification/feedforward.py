"""What a wanted motion takes: the constants of feedforwards, and torques and voltages along a path.

The generated inverse dynamics gives the force that a motion takes, M* nu' - f (3.4), with all that the effects do; the
generated fit gives the torques of least norm that make it, and the motors' laws the voltages.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from omniroll import validation
from omniroll.effects.bearings import Bearings
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.effects.motor import Motor
from omniroll.effects.numbers import spread
from omniroll.effects.torque import Drive, TorqueTable
from omniroll.engine.simulate import simulate
from omniroll.errors import InvalidValueError
from omniroll.identification.answer import Fit
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL

DIRECTIONS = {"forward": "m", "sideways": "m", "turning": "rad"}  # and the unit of the way
PHASES = 64  # of the rollers, over which constants are means
GOLDEN = (5**0.5 - 1) / 2
STEP = 1e-4  # of the differences by fitted numbers, in sizes
SMOOTH = 5  # degree of the splines through a path


@dataclass(frozen=True)
class Feedforward:
    """V = kS sign(v) + kV v + kA a, the largest of the wheels' voltages for speed v and acceleration a.

    unit        of the way: "m", or "rad" for turning
    kS          in V
    kV          in V s/m, or V s/rad
    kA          in V s^2/m, or V s^2/rad
    deviations  of kS, kV and kA by name, of fitted numbers; empty of given ones
    """

    unit: str
    kS: float
    kV: float
    kA: float
    deviations: dict[str, float] = field(default_factory=dict)


def feedforward(
    what: Vehicle | Fit, *, effects: Sequence[Effect] = (), roller_model: str = "massless", speed: float = 0.5
) -> dict[str, Feedforward]:
    """The constants of WPILib's and SysId's feedforwards, for "forward", "sideways" and "turning".

    what          Vehicle, or a Fit, whose vehicle, effects and deviations are taken
    effects       what acts on a Vehicle: a Motor, and Bearings where there is friction
    roller_model  "free", "locked" or "massless"; of a Fit its own
    speed         at which friction that is not linear is taken, and at half of it, in m/s and rad/s, positive

    Each constant is the mean over the rollers' phases. The strafe factor, the speed sideways over that forward with
    the same voltage beyond kS, is the ratio of the kV. Raises InvalidValueError where no Motor drives.
    """
    speed = validation.positive("speed", speed)
    if not isinstance(what, Fit):
        return _constants(what, effects, ROLLER_MODEL.checked(roller_model), speed)
    roller_model = what.model.options.get("roller_model", "free")

    def of(model) -> np.ndarray:
        found = _constants(model.vehicle, model.effects, roller_model, speed)
        return np.array([[f.kS, f.kV, f.kA] for f in found.values()])

    steps = [STEP * size for size in what.sizes]
    slopes = [
        (of(what.model.with_values({n: v + h})) - of(what.model.with_values({n: v - h}))) / (2 * h)
        for n, v, h in zip(what.names, what.values.tolist(), steps, strict=True)
    ]
    by_number = np.stack(slopes, axis=-1)  # (directions, 3, n)
    deviations = np.sqrt(np.einsum("dkn,nm,dkm->dk", by_number, what.covariance, by_number))
    plain = _constants(what.vehicle, what.effects, roller_model, speed)
    names = ("kS", "kV", "kA")
    return {
        name: Feedforward(f.unit, f.kS, f.kV, f.kA, dict(zip(names, row.tolist(), strict=True)))
        for (name, f), row in zip(plain.items(), deviations, strict=True)
    }


def strafe_factor(constants: dict[str, Feedforward]) -> float:
    """The speed sideways over the speed forward with the same voltage beyond kS.

    constants  as feedforward gives them
    """
    return constants["forward"].kV / constants["sideways"].kV


@dataclass(frozen=True)
class PathFeedforward:
    """What a path takes at its T times.

    times    (T,) in s
    nu       (T, 3) in 1/s
    chi      (T, N) in rad
    torque   (T, N) in N m, of least norm
    voltage  (T, N) in V; None without a Motor
    """

    times: np.ndarray
    nu: np.ndarray
    chi: np.ndarray
    torque: np.ndarray
    voltage: np.ndarray | None


def along_path(
    vehicle: Vehicle,
    times: ArrayLike,
    pose: ArrayLike,
    *,
    effects: Sequence[Effect] = (),
    roller_model: str = "free",
    chi: ArrayLike = 0,
) -> PathFeedforward:
    """The torques and voltages that a path takes, with what the rollers do.

    vehicle       Vehicle with N wheels
    times         (T,) in s, increasing, 6 or more
    pose          (T, 3) in m, m, rad: a path that is smooth, and so densely given that splines of degree 5 follow it
    effects       what acts besides the drive: a Motor for voltages, which are not its own; Bearings, a Slope
    roller_model  "free", "locked" or "massless"; the spins of free rollers are those of a run with the torques that
                  rollers without spin would take
    chi           (N,) in rad at the start, or one angle for all wheels

    What an impact at a switch takes is not in it; the friction of axles that stick is that of turning ones. Raises
    InvalidValueError for arrays that do not fit.
    """
    times = validation.real_array("times", times)
    pose = validation.real_array("pose", pose, (len(times), 3))
    acting = EffectSet.checked(tuple(effects), vehicle)
    bound = acting.kernel(vehicle, ROLLER_MODEL.checked(roller_model), "python")
    rates = make_interp_spline(times, pose, SMOOTH).derivative()(times)
    nu = np.stack([_nu_of(bound, rate, theta) for rate, theta in zip(rates, pose[:, 2], strict=True)])
    nu_dot = make_interp_spline(times, nu, SMOOTH).derivative()(times)
    turned = make_interp_spline(times, bound.wheel_speeds(nu), SMOOTH).antiderivative()(times)
    joint = np.pi / vehicle.rollers_per_wheel
    angles = (turned - turned[0] + np.asarray(chi, float) + joint) % (2 * joint) - joint
    values = {"nu": nu, "nu_dot": nu_dot, "chi": angles, "heading": pose[:, 2]}
    torque = _torques(bound, acting, values)
    if bound.has_spins:
        values["momenta"] = _momenta(bound, vehicle, acting, times, pose, values, torque)
        torque = _torques(bound, acting, values)
    motor = _motor(acting)
    voltage = None if motor is None else _voltages(motor, vehicle, torque, bound.wheel_speeds(nu))
    return PathFeedforward(times, nu, angles, torque, voltage)


def _constants(vehicle: Vehicle, effects: Sequence[Effect], roller_model: str, speed: float) -> dict[str, Feedforward]:
    acting = EffectSet.checked(tuple(effects), vehicle)
    motor = _motor(acting)
    if motor is None:
        raise InvalidValueError("effects", list(effects), "must have a Motor: feedforwards are voltages")
    bound = acting.kernel(vehicle, roller_model, "python")
    found = {}
    for (name, unit), way in zip(DIRECTIONS.items(), np.eye(3), strict=True):
        slow, fast, faster = (
            _largest_voltage(bound, acting, motor, way, *motion)
            for motion in ((speed / 2, 0.0), (speed, 0.0), (speed, 1.0))
        )
        kV = (fast - slow) / (speed / 2)
        found[name] = Feedforward(unit, fast - kV * speed, kV, faster - fast)
    return found


def _largest_voltage(
    bound: Kernel, acting: EffectSet, motor: Motor, way: np.ndarray, speed: float, acceleration: float
) -> float:
    """Of the wheel that turns fastest, counted along its rate; the mean over the rollers' phases."""
    along = _nu_of(bound, way, 0.0)
    joint = np.pi / bound.rollers_per_wheel
    phases = np.outer(np.arange(PHASES), GOLDEN * np.arange(1, bound.wheels + 1)) % 1
    values = {"nu": along * speed, "nu_dot": along * acceleration, "chi": joint * (2 * phases - 1), "heading": 0.0}
    rates = bound.wheel_speeds(along * speed)
    voltages = _voltages(motor, bound.vehicle, _torques(bound, acting, values), rates)
    fastest = int(np.abs(rates).argmax())
    return float(voltages[:, fastest].mean() * np.sign(rates[fastest]))


def _nu_of(bound: Kernel, rate: np.ndarray, theta: float) -> np.ndarray:
    """nu (3,) of the pose's rates (3,) at a heading: (2.3) solved."""
    return np.linalg.solve(bound.pose_rates(np.eye(3), theta).T, rate)


def _torques(bound: Kernel, acting: EffectSet, values: dict[str, np.ndarray]) -> np.ndarray:
    """(..., N) of the drives; what else the kernel takes is 0, and axles have the friction of those that turn."""
    others = {argument.name: np.zeros(argument.shape) for argument in bound.signatures["inverse_dynamics"].inputs}
    if "bearing_torque" in others:
        friction = next(e for e in acting.effects if isinstance(e, Bearings)).wheel_coulomb
        rates = bound.wheel_speeds(values["nu"])
        others["bearing_torque"] = -spread("wheel_coulomb", friction, bound.wheels) * np.sign(rates)
    return bound.wheel_torques(call_named(bound, "inverse_dynamics", others | values))


def _voltages(motor: Motor, vehicle: Vehicle, torque: np.ndarray, rates: np.ndarray) -> np.ndarray:
    per_volt, lost_per_rate = motor.line(vehicle)
    return (torque + lost_per_rate * rates) / per_volt


def _motor(acting: EffectSet) -> Motor | None:
    return next((effect for effect in acting.effects if isinstance(effect, Motor)), None)


def _momenta(
    bound: Kernel,
    vehicle: Vehicle,
    acting: EffectSet,
    times: np.ndarray,
    pose: np.ndarray,
    values: dict[str, np.ndarray],
    torque: np.ndarray,
) -> np.ndarray:
    """(T, N, 2) of free rollers in a run with these torques."""
    effects = [TorqueTable(times, torque), *(e for e in acting.effects if not isinstance(e, Drive))]
    run = simulate(
        bound.vehicle, nu=values["nu"][0], chi=values["chi"][0], pose=pose[0], start_time=float(times[0]),
        duration=float(times[-1] - times[0]), effects=effects, control=False,
    )  # fmt: skip
    samples = run.sample(np.minimum(times, run.t[-1]))
    return bound.momenta(bound.axial_speeds(samples.nu, samples.chi, samples.spins))
