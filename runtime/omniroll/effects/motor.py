"""Direct-current motors on the wheels' axles.

The current is i = (u - k_e g chi')/R, cut off at the limit; the torque at the axle is g k_t i. Between two limits that
is a torque g k_t u/R less a damping g^2 k_t k_e/R times chi'; at the limit it is constant. Each wheel is in one of
these three modes, and passes from one to the other where the current that is not cut off reaches the limit: a guard.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect, Influence, Motors, Signal, Table
from omniroll.effects.guards import Guard
from omniroll.effects.numbers import Curve, per_wheel, spread, table
from omniroll.effects.torque import Drive, Following
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles import parts
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INTERPOLATION, MOTOR, ROW_TIMES, documented

LINEAR = 0  # the other modes are +1 and -1, the sign of the limit


@documented(*MOTOR, ROW_TIMES, INTERPOLATION)
@dataclass(frozen=True)
class Motor(Drive):
    """One direct-current motor on each wheel, all of one kind.

    {entries}

    Raises InvalidValueError for numbers out of their bounds and a gear_ratio of 0; simulate raises it for a number of
    voltages that is not N.
    """

    needs: ClassVar[tuple[str, ...]] = ("voltage",)

    voltage: ArrayLike
    torque_constant: float
    resistance: float
    gear_ratio: float = 1.0
    back_emf: float | None = None
    current_limit: float | None = None
    rotor_inertia: float = 0.0
    times: ArrayLike | None = None
    interpolation: str = "linear"

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        if self.back_emf is None:
            put("back_emf", self.torque_constant)
        self._keep_checked(entry for entry in MOTOR if entry.name != "voltage")
        if self.gear_ratio == 0:
            raise InvalidValueError("gear_ratio", self.gear_ratio, "must not be 0")
        if self.times is None:
            put("voltage", per_wheel("voltage", self.voltage))
        else:
            times, voltage = table("voltage", self.times, self.voltage, self.interpolation)
            put("times", times)
            put("voltage", voltage)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        self._curve(vehicle.wheels, 0.0)

    def equipped(self, vehicle: Vehicle) -> Vehicle:
        if self.rotor_inertia == 0:
            return vehicle
        (inertia,) = parts.evaluate(
            "geared_inertia",
            vehicle.wheels,
            vehicle.rollers_per_wheel,
            wheel_inertia=vehicle.wheel_inertia,
            gear_ratio=self.gear_ratio,
            rotor_axial_inertia=self.rotor_inertia,
        )
        return vehicle.replace(wheel_inertia=inertia)

    def events(self) -> tuple[str, ...]:
        knots = () if self.times is None else (f"knots of the voltages, {len(self.times)}",)
        if self.current_limit is None:
            return knots
        return (*knots, f"currents that reach or leave {self.current_limit:g} A")

    def kernel_effects(self) -> tuple[str, ...]:
        return (*super().kernel_effects(), "motor")

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        return {
            "torque_constant": self.torque_constant,
            "resistance": self.resistance,
            "motor_gear_ratio": self.gear_ratio,
            "back_emf": self.back_emf,
            "current_limit": 0.0 if self.current_limit is None else self.current_limit,
        }

    def process(self, kernel: Kernel, start_time: float) -> "Driving":
        return Driving(self, kernel, self._curve(kernel.wheels, start_time))

    def _curve(self, wheels: int, start_time: float) -> Curve:
        if self.times is None:
            return Curve.constant(spread("voltage", self.voltage, wheels))
        if len(self.voltage[0]) != wheels:
            raise InvalidValueError("voltage", self.voltage, f"must have {wheels} columns, one for each wheel")
        return Curve(np.array(self.times) - start_time, np.array(self.voltage), self.interpolation)


class Driving(Following):
    """The motors in one run: the mode of each."""

    def __init__(self, motor: Motor, kernel: Kernel, voltage: Curve):
        super().__init__("voltage", voltage)
        self.motor = motor
        self.wheel_speed_per_nu = kernel.wheel_speeds(np.eye(3)).T  # (N, 3)
        self.mode = np.full(kernel.wheels, LINEAR)
        self.leads_to: list[tuple[int, int]] = []  # wheel and new mode, of each guard

    def compiled(self) -> tuple[Table, Motors]:
        motor = self.motor
        volt_torque = motor.gear_ratio * motor.torque_constant / motor.resistance
        limit = np.inf if motor.current_limit is None else motor.current_limit
        limit_torque = 0.0 if motor.current_limit is None else motor.gear_ratio * motor.torque_constant * limit
        motors = Motors(
            volt_torque=volt_torque,
            rate_voltage=motor.gear_ratio * motor.back_emf,
            inverse_resistance=1 / motor.resistance,
            limit=limit,
            limit_torque=limit_torque,
            wheel_rows=self.wheel_speed_per_nu,
        )
        return Table("voltage", self.curve), motors

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        motor, linear = self.motor, self.mode == LINEAR
        voltage = Signal(*self.curve.after(elapsed))
        if "voltage" in given:
            voltage = voltage + given["voltage"]
        per_volt = motor.gear_ratio * motor.torque_constant / motor.resistance
        limit = 0.0 if motor.current_limit is None else motor.gear_ratio * motor.torque_constant * motor.current_limit
        torque = Signal(
            np.where(linear, per_volt * voltage.value, self.mode * limit),
            np.where(linear, per_volt * voltage.slope, 0.0),
        )
        damping = Signal.constant(np.where(linear, per_volt * motor.gear_ratio * motor.back_emf, 0.0))
        return Influence({"torque": torque, "damping": damping}, self._guards(voltage))

    def _guards(self, voltage: Signal) -> tuple[Guard, ...]:
        """Where sign * current + limit * constant becomes positive, a wheel's mode changes."""
        self.leads_to = []
        limit = self.motor.current_limit
        if limit is None:
            return ()
        guards = []
        for wheel, mode in enumerate(self.mode):
            for sign, constant, follows in TRANSITIONS[int(mode)]:
                self.leads_to.append((wheel, follows))
                guards.append(self._guard(voltage, wheel, sign, constant * limit))
        return tuple(guards)

    def _guard(self, voltage: Signal, wheel: int, sign: int, constant: float) -> Guard:
        motor = self.motor
        per_speed = -motor.back_emf * motor.gear_ratio / motor.resistance
        return Guard(
            constant + sign * voltage.value[wheel] / motor.resistance,
            sign * voltage.slope[wheel] / motor.resistance,
            sign * per_speed * self.wheel_speed_per_nu[wheel],
        )

    def pass_guards(self, passed: np.ndarray) -> None:
        for guard in np.flatnonzero(passed):
            wheel, mode = self.leads_to[guard]
            self.mode[wheel] = mode


# From each mode: (sign, constant, new mode), where sign * i + constant * limit > 0 ends it.
TRANSITIONS = {
    LINEAR: ((+1, -1.0, +1), (-1, -1.0, -1)),
    +1: ((-1, +1.0, LINEAR),),
    -1: ((+1, +1.0, LINEAR),),
}
