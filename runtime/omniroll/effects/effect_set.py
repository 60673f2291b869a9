"""All effects of a run together. The engine asks the set, and the set asks each effect.

What depends on the effects and a kernel alone is found out once and kept with the set; what a run changes is an
EffectRun's.
"""

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np

from omniroll import generated_data
from omniroll.effects import registry
from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.effect import Called, Effect, Modal, Sampler, Signal, Table
from omniroll.effects.friction import Bearing, Grip
from omniroll.effects.guards import NO_GUARDS, Guard, Guards
from omniroll.effects.kept import kept
from omniroll.effects.registry import Quantity
from omniroll.effects.state_vector import StateVector
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import JOINTS, Flow, Kernel
from omniroll.kernels.neutral_kernel import kernel_by
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

# Inputs of the kernel that drives give, and the torques of bearings that may stick: a trajectory's columns.
BEARINGS = ("bearing_torque", "contact_bearing")  # of axles, of rollers in contact
DRIVES = ("torque", "damping", *BEARINGS)
NEXT_SPEEDS = "next_omega"  # of rollers beside the joints on which wheels stand that may slip
MOMENTS = ("bearing_cos", "bearing_sin")  # what the free rollers' bearings add to the rates of momenta, in rows
# Where rows have MOMENTS beside them: where rollers stick and the ground's forces depend on the accelerations.
ON_ACCELERATIONS = {"contact_coulomb"}
STICKING = {"contact_coulomb", "axle_sticking", "roller_sticking"}  # effects whose friction is a set-valued law
MOST_STICKING = 8  # wheels beside these
Made = TypeVar("Made")


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
        effects = tuple(effects)
        if not effects:
            return NONE
        try:
            hash(effects)
        except TypeError:  # fields of an effect that a user writes may be arrays
            return _checked.__wrapped__(effects, vehicle)
        return _checked(effects, vehicle)

    def __bool__(self) -> bool:
        return bool(self.effects)

    def __reduce__(self) -> tuple:
        """For pickle: without what is kept."""
        return type(self), (self.effects,)

    @kept
    def equipped(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with the inertia that the effects bring."""
        for effect in self.effects:
            vehicle = effect.equipped(vehicle)
        return vehicle

    @kept
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

    @kept
    def made(self, make: Callable[..., Made], *arguments: Hashable) -> Made:
        """What `make` gives for this set and further arguments: that which an engine knows of them before it runs."""
        return make(self, *arguments)

    @kept
    def kernel(self, vehicle: Vehicle, roller_model: str, backend: str, also: tuple[str, ...] = ()) -> Kernel:
        """The kernel with these effects, and no others but `also`: effects of the registry that only have functions."""
        if not self.effects:
            return kernel_by(backend, vehicle, roller_model, also)
        for effect in self.effects:
            effect.check_model(roller_model)
            effect.check_model_beside(roller_model, self.effects)
        vehicle = self.equipped(vehicle)
        constants = tuple(self.constants(vehicle).items())
        return kernel_by(backend, vehicle, roller_model, (*self._kernel_effects, *also), constants)

    @cached_property
    def _kernel_effects(self) -> tuple[str, ...]:
        wanted = set(self.names())
        return tuple(entry["name"] for entry in generated_data.load("effects")["effects"] if entry["name"] in wanted)

    @kept
    def doubts(self, vehicle: Vehicle) -> tuple[UserWarning, ...]:
        """What is allowed and yet looks wrong."""
        equipped = self.equipped(vehicle)
        return tuple(doubt for effect in self.effects for doubt in effect.doubts(equipped, self.effects))

    @kept
    def quantities(self, bound: Kernel) -> tuple[Quantity, ...]:
        """What is integrated, last what wheels on joints ask for; effects that name the same quantity share it."""
        names, model = self.names(), bound.roller_model
        states = [q for e in self._with_contact(last=False) for q in e.quantities(model, names)]
        states += registry.quantities([JOINTS], model, [*bound.effects, *names]) if JOINTS in bound.effects else ()
        return tuple({quantity.name: quantity for quantity in states}.values())

    @kept
    def functions(self, roller_model: str) -> tuple[str, ...]:
        """Generated functions that are evaluated with the rates, each once."""
        names = self.names()
        return tuple(dict.fromkeys(f for e in self._with_contact(last=True) for f in e.functions(roller_model, names)))

    def names(self) -> tuple[str, ...]:
        """The effects' names in the registry."""
        return tuple(name for effect in self.effects for name in effect.kernel_effects())

    def sliding_of_massless_rollers(self, bound: Kernel) -> np.ndarray | None:
        """(N,) in N m, the torques of massless rollers that turn and may stick where wheels may slip; or None."""
        found = None if bound.has_spins or not bound.slips else self.bearings(bound).get("roller")
        return None if found is None else found.sliding

    @property
    def slips(self) -> bool:
        """Whether wheels may slip."""
        return "contact" in self.names()

    def slips_or_sticks(self, bound: Kernel) -> bool:
        """Whether wheels may slip, or bearings stick: the Python engine steps such runs in time."""
        return self.slips or bool(self.bearings(bound))

    def _with_contact(self, last: bool) -> list[Effect]:
        """In the order of their states, where guards find the rates of wheels that may slip right behind the pose; or,
        `last`, in that of their functions: that of such wheels needs what the others give."""
        return sorted(self.effects, key=lambda effect: ("contact" in effect.kernel_effects()) is last)

    @kept
    def state_vector(self, bound: Kernel) -> StateVector:
        """Where each quantity stands in the states of a run with these effects."""
        return StateVector(bound, self.quantities(bound))

    @kept
    def plan(self, bound: Kernel, start_time: float) -> "Plan":
        """What an engine must know of a run with these effects before it starts."""
        return Plan(EffectRun(self, bound, start_time))

    @kept
    def grip(self, equipped: Vehicle) -> Grip | None:
        """The friction of contacts that may stick; None where there is none.

        equipped  the vehicle with what the effects bring, as a kernel with these effects has it
        """
        return next((grip for effect in self.effects if (grip := effect.grip(equipped)) is not None), None)

    @kept
    def bearings(self, bound: Kernel) -> dict[str, Bearing]:
        """The bearings that may stick, "axle" of the wheels and "roller"."""
        return {name: own for effect in self.effects for name, own in effect.bearings(bound).items()}

    def begin(self, bound: Kernel, state: State) -> State:
        """The state at the start of a run, from that of a vehicle that rolls."""
        for effect in self.effects:
            state = effect.begin(bound, state)
        return state

    def initial(self, bound: Kernel, state: State) -> dict[str, np.ndarray]:
        """What they integrate, after a switch or at the start."""
        states = {}
        for effect in self.effects:
            states |= effect.initial(bound, state)
        return states

    def own_speeds(self, bound: Kernel, state: State) -> dict[str, np.ndarray]:
        """(N,) the speeds of wheels that may slip, rates and contact_omega; none where wheels roll."""
        contact = next((effect for effect in self.effects if "contact" in effect.kernel_effects()), None)
        return {} if contact is None else contact.initial(bound, state)

    def axial_later(
        self, bound: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray:
        """The free rollers' axial speeds (..., N, n-1) later in a phase; constant where no effect says otherwise."""
        later = (effect.axial_later(bound, axial, before, after, elapsed) for effect in self.effects)
        found = next((speeds for speeds in later if speeds is not None), axial)
        if NEXT_SPEEDS not in after:
            return found
        gained, places = after[NEXT_SPEEDS] - before[NEXT_SPEEDS], found.shape[-1]  # 0 of wheels that turn
        entering = np.where(after["chi"] < 0, 0, places - 1)[..., None] == np.arange(places)
        return found + np.where(entering, gained[..., None], 0.0)

    @kept
    def drives(self) -> tuple[str, ...]:
        """Names of the inputs, and of what else rows keep, in a trajectory's columns `drive`, in their order."""
        present = set(self.names())
        entries = generated_data.load("effects")["effects"]
        given = {name for entry in entries if entry["name"] in present for name in entry["inputs"]}
        recorded = [name for effect in self.effects for name in effect.recorded()]
        moments = MOMENTS if "roller_sticking" in present and present & ON_ACCELERATIONS else ()
        return (*(name for name in DRIVES if name in given), *moments, *recorded)

    @kept
    def potentials(self) -> dict[str, str]:
        """Entries of the account, and the generated functions of the state that give their potential energy."""
        return {entry: name for effect in self.effects for entry, name in effect.potentials.items()}


NONE = EffectSet()  # one for all vehicles, with what it keeps


@lru_cache(maxsize=64)
def _checked(effects: tuple[Effect, ...], vehicle: Vehicle) -> EffectSet:
    for effect in effects:
        effect.check(vehicle, effects)
    ordered = EffectSet(tuple(sorted(effects, key=lambda effect: len(effect.needs))))
    if vehicle.wheels > MOST_STICKING and not STICKING.isdisjoint(ordered.names()):
        instead = "choose the law regularised for the ground and give bearings wheel_speed and roller_speed"
        bound = f"must be at most {MOST_STICKING} where friction sticks; {instead}"
        raise InvalidValueError("wheels", vehicle.wheels, bound)
    ordered.constants(vehicle)
    return ordered


class EffectRun:
    """The effects in one run: their processes, and the rates between two of their events.

    drives   names of what a trajectory's columns `drive` have
    """

    def __init__(self, effects: EffectSet, bound: Kernel, start_time: float):
        self.effects, self.kernel, self.state_vector = effects, bound, effects.state_vector(bound)
        self.processes = [effect.process(bound, start_time) for effect in effects.effects]
        self.influences, self.signals = [], {}
        self.drives = effects.drives()

    @cached_property
    def bound_rates(self) -> BoundRates:
        """The rates by the generated functions; the compiled engine has its own."""
        return BoundRates(self.kernel, self.state_vector, self.effects.functions(self.kernel.roller_model))

    def next_time(self) -> float:
        """When a phase must end at the latest; counted from the start of the run."""
        return min((process.next_time() for process in self.processes), default=np.inf)

    def pass_time(self, elapsed: float, state: State) -> None:
        for process in self.processes:
            if process.next_time() <= elapsed:
                process.pass_time(state)

    def phase(self, elapsed: float, axial: np.ndarray | None, carry: float = 0.0) -> tuple[Flow, Guards]:
        """The rates and the guards of the phase that starts at elapsed + carry. What is set-valued, friction that
        sticks, gives no force here.

        axial  of the free rollers, (N, n-1)
        """
        momenta = None if axial is None else self.kernel.momenta(axial)
        if not self.effects:
            return self.kernel.flow(momenta), NO_GUARDS
        guards = self.begin_phase(elapsed, carry)
        feed_back = {"momenta", "spins"} & self.state_vector.slices.keys()  # rollers that are a part of the state
        constants = {} if momenta is None or feed_back else {"momenta": momenta}
        if "directions" in self.bound_rates.buffers:
            constants["directions"] = np.eye(3).ravel()  # nothing is held
        return self.bound_rates.flow(constants, self.signals), Guards(guards, self.state_vector.size)

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
        """(D, N) the inputs of the drives at a time since the start of this phase; zeros of friction."""
        none = Signal.constant(np.zeros(self.kernel.wheels))
        found = [self.signals.get(name, none).at(time) for name in self.drives]
        return np.array(found).reshape(-1, self.kernel.wheels)

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of this phase, (m,) bool, have ended it."""
        start = 0
        for process, influence in zip(self.processes, self.influences, strict=True):
            own = passed[start : start + len(influence.guards)]
            start += len(influence.guards)
            if own.any():
                process.pass_guards(own)


class Plan:
    """The forms in which the compiled engine knows the processes of a run, in the order of the effects.

    acting    the run's effects at its start; where an engine calls a process, a run has others of its own
    tables, samplers, modal  the forms
    called    of the processes that an engine calls at their samples: place among the processes, and form
    asks      whether some process has none, so that an engine must ask all of them at their events
    """

    def __init__(self, acting: EffectRun):
        self.acting = acting
        described = [process.compiled() for process in acting.processes]
        forms = [form for forms in described if forms is not None for form in forms]
        self.called = [
            (place, form) for place, own in enumerate(described) for form in own or () if isinstance(form, Called)
        ]
        self.tables = [form for form in forms if isinstance(form, Table)]
        self.samplers = [form for form in forms if isinstance(form, Sampler)]
        self.modal = [form for form in forms if isinstance(form, Modal)]
        self.asks = None in described or len(self.modal) > 1

    @cached_property
    def has_events(self) -> bool:
        """Whether the effects have times or guards at the start."""
        return self.acting.next_time() < math.inf or bool(self.acting.begin_phase(0.0))

    @cached_property
    def guards_read_speeds_alone(self) -> bool:
        """Whether guards read what the compiled engine's may, and nothing else; those that are asked for."""
        slices, count = self.acting.state_vector.slices, np.count_nonzero
        guards = self.acting.begin_phase(0.0) if self.asks else ()
        return all(sum(map(count, guard.of_parts(slices))) == count(guard.weights) for guard in guards)

    @cached_property
    def largest(self) -> float:
        """The largest number that torques and voltages are made of; inf where only a call of a process tells."""
        if self.asks or self.called:
            return math.inf
        numbers = [table.curve.values for table in self.tables] + [drive.laws for drive in self.modal]
        for sampler in self.samplers:
            numbers += [sampler.target.values, sampler.proportional, sampler.integral, np.array(sampler.sample_time)]
        numbers += [own.holding for own in self.acting.effects.bearings(self.acting.kernel).values()]
        return max((float(np.abs(array).max()) for array in numbers if array.size), default=0.0)
