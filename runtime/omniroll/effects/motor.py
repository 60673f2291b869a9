"""Direct-current motors on the wheels' axles.

maxima/effects/motor.mac has their law: the current is what the winding says, cut off at a limit, and each motor is in
one of three modes. In a mode its torque is affine in the voltage and the wheel's rate, and so are the margins that end
the mode where they become positive: guards. The generated function motor_laws gives their parts.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll import generated_data, validation
from omniroll.effects.effect import Effect, Influence, Modal, Signal, Table
from omniroll.effects.guards import Guard
from omniroll.effects.numbers import Curve, per_wheel, spread
from omniroll.effects.torque import Drive, Following
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.vehicles import parts
from omniroll.vehicles.data_sheet import motor_constants
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INTERPOLATION, MOTOR, MOTOR_SHEET, ROW_TIMES, documented

# The modes and their transitions, as the derivation has them; here modes are counted from 0 in their order.
(OWN,) = next(effect["modes"] for effect in generated_data.load("effects")["effects"] if effect["name"] == "motor")
MODES = list(OWN["modes"].values())
TRANSITIONS = np.array([(MODES.index(t["mode"]), t["event"], MODES.index(t["to"])) for t in OWN["transitions"]])
LINEAR = list(OWN["modes"]).index("linear")


@documented(*MOTOR, ROW_TIMES, INTERPOLATION)
@dataclass(frozen=True)
class Motor(Drive):
    """One direct-current motor on each wheel, all of one kind.

    {entries}

    Raises InvalidValueError for numbers out of their bounds and a gear_ratio of 0; simulate raises it for a number of
    voltages that is not N.
    """

    needs: ClassVar[tuple[str, ...]] = ("voltage",)
    numbers: ClassVar[Mapping[str, str]] = {
        "torque_constant": "torque_constant", "resistance": "resistance", "gear_ratio": "motor_gear_ratio",
        "back_emf": "back_emf", "current_limit": "current_limit",
    }  # fmt: skip
    signals: ClassVar[tuple[str, ...]] = ("voltage", "times")

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
        if self.back_emf is None:
            self._put(back_emf=self.torque_constant)
        self._keep_checked(entry for entry in MOTOR if entry.name != "voltage")
        if self.gear_ratio == 0:
            raise InvalidValueError("gear_ratio", self.gear_ratio, "must not be 0")
        if self.times is None:
            self._put(voltage=per_wheel("voltage", self.voltage))
        else:
            self._keep_table("voltage")

    @classmethod
    @documented(*MOTOR_SHEET)
    def from_data_sheet(
        cls, voltage: ArrayLike, *, rated_voltage: float, stall_torque: float, free_speed: float, **others: Any
    ) -> "Motor":
        """A motor from the two ends of its line of torque over speed; torque_constant and resistance follow.

        voltage  as of a Motor
        {entries}
        others   arguments of Motor by name

        Raises InvalidValueError as Motor does.
        """
        constants = motor_constants(rated_voltage, stall_torque, free_speed)
        return cls(voltage, **{name: origin.value for name, origin in constants.items()}, **others)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        self._voltages(vehicle.wheels, 0.0)
        if vehicle.rotor is None:
            return
        _, gear_ratio = vehicle.rotor  # a rotor and its gear are given once: as a part of the vehicle, or here
        if self.rotor_inertia:
            bound = "must be 0: the vehicle's rotor_axial_inertia holds the rotor already, and it would count twice"
            raise InvalidValueError("rotor_inertia", self.rotor_inertia, bound)
        if self.gear_ratio != gear_ratio:
            bound = f"must be {gear_ratio:g}, as of the vehicle's parts: the rotor has one gear"
            raise InvalidValueError("gear_ratio", self.gear_ratio, bound)

    def equipped(self, vehicle: Vehicle) -> Vehicle:
        if self.rotor_inertia == 0:
            return vehicle
        rotor = {"gear_ratio": self.gear_ratio, "rotor_axial_inertia": self.rotor_inertia}

        def geared(wheel_inertia: float) -> float:
            return parts.of_vehicle("geared_inertia", vehicle, wheel_inertia=wheel_inertia, **rotor)[0]

        return vehicle.with_drives(geared)

    def events(self) -> tuple[str, ...]:
        knots = () if self.times is None else (f"knots of the voltages, {len(self.times)}",)
        if self.current_limit is None:
            return knots
        return (*knots, f"currents that reach or leave {self.current_limit:g} A")

    def kernel_effects(self) -> tuple[str, ...]:
        return (*super().kernel_effects(), "motor")

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        return super().constants(vehicle) | {"current_limit": self.current_limit or 0.0}  # 0 is no limit

    def process(self, kernel: Kernel, start_time: float) -> "Driving":
        return Driving(self, kernel, self._voltages(kernel.wheels, start_time))

    def line(self, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
        """(N,) torque at the axles in N m per volt, and what it loses per rate of the wheels in N m s; no limit.

        vehicle  Vehicle with N wheels
        """
        constants = tuple(self.constants(vehicle).items())
        bound = kernel(vehicle, "free", "python", effects=self.kernel_effects(), constants=constants)
        _, per_volt, per_rate = laws(bound)[LINEAR, :, 0].T
        return per_volt, -per_rate

    def _voltages(self, wheels: int, start_time: float) -> Curve:
        if self.times is None:
            return Curve.constant(spread("voltage", self.voltage, wheels))
        return self._curve("voltage", start_time, wheels)


class Driving(Following):
    """The motors in one run: the mode of each."""

    remembers: ClassVar[tuple[str, ...] | None] = ("knot", "mode", "leads_to")

    def __init__(self, motor: Motor, kernel: Kernel, voltage: Curve):
        super().__init__("voltage", voltage)
        self.motor = motor
        self.wheel_speed_per_nu = kernel.wheel_rows
        # (N, k) the wheels' rates by the first components of y: by nu, or where wheels may slip, right behind the pose
        self.rate_rows = self.wheel_speed_per_nu
        if kernel.slips:
            self.rate_rows = np.eye(kernel.wheels, 6 + 2 * kernel.wheels, 6 + kernel.wheels)
        self.laws = laws(kernel)
        self.transitions = TRANSITIONS if motor.current_limit is not None else TRANSITIONS[:0]
        self.mode = np.full(kernel.wheels, LINEAR, np.int64)
        self.leads_to: list[tuple[int, int]] = []  # wheel and new mode, of each guard

    def compiled(self) -> tuple[Table, Modal]:
        modal = Modal("voltage", self.laws, self.transitions, self.wheel_speed_per_nu, self.mode)
        return Table("voltage", self.curve), modal

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        own = Signal(*self.curve.after(elapsed))
        voltage = own + given["voltage"] if "voltage" in given else own
        at_zero, per_volt, per_rate = self.laws[self.mode, np.arange(len(self.mode)), 0].T
        torque = Signal(at_zero + per_volt * voltage.value, per_volt * voltage.slope)
        damping = Signal.constant(-per_rate)
        return Influence({"torque": torque, "damping": damping, "voltage": own}, tuple(self._guards(voltage)))

    def readings(self, nu: np.ndarray, signals: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """currents (N,) in A: what the winding says below the limit, the limit at it."""
        _, per_volt, per_rate = self.laws[LINEAR, :, 1].T  # of the current itself, less the limit
        rates = signals.get("rates", self.wheel_speed_per_nu @ nu)  # where wheels may slip, these are their own
        free = per_volt * signals["voltage"] + per_rate * rates
        limited = np.array(MODES)[self.mode] * (self.motor.current_limit or 0.0)
        return {"currents": np.where(self.mode == LINEAR, free, limited)}

    def _guards(self, voltage: Signal) -> Iterator[Guard]:
        """Where an event function becomes positive, a wheel's mode changes."""
        self.leads_to = []
        for wheel, present in enumerate(self.mode):
            for mode, event, follows in self.transitions:
                if mode == present:
                    self.leads_to.append((wheel, follows))
                    at_zero, per_volt, per_rate = self.laws[mode, wheel, 1 + event]
                    of_voltage, slope = per_volt * voltage.value[wheel], per_volt * voltage.slope[wheel]
                    size = abs(at_zero) + abs(of_voltage)
                    yield Guard(at_zero + of_voltage, slope, per_rate * self.rate_rows[wheel], size)

    def pass_guards(self, passed: np.ndarray) -> None:
        for guard in np.flatnonzero(passed):
            wheel, mode = self.leads_to[guard]
            self.mode[wheel] = mode


