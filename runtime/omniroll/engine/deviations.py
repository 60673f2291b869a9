"""What deviates beside a run: names and places of its numbers, and their rates by the generated functions."""

from collections.abc import Iterable, Mapping
from functools import cached_property
from math import prod
from types import MappingProxyType

import numpy as np

from omniroll.effects.bound_rates import PLAIN, PLAIN_RATES, dynamics_with
from omniroll.effects.effect_set import BEARINGS, MOMENTS, EffectSet
from omniroll.effects.state_vector import Layout
from omniroll.engine.contact_modes import MODES, pushes
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named

HELD = {"forward_dynamics": "held_dynamics", "accelerations": "held_accelerations"}  # the same where axles stick
HELD_WITH_SPINS = {"accelerations": "stuck_accelerations"}  # the same where free rollers may stick, too
NOTHING: Mapping[str, np.ndarray] = MappingProxyType({})  # sticks


class Deviations:
    """Names and places of what deviates: the part of y that feeds back, and the inputs that a phase holds.

    rates      names of the quantities that are integrated, and of the rates that the generated functions give them
    state      (m,) their places in y
    inputs     names and shapes of what a phase is given: what the drives give, and the momenta of free rollers where
               they are constant, the torques of their bearings where they may stick
    views, joined, input_size  of the inputs (..., U)
    spins_stick  whether free rollers may stick
    grips      whether contacts may stick on the ground
    functions  generated functions that give the rates, in the order in which they are called
    """

    def __init__(self, effects: EffectSet, bound: Kernel):
        vector = effects.state_vector(bound)
        # Energies are integrals that feed nothing back.
        added = [quantity for quantity in vector.quantities if not quantity.account and quantity.size != "energy"]
        self.rates = PLAIN_RATES | {quantity.name: quantity.rate for quantity in added}
        self.vector = vector
        self.state = np.concatenate([np.arange(vector.size)[vector.slices[name]] for name in self.rates])
        drives = effects.drives()
        self.inputs = {name: (bound.wheels,) for name in drives if name not in (*MODES, *MOMENTS)}
        self.moving = sum(map(prod, self.inputs.values()))  # inputs that change within a phase stand first
        self.inputs |= {name: (bound.wheels,) for name in MODES if name in drives}  # which a phase holds
        self.grips = "sticks" in drives
        if bound.has_spins and not {"momenta", "axial", "spins"} & set(vector.slices):
            self.inputs["momenta"] = (bound.wheels, 2)
        self.spins_stick = bound.rollers_stick and bound.has_spins
        if self.spins_stick:
            self.inputs["free_bearing"] = (bound.wheels, bound.rollers_per_wheel - 1)
        layout = Layout(self.inputs)
        self.views, self.joined, self.input_size = layout.views, layout.joined, layout.size
        asked = effects.functions(bound.roller_model)
        functions = dict.fromkeys((*asked, *(PLAIN[1:] if bound.slips else (dynamics_with(asked), *PLAIN))))
        if not bound.slips and not self.inputs.keys().isdisjoint(BEARINGS):
            held = HELD_WITH_SPINS if self.spins_stick else HELD
            functions = dict.fromkeys(held.get(name, name) for name in functions)
        self.functions = self._needed(bound, functions)

    def _needed(self, bound: Kernel, functions: Iterable[str]) -> tuple[str, ...]:
        """Those of these functions, which are called one after the other, that the rates depend on."""
        needed, found = set(self.rates.values()), []
        for function in reversed(list(functions)):
            signature = bound.signatures[function]
            if needed & {argument.name for argument in signature.outputs}:
                needed |= {argument.name for argument in signature.inputs}
                found.append(function)
        return tuple(reversed(found))

    @cached_property
    def places(self) -> dict[str, np.ndarray]:
        """By name the places of a quantity among what deviates, and of an input behind all quantities."""
        every = Layout({name: self.vector.shapes[name] for name in self.rates} | self.inputs)
        return every.views(np.arange(every.size))

    def known_in(self, y: np.ndarray, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take, by name, in states y (..., size) with inputs (..., U)."""
        known = self.vector.views(y) | self.views(inputs)
        return known | dict.fromkeys(("theta", "heading"), known["pose"][..., 2])

    def known_of(
        self, kernel: Kernel, y: np.ndarray, inputs: np.ndarray, held: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """The same, with what the functions of the rates give; `held`, what sticks leaves to nu."""
        known = self.known_in(y, inputs) | dict(held)
        if self.grips:
            known |= pushes(kernel, known)
        for function in self.functions:
            names = [argument.name for argument in kernel.signatures[function].outputs]
            found = call_named(kernel, function, known)
            known |= dict(zip(names, found if len(names) > 1 else (found,), strict=True))
        return known

    def rates_of(
        self, kernel: Kernel, y: np.ndarray, inputs: np.ndarray, held: Mapping[str, np.ndarray] = NOTHING
    ) -> np.ndarray:
        """(..., m) the rates of what deviates, in states y (..., size) with inputs (..., U)."""
        return self.rates_among(self.known_of(kernel, y, inputs, held))

    def rates_among(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., m) the same from what known_of gives."""
        parts = [(known[rate], len(self.vector.shapes[name])) for name, rate in self.rates.items()]
        parts = [part.reshape(*part.shape[: part.ndim - axes], -1) for part, axes in parts]
        lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        return np.concatenate([np.broadcast_to(part, (*lead, part.shape[-1])) for part in parts], axis=-1)
