"""The libraries of sets: the structs that they are called with, their bits, and the folder that they are kept in."""

import itertools
import os
import shutil
import subprocess
import sys
import textwrap
from types import SimpleNamespace

import numpy as np
import pytest

from omniroll import Slope, Vehicle, generated_data, simulate
from omniroll.codegen import specialise
from omniroll.errors import KernelsMissingError
from omniroll.kernels import sets
from omniroll.kernels.kernel import NUMBER_TYPES, CompiledKernel, PythonKernel, kernel
from omniroll.kernels.neutral_kernel import NeutralKernel, kernel_by

pytestmark = pytest.mark.long

PAPER = Vehicle.paper()
MODELS = ("massless", "locked", "free")
SLOPE = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))

needs_a_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")


# Structs


@needs_a_compiler
@pytest.mark.parametrize("number_type", NUMBER_TYPES)
@pytest.mark.parametrize("model", MODELS)
def test_a_library_knows_the_structs_of_its_declarations(model, number_type):
    """Any other size is refused."""
    made = sets.library(model, (), number_type)
    kinds = ["vehicle", "wheel", *(["roller"] if "omniroll_roller" in made.ffi.list_types()[0] else []), "model"]
    sizes = [made.ffi.sizeof(f"omniroll_{kind}") for kind in kinds]
    assert made.lib.omniroll_check_layout(*sizes) == made.lib.OMNIROLL_OK
    for place in range(len(sizes)):
        for wrong in (-1, 8):
            others = [size + wrong * (k == place) for k, size in enumerate(sizes)]
            assert made.lib.omniroll_check_layout(*others) == made.lib.OMNIROLL_BAD_LAYOUT


@needs_a_compiler
def test_a_library_with_other_structs_is_not_called(monkeypatch):
    floats, doubles = (sets.library("free", (), number_type) for number_type in ("float", "double"))
    mixed = SimpleNamespace(ffi=doubles.ffi, lib=doubles.ffi.dlopen(str(library_file("free", "float"))))
    assert mixed.lib is not floats.lib
    monkeypatch.setattr(sets, "library", lambda *_: mixed)
    with pytest.raises(KernelsMissingError, match="free has other structs"):
        CompiledKernel(PAPER, "free")


def library_file(base, number_type):
    place, file = sets._pair(base, (), number_type)
    return place / file


# What is compiled


@needs_a_compiler
@pytest.mark.parametrize("wheels, library", [(3, "3"), (5, "any")])
def test_a_specialised_run_compiles_one_engine(tmp_path, wheels, library):
    """And any other none: in a process of its own, with an empty cache."""
    runs = f"""
        import pathlib
        import omniroll
        slope = omniroll.Slope(0.1)
        task = {{"nu": (1, 0, 0), "duration": 0.01, "effects": [slope]}}
        omniroll.simulate(omniroll.Vehicle.paper({wheels}), **task)
        assert not list(pathlib.Path({str(tmp_path)!r}).rglob("*.so"))
        omniroll.simulate(omniroll.Vehicle.paper({wheels}), **task, engine="specialised")
    """
    environment = os.environ | {"OMNIROLL_CACHE": str(tmp_path)}
    subprocess.run([sys.executable, "-c", textwrap.dedent(runs)], env=environment, check=True, capture_output=True)
    (made,) = tmp_path.rglob("engine-*.so")
    assert made.stem.split("-")[-1] == library


# Bits


def outputs(made, names):
    """{function: its outputs} for a state of random numbers, the same for every kernel with the same arguments."""
    arguments = {a.name: a for name in names for a in made.signatures[name].inputs}
    rng = np.random.default_rng(7)
    values = {name: 0.4 * rng.uniform(-1, 1, arguments[name].shape) for name in sorted(arguments)}
    given = {name: [values[a.name] for a in made.signatures[name].inputs] for name in names}
    results = {name: made.call(name, *arrays) for name, arrays in given.items()}
    return {name: result if isinstance(result, tuple) else (result,) for name, result in results.items()}


def assert_same_bits(one, other):
    assert one.keys() == other.keys()
    for name in one:
        for first, second in zip(one[name], other[name], strict=True):
            np.testing.assert_array_equal(first, second, err_msg=name)


@needs_a_compiler
@pytest.mark.parametrize("model", MODELS)
def test_a_set_made_on_demand_has_the_bits_of_its_base(model):
    """In every function in which the effect does not stand."""
    base, made = kernel(PAPER, model), kernel(PAPER, model, effects=("slope",), constants=SLOPE)
    changed = {"forward_dynamics", "accelerations", "forces", "inverse_dynamics"}
    names = [name for name in base.signatures if name not in changed]
    assert {"wheel_speeds", "mass_matrix", "energy"} <= set(names)
    assert_same_bits(outputs(made, names), outputs(base, names))
    assert {a.name for a in made.signatures["forward_dynamics"].inputs} - {
        a.name for a in base.signatures["forward_dynamics"].inputs
    }


# Compilers that fail


