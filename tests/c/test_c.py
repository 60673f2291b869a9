"""The pairs of C files alone, as a controller takes them: strict compilers, small programs, Python's numbers."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from firmware.files import (
    EXAMPLES,
    NUMBER_TYPES,
    PAIRS,
    STRICT,
    WARNINGS,
    example,
    run,
    texts,
    tool,
    write,
    write_driven,
)

import omniroll
from omniroll.cli import main

pytestmark = pytest.mark.long

SCENE = Path(__file__).resolve().parents[2] / "scenes/robot-soccer-kit.toml"  # free rollers, no further effects
EPS = {"double": 2.0**-52, "float": 2.0**-23, "long double": 2.0**-52}  # long double is compared with double
LIBRARY_CALLS = {f"{name}{suffix}" for name in ("sin", "cos", "sincos", "sqrt", "exp") for suffix in ("", "f", "l")}
SCALARS = (
    "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
    "roller_axis_radius",
)  # fmt: skip
SANITIZERS = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
OWN_CALLS_ONLY = {"gcc": "-fno-tree-loop-distribute-patterns", "clang": "-fno-builtin"}  # no memset for a loop
# gcc's warnings need its optimiser; clang has its warnings before it optimises.
LESS = {"gcc": (), "clang": ("-O1",)}
BAD_LAYOUT = 6
MAIN = '#include "omniroll.h"\n#include <stdio.h>\n{}\nint main(void)\n{{\n    return example();\n}}\n'

pairs = pytest.mark.parametrize("pair", PAIRS)


def program(compiler, folder, main, pair, *flags):
    """The program of a C file and a pair."""
    return linked(compiler, folder, main, write(pair, folder), *flags)


def linked(compiler, folder, main, source, *flags):
    made = folder / "program"
    run(tool(compiler), *STRICT, *flags, main, source, "-I", folder, "-o", made, "-lm")
    return made


@pytest.mark.parametrize("compiler, number_type", [("gcc", "double"), ("gcc", "float"), ("clang", "long double")])
def test_program_gives_the_accelerations_of_python(compiler, number_type, tmp_path, request):
    main = request.path.with_name("accelerations.c")
    out = run(program(compiler, tmp_path, main, "free", *NUMBER_TYPES[number_type]))
    shown = {name: np.array(values, dtype=float) for name, *values in map(str.split, out.splitlines())}
    wheels = len(shown["chi"])
    spins = shown["spins"].reshape(wheels, -1)
    vehicle = omniroll.Vehicle(
        wheels=wheels,
        rollers_per_wheel=spins.shape[1] + 1,
        wheel_angles=tuple(shown["wheel_angles"]),
        **{name: float(shown[name][0]) for name in SCALARS},
    )
    nu_dot, spins_dot = omniroll.accelerations(vehicle, shown["nu"], shown["chi"], spins)
    limit = 0 if (compiler, number_type) == ("gcc", "double") else 1000 * EPS[number_type]
    assert np.all(np.abs(shown["nu_dot"] - nu_dot) <= limit * np.abs(nu_dot).max())
    assert np.all(np.abs(shown["spins_dot"] - spins_dot.ravel()) <= limit * np.abs(spins_dot).max())


@pytest.mark.parametrize("compiler, number_type, pair", [
    *(("gcc", "double", pair) for pair in PAIRS),
    *(("clang", number_type, "everything") for number_type in NUMBER_TYPES), ("gcc", "float", "everything"),
])  # fmt: skip
def test_each_source_compiles_alone_calls_only_the_library_and_runs_its_example(compiler, number_type, pair, tmp_path):
    """The example stands in the header's first comment and is taken from there as it is."""
    flags = (*STRICT, OWN_CALLS_ONLY[compiler], *NUMBER_TYPES[number_type], *LESS[compiler])
    compiled, main = tmp_path / "kernel.o", tmp_path / "main.c"
    run(tool(compiler), *flags, "-c", write(pair, tmp_path), "-o", compiled)
    symbols = run("nm", compiled)
    wanted = set(re.findall(r"\bU (\w+)", symbols))
    exported = set(re.findall(r"\b[A-Z] (\w+)", symbols)) - wanted
    variables = re.findall(r"\b[bBdDC] (\w+)", symbols)
    assert wanted <= LIBRARY_CALLS | {"_GLOBAL_OFFSET_TABLE_"}
    assert exported and all(name.startswith("omniroll_") for name in exported)
    assert variables == []
    main.write_text(MAIN.format(example(texts(pair).header)))
    run(tool(compiler), *flags, main, compiled, "-lm", "-o", tmp_path / "program")
    run(tmp_path / "program")


