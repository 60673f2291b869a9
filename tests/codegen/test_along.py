"""Functions with slopes in a direction against the complex step on the functions themselves."""

from pathlib import Path

import numpy as np
import pytest

from omniroll import Bearings, Contact, Vehicle
from omniroll.codegen.along import ALONG, SUFFIX
from omniroll.codegen.on_demand import Programs
from omniroll.codegen.programs import steps
from omniroll.effects.effect_set import EffectSet
from omniroll.kernels import sets
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

DATA = Path(__file__).parents[2] / "generated" / "data"
VISCOUS = (Contact((40.0, 30.0)),)
REGULARISED = (Contact(law="regularised", friction=(0.3, 0.4), speed=0.05), Bearings(roller_viscous=1e-5))
IN_SERIES = (REGULARISED[0], Bearings(roller_coulomb=0.01))  # whose bearings leave a part of the loads


@pytest.mark.long
@pytest.mark.parametrize("model, effects", [
    ("massless", ()), ("locked", ()), ("free", ()), ("massless", VISCOUS), ("free", VISCOUS), ("massless", REGULARISED),
    ("free", REGULARISED), ("massless", IN_SERIES),
])  # fmt: skip
def test_slopes_are_those_of_the_functions(model, effects):
    plain, random = EffectSet(effects).kernel(Vehicle.paper(), model, "python"), np.random.default_rng(3)
    made = sets.python_module(plain.base, (*plain.effects, ALONG))
    signatures = {f["name"]: f for f in sets.functions(plain.base, (*plain.effects, ALONG))}
    constants = dict(zip(plain.constant_names, plain.constants, strict=True))
    moved = {name: value * random.uniform(-1, 1, value.shape) for name, value in constants.items()}
    tangents = TangentKernel(plain, moved)
    given = {**constants, **{f"{name}{SUFFIX}": value for name, value in moved.items()}}
    taken = [a["name"] for a in signatures["prepare"]["arguments"] if a["role"] == "in"]
    prepared = made.prepare(plain.wheels, plain.rollers_per_wheel, *(given[name].tolist() for name in taken))
    compared = 0
    for name, signature in plain.signatures.items():
        if f"{name}{SUFFIX}" not in signatures:
            continue
        inputs = [random.uniform(-0.3, 0.3, argument.shape) for argument in signature.inputs]
        ways = [random.normal(size=argument.shape) for argument in signature.inputs]
        found = getattr(made, f"{name}{SUFFIX}")(prepared, *(value.tolist() for value in (*inputs, *ways)))
        wanted = tangents.call(name, *map(with_tangent, inputs, ways))
        wanted = wanted if len(signature.outputs) > 1 else (wanted,)
        for value, slope, own in zip(found[: len(wanted)], found[len(wanted) :], wanted, strict=True):
            size = max(np.abs(tangent_of(own)).max(), np.abs(own.real).max())
            assert np.abs(np.array(value) - own.real).max() <= 1e-13 * np.abs(own.real).max(), name
            assert np.abs(np.array(slope) - tangent_of(own)).max() <= 1e-12 * size, name
            compared += 1
    assert compared >= (5 if model == "massless" else 6)


@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_a_step_whose_slopes_are_a_rule_is_the_same_in_all_functions(model):
    """A rule belongs to a name. Where another function gave this name to something else, it would be wrong there."""
    programs = Programs.load(DATA)
    rules, base = programs.registry.derivatives.rules, programs.base(model)
    found: dict[str, set] = {}
    for function in base.functions:
        for step in steps(function.body):
            if step.kind == "let" and (step.name in rules.slopes or step.name in rules.still):
                found.setdefault(step.name, set()).add(step.expression)
    assert len(found) >= 5
    assert {name for name, expressions in found.items() if len(expressions) > 1} == set()
