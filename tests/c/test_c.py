"""The generated C alone, as a controller takes it: strict compilers, a small program, Python's numbers."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import omniroll

HERE = Path(__file__).resolve().parent
GENERATED = HERE.parents[1] / "generated" / "c"
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "-ffp-contract=off"]
NUMBER_TYPES = {  # macro, machine epsilon of the type
    "double": ([], np.finfo(np.float64).eps),
    "float": (["-DOMNIROLL_FLOAT"], np.finfo(np.float32).eps),
    "long double": (["-DOMNIROLL_LONG_DOUBLE"], np.finfo(np.float64).eps),  # compared with double
}
LIBRARY_CALLS = {f"{name}{suffix}" for name in ("sin", "cos", "sincos", "sqrt", "exp") for suffix in ("", "f", "l")}
SCALARS = (
    "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
    "roller_axis_radius",
)  # fmt: skip

compilers = pytest.mark.parametrize("compiler", ["gcc", "clang"])
number_types = pytest.mark.parametrize("number_type", NUMBER_TYPES)
sources = pytest.mark.parametrize("source", sorted(GENERATED.glob("*.c")), ids=lambda path: path.stem)


def compile_c(compiler: str, *arguments: str | Path) -> None:
    """Compile with strict warnings as errors; skip where the compiler is not installed."""
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    command = [compiler, *STRICT, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr}"


def run_program(compiler: str, number_type: str, folder: Path) -> dict[str, np.ndarray]:
    """What accelerations.c prints: its inputs and outputs by name."""
    program = folder / "program"
    macro, _ = NUMBER_TYPES[number_type]
    files = (HERE / "accelerations.c", GENERATED / "omniroll_free.c", "-I", GENERATED)
    compile_c(compiler, *macro, *files, "-o", program, "-lm")
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    return {name: np.array(values, dtype=float) for name, *values in map(str.split, out.splitlines())}


@compilers
@number_types
def test_program_gives_the_accelerations_of_python(compiler, number_type, tmp_path):
    shown = run_program(compiler, number_type, tmp_path)
    wheels = len(shown["chi"])
    spins = shown["spins"].reshape(wheels, -1)
    vehicle = omniroll.Vehicle(
        wheels=wheels,
        rollers_per_wheel=spins.shape[1] + 1,
        wheel_angles=tuple(shown["wheel_angles"]),
        **{name: float(shown[name][0]) for name in SCALARS},
    )
    nu_dot, spins_dot = omniroll.accelerations(vehicle, shown["nu"], shown["chi"], spins)
    _, eps = NUMBER_TYPES[number_type]
    limit = 0 if (compiler, number_type) == ("gcc", "double") else 1000 * eps
    assert np.all(np.abs(shown["nu_dot"] - nu_dot) <= limit * np.abs(nu_dot).max())
    assert np.all(np.abs(shown["spins_dot"] - spins_dot.ravel()) <= limit * np.abs(spins_dot).max())


@compilers
@number_types
@sources
def test_each_source_compiles_alone_and_calls_only_the_library(compiler, number_type, source, tmp_path):
    compiled = tmp_path / "kernel.o"
    macro, _ = NUMBER_TYPES[number_type]
    compile_c(compiler, *macro, "-Wconversion", "-Wdouble-promotion", "-c", source, "-o", compiled)
    symbols = subprocess.run(["nm", compiled], capture_output=True, text=True, check=True).stdout
    wanted = set(re.findall(r"\bU (\w+)", symbols))
    exported = set(re.findall(r"\b[A-Z] (\w+)", symbols)) - wanted
    variables = re.findall(r"\b[bBdDC] (\w+)", symbols)
    assert wanted <= LIBRARY_CALLS | {"_GLOBAL_OFFSET_TABLE_"}
    assert exported and all(name.startswith(f"{source.stem}_") for name in exported)
    assert variables == []


@sources
def test_each_header_serves_cplusplus(source, tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed")
    unit = tmp_path / "unit.cpp"
    unit.write_text(f'#include "{source.stem}.h"\n', encoding="ascii")
    flags = ["-pedantic", "-Wall", "-Werror", "-fsyntax-only"]
    subprocess.run(["g++", *flags, f"-I{GENERATED}", unit], check=True)
