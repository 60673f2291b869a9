"""What drives give in the motions beside a run: tangents of torques and damping in each of its phases.

It goes along the run a second time: the samples of its controllers are taken again, on numbers that carry tangents.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from omniroll.effects.controller import Controller
from omniroll.effects.effect import Effect, Process
from omniroll.effects.motor import MODES, Motor
from omniroll.effects.numbers import Curve, spread
from omniroll.effects.torque import Torque, TorqueTable
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

FOLLOWED = (Torque, TorqueTable, Motor, Controller)  # effects with a process whose tangents are known


def refuse_what_is_not_followed(effects: Sequence[Effect], plain: Kernel) -> None:
    """Raises InvalidValueError for effects in whose presence a run has no sensitivities."""
    for effect in effects:
        known = isinstance(effect, FOLLOWED) or type(effect.process(plain, 0.0)) is Process
        if effect.axles(plain) is not None or plain.slips or not known:
            what = "axles that stick, wheels that slip and functions of your own are not followed"
            raise InvalidValueError("sensitivities", type(effect).__name__, what)


class DriveDeviations:
    """P columns of tangents of what the drives give.

    effects  of the run, in its order
    bound    TangentKernel of the columns, (P,)
    signals  (P, ...) tangents of the effects' fields, by place of the effect and field
    """

    def __init__(self, effects: Sequence[Effect], bound: TangentKernel, signals: Mapping, start_time: float):
        self.bound, (self.columns,) = bound, bound.columns
        self.motor = next((effect for effect in effects if isinstance(effect, Motor)), None)
        self.curves: list[tuple[str, Curve]] = []  # of tangents (K, P, N), by the signal that they are added to
        self.torques: list[Curve] = []  # (K, N) that motors have no part in
        self.samplers: list[_Sampling] = []
        for k, effect in enumerate(effects):
            given = {name: signals[place, name] for place, name in signals if place == k}
            if isinstance(effect, Controller):
                self.samplers.append(_Sampling(effect, bound, given, start_time))
            if isinstance(effect, Torque | TorqueTable):
                self.torques.append(effect.process(bound, start_time).curve)
            for name in ("torque", "voltage"):
                if name in given:
                    self.curves.append((name, _curve(effect, name, given[name], start_time)))

    def next_time(self) -> float:
        return min((sampler.next_time() for sampler in self.samplers), default=math.inf)

    def pass_time(self, elapsed: float, nu: np.ndarray) -> None:
        """The samples that are due, where nu (P, 3) carries tangents."""
        for sampler in self.samplers:
            if sampler.next_time() <= elapsed:
                sampler.pass_time(nu)

    def after(self, elapsed: float, drive: Mapping[str, np.ndarray], slopes: Mapping[str, np.ndarray]) -> dict:
        """Tangents of value and slope (P, N) of each input from `elapsed` on, by name.

        drive, slopes  (N,) torque and damping of the run from there on, and how fast they change
        """
        zero = np.zeros((self.columns, self.bound.wheels))
        found = {name: (zero, zero) for name in ("torque", "voltage")}
        for name, curve in self.curves:
            found[name] = tuple(a + b for a, b in zip(found[name], curve.after(elapsed), strict=True))
        for sampler in self.samplers:
            value, slope = found[sampler.signal]
            found[sampler.signal] = value + tangent_of(sampler.output), slope
        if self.motor is None:
            return found
        given = [curve.after(elapsed) for curve in self.torques]
        given += [(sampler.output[0].real, 0.0) for sampler in self.samplers if sampler.signal == "torque"]
        own = drive["torque"] - sum(value for value, _ in given), slopes["torque"] - sum(slope for _, slope in given)
        return self._of_motors(found, *own, drive["damping"])

    def _of_motors(self, found: Mapping, own: np.ndarray, own_slope: np.ndarray, damping: np.ndarray) -> dict:
        """Torque and damping of the motors in their modes, whose torques are `own` and change with `own_slope`."""
        modes = np.where(self._at_limit(own, damping), np.sign(own), 0.0)
        at_zero, per_volt, lost, *_ = self.bound.motor_laws(modes)
        with np.errstate(divide="ignore", invalid="ignore"):
            volts, volts_slope = (np.where(modes == 0, value / per_volt[0].real, 0.0) for value in (own, own_slope))
        (volts_moved, slope_moved), (torque, torque_slope) = found["voltage"], found["torque"]
        value = at_zero + per_volt * with_tangent(volts, volts_moved)
        slope = per_volt * with_tangent(volts_slope, slope_moved)
        return {
            "torque": (torque + tangent_of(value), torque_slope + tangent_of(slope)),
            "damping": (tangent_of(lost), np.zeros_like(torque)),
        }

    def _at_limit(self, own: np.ndarray, damping: np.ndarray) -> np.ndarray:
        """(N,) bool: a motor at its limit does not feel the rate."""
        if self.motor.current_limit is None:
            return np.zeros(self.bound.wheels, bool)
        _, _, lost, *_ = self.bound.motor_laws(np.full(self.bound.wheels, float(MODES[0])))
        return damping == 0 if lost.real.any() else np.abs(own) == self.motor.current_limit * 0


def _curve(effect: Effect, name: str, tangents: np.ndarray, start_time: float) -> Curve:
    """The tangents (P, N) of a constant, or (P, K, N) of a table, over time."""
    if getattr(effect, "times", None) is None:
        return Curve.constant(tangents)
    return Curve(np.array(effect.times) - start_time, tangents.swapaxes(0, 1), effect.interpolation)


class _Sampling:
    """A controller whose samples carry tangents."""

    def __init__(self, controller: Controller, bound: TangentKernel, given: Mapping, start_time: float):
        wheels = bound.wheels
        self.controller, self.bound, self.signal = controller, bound, controller.output
        wanted = np.array(controller.target)
        target = with_tangent(wanted, given.get("target", np.zeros((*bound.columns, *wanted.shape))))
        self.target = (
            Curve(np.array([-math.inf]), target[None], "hold")
            if controller.times is None
            else Curve(np.array(controller.times) - start_time, target.swapaxes(0, 1))
        )
        self.gains = [
            with_tangent(
                spread(name, getattr(controller, name), wheels), given.get(name, np.zeros((*bound.columns, 1)))
            )
            for name in ("proportional", "integral")
        ]
        self.limit = math.inf if controller.limit is None else controller.limit
        self.samples = 0
        self.sum = self.output = np.zeros((*bound.columns, wheels), complex)

    def next_time(self) -> float:
        return self.samples * self.controller.sample_time

    def pass_time(self, nu: np.ndarray) -> None:
        wanted, _ = self.target.after(self.next_time())
        error = self.bound.wheel_speeds(wanted - nu)
        arguments = (np.moveaxis(values, -1, 0) for values in (error, self.sum, *self.gains))
        found = parts.controller_sample(self.bound.wheels, 0, *arguments, self.controller.sample_time)
        summed, output = (np.stack(values, axis=-1) for values in found)
        clipped = np.abs(output.real) > self.limit
        self.output = np.where(clipped, np.sign(output.real) * self.limit, output)
        self.sum = np.where(clipped, self.sum, summed)
        self.samples += 1
