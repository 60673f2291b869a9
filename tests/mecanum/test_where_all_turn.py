"""What the engine calls while no wheel stands on its joint: the same numbers to rounding, for less
work."""

import types

import numpy as np
import pytest

from omniroll import Vehicle, codegen
from omniroll.kernels import sets
from omniroll.kernels.kernel import kernel

PAPER = Vehicle.paper(3, 6)
VEHICLES = {"mecanum": PAPER.replace(roller_angle=[0.7, -0.7, 0.4]), "rows": PAPER.replace(rows=2, row_offset=1e-2)}


@pytest.mark.parametrize(("model", "name"), [("free", "mecanum"), ("locked", "rows")])
def test_its_numbers_are_those_of_wheels_of_which_none_stands(model, name):
    bound, random = kernel(VEHICLES[name], model, "python", effects=("drive",)), np.random.default_rng(1)
    made = sets.programs().kernel(model, bound.effects)
    found = codegen.engine_sets.for_wheels_that_turn(made.effects, made.programs.registry)
    assert found[0].name == "forward_dynamics_turning"
    found = [codegen.sharing.share(function) for function in found]
    (usual,) = (function for function in made.functions if function.name == "forward_dynamics")
    own, whole = (codegen.operations.count_operations(function) for function in (found[0], usual))
    work = [sum(counts["wheel"].values()) for counts in (own, whole)]
    assert work[0] < (0.85 if name == "mecanum" else 1) * work[1]
    module = types.ModuleType("turning")
    module.__package__ = "omniroll.generated.python"
    exec(codegen.rendering.python_text(made.effects, [*made.functions, *found], {}), module.__dict__)
    for _ in range(20):
        inputs = [random.uniform(-0.4, 0.4, a.shape).tolist() for a in bound.signatures["forward_dynamics"].inputs]
        expected = bound.call("forward_dynamics", *inputs)
        found = module.forward_dynamics_turning(bound._model, *inputs)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * np.abs(expected).max())
