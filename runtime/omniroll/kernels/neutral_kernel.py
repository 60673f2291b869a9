"""A general set presented as the kernel of a scene: effects that the scene does not call for are at neutral values.

The general sets are built with omniroll (building.py says what is in them), so that a scene runs without a compiler;
derivatives of runs with effects need one, the first time. A function of the scene's own set is there under its name,
takes what it would take there, and gives what it would give, to rounding: the general set has the same function with
more inputs.
"""

import copy
from collections.abc import Callable, Mapping
from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from omniroll import generated_data
from omniroll.codegen.specialise import is_there
from omniroll.errors import KernelsMissingError
from omniroll.kernels import sets
from omniroll.kernels.by_state import flow_by_calls
from omniroll.kernels.kernel import (
    OF_THE_VEHICLE,
    CompiledKernel,
    Constants,
    Flow,
    Kernel,
    Signature,
    effects_of,
    kernel,
    signatures,
)
from omniroll.vehicles.vehicle import Vehicle

PREBUILT = "prebuilt"


class NeutralKernel(Kernel):
    """The kernel of a scene on the first general set that has its effects; arguments as of Kernel.

    effects  those of the scene
    inner    the general set, whose absent effects have neutral constants
    engine   the same, as the compiled engine of that set is made: for any tips of rollers
    """

    backend = "compiled"

    def __init__(
        self,
        vehicle: Vehicle,
        roller_model: str,
        effects: tuple[str, ...],
        constants: Constants,
        general: tuple[str, ...],
    ):
        self._general = general
        super().__init__(vehicle, roller_model, effects, constants)
        self.inner = CompiledKernel(
            vehicle, roller_model, "double", general, (*neutral_constants(self.effects, general), *constants)
        )
        self.engine = self.inner
        if self.sharp != (roller_model != "massless"):
            self.engine = copy.copy(self.inner)
            self.engine.sharp = not self.sharp

    def _found_signatures(self) -> dict[str, Signature]:
        size = self.wheels, self.rollers_per_wheel
        return neutral_signatures(self.base, self.effects, self._general, *size, self.sharp)

    def form(self, name: str) -> str:
        return self.inner.form(name)

    def _made_with(self, constants: Constants) -> Kernel:
        return NeutralKernel(self.vehicle, self.roller_model, self.effects, constants, self._general)

    def call(self, name: str, *values: ArrayLike):
        signature, whole = self._signature(name), self.inner.signatures[name]
        if len(signature.inputs) == len(whole.inputs):
            found = self.inner.call(name, *values)
        else:
            given = dict(zip((argument.name for argument in self.checked_inputs(name, values)), values, strict=True))
            arguments = (given.get(a.name, neutral(a.name, a.shape)) for a in whole.inputs)
            found = self.inner.call(name, *arguments)
        if len(signature.outputs) == len(whole.outputs):
            return found
        names = {argument.name for argument in signature.outputs}
        kept = tuple(own for a, own in zip(whole.outputs, found, strict=True) if a.name in names)
        return kept if len(kept) > 1 else kept[0]

    def flow(self, momenta: np.ndarray | None) -> Flow:
        return flow_by_calls(self, momenta)

    def bind(self, name: str, buffers: Mapping[str, np.ndarray]) -> Callable[[], None]:
        whole = self.inner.signatures[name]
        absent = {a.name: neutral(a.name, a.shape) for a in (*whole.inputs, *whole.outputs) if a.name not in buffers}
        return self.inner.bind(name, {**buffers, **absent})


def neutral(name: str, shape: tuple[int, ...]) -> np.ndarray:
    """The neutral value of an input that an absent effect brings: nothing acts, nothing is held."""
    return np.eye(3).ravel() if name == "directions" else np.zeros(shape)


def neutral_constants(effects: tuple[str, ...], general: tuple[str, ...]) -> Constants:
    """The arguments of `prepare` of what a general set has beside these effects, so that it does nothing; 1 for what
    must be positive."""
    positive = {bound["field"] for bound in generated_data.load("bounds")["bounds"] if "positive" in bound}
    absent = [e for e in generated_data.load("effects")["effects"] if e["name"] in general and e["name"] not in effects]
    names = [name for effect in absent for name in effect["constants"]]
    return tuple((name, 1.0 if name in positive else 0.0) for name in names if name not in OF_THE_VEHICLE)


@lru_cache(maxsize=256)
def neutral_signatures(
    base: str, effects: tuple[str, ...], general: tuple[str, ...], wheels: int, rollers_per_wheel: int, sharp: bool
) -> dict[str, Signature]:
    """The signatures of the functions that these effects call for, by name, with what belongs to them."""
    entries = {function["name"]: function for function in sets.functions(base, general)}
    belongs = {(f["name"], a["name"]): a.get("effect", "") for f in entries.values() for a in f["arguments"]}
    found = {}
    for name, whole in signatures(base, general, wheels, rollers_per_wheel, sharp).items():
        if any(is_there(case, effects) for case in entries[name]["cases"]):
            inputs, outputs = (
                tuple(a for a in arguments if not belongs.get((name, a.name)) or belongs[name, a.name] in effects)
                for arguments in (whole.inputs, whole.outputs)
            )
            found[name] = Signature(inputs, outputs)
    return found


@lru_cache(maxsize=256)
def first_general_set(base: str, effects: tuple[str, ...]) -> tuple[str, ...] | None:
    """The effects of the first general set that was built and has these; None where there is none."""
    sets_with = (general for general in sets.general_sets(base) if {*effects} <= {*general})
    return next((general for general in sets_with if sets.is_general(base, general)), None)


@lru_cache(maxsize=64)
def neutral_kernel(
    vehicle: Vehicle, roller_model: str, effects: tuple[str, ...], constants: Constants
) -> NeutralKernel | None:
    """The kernel of these effects on a general set; None where none has them, or was built."""
    general = first_general_set(roller_model, effects_of(vehicle, roller_model, effects))
    return None if general is None else NeutralKernel(vehicle, roller_model, effects, constants, general)


@cache
def best_backend(roller_model: str) -> str:
    """ "prebuilt" where this model's C kernel is there or can be made, else "python"."""
    try:
        sets.library(roller_model, (), "double")
    except KernelsMissingError:
        return "python"
    return PREBUILT


def kernel_by(
    backend: str,
    vehicle: Vehicle,
    roller_model: str,
    effects: tuple[str, ...] = (),
    constants: Constants = (),
) -> Kernel:
    """The kernel of these effects by a backend: "compiled" or "python", or "prebuilt": a general set where one has the
    effects, and else compiled."""
    if backend == PREBUILT:
        made = None
        if effects_of(vehicle, roller_model, effects):  # else the set itself was built
            made = neutral_kernel(vehicle, roller_model, effects, constants)
        if made is not None:
            return made
        backend = "compiled"
    return kernel(vehicle, roller_model, backend, effects=effects, constants=constants)