def voltages_of(bound: Kernel, torque: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """(..., N) in V, with which motors below their limits give torques (..., N) at rates of the wheels (..., N).

    bound  a kernel with motors
    """
    at_zero, per_volt, per_rate = laws(bound)[LINEAR, :, 0].T
    there = per_volt != 0  # but at wheels without a drive
    return np.where(there, (torque - at_zero - per_rate * rates) / np.where(there, per_volt, 1.0), 0.0)


def spin_inertia_of(equipped: Vehicle, effects: Sequence[Any], given: ArrayLike | None = None) -> np.ndarray:
    """(N,) in kg m^2, angular momentum about the axles per rate of the wheels.

    equipped  Vehicle with the inertia that the effects bring
    effects   of the run; those with a gear_ratio and a rotor_inertia are motors
    given     one number or (N,) in its place

    Raises InvalidValueError.
    """
    wheels = equipped.wheels
    if given is not None:
        numbers = validation.real_array("spin_inertia", given)
        numbers = validation.real_array("spin_inertia", numbers, () if numbers.ndim == 0 else (wheels,))
        if (numbers <= 0).any():
            raise InvalidValueError("spin_inertia", given, "must be positive")
        return np.broadcast_to(numbers, (wheels,))
    inertia = equipped.wheel_inertia
    for motor in effects:
        if hasattr(motor, "rotor_inertia"):
            rotor = {"gear_ratio": motor.gear_ratio, "rotor_axial_inertia": motor.rotor_inertia}
            inertia = parts.of_vehicle("spin_inertia", equipped, wheel_inertia=inertia, **rotor)[0]
    return np.full(wheels, inertia)


NO_MOTOR = [[0, 0, 0], [-1, 0, 0], [-1, 0, 0]]  # of wheels without a drive: no torque, and no event


@lru_cache(maxsize=64)
def laws(kernel: Kernel) -> np.ndarray:
    """(modes, N, 3, 3) what motors make of voltage u and wheel rate w: the torque, and the two event functions.

    Each is a + b u + c w, and its row is a, b, c.
    """
    modes = np.repeat(np.array(MODES, float)[:, None], kernel.wheels, axis=1)
    at_zero, per_volt, lost_per_rate, *margins = kernel.motor_laws(modes)
    torque = np.stack([at_zero, per_volt, -lost_per_rate], axis=-1)
    found = np.concatenate([torque[:, :, None], np.stack(margins, axis=-1)], axis=2)
    found[:, ~kernel.vehicle.driven] = NO_MOTOR
    found.flags.writeable = False
    return found
