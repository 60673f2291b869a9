"""An absent effect is absent: from the arguments, from the operations, from the machine code, from the state."""

import inspect
import re
from functools import cache

import numpy as np
import pytest

import omniroll
from omniroll import generated_data
from omniroll.codegen.programs import ContractError
from omniroll.errors import InvalidValueError
from omniroll.kernels import sets
from omniroll.kernels.kernel import CompiledKernel, PythonKernel, kernel

pytestmark = pytest.mark.long

EFFECTS = {
    e["name"]: e for e in generated_data.load("effects")["effects"] if e["neutral"] and e["table"] != "reactions"
}
MODELS = ("massless", "locked", "free")
KERNEL = "forward_dynamics"
CONSTANTS = {
    "layout": {"wheel_places": ((0.1, 0.0), (-0.1, 0.1), (-0.1, -0.1)), "center_of_mass": (0.0, 0.0)},
    "axle_viscous": {"axle_damping": 0.1},
    "axle_coulomb": {"axle_torque": 0.1, "axle_fade_speed": 0.1},
    "roller_viscous": {"roller_damping": 1e-6},
    "roller_coulomb": {"roller_torque": 1e-5, "roller_fade_speed": 0.1},
    "slope": {"gravity": 9.8, "slope_angle": 0.1, "slope_direction": 0.0},
}


@cache
def made(base, effects):
    return sets.programs().kernel(base, effects)


def operations(texts, name=KERNEL, wheels=3, rollers=5):
    (function,) = (f for f in texts.signatures if f["name"] == name)
    turns = {"once": 1, "wheel": wheels, "slot": rollers - 1, "roller": wheels * (rollers - 1)}
    return sum(turns[place] * sum(counts.values()) for place, counts in function["operations"].items())


@cache
def words(base, effects):
    """The words in the C files, in the functions on vectors and in the Python of a set, but for what explains them."""
    texts = made(base, effects)
    pair = texts.pair()
    codes = [re.sub(r'/\*.*?\*/|""".*?"""', "", text, flags=re.DOTALL)
             for text in (pair.source, pair.header, texts.in_lanes, texts.python)]  # fmt: skip
    return [set(re.findall(r"\w+", code)) for code in codes]


LAWS = ("contact_viscous", "contact_regularised", "contact_coulomb")
NEEDS = {
    "rows": ("layout",),
    "motor": ("drive",),
    **dict.fromkeys(LAWS, ("contact",)),
    "contact_loads": ("contact", "contact_viscous", "reactions"),  # they act through a law
    "contact_springs": ("contact", "contact_regularised"),
}


def added_to_nothing(effect):
    return (*NEEDS.get(effect, ()), effect)


def without_what_needs(effect):
    return tuple(e for e in EFFECTS if e != effect and effect not in (*NEEDS.get(e, ()), *EFFECTS[e]["needs"]))


def solver(effect):
    """The function that an effect acts in: wheels that may slip have one of their own."""
    return "slip_dynamics" if effect.startswith("contact_") else KERNEL


def is_there(effect, base):
    """Rollers that are locked cannot slip."""
    return base != "locked" or not effect.startswith("contact")


@pytest.mark.parametrize("base", ["free"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_the_smaller_set_has_fewer_operations(effect, base):
    larger = added_to_nothing(effect)
    smaller = tuple(e for e in larger if e != effect)
    with_it, without = made(base, larger), made(base, smaller)
    if not is_there(effect, base):
        others = tuple(e for e in larger if not e.startswith("contact"))
        assert [f["name"] for f in with_it.signatures] == [f["name"] for f in made(base, others).signatures]
        return
    if (effect, base) == ("roller_coulomb", "free"):  # the rollers are asked one by one, in a function of its own
        assert "roller_rates" not in {f["name"] for f in without.signatures}
    if effect == "contact_coulomb":  # contacts that stick and slip have a function in the place of the other laws'
        assert "ground_dynamics" not in {f["name"] for f in without.signatures}
        assert operations(without) == operations(with_it)
        return
    if effect == "contact":  # so are the wheels that may slip
        assert "slip_dynamics" not in {f["name"] for f in without.signatures}
        assert operations(without) == operations(with_it)
        return
    if effect == "contact_springs":  # so are those on springs
        assert "spring_dynamics" not in {f["name"] for f in without.signatures}
        assert operations(without, "slip_dynamics") < operations(with_it, "spring_dynamics")
        return
    assert operations(without, solver(effect)) < operations(with_it, solver(effect))


@pytest.mark.parametrize("base", ["free"])
@pytest.mark.parametrize("effect", list(EFFECTS)[::3])
def test_no_symbol_of_an_absent_effect_is_left(effect, base):
    """All other effects are there; of this one there is no argument, field, function or local."""
    others = without_what_needs(effect)
    symbols = set(EFFECTS[effect]["neutral"])
    assert not any(symbols & text for text in words(base, others))
    assert bool(symbols & words(base, tuple(EFFECTS))[0]) == is_there(effect, base)
    assert not any(a.get("effect") == effect for f in made(base, others).signatures for a in f["arguments"])


def bodies(text):
    """{name: text} of the Python functions of a set."""
    parts = re.split(r"^def (\w+)", text, flags=re.MULTILINE)[1:]
    return {name: body.strip() for name, body in zip(parts[::2], parts[1::2], strict=True)}


def test_a_committed_set_is_what_is_made_on_demand():
    """Function by function: a committed module may import one from the first module that has it."""
    for entry in generated_data.load("kernels")["sets"]:
        if "base" in entry and entry["base"] != "parts":
            texts = made(entry["base"], tuple(entry["effects"]))
            module = sets.python_module(entry["base"], tuple(entry["effects"]))
            wanted = bodies(texts.python)
            assert len(wanted) > 8
            for name, body in wanted.items():
                assert bodies(inspect.getsource(getattr(module, name)))[name] == body


def test_effects_that_nobody_knows():
    with pytest.raises(ContractError, match="levitation"):
        made("free", ("levitation",))
    with pytest.raises(InvalidValueError, match="effects"):
        kernel(omniroll.Vehicle.paper(), "free", effects=("levitation",))
    with pytest.raises(TypeError, match="slope_angle"):
        kernel(omniroll.Vehicle.paper(), "free", effects=("slope",), constants=(("gravity", 9.8),))


SLOPE = tuple(CONSTANTS["slope"].items())
STATE = (np.array([1.0, 0.2, 0.3]), np.array([0.1, -0.2, 0.3]))


def test_both_backends_of_a_set_made_on_demand():
    vehicle = omniroll.Vehicle.paper()
    compiled = kernel(vehicle, "locked", "compiled", effects=("slope", "drive"), constants=SLOPE)
    python = kernel(vehicle, "locked", "python", effects=("drive", "slope"), constants=SLOPE)
    assert isinstance(compiled, CompiledKernel) and isinstance(python, PythonKernel)
    assert compiled.effects == python.effects == ("drive", "slope")  # the registry's order
    found = [k.forward_dynamics(*STATE, [0.1, 0.2, 0.3], 0.4) for k in (compiled, python)]
    np.testing.assert_allclose(*found, rtol=1e-13)
