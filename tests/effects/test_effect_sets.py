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

REACTIONS = {"contact_forces", "contact_impulses", "load_balance"}
LISTED = {e["name"]: e for e in generated_data.load("effects")["effects"] if e["neutral"]}
EFFECTS = {name: e for name, e in LISTED.items() if e["table"] != "reactions"}
NEUTRAL = {name: e["neutral"] for name, e in LISTED.items()}
BESIDE_REACTIONS = tuple(  # loads from springs share the numbers of the loads' balance
    name for name, e in LISTED.items()
    if "reactions" not in (name, *e["needs"], *e["excludes"]) and e["table"] != "springs"
)  # fmt: skip
KERNEL = "forward_dynamics"


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


# An effect that acts in a function of its own, in the place of another one or beside it.
INSTEAD = {
    "contact": ("slip_dynamics", KERNEL), "contact_coulomb": ("ground_dynamics", KERNEL),
    "contact_springs": ("spring_dynamics", "slip_dynamics"), "roller_coulomb": ("roller_rates", KERNEL),
}  # fmt: skip


@pytest.mark.parametrize("effect", EFFECTS)
def test_the_smaller_set_has_fewer_operations(effect):
    larger = added_to_nothing(effect)
    with_it, without = made("free", larger), made("free", tuple(e for e in larger if e != effect))
    own, other = INSTEAD.get(effect, (None, solver(effect)))
    if own is not None:
        assert own not in {f["name"] for f in without.signatures} and own in {f["name"] for f in with_it.signatures}
    if effect in ("contact", "contact_coulomb"):
        assert operations(without) == operations(with_it)
    else:
        of_larger = own if effect == "contact_springs" else other
        assert operations(without, other) < operations(with_it, of_larger)


@pytest.mark.parametrize("effect", [*list(EFFECTS)[::3], "reactions"])
def test_no_symbol_of_an_absent_effect_is_left(effect):
    """All other effects are there; of this one there is no argument, field, function or local."""
    others = without_what_needs(effect) if effect in EFFECTS else BESIDE_REACTIONS
    symbols = set(NEUTRAL[effect])
    assert not any(symbols & text for text in words("free", others))
    assert symbols & words("free", tuple(EFFECTS) if effect in EFFECTS else ("reactions",))[0]
    assert not any(a.get("effect") == effect for f in made("free", others).signatures for a in f["arguments"])


@pytest.mark.parametrize("base", ["massless", "locked", "free"])
def test_reactions_leave_every_other_function_as_it_is(base):
    plain, asked = (bodies(made(base, (*BESIDE_REACTIONS, *more)).python) for more in ((), ("reactions",)))
    extra = asked.keys() - plain.keys()
    assert extra >= REACTIONS and extra <= {*REACTIONS, "coulomb_momenta", "bearing_momenta"}
    assert all(asked[name] == text for name, text in plain.items())


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


SLOPE = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))
STATE = (np.array([1.0, 0.2, 0.3]), np.array([0.1, -0.2, 0.3]))


def test_both_backends_of_a_set_made_on_demand():
    vehicle = omniroll.Vehicle.paper()
    compiled = kernel(vehicle, "locked", "compiled", effects=("slope", "drive"), constants=SLOPE)
    python = kernel(vehicle, "locked", "python", effects=("drive", "slope"), constants=SLOPE)
    assert isinstance(compiled, CompiledKernel) and isinstance(python, PythonKernel)
    assert compiled.effects == python.effects == ("drive", "slope")  # the registry's order
    found = [k.forward_dynamics(*STATE, [0.1, 0.2, 0.3], 0.4) for k in (compiled, python)]
    np.testing.assert_allclose(*found, rtol=1e-13)
