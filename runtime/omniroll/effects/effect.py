"""What acts on a vehicle: the contract between an effect and the engine.

The effect (a subclass of Effect) is what the user makes: a frozen dataclass of numbers that checks itself. Its process
(a subclass of Process) is what it does in one run. Inputs and outputs meet by name: torque and damping are inputs of
the kernel; voltage is an input of a motor. Inputs of one name add up. An effect that reads an input says so in `needs`,
and is asked after those that give it. What an effect does not name costs nothing: no state, no call.
docs/adding-an-effect.md goes through the methods.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from omniroll.effects import registry
from omniroll.effects.friction import Bearing, Grip
from omniroll.effects.guards import Guard
from omniroll.effects.named import name_of
from omniroll.effects.numbers import Curve
from omniroll.effects.registry import Quantity
from omniroll.errors import InvalidValueError
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

    def later(self, time: float) -> "Signal":
        """The same, where t counts from `time`."""
        return Signal(self.at(time), self.slope)


@dataclass(frozen=True)
class Influence:
    """What an effect does in one phase: inputs by name, and guards that end the phase."""

    inputs: Mapping[str, Signal] = field(default_factory=dict)
    guards: tuple[Guard, ...] = ()


@dataclass(frozen=True)
class Table:
    """A signal that follows a curve (K, N): a form in which the compiled engine knows a process, as the next three."""

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
class Called:
    """A signal that holds between samples: the engine calls pass_time of the process and then reads `output` (N,)."""

    signal: str
    sample_time: float


@dataclass(frozen=True)
class Modal:
    """Torques of the wheels that are affine in a signal and in the wheels' rates, in modes that are counted from 0.

    laws         (modes, N, 1 + E, 3) the torque and the E event functions: without signal at rest, per signal, per rate
    transitions  (T, 3) int: mode, event, mode that follows where the event's function becomes positive
    wheel_rows   (N, 3) the wheels' speeds for each of nu
    modes        (N,) int64, the mode of each wheel; the engine keeps them here
    """

    signal: str
    laws: np.ndarray
    transitions: np.ndarray
    wheel_rows: np.ndarray
    modes: np.ndarray


Form = Table | Sampler | Called | Modal


class Process:
    """An effect in one run. Times are counted from the start of the run.

    remembers  names of the attributes that change during a run, so that a session can save and restore them; None
               where the process does not say
    ended      why the run ends at the guard that was passed last; nothing where it goes on
    """

    remembers: ClassVar[tuple[str, ...] | None] = None
    ended: str = ""

    def compiled(self) -> tuple[Form, ...] | None:
        """The same for the compiled engine, before the run starts; None where that must ask this process."""
        return () if type(self) is Process else None

    def next_time(self) -> float:
        """The time in s at which pass_time must be called: a phase ends there exactly. inf: never."""
        return np.inf

    def pass_time(self, state: State) -> None:
        """The time next_time() has come, in this state. After the call next_time() must be later.

        Of the state nu, chi, pose and contact are known; the compiled engine gives no axial speeds.
        """

    def influence(self, elapsed: float, given: Mapping[str, Signal]) -> Influence:
        """What it does in the phase that starts now.

        elapsed  in s, the time since the start of the run
        given    inputs by name, of the processes that were asked before
        """
        return Influence()

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of the last influence, (m,) bool, have ended the phase."""

    # What a session asks besides

    def held(self) -> Mapping[str, np.ndarray]:
        """Values by name that hold until the caller of a session writes others into these arrays.

        torque and voltage, signals, act from then on; others where the process next reads them.
        """
        return {}

    def readings(self, nu: np.ndarray, signals: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """What can be read of it beside the state, by name.

        nu       (3,) in 1/s
        signals  the inputs of all processes at this instant, (N,) by name, and what the effects integrate
        """
        return {}

    def saved(self) -> dict[str, Any]:
        """What it remembers; a session pickles it at once. Raises InvalidValueError where it does not say."""
        if self.remembers is None and type(self) is not Process:
            raise InvalidValueError("effects", self, "cannot be saved: its class does not say what it remembers")
        return {name: getattr(self, name) for name in self.remembers or ()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Take back what `saved` gave."""
        for name, value in saved.items():
            setattr(self, name, value)


class Effect:
    """Base of the effects: one that does nothing.

    In its methods `vehicle` is a Vehicle, `roller_model` is "free", "locked" or "massless", and `kernel` is the Kernel
    of the vehicle with all effects of the run.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    is_friction: ClassVar[bool] = False  # of bearings or of the ground
    potentials: ClassVar[Mapping[str, str]] = {}  # entry of the account: generated function of the potential energy
    numbers: ClassVar[Mapping[str, str]] = {}  # field: argument of `prepare` that it is; one number is for all wheels
    signals: ClassVar[tuple[str, ...]] = ()  # fields by which its process acts that are no arguments of `prepare`

    def _put(self, **fields: Any) -> None:
        """Put values into fields; effects are frozen for everybody else."""
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def _keep_checked(self, entries: Iterable[Entry]) -> None:
        """Put the fields of these names, checked, in place of what was given. Raises InvalidValueError."""
        self._put(**{entry.name: entry.checked(getattr(self, entry.name)) for entry in entries})

    def check(self, vehicle: Vehicle, others: "Sequence[Effect]") -> None:
        """Raise InvalidValueError where it does not fit the vehicle, or `others`, the effects with which it acts."""

    def check_model(self, roller_model: str) -> None:
        """Raise InvalidValueError where it makes no sense with this roller_model."""

    def check_model_beside(self, roller_model: str, others: "Sequence[Effect]") -> None:
        """Raise InvalidValueError where it makes no sense with this roller_model beside `others`, the effects with
        which it acts."""

    def doubts(self, vehicle: Vehicle, others: "Sequence[Effect]") -> tuple[UserWarning, ...]:
        """What is allowed and yet looks wrong; simulate warns with it.

        vehicle  with the inertia that all effects bring
        others   the effects with which it acts
        """
        return ()

    def events(self) -> tuple[str, ...]:
        """The events that steps end on because of it, in words."""
        return ()

    def terms(self) -> "Iterable[tuple[str, Effect | None]]":
        """Each of its terms as it was given, and this effect without it; None where nothing would be left.

        Where steps collapse, the term is looked for without which they would not.
        """
        return ((type(self).__name__, None),)

    def equipped(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with the inertia that this effect brings."""
        return vehicle

    def kernel_effects(self) -> tuple[str, ...]:
        """Its names in the registry of effects, generated/data/effects.json."""
        return ()

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        """The arguments of the kernel's `prepare` that it brings for this vehicle, by name; a number or (N,): its
        `numbers`, where it says nothing else."""
        return {argument: getattr(self, name) for name, argument in self.numbers.items()}

    def constants_along(self, vehicle: Vehicle, moved: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The slopes of those constants that follow from the vehicle's numbers, whose slopes are `moved`."""
        return {}

    def number_shape(self, name: str, shape: tuple[int, ...]) -> tuple[int, ...]:
        """The shape in which the field `name` is given, whose argument of `prepare` has this shape."""
        return shape

    def functions(self, roller_model: str, present: Sequence[str] = ()) -> tuple[str, ...]:
        """Names of the generated functions that are evaluated with the rates, for this roller_model.

        present  names in the registry of all effects of the run; none: its own
        """
        return registry.functions(self.kernel_effects(), roller_model, present)

    def quantities(self, roller_model: str, present: Sequence[str] = ()) -> tuple[Quantity, ...]:
        """What is integrated for it, for this roller_model; `present` as in `functions`."""
        return registry.quantities(self.kernel_effects(), roller_model, present)

    def begin(self, kernel: Kernel, state: State) -> State:
        """The state at the start of a run.

        kernel  Kernel of the run
        state   State of a vehicle that rolls
        """
        return state

    def initial(self, kernel: Kernel, state: State) -> dict[str, np.ndarray]:
        """What it integrates, at the start and after a switch, by the names of its quantities.

        kernel  Kernel of the run
        state   State at that instant

        Entries of the energy account have no such states: they go on over a switch.
        """
        return {}

    def start(self) -> dict[str, np.ndarray]:
        """What it integrates, at the start, by name: numbers that no State has. They are 0 where it says nothing."""
        return {}

    def axial_later(
        self, kernel: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray | None:
        """The free rollers' axial speeds (..., N, n-1) later in the phase; None where this effect leaves them alone.

        kernel   Kernel of the run
        axial    (..., N, n-1) in rad/s, the axial speeds at first
        before   nu, chi, pose and the quantities by name at first
        after    the same later
        elapsed  (...,) in s, the time between
        """
        return None

    def shape_of(self, name: str, wheels: int) -> tuple[int, ...]:
        """The shape of one of `signals`, by its name, for a vehicle of so many wheels; one number is for all wheels."""
        array = np.asarray(getattr(self, name))
        return array.shape if array.ndim > 1 or name in ("times", "target") else (wheels,)

    def bearings(self, kernel: Kernel) -> Mapping[str, Bearing]:
        """The bearings whose friction is the set-valued law, "axle" of the wheels and "roller"; none where it has none.

        kernel  Kernel of the run
        """
        return {}

    def grip(self, vehicle: Vehicle) -> Grip | None:
        """The friction of contacts that stick and slip on the ground; None where this effect has none.

        vehicle  with the inertia that all effects bring
        """
        return None

    def recorded(self) -> tuple[str, ...]:
        """Names of signals (N,) of each phase that the rows of a run keep beside the inputs of drives."""
        return ()

    def process(self, kernel: Kernel, start_time: float) -> Process:
        """Its process in a run.

        kernel      Kernel of the run
        start_time  in s, the time at the run's start on its clock
        """
        return Process()

    def as_dict(self) -> dict[str, Any]:
        """The name of its kind, and its fields in plain Python types. Raises InvalidValueError where it has no name."""
        return {"kind": name_of(type(self))} | {entry.name: getattr(self, entry.name) for entry in fields(self)}
