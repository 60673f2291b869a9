"""All effects of a run together. The engine asks the set, and the set asks each effect.

What depends on the effects and a kernel alone is found out once and kept with the set; what a run changes is an
EffectRun's.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np

from omniroll import generated_data
from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.effect import Called, Effect, Modal, Sampler, Signal, Table
from omniroll.effects.ground import Grip, Ground
from omniroll.effects.ground_flow import GroundFlow
from omniroll.effects.ground_with_axles import GroundWithAxles
from omniroll.effects.ground_with_bearings import GroundWithBearings
from omniroll.effects.ground_with_damped_rollers import DampedStripFlow, GroundWithDampedRollers
from omniroll.effects.ground_with_massless_rollers import GroundWithMasslessRollers, StripFlow
from omniroll.effects.guards import NO_GUARDS, Guard, Guards
from omniroll.effects.kept import kept
from omniroll.effects.loaded_axles import GroundBesideAxles
from omniroll.effects.loaded_bearings import GroundBesideBearings
from omniroll.effects.loaded_ground import LoadedFlow, LoadedGround
from omniroll.effects.loaded_ground_with_axles import LoadedGroundWithAxles
from omniroll.effects.loaded_ground_with_bearings import LoadedGroundWithBearings
from omniroll.effects.loaded_ground_with_damped_rollers import LoadedDampedFlow, LoadedGroundWithDampedRollers
from omniroll.effects.loaded_ground_with_massless_rollers import LoadedGroundWithMasslessRollers, LoadedStripFlow
from omniroll.effects.loaded_massless_rollers import GroundBesideMasslessRollers
from omniroll.effects.massless_rollers import MasslessRollers
from omniroll.effects.registry import Quantity
from omniroll.effects.slipping_axles import SlippingAxles
from omniroll.effects.slipping_bearings import MOMENTS, MasslessSlippingBearings, SlippingBearings, Torques
from omniroll.effects.slipping_rollers import SlippingRollers
from omniroll.effects.smooth_ground import SmoothFlow, SmoothGround
from omniroll.effects.state_vector import StateVector
from omniroll.effects.sticking_bearings import BearingFlow
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Flow, Kernel, kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

# Inputs of the kernel that drives give, and the torques of bearings that may stick: a trajectory's columns.
BEARINGS = ("bearing_torque", "contact_bearing")  # of axles, of rollers in contact
DRIVES = ("torque", "damping", *BEARINGS)
# Where rows have MOMENTS beside them: where rollers stick and the ground's forces depend on the accelerations.
ON_ACCELERATIONS = {"contact_coulomb", "contact_loads"}
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
        return _checked(effects, vehicle) if _can_be_hashed(effects) else _checked.__wrapped__(effects, vehicle)

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

    def kernel(self, vehicle: Vehicle, roller_model: str, backend: str, also: tuple[str, ...] = ()) -> Kernel:
        """The kernel with these effects, and no others but `also`: effects of the registry that only have functions."""
        if not self.effects:
            return kernel(vehicle, roller_model, backend, effects=also)
        for effect in self.effects:
            effect.check_model(roller_model)
            effect.check_model_beside(roller_model, self.effects)
        vehicle = self.equipped(vehicle)
        constants = tuple(self.constants(vehicle).items())
        return kernel(vehicle, roller_model, backend, effects=(*self._kernel_effects, *also), constants=constants)

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
    def quantities(self, roller_model: str) -> tuple[Quantity, ...]:
        """What is integrated; effects that name the same quantity share it."""
        states = (q for e in self._slipping_first() for q in e.quantities(roller_model, self.names()))
        return tuple({quantity.name: quantity for quantity in states}.values())

    @kept
    def functions(self, roller_model: str) -> tuple[str, ...]:
        """Generated functions that are evaluated with the rates, each once."""
        names = self.names()
        return tuple(dict.fromkeys(f for e in self._slipping_last() for f in e.functions(roller_model, names)))

    def names(self) -> tuple[str, ...]:
        """The effects' names in the registry."""
        return tuple(name for effect in self.effects for name in effect.kernel_effects())

    def sliding_of_massless_rollers(self, bound: Kernel) -> np.ndarray | None:
        """(N,) in N m, the torques of massless rollers that turn and may stick where wheels may slip; or None."""
        found = () if bound.has_spins else (effect.roller_torques(bound) for effect in self.effects)
        return next((own[0] for own in found if own is not None), None)

    @property
    def slips(self) -> bool:
        """Whether wheels may slip."""
        return "contact" in self.names()

    def _slipping_first(self) -> list[Effect]:
        """In the order of their states: guards find the rates of wheels that may slip right behind the pose."""
        return sorted(self.effects, key=lambda effect: "contact" not in effect.kernel_effects())

    def _slipping_last(self) -> list[Effect]:
        """In the order of their functions: that of wheels that may slip needs what the others give."""
        return sorted(self.effects, key=lambda effect: "contact" in effect.kernel_effects())

    @kept
    def state_vector(self, bound: Kernel) -> StateVector:
        """Where each quantity stands in the states of a run with these effects."""
        return StateVector(bound, self.quantities(bound.roller_model))

    @kept
    def plan(self, bound: Kernel, start_time: float) -> "Plan":
        """What an engine must know of a run with these effects before it starts."""
        return Plan(EffectRun(self, bound, start_time))

    @kept
    def grip(self, equipped: Vehicle) -> Grip | None:
        """The friction of contacts that may stick, and loads that follow the motion; None where there is neither.

        equipped  the vehicle with what the effects bring, as a kernel with these effects has it
        """
        grips = (effect.grip(equipped, self.effects) for effect in self.effects)
        return next((grip for grip in grips if grip is not None), None)

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

    def state_at(self, layout: StateVector, y: np.ndarray, state: State) -> State:
        """The state with the wheels' rates and the axial speeds of the rollers in contact of y, where they may slip."""
        if "rates" in layout.slices:
            state = replace(state, rates=layout.view(y, "rates").copy())
        return state.with_contact_axial(layout.view(y, "contact_omega")) if "contact_omega" in layout.slices else state

    def axial_later(
        self, bound: Kernel, axial: np.ndarray, before: dict, after: dict, elapsed: np.ndarray
    ) -> np.ndarray:
        """The free rollers' axial speeds (..., N, n-1) later in a phase; constant where no effect says otherwise."""
        later = (effect.axial_later(bound, axial, before, after, elapsed) for effect in self.effects)
        return next((speeds for speeds in later if speeds is not None), axial)

    @kept
    def drives(self) -> tuple[str, ...]:
        """Names of the inputs, and of what else rows keep, in a trajectory's columns `drive`, in their order."""
        present = {name for effect in self.effects for name in effect.kernel_effects()}
        entries = generated_data.load("effects")["effects"]
        given = {name for entry in entries if entry["name"] in present for name in entry["inputs"]}
        recorded = [name for effect in self.effects for name in effect.recorded()]
        moments = MOMENTS if "roller_sticking" in present and present & ON_ACCELERATIONS else ()
        return (*(name for name in DRIVES if name in given), *moments, *recorded)

    @kept
    def potentials(self) -> dict[str, str]:
        """Entries of the account, and the generated functions of the pose that give their potential energy."""
        return {entry: name for effect in self.effects for entry, name in effect.potentials.items()}


