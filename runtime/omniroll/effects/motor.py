"""Direct-current motors on the wheels' axles.

maxima/effects/motor.mac has their law: the current is what the winding says, cut off at a limit, and each motor is in
one of three modes. In a mode its torque is affine in the voltage and the wheel's rate, and so are the margins that end
the mode where they become positive: guards. The generated function motor_laws gives their parts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll import generated_data
from omniroll.effects.effect import Effect, Influence, Motors, Signal, Table
from omniroll.effects.guards import Guard
from omniroll.effects.numbers import Curve, per_wheel, spread, table
from omniroll.effects.torque import Drive, Following
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles import parts
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INTERPOLATION, MOTOR, ROW_TIMES, documented

# The modes by name and their transitions, as the derivation has them.
(OWN,) = next(effect["modes"] for effect in generated_data.load("effects")["effects"] if effect["name"] == "motor")
MODES = OWN["modes"]
TRANSITIONS = {
    mode: [(t["event"], t["to"]) for t in OWN["transitions"] if t["mode"] == mode] for mode in MODES.values()
}
LINEAR = MODES["linear"]


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

    remembers: ClassVar[tuple[str, ...] | None] = ("knot", "mode", "leads_to")

    def __init__(self, motor: Motor, kernel: Kernel, voltage: Curve):
        super().__init__("voltage", voltage)
        self.motor = motor
        self.wheel_speed_per_nu = kernel.wheel_speeds(np.eye(3)).T  # (N, 3)
        self.mode = np.full(kernel.wheels, LINEAR, np.int64)
        self.leads_to: list[tuple[int, int]] = []  # wheel and new mode, of each guard
        self.laws = {mode: Law(*kernel.motor_laws(np.full(kernel.wheels, mode))) for mode in MODES.values()}

    def compiled(self) -> tuple[Table, Motors]:
        linear, limited = self.laws[LINEAR], self.laws[MODES["at_limit"]]
        motors = Motors(
            volt_torque=linear.torque_per_volt[0],
            rate_voltage=-linear.margins_per_rate[0, 0] / linear.margins_per_volt[0, 0],
            inverse_resistance=linear.margins_per_volt[0, 0],
            limit=np.inf if self.motor.current_limit is None else self.motor.current_limit,
            limit_torque=limited.torque_at_zero[0],
            wheel_rows=self.wheel_speed_per_nu,
            modes=self.mode,
        )
        return Table("voltage", self.curve), motors

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        own = Signal(*self.curve.after(elapsed))
        voltage = own + given["voltage"] if "voltage" in given else own
        torque = Signal(
            self._own("torque_at_zero") + self._own("torque_per_volt") * voltage.value,
            self._own("torque_per_volt") * voltage.slope,
        )
        damping = Signal.constant(self._own("torque_lost_per_rate"))
        return Influence({"torque": torque, "damping": damping, "voltage": own}, self._guards(voltage))

    def readings(self, nu: np.ndarray, signals: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """currents (N,) in A: what the winding says below the limit, the limit at it."""
        linear, limit = self.laws[LINEAR], self.motor.current_limit or 0.0
        per_volt, per_rate = linear.margins_per_volt[:, 0], linear.margins_per_rate[:, 0]  # of the current itself
        free = per_volt * signals["voltage"] + per_rate * (self.wheel_speed_per_nu @ nu)
        return {"currents": np.where(self.mode == LINEAR, free, self.mode * limit)}

    def _own(self, part: str) -> np.ndarray:
        """(N,) a part of the torque, of each motor in its mode."""
        return np.array([getattr(self.laws[mode], part)[wheel] for wheel, mode in enumerate(self.mode)])

    def _guards(self, voltage: Signal) -> tuple[Guard, ...]:
        """Where a margin becomes positive, a wheel's mode changes."""
        self.leads_to = []
        if self.motor.current_limit is None:
            return ()
        guards = []
        for wheel, mode in enumerate(self.mode):
            for event, follows in TRANSITIONS[mode]:
                self.leads_to.append((wheel, follows))
                guards.append(self._guard(voltage, wheel, self.laws[mode], event))
        return tuple(guards)

    def _guard(self, voltage: Signal, wheel: int, law: "Law", event: int) -> Guard:
        per_volt, at_zero = law.margins_per_volt[wheel, event], law.margins_at_zero[wheel, event]
        of_voltage = per_volt * voltage.value[wheel]
        return Guard(
            at_zero + of_voltage,
            per_volt * voltage.slope[wheel],
            law.margins_per_rate[wheel, event] * self.wheel_speed_per_nu[wheel],
            size=abs(at_zero) + abs(of_voltage),
        )

    def pass_guards(self, passed: np.ndarray) -> None:
        for guard in np.flatnonzero(passed):
            wheel, mode = self.leads_to[guard]
            self.mode[wheel] = mode


@dataclass(frozen=True)
class Law:
    """What motors in one mode make of voltage u and wheel rate w.

    torque_at_zero + torque_per_volt u - torque_lost_per_rate w, each (N,), and
    margins_at_zero + margins_per_volt u + margins_per_rate w, each (N, 2)
    """

    torque_at_zero: np.ndarray
    torque_per_volt: np.ndarray
    torque_lost_per_rate: np.ndarray
    margins_at_zero: np.ndarray
    margins_per_volt: np.ndarray
    margins_per_rate: np.ndarray
