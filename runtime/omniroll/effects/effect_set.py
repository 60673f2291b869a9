"""All effects of a run together. The engine asks the set, and the set asks each effect."""

from collections.abc import Sequence
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

DRIVES = ("torque", "damping")  # inputs of the kernel that drives give, in the order of a trajectory's columns


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
        return [doubt for effect in self.effects for doubt in effect.doubts(vehicle)]

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

    def potentials(self) -> dict[str, str]:
        """Entries of the account, and the generated functions of the pose that give their potential energy."""
        return {entry: name for effect in self.effects for entry, name in effect.potentials.items()}


class EffectRun:
    """The effects in one run: their processes, and the rates between two of their events.

    drives   names of the drives' inputs of the kernel that there are: torque, and with motors damping
    """

    def __init__(self, effects: EffectSet, bound: Kernel, start_time: float):
        self.effects, self.kernel, self.state_vector = effects, bound, effects.state_vector(bound)
        self.processes = [effect.process(bound, start_time) for effect in effects.effects]
        self.influences, self.signals = [], {}
        self.drives = tuple(a.name for a in bound.signatures["forward_dynamics"].inputs if a.name in DRIVES)
        self.bound_rates = (
            BoundRates(bound, self.state_vector, effects.functions(bound.roller_model)) if effects else None
        )

    def next_time(self) -> float:
        """When a phase must end at the latest; counted from the start of the run."""
        return min((process.next_time() for process in self.processes), default=np.inf)

    def pass_time(self, elapsed: float, state: State) -> None:
        for process in self.processes:
            if process.next_time() <= elapsed:
                process.pass_time(state)

    def phase(self, elapsed: float, axial: np.ndarray | None, carry: float = 0.0) -> tuple[Flow, Guards]:
        """The rates and the guards of the phase that starts at elapsed + carry, with the axial speeds (N, n-1)."""
        momenta = None if axial is None else self.kernel.momenta(axial)
        if self.bound_rates is None:
            return self.kernel.flow(momenta), NO_GUARDS
        guards = Guards(self.begin_phase(elapsed, carry), self.state_vector.size)
        constants = {} if momenta is None or "momenta" in self.state_vector.slices else {"momenta": momenta}
        return self.bound_rates.flow(constants, self.signals), guards

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
        """(D, N) the inputs of the drives at a time since the start of this phase."""
        return np.array([self.signals[name].at(time) for name in self.drives]).reshape(-1, self.kernel.wheels)

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of this phase, (m,) bool, have ended it."""
        start = 0
        for process, influence in zip(self.processes, self.influences, strict=True):
            own = passed[start : start + len(influence.guards)]
            start += len(influence.guards)
            if own.any():
                process.pass_guards(own)
