"""Functions with slopes in a direction against the complex step on the functions themselves."""

import numpy as np
import pytest

from omniroll import Vehicle
from omniroll.codegen.along import ALONG, SUFFIX
from omniroll.kernels import sets
from omniroll.kernels.kernel import kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent


@pytest.mark.long
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_slopes_are_those_of_the_functions(model):
    plain, random = kernel(Vehicle.paper(), model, "python"), np.random.default_rng(3)
    made = sets.python_module(model, (ALONG,))
    signatures = {f["name"]: f for f in sets.functions(model, (ALONG,))}
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
