"""All effects of a run together. The engine asks the set, and the set asks each effect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from omniroll import generated_data
from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.effect import Effect, Signal
from omniroll.effects.guards import NO_GUARDS, Guard, Guards
from omniroll.effects.registry import Quantity
from omniroll.effects.state_vector import StateVector
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Flow, Kernel, kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

# Inputs of the kernel that drives give, and the torques of bearings that may stick: a trajectory's columns.
DRIVES = ("torque", "damping", "bearing_torque")


@dataclass(frozen=True)
class EffectSet:
    """Effects (a tuple), one after the other in the order in which they are asked; checked against a vehicle."""

    effects: tuple[Effect, ...] = ()

    @classmethod
    def checked(cls, effects: Sequence[Effect], vehicle: Vehicle) -> "EffectSet":
        """Raises InvalidValueError for what is not an effect, or does not fit the vehicle."""
        if isinstance(effects, Effect) or not isinstance(effects, Sequence):
            raise InvalidValueError("effects", effects, "must be a sequence of effects")
        for effect in effects:
            if not isinstance(effect, Effect):
                raise InvalidValueError("effects", effect, "is not an effect, such as omniroll.Torque")
        for effect in effects:
            effect.check(vehicle, effects)
        ordered = cls(tuple(sorted(effects, key=lambda effect: len(effect.needs))))
        ordered.constants(vehicle)
        return ordered

    def __bool__(self) -> bool:
        return bool(self.effects)

    def equipped(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with the inertia that the effects bring."""
        for effect in self.effects:
            vehicle = effect.equipped(vehicle)
        return vehicle

    def constants(self, vehicle: Vehicle) -> dict[str, float | tuple[float, ...]]:
        """Arguments of `prepare`; refuses two effects that say the same thing."""
        constants = {}
        for effect in self.effects:
            own = effect.constants(vehicle)
            twice = constants.keys() & own.keys()
            if twice:
                raise InvalidValueError("effects", effect, f"{min(twice)} is given twice")
            constants |= own
        return constants

    def kernel(self, vehicle: Vehicle, roller_model: str, backend: str) -> Kernel:
        """The kernel with these effects, and no others."""
        vehicle = self.equipped(vehicle)
        if not self.effects:
            return kernel(vehicle, roller_model, backend)
        wanted = {name for effect in self.effects for name in effect.kernel_effects()}
        names = tuple(entry["name"] for entry in generated_data.load("effects")["effects"] if entry["name"] in wanted)
        constants = tuple(self.constants(vehicle).items())
        return kernel(vehicle, roller_model, backend, effects=names, constants=constants)

    def doubts(self, vehicle: Vehicle) -> list[UserWarning]:
        """What is allowed and yet looks wrong."""
        equipped = self.equipped(vehicle)
        return [doubt for effect in self.effects for doubt in effect.doubts(equipped, self.effects)]

    def quantities(self, roller_model: str) -> tuple[Quantity, ...]:
        """What is integrated; effects that name the same quantity share it."""
        named = {quantity.name: quantity for effect in self.effects for quantity in effect.quantities(roller_model)}
        return tuple(named.values())

    def functions(self, roller_model: str) -> tuple[str, ...]:
        """Generated functions that are evaluated with the rates, each once."""
        return tuple(dict.fromkeys(name for effect in self.effects for name in effect.functions(roller_model)))

    def state_vector(self, bound: Kernel) -> StateVector:
        """Where each quantity stands in the states of a run with these effects."""
        return StateVector(bound, self.quantities(bound.roller_model))

    def initial(self, bound: Kernel, axial: np.ndarray | None) -> dict[str, np.ndarray]:
        """States after a switch or at the start."""
        states = {}
        for effect in self.effects:
            states |= effect.initial(bound, axial)
        return states

    def axial_later(
        self, bound: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray:
        """The free rollers' axial speeds (..., N, n-1) later in a phase; constant where no effect says otherwise."""
        later = (effect.axial_later(bound, axial, before, after, elapsed) for effect in self.effects)
        return next((speeds for speeds in later if speeds is not None), axial)

    def drives(self) -> tuple[str, ...]:
        """Names of the inputs in a trajectory's columns `drive`, in their order."""
        present = {name for effect in self.effects for name in effect.kernel_effects()}
        entries = generated_data.load("effects")["effects"]
        given = {name for entry in entries if entry["name"] in present for name in entry["inputs"]}
        return tuple(name for name in DRIVES if name in given)

    def potentials(self) -> dict[str, str]:
        """Entries of the account, and the generated functions of the pose that give their potential energy."""
        return {entry: name for effect in self.effects for entry, name in effect.potentials.items()}


class EffectRun:
    """The effects in one run: their processes, and the rates between two of their events.

    drives   names of the drives' inputs of the kernel that there are
    axles    the wheels' axles where they may stick, or None
    """

    def __init__(self, effects: EffectSet, bound: Kernel, start_time: float):
        self.effects, self.kernel, self.state_vector = effects, bound, effects.state_vector(bound)
        self.processes = [effect.process(bound, start_time) for effect in effects.effects]
        self.influences, self.signals = [], {}
        self.drives = effects.drives()
        functions = effects.functions(bound.roller_model)
        self.bound_rates = BoundRates(bound, self.state_vector, functions) if effects else None
        self.axles = next((axles for e in effects.effects if (axles := e.axles(bound)) is not None), None)
        if self.axles is not None:
            self.held_rates = BoundRates(bound, self.state_vector, functions, "held_dynamics")
            self.held_force = self.held_rates.buffers["held_force"]

    def next_time(self) -> float:
        """When a phase must end at the latest; counted from the start of the run."""
        return min((process.next_time() for process in self.processes), default=np.inf)

    def pass_time(self, elapsed: float, state: State) -> None:
        for process in self.processes:
            if process.next_time() <= elapsed:
                process.pass_time(state)

    def phase(self, elapsed: float, axial: np.ndarray | None, y: np.ndarray, carry: float = 0.0) -> tuple[Flow, Guards]:
        """The rates and the guards of the phase that starts at elapsed + carry in the state y.

        axial: of the free rollers, (N, n-1). Where axles may stick, it is decided which do.
        """
        momenta = None if axial is None else self.kernel.momenta(axial)
        if self.bound_rates is None:
            return self.kernel.flow(momenta), NO_GUARDS
        guards = self.begin_phase(elapsed, carry)
        constants = {} if momenta is None or "momenta" in self.state_vector.slices else {"momenta": momenta}
        if self.axles is None:
            return self.bound_rates.flow(constants, self.signals), Guards(guards, self.state_vector.size)
        self._decide(constants, y)
        self.signals["bearing_torque"] = Signal.constant(self.axles.torques())
        guards = Guards([*guards, *self.axles.rate_guards(self.state_vector.view(y, "nu"))], self.state_vector.size)
        if not len(self.axles.sticking):
            return self.bound_rates.flow(constants, self.signals), guards
        return self._held_flow(constants, self.signals, self.axles.directions), guards

    def _decide(self, constants: Mapping[str, np.ndarray], y: np.ndarray) -> None:
        """Which axles stick in the phase that starts now."""

        def held(torques: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            flow = self._held_flow(constants, self.signals | {"bearing_torque": Signal.constant(torques)}, directions)
            return flow(0.0, y)[:3], self.held_force.copy()

        drives = sum(np.abs(self.signals[name].value) for name in self.drives if name in self.signals)
        _, force = held(np.zeros(self.kernel.wheels), np.zeros((3, 3)))
        size = np.abs(force) + np.abs(self.axles.rows.T) @ np.broadcast_to(drives, self.kernel.wheels)
        self.axles.decide(self.kernel.mass_matrix(self.state_vector.view(y, "chi")), held, size)

    def _held_flow(
        self, constants: Mapping[str, np.ndarray], signals: Mapping[str, Signal], directions: np.ndarray
    ) -> Flow:
        """The rates while nu may change only in the directions (3, 3), columns; what sticks does not turn."""
        absent = ~directions.any(axis=0)
        flow = self.held_rates.flow({**constants, "directions": directions.ravel(), "absent": absent}, signals)
        sticking = self.state_vector.slices["chi"].start + self.axles.sticking

        def held_flow(time: float, y: np.ndarray) -> np.ndarray:
            rates = flow(time, y)
            rates[sticking] = 0.0
            return rates

        return held_flow

    def wheel_speeds(self, nu: np.ndarray) -> np.ndarray:
        """(N,) rates of the wheels; exactly zero where an axle rests."""
        return self.kernel.wheel_speeds(nu) if self.axles is None else self.axles.rates(nu)

    def wheel_accelerations(self, nu_dot: np.ndarray) -> np.ndarray:
        """(N,) accelerations of the wheels; exactly zero where an axle sticks."""
        return self.kernel.wheel_speeds(nu_dot) if self.axles is None else self.axles.accelerations(nu_dot)

    def begin_phase(self, elapsed: float, carry: float = 0.0) -> list[Guard]:
        """The guards of the phase that starts at elapsed + carry; `signals` are its inputs then.

        The carry is what the rounding of elapsed has left over: without it a guard that has been landed on would be
        off zero by its slope times that rounding, and so might be landed on again.
        """
        inputs: dict[str, Signal] = {}
        self.influences = []
        for process in self.processes:
            influence = process.influence(elapsed, inputs)
            for name, signal in influence.inputs.items():
                inputs[name] = inputs[name] + signal if name in inputs else signal
            self.influences.append(influence)
        self.signals = {name: signal.later(carry) for name, signal in inputs.items()}
        return [guard.later(carry) for influence in self.influences for guard in influence.guards]

    def drive(self, time: float) -> np.ndarray:
        """(D, N) the inputs of the drives at a time since the start of this phase; of bearings, where axles turn."""
        return np.array([self.signals[name].at(time) for name in self.drives]).reshape(-1, self.kernel.wheels)

    def drive_in(self, flow: Flow, time: float, y: np.ndarray) -> np.ndarray:
        """The same in the state y of the phase with the rates `flow`, with what holds the axles that stick."""
        drive = self.drive(time)
        if self.axles is not None and len(self.axles.sticking):
            flow(time, y)
            drive[self.drives.index("bearing_torque")] += self.axles.holding_torques(self.held_force)
        return drive

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of this phase, (m,) bool, have ended it."""
        start = 0
        for process, influence in zip(self.processes, self.influences, strict=True):
            own = passed[start : start + len(influence.guards)]
            start += len(influence.guards)
            if own.any():
                process.pass_guards(own)
        if self.axles is not None and passed[start:].any():
            self.axles.pass_guards(passed[start:])