@pytest.mark.parametrize("pair", ["free", "everything"])
def test_each_pair_is_cplusplus_too_and_so_is_its_example(pair, tmp_path):
    source = write(pair, tmp_path)
    text = tmp_path / "main.cpp"
    text.write_text(MAIN.format(example(texts(pair).header)))
    run(tool("g++"), "-std=c++17", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", text)
    for standard, number_type in (("-std=c++98", "double"), ("-std=c++17", "float")):
        flags = (*WARNINGS, "-Wno-long-long", standard, *NUMBER_TYPES[number_type])
        run(tool("g++"), *flags, "-x", "c++", "-fsyntax-only", source)


@pytest.mark.parametrize("pair", ["free", "everything"])
def test_a_header_serves_cplusplus_with_the_source_in_c(pair, tmp_path):
    unit = tmp_path / "unit.cpp"
    unit.write_text(
        '#include "omniroll.h"\nint main()\n{\n    return omniroll_check_layout == 0;\n}\n', encoding="ascii"
    )
    source = write(pair, tmp_path)
    run(tool("gcc"), *STRICT, "-O0", "-c", source, "-o", tmp_path / "kernel.o")
    run(tool("g++"), "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wno-address", unit, tmp_path / "kernel.o", "-lm",
        "-o", tmp_path / "program")  # fmt: skip


@pairs
def test_every_public_name_has_the_prefix(pair):
    """Types, macros and functions, also under a prefix of the caller's; nothing of the standard one is left."""
    header = re.sub(r"/\*.*?\*/", "", texts(pair, "base").header, flags=re.DOTALL)
    macros = re.findall(r"#\s*define (\w+)", header)
    types = re.findall(r"^(?:typedef [\w ]+|\}) (\w+);", header, re.MULTILINE)
    functions = re.findall(r"^(?:void|int|base_real) (\w+)\(", header, re.MULTILINE)
    constants = re.findall(r"^    ([A-Z]\w+) = ", header, re.MULTILINE)
    renamed = {name for name in macros if name.removesuffix("_checked") in functions}  # functions of a number type
    assert all(name.startswith("BASE_") for name in (*set(macros).difference(renamed), *constants))
    assert all(name.startswith("base_") for name in (*types, *functions))
    assert len(functions) > 10 and len(types) >= 5 and macros and constants
    for text in (texts(pair, "base").header, texts(pair, "base").source):
        assert "omniroll" not in text.lower().replace("omniroll kernel", "")
    assert max(map(len, texts(pair).header.splitlines())) <= 120


def test_two_pairs_in_one_program(tmp_path):
    for pair, prefix in (("free", "first"), ("locked", "second")):
        write(pair, tmp_path, prefix)
    main = tmp_path / "main.c"
    main.write_text(
        '#include "first.h"\n#include "second.h"\nint main(void)\n{\n'
        "    return first_joint == 0 || second_joint == 0 || (int)FIRST_OK != (int)SECOND_OK;\n}\n"
    )
    sources = (main, tmp_path / "first.c", tmp_path / "second.c")
    run(tool("gcc"), *STRICT, "-Wno-address", *sources, "-I", tmp_path, "-lm", "-o", tmp_path / "program")


def test_other_number_types_do_not_link_and_other_structs_are_noticed(tmp_path):
    main, made = tmp_path / "main.c", tmp_path / "program"
    main.write_text(MAIN.format(example(texts("free").header)))
    source = write("free", tmp_path)
    for name, flags in NUMBER_TYPES.items():
        run(tool("gcc"), *STRICT, "-O0", *flags, "-c", source, "-o", tmp_path / f"{name}.o")
    for name, flags in NUMBER_TYPES.items():
        run(tool("gcc"), *STRICT, "-O0", *flags, "-c", main, "-o", tmp_path / "main.o")
        for other in NUMBER_TYPES:
            done = subprocess.run(["gcc", tmp_path / "main.o", tmp_path / f"{other}.o", "-lm", "-o", made],
                                  capture_output=True, text=True)  # fmt: skip
            assert (done.returncode == 0) == (name == other)
            assert name == other or "undefined reference to `omniroll_" in done.stderr
    header = tmp_path / "omniroll.h"
    header.write_text(header.read_text().replace("    omniroll_real mass;", "    omniroll_real old, mass;"))
    run(tool("gcc"), *STRICT, "-O0", main, tmp_path / "double.o", "-lm", "-o", made)
    assert subprocess.run([made]).returncode == BAD_LAYOUT


# The bound of a call


@pytest.mark.parametrize("number_type", ["double", "float"])
def test_a_step_in_several_calls_ends_at_the_same_bits(number_type, tmp_path, request):
    """As many calls as the bound takes: none too many joints in each, and nothing is lost between them."""
    assert main(["kernel", str(SCENE), "--output", str(tmp_path), "--constants"]) == 0
    files = (request.path.with_name("bounded.c"), tmp_path / "omniroll.c")
    ends, made = {}, tmp_path / "program"
    for most in ("0", "1", "wheels", "10*(wheels)*(rollers_per_wheel)", None):
        macro = () if most is None else (f"-DOMNIROLL_MOST_JOINTS(wheels,rollers_per_wheel)=({most})",)
        flags = (*STRICT, *NUMBER_TYPES[number_type], *macro)
        run(tool("gcc"), *flags, *files, "-I", tmp_path, "-o", made, "-lm")
        calls, *end = run(made).splitlines()
        ends[most] = int(calls), end
    one_call, end = ends["10*(wheels)*(rollers_per_wheel)"]
    assert one_call == 1 and all(other == end for _, other in ends.values())
    assert ends["0"][0] > ends["1"][0] > ends["wheels"][0] > ends[None][0] > 1


# Memory


@pytest.mark.parametrize("wheels, rollers, number_type, pair", [
    (1, 3, "float", "everything"), (1, 3, "float", "locked"), (3, 5, "long double", "free"),
    (30, 12, "double", "everything"),
])  # fmt: skip
def test_storage_of_exactly_the_stated_size_is_enough(pair, wheels, rollers, number_type, tmp_path):
    """The example with other numbers of wheels and rollers, under sanitizers, which watch the ends of its arrays."""
    text = example(texts(pair).header).replace("WHEELS = 3, ROLLERS = 5", f"WHEELS = {wheels}, ROLLERS = {rollers}")
    text = text.replace("roller_axis_radius = (omniroll_real)0.038", "roller_axis_radius = (omniroll_real)0.02")

    def spread(match):
        count = wheels * (2 if "places" in match[1] else 1)
        if "wheel" in match[1]:
            values = [f"(omniroll_real){0.1 + 0.37 * k:.3f}" for k in range(count)]
        else:
            values = [match[2].split(",")[0].strip()] * count
        return f"{match[1]} = {{{', '.join(values)}}}"

    text = re.sub(r"(\w+\[WHEELS(?:\*2)?\]) = \{\s*([^}]*?)\s*\}", spread, text)
    main = tmp_path / "main.c"
    main.write_text(MAIN.format(text))
    run(program("gcc", tmp_path, main, pair, "-O0", *SANITIZERS, *NUMBER_TYPES[number_type]))


@pytest.mark.parametrize("pair", ["free", "everything"])
def test_the_example_is_clean_under_valgrind(pair, tmp_path):
    """Valgrind sees what the sanitizers do not: numbers that were never written."""
    valgrind = tool("valgrind")
    main = tmp_path / "main.c"
    main.write_text(MAIN.format(example(texts(pair).header)))
    made = program("gcc", tmp_path, main, pair, "-g", "-O1", *NUMBER_TYPES["float"])
    out = subprocess.run([valgrind, "--error-exitcode=9", "--leak-check=full", made], capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    assert "total heap usage: 0 allocs" in out.stderr or "in use at exit: 0 bytes in 0 blocks" in out.stderr


# A controller's loop


def drive(source, folder, number_type, *flags):
    """What controller.c prints: joints, steps, nu, pose, turned, most_nu, most_torque."""
    out = run(linked("gcc", folder, EXAMPLES / "controller.c", source, *NUMBER_TYPES[number_type], *flags))
    joints, steps, *numbers = map(float, out.split())
    return joints, steps, np.array(numbers)


def test_a_controller_drives_through_a_thousand_joints_in_float_as_in_double(tmp_path):
    """In K steps a number of size x or less gathers a rounding error of K 2^-24 x at worst, since each step rounds what
    it adds up once to 2^-24; the feedback keeps the speeds together, and nothing else lets errors grow as long as the
    joints come in the same order. Where two wheels come to their joints within the resolution of float, rounding
    decides which switches first, and paths may part; on this drive none do.
    """
    source = write_driven(tmp_path)
    (joints, steps, double), (also, as_many, single) = (drive(source, tmp_path, kind) for kind in ("double", "float"))
    assert joints >= 1000 and (joints, steps) == (also, as_many)
    size = {"nu": double[9], "pose": 1.0, "turned": np.pi / 5}
    bound = steps * 2.0**-24 * np.repeat(list(size.values()), 3)
    error = np.abs(single - double)[:9]
    assert np.all(error <= bound), (error, bound)


def test_the_controller_is_clean_under_sanitizers(tmp_path):
    source = write_driven(tmp_path)
    for number_type in ("double", "float"):
        joints, *_ = drive(source, tmp_path, number_type, *SANITIZERS, "-DJOINTS=60")
        assert joints >= 60
