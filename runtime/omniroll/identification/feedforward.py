"""What a wanted motion takes: the constants of feedforwards.

The generated inverse dynamics gives the force that a motion takes, M* nu' - f (3.4), with all that the effects do; the
generated fit gives the torques of least norm that make it, and the motors' laws the voltages.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from omniroll import validation
from omniroll.effects.bearings import Bearings
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.effects.motor import Motor, voltages_of
from omniroll.effects.numbers import spread
from omniroll.effects.path_follower import nu_of_rates
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


def _constants(vehicle: Vehicle, effects: Sequence[Effect], roller_model: str, speed: float) -> dict[str, Feedforward]:
    acting = EffectSet.checked(tuple(effects), vehicle)
    if not _has_motor(acting):
        raise InvalidValueError("effects", list(effects), "must have a Motor: feedforwards are voltages")
    bound = acting.kernel(vehicle, roller_model, "python")
    found = {}
    for (name, unit), way in zip(DIRECTIONS.items(), np.eye(3), strict=True):
        slow, fast, faster = (
            _largest_voltage(bound, acting, way, *motion) for motion in ((speed / 2, 0.0), (speed, 0.0), (speed, 1.0))
        )
        kV = (fast - slow) / (speed / 2)
        found[name] = Feedforward(unit, fast - kV * speed, kV, faster - fast)
    return found


def _largest_voltage(bound: Kernel, acting: EffectSet, way: np.ndarray, speed: float, acceleration: float) -> float:
    """Of the wheel that turns fastest, counted along its rate; the mean over the rollers' phases."""
    along = nu_of_rates(bound, way, 0.0)
    joint = np.pi / bound.rollers_per_wheel
    phases = np.outer(np.arange(PHASES), GOLDEN * np.arange(1, bound.wheels + 1)) % 1
    values = {"nu": along * speed, "nu_dot": along * acceleration, "chi": joint * (2 * phases - 1), "heading": 0.0}
    rates = bound.wheel_speeds(along * speed)
    voltages = voltages_of(bound, bound.wheel_torques(force_of(bound, acting, values)), rates)
    fastest = int(np.abs(rates).argmax())
    return float(voltages[:, fastest].mean() * np.sign(rates[fastest]))


def force_of(bound: Kernel, acting: EffectSet, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """(..., 3) that the drives must bring; what else the kernel takes is 0, and axles have the friction of those that
    turn.

    values  nu, nu_dot, chi, heading, and where rollers are free momenta, by name
    """
    others = {argument.name: np.zeros(argument.shape) for argument in bound.signatures["inverse_dynamics"].inputs}
    if "bearing_torque" in others:
        friction = next(e for e in acting.effects if isinstance(e, Bearings)).wheel_coulomb
        rates = bound.wheel_speeds(values["nu"])
        others["bearing_torque"] = -spread("wheel_coulomb", friction, bound.wheels) * np.sign(rates)
    return call_named(bound, "inverse_dynamics", others | dict(values))


def _has_motor(acting: EffectSet) -> bool:
    return any(isinstance(effect, Motor) for effect in acting.effects)
