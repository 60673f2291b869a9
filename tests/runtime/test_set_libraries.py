"""The libraries of sets: the structs that they are called with, their bits, and the folder that they are kept in."""

import os
import shlex
import shutil
import stat
import subprocess
import sys
import textwrap
from types import SimpleNamespace

import numpy as np
import pytest

from omniroll import Vehicle
from omniroll.errors import KernelsMissingError
from omniroll.kernels import sets
from omniroll.kernels.kernel import NUMBER_TYPES, CompiledKernel, PythonKernel, kernel

pytestmark = pytest.mark.long

PAPER = Vehicle.paper()
MODELS = ("massless", "locked", "free")
SLOPE = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))
BROKEN = "#!/bin/sh\necho 'cannot write: No space left on device' >&2\nexit 1\n"

needs_a_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")


def sloped(backend="compiled"):
    return kernel(PAPER, "locked", backend, effects=("slope",), constants=SLOPE)


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
def test_a_run_compiles_one_engine(tmp_path, wheels, library):
    """In a process of its own, with an empty cache."""
    runs = f"""
        import omniroll
        slope = omniroll.Slope(0.1)
        omniroll.simulate(omniroll.Vehicle.paper({wheels}), nu=(1, 0, 0), duration=0.01, effects=[slope])
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
def test_a_base_made_on_demand_has_the_bits_of_the_one_that_was_built(model, fresh_cache, monkeypatch):
    built = CompiledKernel(PAPER, model)
    monkeypatch.setattr(sets, "BUILT", fresh_cache / "nothing")
    place, file = sets._pair(model, (), "double")
    monkeypatch.setattr(sets, "library", lambda *_: sets._opened(place, file, "double", []))
    made = CompiledKernel(PAPER, model)
    assert made._lib is not built._lib and place.is_relative_to(fresh_cache)
    names = list(built.signatures)
    assert_same_bits(outputs(made, names), outputs(built, names))


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


# The folder


def compiler_script(folder, text, monkeypatch):
    """$CC as a shell script."""
    script = folder / "compiler"
    script.write_text(text)
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("CC", str(script))


def test_a_compiler_without_room_gives_one_message(fresh_cache, tmp_path, monkeypatch):
    """The Python kernel runs then."""
    compiler_script(tmp_path, BROKEN, monkeypatch)
    with pytest.warns(RuntimeWarning, match="No space left on device") as said:
        made = sloped()
    assert len(said) == 1 and isinstance(made, PythonKernel)


@needs_a_compiler
def test_a_folder_that_cannot_be_written_gives_one_message(fresh_cache, tmp_path, monkeypatch):
    """The kernels of this process are made elsewhere."""
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("OMNIROLL_CACHE", str(blocked))
    with pytest.warns(RuntimeWarning, match="OMNIROLL_CACHE") as said:
        assert isinstance(sloped(), CompiledKernel)
        assert isinstance(kernel(PAPER, "massless", effects=("slope",), constants=SLOPE), CompiledKernel)
    assert len(said) == 1 and str(blocked) in str(said[0].message)


WITHOUT_A_COMPILER = """
    import sys, warnings
    import omniroll
    from omniroll.engine.simulate import checked_task
    from omniroll.scenes import load_scene
    from omniroll.scenes.explanation import runs_on
    from omniroll.scenes.outcome import run_scene
    warnings.simplefilter("ignore")
    scene = load_scene(sys.argv[1])
    run = run_scene(scene)
    session = omniroll.Session(scene, driven=False)
    session.step(0.1)
    assert abs(session.nu - run.trajectory.nu[-1]).max() < 1e-8
    assert set(session.outputs) == eval(sys.argv[2])
    print(run.summary()["engine"], run.summary()["kernel"])
    print(runs_on(checked_task(scene.vehicle, **scene.options)))
"""
SCENE = """
[vehicle]
preset = "paper"
[start]
nu = [1, 0, 1]
[run]
duration = 0.1
[slope]
angle = 0.1
"""


STICKING = SCENE.replace("[slope]\nangle = 0.1", "[bearings]\nwheel_coulomb = 1e-2\nroller_coulomb = 1e-5")
BEARINGS = "{'bearing_torque', 'contact_bearing', 'axle_loss', 'spins', 'roller_loss'}"


@pytest.mark.parametrize(
    ("compiler", "text", "general", "outputs"),
    [
        ("false", SCENE, 0, "set()"),
        ("no compiler of this name", SCENE, 0, "set()"),
        ("false", STICKING, 1, BEARINGS),
    ],
)
def test_without_a_compiler_the_kernel_of_all_effects_runs(compiler, text, general, outputs, fresh_cache, tmp_path):
    """And `explain` and the summary say so."""
    scene = tmp_path / "scene.toml"
    scene.write_text(text)
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(WITHOUT_A_COMPILER), str(scene), outputs],
        capture_output=True, text=True, env=os.environ | {"CC": shlex.quote(compiler)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        f"compiled {sets.set_name('free', sets.general_sets('free')[general])}",
        "compiled engine, precompiled general kernel, since the one of this scene is not compiled",
    ]


def test_general_sets():
    """All effects, without those that exclude others or change no motion, and bearings that stick; first those that
    keep the states small. Then the same on a ground on which wheels may slip, without what sticks."""
    drives, axles, rollers = ("layout", "drive", "motor"), ("axle_viscous", "axle_coulomb"), "roller_viscous"
    everything = (*drives, *axles, "axle_sticking", rollers, "roller_coulomb", "roller_sticking", "slope")
    smaller = (*drives, *axles, "axle_sticking", rollers, "slope")
    ground = ("contact", "contact_viscous", "contact_regularised")
    slipping = (*drives, *axles, rollers, "roller_coulomb", "slope", *ground)
    assert sets.general_sets("locked") == [everything]
    assert sets.general_sets("massless") == [everything, slipping]
    smaller_slipping = tuple(name for name in slipping if name != "roller_coulomb")
    assert sets.general_sets("free") == [smaller, everything, smaller_slipping, slipping]
    for model in MODELS:
        for effects in sets.general_sets(model):
            assert sets.is_general(model, effects) and not sets.is_general(model, effects[1:])
