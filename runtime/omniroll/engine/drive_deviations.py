"""What drives give in the motions beside a run: tangents of torques and damping in each of its phases.

It goes along the run a second time: the samples of its controllers are taken again, on numbers that carry tangents.
"""

import math
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from omniroll.effects.controller import Controller
from omniroll.effects.effect import Effect, Process
from omniroll.effects.motor import Motor
from omniroll.effects.numbers import spread
from omniroll.effects.torque import Torque, TorqueTable
from omniroll.engine.motion import Columns
from omniroll.engine.switching import EPS
from omniroll.errors import InvalidValueError, NoDerivativeError, OneSidedWarning
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

ROUNDINGS = 16  # of a torque: one that is closer to the limit is at it
FOLLOWED = (Torque, TorqueTable, Motor, Controller)  # effects with a process whose tangents are known


def refuse_what_is_not_followed(effects: Sequence[Effect], plain: Kernel) -> None:
    """Raises InvalidValueError for effects in whose presence a run has no sensitivities."""
    if "contact_springs" in plain.effects:
        raise InvalidValueError("sensitivities", "Springs", "loads from springs have no derivatives: leave Springs out")
    if "contact" in plain.effects and plain.pivots:
        raise InvalidValueError("sensitivities", "Contact", "no derivatives where wheels stand on joints; compare runs")
    for effect in effects:
        known = isinstance(effect, FOLLOWED) or type(effect.process(plain, 0.0)) is Process
        if not known:
            raise InvalidValueError("sensitivities", type(effect).__name__, "functions of your own are not followed")