@pytest.mark.parametrize("compiler, said", [
    ("#!/bin/sh\necho 'cannot write: No space left on device' >&2\nexit 1\n", "No space left on device"),
    ("", "Python kernel"),
])  # fmt: skip
def test_a_set_of_its_own_needs_a_compiler(compiler, said, fresh_cache, tmp_path, monkeypatch):
    """One that has no room gives one message, and the Python kernel serves; so does none."""
    script = tmp_path / "compiler"
    monkeypatch.setenv("CC", str(script))
    if compiler:
        script.write_text(compiler)
        script.chmod(0o755)
    with pytest.warns(RuntimeWarning, match=said) as warned:
        made = kernel(PAPER, "locked", effects=("slope",), constants=SLOPE)
    assert len(warned) == 1 and isinstance(made, PythonKernel)
    task = {"nu": (1, 0, 0), "duration": 0.01, "effects": [Slope(0.1)]}
    assert simulate(PAPER, **task).stats["kernel"] == sets.set_name("free", sets.general_sets("free")[0])
    with pytest.warns(RuntimeWarning, match="Python kernel"), pytest.raises(KernelsMissingError, match="compiled"):
        simulate(PAPER, **task, engine="specialised")


# General sets


def allowed(model):
    """Sets of effects that can stand together under a roller model: with all that excludes nothing, and one choice of
    each axle's and roller's friction and of the ground."""
    entries = {entry["name"]: entry for entry in generated_data.load("effects")["effects"]}
    plain = ("layout", "drive", "motor", "slope")
    kinds = [name for name in entries if name.startswith(("axle_", "roller_", "contact_")) and name != "contact_loads"]
    kinds = [name for name in kinds if model not in entries[name]["excludes"]]
    for count in range(len(kinds) + 1):
        for chosen in itertools.combinations(kinds, count):
            present = {*chosen, *(need for name in chosen for need in entries[name]["needs"])}
            series = model == "massless" and {"roller_viscous", "roller_sticking", "contact_coulomb"} <= present
            if not series and not any({*present, model} & {*entries[name]["excludes"]} for name in present):
                yield tuple(name for name in entries if name in present or name in plain)


@pytest.mark.parametrize("model", MODELS)
def test_a_general_set_stands_for_every_set(model):
    """It has all functions of the set, and solves for the same numbers; on smooth ground for the free rollers', too."""
    programs, generals = sets.programs(), sets.general_sets(model)
    functions = programs.base(model).functions

    def named(effects):
        return {function.name for function in functions if specialise.is_called_for(function, effects)}

    def solved(effects):
        states = programs.registry.integrated(SimpleNamespace(base=model, effects=effects))
        return {state.name for state in states if state.kind == "core"}

    found = list(allowed(model))
    assert len(found) >= {"locked": 36, "massless": 100, "free": 150}[model]
    for effects in found:
        general = next(own for own in generals if {*effects} <= {*own})
        assert named(effects) <= named(general)
        more = solved(general) - solved(effects)
        assert solved(effects) <= solved(general) and (not more or "contact_viscous" in general)
    for general in generals:
        assert sets.is_general(model, general) and not sets.is_general(model, general[1:])


def test_texts_of_the_engine():
    """With those without effects: each costs everybody's build some seconds. Other wheels: eight roll, four slip, and
    three have profiles."""
    every = [effects for model in MODELS for effects in ((), *sets.general_sets(model))]
    of_other_wheels = [effects for effects in every if {"rows", "mecanum"} & {*effects}]
    assert len(every) - len(of_other_wheels) <= 22 and len(of_other_wheels) <= 15


SETS = {
    "free": ("slope", "roller_viscous"),
    "massless": ("drive", "slope", "contact", "contact_coulomb"),
    "locked": ("axle_coulomb",),
}
GIVEN = {
    "gravity": 9.8,
    "slope_angle": 0.1,
    "slope_direction": 0.3,
    "axle_torque": 0.01,
    "axle_fade_speed": 0.2,
    "roller_damping": 1e-5,
}


@pytest.mark.parametrize("model", MODELS)
def test_a_neutral_kernel_has_the_functions_of_the_set(model):
    """With what they take, and they give the same to rounding."""
    names = {
        name
        for entry in generated_data.load("effects")["effects"]
        if entry["name"] in SETS[model]
        for name in entry["constants"]
    }
    constants = tuple((name, GIVEN[name]) for name in sorted(names))
    own, general = (kernel_by(backend, PAPER, model, SETS[model], constants) for backend in ("python", "prebuilt"))
    assert isinstance(general, NeutralKernel) and general.set_name == own.set_name
    assert {name: signature.shapes for name, signature in own.signatures.items()} == {
        name: signature.shapes for name, signature in general.signatures.items()
    }
    wanted, found = (outputs(made, list(own.signatures)) for made in (own, general))
    for name in wanted:
        for one, other in zip(wanted[name], found[name], strict=True):
            np.testing.assert_allclose(
                other, one, rtol=1e-10, atol=1e-12 * (1 + np.abs(one).max(initial=0)), err_msg=name
            )
