"""What acts on a vehicle: the contract between an effect and the engine.

A kind of effect is one file of this folder with two classes.

 1. The effect (a subclass of Effect) is what the user makes: a frozen dataclass of numbers that checks itself. What
    needs the vehicle is checked in `check`.
 2. It names its effects of the registry (generated/data/effects.json), which choose the kernel, and the constants that
    the kernel's `prepare` takes with them.
 3. It names the generated functions that are evaluated with the rates, before `forward_dynamics`, in the order of their
    inputs, and the quantities that they integrate: states, and entries of the energy's account.
 4. Its process (a subclass of Process) is what it does in one run: what it remembers, at which times it must be asked
    again, and for each phase the inputs that it gives and the guards that end the phase.
 5. Inputs and outputs meet by name: torque and damping are inputs of the kernel; voltage is an input of a motor. Inputs
    of one name add up. An effect that reads an input says so in `needs`, and is asked after those that give it.

What an effect does not name costs nothing: no state, no call.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from omniroll.effects.guards import Guard
from omniroll.effects.numbers import Curve
from omniroll.effects.sticking import Axles
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import Entry


@dataclass(frozen=True)
class Signal:
    """An input during one phase, (N,): value + slope t, where t counts from the phase's start."""

    value: np.ndarray
    slope: np.ndarray

    @classmethod
    def constant(cls, value: np.ndarray) -> "Signal":
        return cls(value, np.zeros_like(value))

    def __add__(self, other: "Signal") -> "Signal":
        return Signal(self.value + other.value, self.slope + other.slope)

    def at(self, time: float) -> np.ndarray:
        return self.value + self.slope * time


@dataclass(frozen=True)
class Quantity:
    """What an effect integrates.

    name     of the state
    rate     the output of a generated function that is its rate
    account  +1: work that is done on the vehicle; -1: energy that it loses; 0: neither
    size     "energy", "momentum" (kg m^2/s) or "speed" (rad/s): what its error is measured against
    """

    name: str
    rate: str
    account: int = 0
    size: str = "energy"


@dataclass(frozen=True)
class Influence:
    """What an effect does in one phase: inputs by name, and guards that end the phase."""

    inputs: Mapping[str, Signal] = field(default_factory=dict)
    guards: tuple[Guard, ...] = ()


@dataclass(frozen=True)
class Table:
    """A signal that follows a curve (K, N): a form in which the compiled engine knows a process. So are these two."""

    signal: str
    curve: Curve


@dataclass(frozen=True)
class Sampler:
    """A sampled controller of the wheels' speeds; arrays are (N,), the target's curve is of nu (K, 3)."""

    signal: str
    sample_time: float
    limit: float
    target: Curve
    proportional: np.ndarray
    integral: np.ndarray


@dataclass(frozen=True)
class Motors:
    """Motors that make torque and damping of voltages; limit is inf where the currents have none.

    wheel_rows  (N, 3) the wheels' speeds for each of nu
    """

    volt_torque: float
    rate_voltage: float
    inverse_resistance: float
    limit: float
    limit_torque: float
    wheel_rows: np.ndarray


class Process:
    """An effect in one run. Times are counted from the start of the run."""

    def compiled(self) -> "tuple[Table | Sampler | Motors, ...] | None":
        """The same for the compiled engine, before the run starts; None where that must ask this process."""
        return () if type(self) is Process else None

    def next_time(self) -> float:
        """The time in s at which pass_time must be called: a phase ends there exactly. inf: never."""
        return np.inf

    def pass_time(self, state: State) -> None:
        """The time next_time() has come, in this state. After the call next_time() must be later."""

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        """What it does in the phase that starts now.

        elapsed  in s, the time since the start of the run
        given    inputs by name, of the processes that were asked before
        """
        return Influence()

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of the last influence, (m,) bool, have ended the phase."""


class Effect:
    """Base of the effects: one that does nothing.

    In its methods `vehicle` is a Vehicle, `roller_model` is "free", "locked" or "massless", and `kernel` is the Kernel
    of the vehicle with all effects of the run.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    potentials: ClassVar[Mapping[str, str]] = {}  # entry of the account: generated function of the potential energy

    def _keep_checked(self, entries: Iterable[Entry]) -> None:
        """Put the fields of these names, checked, in place of what was given. Raises InvalidValueError."""
        for entry in entries:
            object.__setattr__(self, entry.name, entry.checked(getattr(self, entry.name)))  # effects are frozen

    def check(self, vehicle: Vehicle, others: "Sequence[Effect]") -> None:
        """Raise InvalidValueError where it does not fit the vehicle, or `others`, the effects with which it acts."""

    def doubts(self, vehicle: Vehicle) -> tuple[UserWarning, ...]:
        """What is allowed for this vehicle and yet looks wrong; simulate warns with it."""
        return ()

    def events(self) -> tuple[str, ...]:
        """The events that steps end on because of it, in words."""
        return ()

    def equipped(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with the inertia that this effect brings."""
        return vehicle

    def kernel_effects(self) -> tuple[str, ...]:
        """Its names in the registry of effects, generated/data/effects.json."""
        return ()

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        """The arguments of the kernel's `prepare` that it brings for this vehicle, by name; a number or (N,)."""
        return {}

    def functions(self, roller_model: str) -> tuple[str, ...]:
        """Names of the generated functions that are evaluated with the rates, for this roller_model."""
        return ()

    def quantities(self, roller_model: str) -> tuple[Quantity, ...]:
        """What is integrated for it, for this roller_model."""
        return ()

    def initial(self, kernel: Kernel, axial: np.ndarray | None) -> dict[str, np.ndarray]:
        """Its states at the start and after a switch, by the names of its quantities.

        kernel  Kernel of the run
        axial   (N, n-1) in rad/s, the free rollers' axial speeds; None but for free rollers

        Entries of the energy account have no such states: they go on over a switch.
        """
        return {}

    def axial_later(
        self, kernel: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray | None:
        """The free rollers' axial speeds (..., N, n-1) later in the phase; None where this effect leaves them alone.

        kernel   Kernel of the run
        axial    (..., N, n-1) in rad/s, the axial speeds at first
        before   the quantities by name at first
        after    the same later
        elapsed  (...,) in s, the time between
        """
        return None

    def axles(self, kernel: Kernel) -> Axles | None:
        """The wheels' axles in a run, where their friction is the set-valued law; None where this effect has none.

        kernel  Kernel of the run
        """
        return None

    def process(self, kernel: Kernel, start_time: float) -> Process:
        """Its process in a run.

        kernel      Kernel of the run
        start_time  in s, the time at the run's start on its clock
        """
        return Process()

    def as_dict(self) -> dict[str, Any]:
        """Kind and fields, in plain Python types."""
        return {"kind": type(self).__name__} | {entry.name: getattr(self, entry.name) for entry in fields(self)}
