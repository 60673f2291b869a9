"""The emitted C compiles as a hostile reviewer would compile it, and agrees with the emitted Python."""

import importlib
import json
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
TYPES = {"double": ([], "double", 2.0**-52), "float": (["-DOMNIROLL_FLOAT"], "float", 2.0**-23),
         "long double": (["-DOMNIROLL_LONG_DOUBLE"], "long double", 2.0**-52)}  # fmt: skip
N, n = 3, 4
NU, CHI, THETA = [0.25, -0.5, 1.5], [0.125, -0.25, 0.5], 0.75
SPINS = [[0.5 * i - 0.25 * j for j in range(n - 1)] for i in range(N)]
MOMENTA = [[0.5, 0.25], [-0.75, 1.0], [0.125, -2.0]]


@pytest.fixture(scope="module")
def files():
    """The toy's pair."""
    read = Derivation(json.loads(json.dumps(derivation())))
    toy = next(s for s in read.sets if s.name == "toy")
    return pair(toy, [share(f) for f in toy.functions], read.data["bounds"], {}, "omniroll", "omniroll")


@pytest.fixture(scope="module")
def pair_folder(files, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    (folder / "omniroll.h").write_text(files.header)
    (folder / "omniroll.c").write_text(files.source)
    return folder


@pytest.fixture(scope="module", params=[("gcc", "double"), ("gcc", "float"), ("clang", "long double")], ids="-".join)
def library(request, files, pair_folder, tmp_path_factory):
    """(the loaded toy with its model, its epsilon), for a compiler and a number type."""
    compiler, number_type = request.param
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    macro, real, epsilon = TYPES[number_type]
    file = tmp_path_factory.mktemp("toy") / "toy.so"
    plain = "-DOMNIROLL_PLAIN_NAMES"  # which cffi looks for
    command = [compiler, *FLAGS, *macro, plain, "-shared", "-fPIC", "-o", file, pair_folder / "omniroll.c", "-lm"]
    subprocess.run(command, check=True)
    ffi = cffi.FFI()
    ffi.cdef(f"typedef {real} omniroll_real;\n{files.declarations}")
    toy = SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(file)))
    toy.angles = reals(toy, [0.5, 2.5, 4.5])
    toy.storage = ffi.new("omniroll_wheel[]", N), ffi.new("omniroll_roller[]", n - 1)
    toy.model, vehicle = ffi.new("omniroll_model *"), ffi.new("omniroll_vehicle *")
    vehicle.wheels, vehicle.rollers_per_wheel = N, n
    vehicle.mass, vehicle.length, vehicle.wheel_angles = 2.5, 8.0, toy.angles
    assert toy.lib.omniroll_prepare(vehicle, *toy.storage, toy.model) == 0
    return toy, epsilon


@pytest.fixture(scope="module")
def python(toy_folder):
    return importlib.import_module("toy_generated.python.toy")


def flat(values):
    return [x for v in values for x in flat(v)] if isinstance(values, list | tuple) else [float(values)]


def reals(toy, values):
    return toy.ffi.new("omniroll_real[]", flat(values))


def python_model(python):
    return python.prepare(N, n, 2.5, 8.0, [0.5, 2.5, 4.5])


def agree(found, expected, epsilon):
    assert flat(list(found)) == pytest.approx(flat(expected), rel=200 * epsilon, abs=20 * epsilon)


def test_functions(library, python):
    toy, epsilon = library
    m, out = python_model(python), reals(toy, [0.0] * 3)
    toy.lib.omniroll_forward_dynamics(toy.model, reals(toy, NU), reals(toy, CHI), reals(toy, MOMENTA), out)
    agree(out, python.forward_dynamics(m, NU, CHI, MOMENTA), epsilon)
    rates, spins = reals(toy, [0.0] * N), reals(toy, [0.0] * N)
    toy.lib.omniroll_wheel_rates(toy.model, reals(toy, NU), reals(toy, CHI), rates, spins)
    agree([*rates, *spins], python.wheel_rates(m, NU, CHI), epsilon)
    toy.lib.omniroll_pose_rates(toy.model, reals(toy, NU), THETA, out)
    agree(out, python.pose_rates(m, NU, THETA), epsilon)


def test_arrays_are_dense(library, python):
    toy, epsilon = library
    matrix, spins, momenta = (reals(toy, [0.0] * size) for size in (9, N * (n - 1), 2 * N))
    energy = reals(toy, [0.0])
    toy.lib.omniroll_everything(
        toy.model, reals(toy, NU), reals(toy, CHI), reals(toy, SPINS), matrix, spins, momenta, energy
    )
    expected = python.everything(python_model(python), NU, CHI, SPINS)
    agree([*matrix, *spins, *momenta, *energy], expected, epsilon)
