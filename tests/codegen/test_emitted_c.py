"""The emitted C compiles as a hostile reviewer would compile it, and agrees with the emitted Python."""

import importlib
import shutil
import subprocess
from types import SimpleNamespace

import cffi
import pytest
from toy import derivation

from codegen.derivation import Derivation
from codegen.pair import pair
from codegen.sharing import share

FLAGS = [
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-O2",
]
TYPES = {"double": ([], 2.0**-52), "float": (["-DOMNIROLL_FLOAT"], 2.0**-23),
         "long double": (["-DOMNIROLL_LONG_DOUBLE"], 2.0**-52)}  # fmt: skip
N, n = 3, 4
NU, CHI, THETA = [0.25, -0.5, 1.5], [0.125, -0.25, 0.5], 0.75
SPINS = [[0.5 * i - 0.25 * j for j in range(n - 1)] for i in range(N)]
MOMENTA = [[0.5, 0.25], [-0.75, 1.0], [0.125, -2.0]]


@pytest.fixture(scope="module")
def toy_pair():
    """The toy's header and source. Without wheel_speeds there are no steps, which need a vehicle of rollers."""
    toy = Derivation(derivation())
    names = {symbol: entry["code"] for symbol, entry in toy.data["symbols"].items()}
    functions = [share(f) for f in toy.sets[0].functions if f.name != "wheel_speeds"]
    return pair(toy.sets[0], functions, [], names, "omniroll_toy", "omniroll")


@pytest.fixture(scope="module")
def toy_files(toy_pair, tmp_path_factory):
    folder = tmp_path_factory.mktemp("toy")
    (folder / "omniroll_toy.h").write_text(toy_pair.header)
    (folder / "omniroll_toy.c").write_text(toy_pair.source)
    return folder


@pytest.fixture(scope="module", params=[(c, t) for c in ("gcc", "clang") for t in TYPES], ids="-".join)
def library(request, toy_pair, toy_files, tmp_path_factory):
    """The loaded toy, for a compiler and a number type."""
    compiler, number_type = request.param
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    macro, epsilon = TYPES[number_type]
    file = tmp_path_factory.mktemp("built") / "toy.so"
    source = toy_files / "omniroll_toy.c"
    subprocess.run([compiler, *FLAGS, *macro, "-shared", "-fPIC", "-o", file, source, "-lm"], check=True)
    ffi = cffi.FFI()
    ffi.cdef(f"typedef {number_type} omniroll_real;\n{toy_pair.declarations}")
    return SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(file)), epsilon=epsilon)


@pytest.fixture(scope="module")
def python(toy_folder):
    return importlib.import_module("toy_generated.python.toy")


def flat(values):
    return [x for v in values for x in flat(v)] if isinstance(values, list | tuple) else [float(values)]


def reals(library, values):
    return library.ffi.new("omniroll_real[]", flat(values))


def model_of(library):
    """The toy's model, and the storage that it points to."""
    ffi = library.ffi
    vehicle, model = ffi.new("omniroll_vehicle *"), ffi.new("omniroll_model *")
    storage = [reals(library, [0.5, 2.5, 4.5]), ffi.new("omniroll_wheel[]", N), ffi.new("omniroll_roller[]", n - 1)]
    vehicle.wheels, vehicle.rollers_per_wheel = N, n
    vehicle.mass, vehicle.length, vehicle.wheel_angles = 2.5, 8.0, storage[0]
    assert library.lib.omniroll_prepare(vehicle, storage[1], storage[2], model) == library.lib.OMNIROLL_OK
    return model, storage


def python_model(python):
    return python.prepare(N, n, 2.5, 8.0, [0.5, 2.5, 4.5])


def agree(library, found, expected):
    values = [float(x) for array in found for x in array]
    assert values == pytest.approx(flat(expected), rel=200 * library.epsilon, abs=20 * library.epsilon)


def test_model(library, python):
    (c, _), m = model_of(library), python_model(python)
    found = [c.gain, c.l, *[x for i in range(N) for x in (c.wheel[i].cos_alpha, c.wheel[i].sin_alpha)]]
    expected = [m.gain, m.l, *[x for i in range(N) for x in (m.cos_alpha[i], m.sin_alpha[i])], *m.cos_kappa]
    agree(library, [found, [c.roller[j].cos_kappa for j in range(n - 1)]], expected)


def test_functions(library, python):
    (model, _), m, lib = model_of(library), python_model(python), library.lib
    nu, chi, momenta = (reals(library, values) for values in (NU, CHI, MOMENTA))
    out = reals(library, [0.0] * 3)
    lib.omniroll_reduced(model, nu, chi, momenta, out)
    agree(library, [out], python.reduced(m, NU, CHI, MOMENTA))
    rates, spins = reals(library, [0.0] * N), reals(library, [0.0] * N)
    lib.omniroll_wheel_rates(model, nu, chi, rates, spins)
    agree(library, [rates, spins], python.wheel_rates(m, NU, CHI))
    lib.omniroll_pose_rates(model, nu, THETA, out)
    agree(library, [out], python.pose_rates(m, NU, THETA))


def test_arrays_are_dense(library, python):
    model, _ = model_of(library)
    outputs = [reals(library, [0.0] * size) for size in (9, N * (n - 1), 2 * N, 1)]
    inputs = [reals(library, values) for values in (NU, CHI, SPINS)]
    library.lib.omniroll_everything(model, *inputs, *outputs)
    agree(library, outputs, python.everything(python_model(python), NU, CHI, SPINS))


def test_header_serves_cpp(toy_files, tmp_path):
    compiler = next(filter(None, map(shutil.which, ["g++", "clang++"])), None)
    if compiler is None:
        pytest.skip("no C++ compiler")
    program = tmp_path / "all.cpp"
    program.write_text('#include "omniroll_toy.h"\nint main() { return 0; }\n')
    subprocess.run([compiler, "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{toy_files}", program], check=True)


def test_source_says_where_it_comes_from(toy_folder):
    for file in toy_folder.rglob("*.*"):
        if file.is_file() and "__pycache__" not in file.parts:
            start = file.read_text()[:600]
            assert "Generated by codegen from codegen/templates/" in start, file
            assert "do not edit" in start.replace("\n", " "), file


def test_comments_carry_equations_steps_and_units(toy_pair):
    assert "Equations: (3.4), section 4." in toy_pair.source
    assert "Steps: wheel (maxima/forms/toy.mac)." in toy_pair.source
    assert "1: the toy's gain" in toy_pair.header
    assert max(map(len, (toy_pair.header + toy_pair.source).splitlines())) <= 120