class DriveDeviations:
    """P columns of tangents of what the drives give.

    columns  Columns of the run
    """

    def __init__(self, columns: Columns, start_time: float):
        self.columns, self.count, self.wheels = columns, len(columns), columns.plain.wheels
        effects, signals = columns.effects, columns.signals
        self.motor = next((effect for effect in effects if isinstance(effect, Motor)), None)
        self.curves: list[tuple[str, _Curve]] = []  # by the signal that they are added to
        self.torques: list[_Curve] = []  # that motors have no part in
        self.samplers: list[_Sampling] = []
        for k, effect in enumerate(effects):
            given = {name: signals[place, name] for place, name in signals if place == k}
            if isinstance(effect, Controller):
                self.samplers.append(_Sampling(effect, columns.kernel, given, start_time))
            if isinstance(effect, Torque | TorqueTable):
                self.torques.append(_Curve(effect, "torque", self.wheels, {}, self.count, start_time))
            for name in ("torque", "voltage"):
                if given and name in effect.signals:
                    curve = _Curve(effect, name, self.wheels, given, self.count, start_time)
                    self.curves.append((name, curve))

    def hold(self, held: Mapping[str, list[np.ndarray]]) -> None:
        """The torques and targets that the steps of a session hold now, by name; their deviations stay."""
        constant = {"torque": self.torques, "target": [sampler.target for sampler in self.samplers]}
        for name, curves in constant.items():
            for curve in curves:
                if len(curve.values) == 1:
                    curve.values.real[0] = held[name][0]

    def remembered(self) -> tuple:
        """What the controllers remember."""
        return tuple((sampler.samples, sampler.sum, sampler.output) for sampler in self.samplers)

    def recall(self, remembered: tuple) -> None:
        """Go back to what `remembered` gave."""
        for sampler, own in zip(self.samplers, remembered, strict=True):
            sampler.samples, sampler.sum, sampler.output = own

    def next_time(self) -> float:
        return min((sampler.next_time() for sampler in self.samplers), default=math.inf)

    def pass_time(self, elapsed: float, nu: np.ndarray) -> None:
        """The samples that are due, where nu (P, 3) carries tangents."""
        for sampler in self.samplers:
            if sampler.next_time() <= elapsed:
                sampler.pass_time(nu)

    def jump(self, elapsed: float) -> np.ndarray | None:
        """(P,) by how much the time deviates at which a drive jumps now; None where none does.

        Raises InvalidValueError where a controller samples at the same time: it may come before the jump or after it.
        """
        jumps = [moved for _, curve in self.curves if (moved := curve.jump(elapsed)) is not None]
        if not jumps:
            return None
        if len(jumps) > 1 or any(sampler.next_time() <= elapsed for sampler in self.samplers):
            bound = f"has no derivative: at t = {elapsed!r} after the start something else changes, too"
            raise InvalidValueError("sensitivities", "times", bound)
        return jumps[0]

    def jumps(self, elapsed: np.ndarray) -> np.ndarray:
        """(...,) bool: times at which a drive jumps, at a time that deviates."""
        return np.isin(elapsed, np.concatenate([[math.nan], *(curve.jumps for _, curve in self.curves)]))

    def samples(self, elapsed: float) -> np.ndarray:
        """All times of samples up to `elapsed`."""
        times = [
            np.arange(elapsed / own.controller.sample_time + 1) * own.controller.sample_time for own in self.samplers
        ]
        return np.concatenate([np.zeros(0), *times])

    def after(self, elapsed: np.ndarray, drive: Mapping[str, np.ndarray], slopes: Mapping[str, np.ndarray]) -> dict:
        """Tangents of value and slope (S, P, N) of each input from the times (S,) on, by name; up to the next sample.

        drive, slopes  (S, N) torque and damping of the run from there on, and how fast they change
        """
        zero = np.zeros((len(elapsed), self.count, self.wheels))
        found = {name: (zero, zero) for name in ("torque", "voltage")}
        for name, curve in self.curves:
            found[name] = tuple(a + tangent_of(b) for a, b in zip(found[name], curve.after(elapsed), strict=True))
        for sampler in self.samplers:
            value, slope = found[sampler.signal]
            found[sampler.signal] = value + tangent_of(sampler.output), slope
        if self.motor is None:
            return found
        own, own_slope = np.array(drive["torque"]), np.array(slopes["torque"])
        for curve in self.torques:
            value, slope = (part[:, 0].real for part in curve.after(elapsed))
            own -= value
            own_slope -= slope
        own -= sum(sampler.output[0].real for sampler in self.samplers if sampler.signal == "torque")
        return self._of_motors(found, own, own_slope, drive["damping"])

    def _of_motors(self, found: Mapping, own: np.ndarray, own_slope: np.ndarray, damping: np.ndarray) -> dict:
        """Torque and damping of the motors in their modes, whose torques are `own` and change with `own_slope`."""
        bound = self.columns.kernel
        limit, *_ = bound.motor_laws(np.ones(self.wheels))
        modes = np.where(self._at_limit(own, limit[0].real, damping), np.sign(own * limit[0].real), 0.0)
        sets, which = np.unique(modes, axis=0, return_inverse=True)  # a run has few
        laws = [bound.motor_laws(own_modes)[:3] for own_modes in sets]
        at_zero, per_volt, lost = (np.array(parts)[which.reshape(-1)] for parts in zip(*laws, strict=True))
        with np.errstate(divide="ignore", invalid="ignore"):
            volts, volts_slope = (
                np.where(modes == 0, value / per_volt[:, 0].real, 0.0)[:, None] for value in (own, own_slope)
            )
        (volts_moved, slope_moved), (torque, torque_slope) = found["voltage"], found["torque"]
        value = at_zero + per_volt * with_tangent(volts, volts_moved)
        slope = per_volt * with_tangent(volts_slope, slope_moved)
        return {
            "torque": (torque + tangent_of(value), torque_slope + tangent_of(slope)),
            "damping": (tangent_of(lost), np.zeros_like(torque)),
        }

    def _at_limit(self, own: np.ndarray, limit: np.ndarray, damping: np.ndarray) -> np.ndarray:
        """(S, N) bool: a motor at its limit does not feel the rate."""
        if self.motor.current_limit is None:
            return np.zeros(own.shape, bool)
        lost = self.columns.kernel.motor_laws(np.zeros(self.wheels))[2]
        return damping == 0 if lost.real.any() else np.abs(own) >= (1 - ROUNDINGS * EPS) * np.abs(limit)