NONE = EffectSet()  # one for all vehicles, with what it keeps


def _can_be_hashed(effects: tuple[Effect, ...]) -> bool:
    """Whether all fields of these effects can be; those that a user writes may have arrays."""
    try:
        hash(effects)
    except TypeError:
        return False
    return True


@lru_cache(maxsize=64)
def _checked(effects: tuple[Effect, ...], vehicle: Vehicle) -> EffectSet:
    for effect in effects:
        effect.check(vehicle, effects)
    if vehicle.wheels > MOST_STICKING and any(not STICKING.isdisjoint(effect.kernel_effects()) for effect in effects):
        bound = (
            f"must be at most {MOST_STICKING} where friction sticks; choose the law regularised for the ground and give "
            "bearings wheel_speed and roller_speed"
        )
        raise InvalidValueError("wheels", vehicle.wheels, bound)
    ordered = EffectSet(tuple(sorted(effects, key=lambda effect: len(effect.needs))))
    ordered.constants(vehicle)
    return ordered


class EffectRun:
    """The effects in one run: their processes, and the rates between two of their events.

    drives   names of the drives' inputs of the kernel that there are
    axles    the wheels' axles where they may stick, or None
    slipping_axles  the same where wheels may slip
    slipping_rollers  the rollers where they may stick on their disks and wheels may slip, or None
    bearings  those of rollers, and of axles beside them, where rollers may stick and wheels roll; or None
    ground   the contacts where they may stick on the ground, or None
    """

    def __init__(self, effects: EffectSet, bound: Kernel, start_time: float):
        self.effects, self.kernel, self.state_vector = effects, bound, effects.state_vector(bound)
        self.processes = [effect.process(bound, start_time) for effect in effects.effects]
        self.influences, self.signals = [], {}
        self.drives = effects.drives()
        self.slipping = self.state_vector.slices.get("rates")  # where y has the rates of wheels that may slip
        self.axles = next((axles for e in effects.effects if (axles := e.axles(bound)) is not None), None)
        slipping = (axles for e in effects.effects if (axles := e.slipping_axles(bound)) is not None)
        self.slipping_axles = next(slipping, None)
        of_rollers = next((own for e in effects.effects if (own := e.roller_torques(bound)) is not None), None)
        grip = effects.grip(bound.vehicle)
        beside = of_rollers is not None and grip is not None
        self.slipping_rollers = None if of_rollers is None or beside else self._rollers(*of_rollers)
        found = (bearings for e in effects.effects if (bearings := e.sticking_bearings(bound)) is not None)
        self.bearings = next(found, None)
        self.ground = None if grip is None else self._ground(grip, of_rollers if beside else None)

    def _rollers(self, sliding: np.ndarray, holding: np.ndarray) -> SlippingRollers | MasslessRollers:
        if not self.kernel.has_spins:
            return MasslessRollers(sliding, holding, self.bound_rates)
        return SlippingRollers(self.kernel, sliding, holding, self.bound_rates.buffers)

    def _ground(self, grip: Grip, rollers: Torques | None) -> Ground | SmoothGround:
        axles, self.slipping_axles = self.slipping_axles, None  # the ground has them then
        if rollers is not None:
            of_axles = None if axles is None else (axles.sliding, axles.holding)
            if not self.kernel.has_spins:
                bearings = MasslessSlippingBearings(self.kernel, of_axles, rollers)
                if not grip.sticks:
                    return GroundBesideMasslessRollers(self.kernel, grip, bearings, self.bound_rates)
                damped = "damped_ways" in self.kernel.signatures
                if grip.balance is not None:
                    loaded = LoadedGroundWithDampedRollers if damped else LoadedGroundWithMasslessRollers
                    return loaded(self.kernel, grip, bearings, self.bound_rates)
                own = GroundWithDampedRollers if damped else GroundWithMasslessRollers
                return own(self.kernel, grip, bearings, self.bound_rates.buffers)
            bearings = SlippingBearings(self.kernel, of_axles, rollers)
            if not grip.sticks:
                return GroundBesideBearings(self.kernel, grip, bearings, self.bound_rates)
            if grip.balance is not None:
                return LoadedGroundWithBearings(self.kernel, grip, bearings, self.bound_rates)
            return GroundWithBearings(self.kernel, grip, bearings, self.bound_rates.buffers)
        if axles is not None:
            if not grip.sticks:
                return GroundBesideAxles(self.kernel, grip, axles, self.bound_rates)
            if grip.balance is not None:
                return LoadedGroundWithAxles(self.kernel, grip, axles, self.bound_rates)
            return GroundWithAxles(self.kernel, grip, axles, self.bound_rates.buffers)
        if grip.balance is None:
            return Ground(self.kernel, grip)
        return (LoadedGround if grip.sticks else SmoothGround)(self.kernel, grip, self.bound_rates)

    @property
    def own_axles(self) -> SlippingAxles | SlippingBearings | None:
        """The axles where wheels may slip and their bearings stick, also those that the ground has; with rollers where
        these stick beside contacts that do."""
        beside = isinstance(self.ground, GroundWithAxles | GroundBesideAxles)
        return self.ground.axles if beside else self.slipping_axles

    @cached_property
    def bound_rates(self) -> BoundRates:
        """The rates where no axle sticks; the compiled engine has its own."""
        return BoundRates(self.kernel, self.state_vector, self.effects.functions(self.kernel.roller_model))

    @cached_property
    def held_rates(self) -> BoundRates:
        """The rates where axles stick."""
        functions = self.effects.functions(self.kernel.roller_model)
        return BoundRates(self.kernel, self.state_vector, functions, held=True)

    @property
    def held_force(self) -> np.ndarray:
        """(3,) what holds the axles that stick, as the rates that were computed last have it."""
        return self.held_rates.buffers["held_force"]

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
        if not self.effects:
            return self.kernel.flow(momenta), NO_GUARDS
        guards = self.begin_phase(elapsed, carry)
        for name in set(MOMENTS) & set(self.drives):
            self.signals[name] = Signal.constant(np.zeros(self.kernel.wheels))  # drive_in has them
        feed_back = {"momenta", "spins"} & self.state_vector.slices.keys()  # rollers that are a part of the state
        constants = {} if momenta is None or feed_back else {"momenta": momenta}
        if isinstance(self.ground, GroundWithAxles):
            return self._on_ground_and_axles(self.ground, constants, guards, y)
        if isinstance(self.ground, GroundBesideAxles):
            return self._on_ground_beside_axles(self.ground, constants, guards, y)
        if self.ground is not None:
            flow = self._on_the_ground if self.ground.grip.sticks else self._on_smooth_ground
            return flow(constants, y), Guards(guards, self.state_vector.size)
        if self.slipping_axles is not None or self.slipping_rollers is not None:
            return self._in_slipping_bearings(constants, guards, y)
        if self.bearings is not None:
            return self._in_bearings(constants, guards, y)
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

    def _on_the_ground(self, constants: Mapping[str, np.ndarray], y: np.ndarray) -> GroundFlow:
        """The rates in the modes of the contacts, which are decided for the phase that starts now."""
        ground, rates = self.ground, self.bound_rates

        def dynamics(sticks: np.ndarray, pushed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            flow = rates.flow({**constants, "sticks": sticks, "ground_push": pushed}, self.signals)
            flow(0.0, y)
            return rates.buffers["ground_force"].copy(), rates.buffers["slip_dot"].copy()

        plain = rates.flow({**constants, "sticks": np.zeros(self.kernel.wheels)}, self.signals)
        kind = GroundFlow if ground.grip.balance is None else LoadedFlow
        slip = kind(ground, rates, plain).slip(y)
        try:
            ground.decide(slip, dynamics)
        finally:
            self._keep_modes()
        return kind(ground, rates, rates.flow(constants, self.signals))

    def _on_ground_and_axles(
        self, ground: GroundWithAxles, constants: Mapping[str, np.ndarray], guards: list[Guard], y: np.ndarray
    ) -> tuple[GroundFlow, Guards]:
        """The rates and guards in the modes of contacts and axles, which are decided for the phase that starts now."""
        rates, layout = self.bound_rates, self.state_vector

        def flow(sticks: np.ndarray, stuck: np.ndarray, torques: np.ndarray) -> Flow:
            inputs = self._put_torques(ground.inputs(sticks, stuck, torques))
            return rates.flow({**constants, **inputs}, self.signals)

        def evaluate(sticks: np.ndarray, stuck: np.ndarray, pushed: np.ndarray, torques: np.ndarray) -> None:
            plain = flow(sticks, stuck, torques)
            rates.buffers["ground_push"][:] = pushed
            plain(0.0, y)

        none, turns = np.zeros(self.kernel.wheels, bool), np.zeros(len(ground.axles.modes), bool)
        kind = GroundFlow if ground.grip.balance is None else LoadedFlow
        if isinstance(ground, GroundWithMasslessRollers):
            kind = StripFlow if ground.grip.balance is None else LoadedStripFlow
        if isinstance(ground, GroundWithDampedRollers) and ground.grip.balance is None:
            kind = DampedStripFlow
        slip = kind(ground, rates, flow(none, turns, ground.axles.torques())).slip(y)
        try:
            ground.begin(slip, evaluate)
        finally:
            self._keep_modes()
        turning = ground.turning_guards(layout.view(y, "nu"), layout.view(y, "rates"))
        plain = flow(ground.sticks, ground.axles.modes == 0, ground.axles.torques())
        if isinstance(ground, LoadedGroundWithDampedRollers):
            kind = LoadedDampedFlow  # not before: its slips need the loads, which are found with the modes
        return kind(ground, rates, plain), Guards([*guards, *turning], layout.size)

    def _on_smooth_ground(self, constants: Mapping[str, np.ndarray], y: np.ndarray) -> SmoothFlow:
        """The rates where contacts carry or are off, which is decided for the phase that starts now."""
        plain = self.bound_rates.flow(constants, self.signals)
        try:
            self.ground.decide(lambda: plain(0.0, y))
        finally:
            self._keep_modes()
        return SmoothFlow(self.ground, plain)

    def _on_ground_beside_axles(
        self, ground: GroundBesideAxles, constants: Mapping[str, np.ndarray], guards: list[Guard], y: np.ndarray
    ) -> tuple[SmoothFlow, Guards]:
        """The rates and guards where contacts carry or are off and axles stick or turn, which is decided for the phase
        that starts now."""
        rates, layout, axles = self.bound_rates, self.state_vector, ground.axles
        self._put_torques(ground.inputs(axles.modes, axles.sliding))
        plain = rates.flow(constants, self.signals)
        try:
            ground.decide(lambda: plain(0.0, y))
        finally:
            self._keep_modes()
            inputs = self._put_torques(ground.inputs(axles.modes, axles.sliding))
        turning = ground.turning_guards(layout.view(y, "nu"), layout.view(y, "rates"))
        plain = rates.flow({**constants, **inputs}, self.signals)
        return SmoothFlow(ground, plain), Guards([*guards, *turning], layout.size)

    def _put_torques(self, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Puts the torques of axles and rollers in contact among the signals; returns the other inputs, by name."""
        for name in BEARINGS:
            if name in inputs:
                self.signals[name] = Signal.constant(inputs.pop(name))
        return inputs

    def _keep_modes(self) -> None:
        """The modes of the contacts among the signals."""
        ground = self.ground
        self.signals["carries"] = Signal.constant((~ground.off).astype(float))
        if not ground.grip.sticks:
            return
        self.signals["sticks"] = Signal.constant(ground.sticks.astype(float))
        self.signals["slip_heading"] = Signal.constant(np.arctan2(ground.towards[:, 1], ground.towards[:, 0]))
        ground.keep_ways()

    def _in_slipping_bearings(
        self, constants: Mapping[str, np.ndarray], guards: list[Guard], y: np.ndarray
    ) -> tuple[Flow, Guards]:
        """The rates and guards in the modes of axles and rollers, which are decided for the phase that starts now. What
        holds a roller does not depend on the axles' modes, nor what holds an axle on those of rollers with inertia.
        Massless ones are decided first: the ground's force across them depends on their modes."""
        axles, rollers, layout = self.slipping_axles, self.slipping_rollers, self.state_vector

        def flow(*own: np.ndarray) -> Flow:
            modes = {}
            if axles is not None:
                self.signals["bearing_torque"] = Signal.constant(axles.torques())
                modes["axle_sticks"] = axles.modes == 0
            if rollers is not None:
                modes |= rollers.inputs(*own)
                self.signals["contact_bearing"] = Signal.constant(modes.pop("contact_bearing"))
            return self.bound_rates.flow({**constants, **modes}, self.signals)

        turning = []
        if isinstance(rollers, MasslessRollers):
            rollers.decide(y)
        if axles is not None:
            flow()(0.0, y)
            axles.decide(self.axle_holding)
            turning = axles.rate_guards(layout.view(y, "nu"), layout.view(y, "rates"))
        if isinstance(rollers, SlippingRollers):
            rollers.decide(lambda sticks, torques: flow(sticks, torques)(0.0, y))
        return flow(), Guards([*guards, *turning], layout.size)

    @property
    def axle_holding(self) -> np.ndarray:
        """(N,) what holds the axles that stick where wheels may slip, as the rates that were computed last have it."""
        return self.bound_rates.buffers["axle_holding"]

    def _in_bearings(
        self, constants: Mapping[str, np.ndarray], guards: list[Guard], y: np.ndarray
    ) -> tuple[BearingFlow, Guards]:
        """The rates and guards in the modes of the bearings, which are decided for the phase that starts now."""
        layout, bearings = self.state_vector, self.bearings
        plain = self.bound_rates.flow(constants, self.signals)
        flow = BearingFlow(bearings, self.bound_rates.buffers, plain, layout)
        drives = sum(np.abs(self.signals[name].value) for name in self.drives if name in self.signals)
        bearings.decide(flow, y, np.broadcast_to(drives, self.kernel.wheels))
        for name in BEARINGS:
            if name in self.drives:
                self.signals[name] = Signal.constant(np.zeros(self.kernel.wheels))  # drive_in has the torques
        spins = layout.view(y, "spins") if "spins" in layout.slices else np.zeros(0)
        turning = bearings.turning_guards(layout, layout.view(y, "nu"), spins)
        return flow, Guards([*guards, *turning], layout.size)

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

    def wheel_speeds(self, state: State) -> np.ndarray:
        """(N,) rates of the wheels; exactly zero where an axle rests."""
        if state.rates is not None:
            return state.rates
        if self.bearings is not None:
            return self.bearings.of_wheels(self.kernel.wheel_speeds(state.nu), self.bearings.resting)
        return self.kernel.wheel_speeds(state.nu) if self.axles is None else self.axles.rates(state.nu)

    def wheel_accelerations(self, rates: np.ndarray) -> np.ndarray:
        """(N,) accelerations of the wheels from y'; exactly zero where an axle sticks."""
        if self.slipping is not None:
            return rates[self.slipping]
        nu_dot = rates[:3]
        if self.bearings is not None:
            return self.bearings.of_wheels(self.kernel.wheel_speeds(nu_dot), self.bearings.modes == 0)
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
        if self.bearings is not None:
            flow(time, y)
            drive[self._own_drives()] = self.bearings.reported(flow.rows).reshape(-1, self.kernel.wheels)
        if self.axles is not None and len(self.axles.sticking):
            flow(time, y)
            drive[self.drives.index("bearing_torque")] += self.axles.holding_torques(self.held_force)
        if self.slipping_axles is not None:
            flow(time, y)
            drive[self.drives.index("bearing_torque")] += self.axle_holding
        if self.slipping_rollers is not None:
            flow(time, y)
            drive[self.drives.index("contact_bearing")] += self.slipping_rollers.held_in_contact()
        if isinstance(flow, GroundFlow):
            drive[self.drives.index("slip_heading")] = flow.headings(y)
        standing = isinstance(self.ground, GroundWithAxles) and isinstance(flow, GroundFlow)
        if standing or (isinstance(self.ground, GroundBesideAxles) and isinstance(flow, SmoothFlow)):
            flow.in_row(time, y)
            for name, torques in self.ground.torques_in_rows().items():
                if name in self.drives:
                    drive[self.drives.index(name)] = torques
        return drive

    def _own_drives(self) -> list[int]:
        """Places among the drives of the bearings' torques: of axles, of rollers in contact."""
        return [self.drives.index(name) for name in BEARINGS if name in self.drives]

    def drive_sizes(self) -> np.ndarray:
        """(D, N) what the inputs of the drives are rounded against beside themselves."""
        sizes = np.zeros((len(self.drives), self.kernel.wheels))
        if self.bearings is not None:
            sizes[self._own_drives()] = self.bearings.sizes_of_torques().reshape(-1, self.kernel.wheels)
        if self.axles is not None:
            sizes[self.drives.index("bearing_torque")] = self.axles.torque_sizes()
        if isinstance(self.own_axles, SlippingBearings):
            for name, own in self.own_axles.sizes_in_rows().items():
                if name in self.drives:
                    sizes[self.drives.index(name)] = own
        elif self.own_axles is not None:
            sizes[self.drives.index("bearing_torque")] = self.own_axles.torque_sizes()
        if self.slipping_rollers is not None:
            sizes[self.drives.index("contact_bearing")] = self.slipping_rollers.torque_sizes()
        return sizes

    def pass_guards(self, passed: np.ndarray) -> None:
        """Some guards of this phase, (m,) bool, have ended it."""
        start = 0
        for process, influence in zip(self.processes, self.influences, strict=True):
            own = passed[start : start + len(influence.guards)]
            start += len(influence.guards)
            if own.any():
                process.pass_guards(own)
        if self.ground is not None and passed[start:].any():
            self.ground.pass_guards(passed[start:])
        if self.bearings is not None and passed[start:].any():
            self.bearings.pass_guards(passed[start:])
        if self.slipping_axles is not None:
            end = start + self.kernel.wheels
            if passed[start:end].any():
                self.slipping_axles.pass_guards(passed[start:end])
            start = end
        if self.slipping_rollers is not None and passed[start:].any():
            self.slipping_rollers.pass_guards(passed[start:])
        if self.axles is not None and passed[start:].any():
            self.axles.pass_guards(passed[start:])


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
        slices = self.acting.state_vector.slices
        return not self.asks or all(guard.reads_parts_alone(slices) for guard in self.acting.begin_phase(0.0))

    @cached_property
    def largest(self) -> float:
        """The largest number that torques and voltages are made of; inf where only a call of a process tells."""
        if self.asks or self.called:
            return math.inf
        numbers = [table.curve.values for table in self.tables] + [drive.laws for drive in self.modal]
        for sampler in self.samplers:
            numbers += [sampler.target.values, sampler.proportional, sampler.integral, np.array(sampler.sample_time)]
        sticking = (self.acting.axles, self.acting.own_axles, self.acting.bearings, self.acting.slipping_rollers)
        numbers += [found.holding for found in sticking if found is not None]
        return max((float(np.abs(array).max()) for array in numbers if array.size), default=0.0)