class _Curve:
    """A constant or a table over time that carries tangents: values (K, P, W), knots (K, P)."""

    def __init__(self, effect: Effect, name: str, width: int, given: Mapping, columns: int, start_time: float):
        own, times = np.array(getattr(effect, name), float), getattr(effect, "times", None)
        values = own if times is not None else np.broadcast_to(own, (width,))
        moved = given.get(name, np.zeros((columns, *values.shape)))
        values = with_tangent(values, moved)
        self.values = values[None] if times is None else values.swapaxes(0, 1)
        self.knots = np.array([-math.inf]) if times is None else np.array(times) - start_time
        self.moved = given.get("times", np.zeros((columns, len(self.knots)))).T
        self.holds = times is None or getattr(effect, "interpolation", "linear") == "hold"

    def after(self, elapsed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes (S, P, W) from the times (S,) to the next knot of each."""
        segment = np.searchsorted(self.knots, elapsed, side="right") - 1
        held = self.values[np.maximum(segment, 0)]
        slope = np.zeros_like(held)
        inside = (segment >= 0) & (segment < len(self.knots) - 1) & (not self.holds)
        if not inside.any():
            return held, slope
        start, end = (
            with_tangent(self.knots[k][:, None], self.moved[k])[..., None]
            for k in (segment[inside], segment[inside] + 1)
        )
        slope[inside] = (self.values[segment[inside] + 1] - held[inside]) / (end - start)
        held[inside] += slope[inside] * (elapsed[inside, None, None] - start)
        return held, slope

    @property
    def jumps(self) -> np.ndarray:
        """The times at which a value that is held changes, of those that deviate."""
        return self.knots[self.moved.any(axis=1)] if self.holds else np.zeros(0)

    def jump(self, elapsed: float) -> np.ndarray | None:
        """(P,) by how much the time deviates at which a value that is held changes now; None where none does."""
        (now,) = np.nonzero(self.knots == elapsed)
        return self.moved[now[0]] if self.holds and len(now) and self.moved[now[0]].any() else None


class _Sampling:
    """A controller whose samples carry tangents."""

    def __init__(self, controller: Controller, bound: TangentKernel, given: Mapping, start_time: float):
        wheels = bound.wheels
        self.controller, self.bound, self.signal = controller, bound, controller.output
        self.start_time = start_time
        self.target = _Curve(controller, "target", 3, given, *bound.columns, start_time)
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
        (wanted,), _ = self.target.after(np.array([self.next_time()]))
        error = self.bound.wheel_speeds(wanted - nu)
        arguments = (np.moveaxis(values, -1, 0) for values in (error, self.sum, *self.gains))
        found = parts.controller_sample(self.bound.wheels, 0, *arguments, self.controller.sample_time)
        summed, output = (np.stack(values, axis=-1) for values in found)
        clipped = self._clipped(output, summed)
        self.output = np.where(clipped, np.sign(output.real) * self.limit, output)
        self.sum = np.where(clipped, self.sum, summed)
        self.samples += 1

    def _clipped(self, output: np.ndarray, summed: np.ndarray) -> np.ndarray:
        """(P, W) outputs that are cut off; of one that is just at the limit, where the number makes it larger.

        Warns of such a kink. Raises NoDerivativeError where the integral, which a cut stops, has a part in outputs.
        """
        size, moved = np.abs(output.real), tangent_of(output) * np.sign(output.real)
        at_limit = (np.abs(size - self.limit) <= ROUNDINGS * EPS * size) & (moved != 0)  # none where there is no limit
        if not at_limit.any():
            return size > self.limit
        t, (wheels,) = float(self.start_time + self.next_time()), np.nonzero(at_limit.any(axis=0))
        sums = (summed.real != self.sum.real) & (self.gains[1] != 0)
        if (at_limit & sums).any():
            reason = "a controller's output is at its limit: beside the run it is cut off, or its integral goes on"
            raise NoDerivativeError(reason, t=t, wheels=tuple(map(int, wheels)))
        text = f"a controller's output is at its limit, at t = {t!r}, wheels {', '.join(map(str, wheels))}"
        warnings.warn(OneSidedWarning(f"{text}: the derivatives are those for numbers that grow"), stacklevel=2)
        return np.where(at_limit, moved > 0, size > self.limit)
