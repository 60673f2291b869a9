"""The generated C kernels under other compilers, flags, number types and rounding modes.

A build is one program with the sets in it. It reads states from its input, prepares each state's vehicle, calls every
function of one set and writes their outputs, all in its own number type.
"""

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from hard.sampling import Sample
from omniroll.kernels import sets
from omniroll.kernels.kernel import VEHICLE_SCALARS, Argument, Signature, form, signatures

ROOT = Path(__file__).resolve().parents[2]
MODELS = ("massless", "locked", "free")
SETS = (*MODELS, "locked_sharp", "free_sharp")  # the last two call the functions for sharp tips
ROUNDINGS = ("FE_TONEAREST", "FE_UPWARD", "FE_DOWNWARD", "FE_TOWARDZERO")
NUMBER_TYPES = {  # macro, NumPy type, machine epsilon
    "double": ([], np.float64),
    "float": (["-DOMNIROLL_FLOAT"], np.float32),
    "long double": (["-DOMNIROLL_LONG_DOUBLE"], np.longdouble),
}
HEAD = """#include <fenv.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
{includes}

static void *numbers(size_t count)
{{
    void *const found = calloc(count ? count : 1, sizeof(real_t));
    if (!found)
        exit(3);
    return found;
}}
"""
SET = """
static int run_{set}(int N, int n)
{{
    real_t *const model = numbers(omniroll_{base}_model_size(N, n));
    {buffers}
    while (fread(vehicle, sizeof(real_t), 8, stdin) == 8) {{
        {reads}
        omniroll_{base}_prepare(N, n, vehicle[0], vehicle[1], vehicle[2], vehicle[3], vehicle[4], vehicle[5],
                                vehicle[6], vehicle[7], wheel_angles, model);
        {calls}
    }}
    {frees}
    free(model);
    return 0;
}}
"""
MAIN = """
int main(int count, char **arguments)
{{
    static const int modes[] = {{{modes}}};
    if (count != 5 || fesetround(modes[atoi(arguments[4])]))
        return 2;
    const int N = atoi(arguments[2]), n = atoi(arguments[3]);
{choices}    return 2;
}}
"""


@dataclass(frozen=True)
class Build:
    """A compiler, its flags and a number type."""

    compiler: str
    flags: tuple[str, ...]
    number_type: str = "double"

    @property
    def name(self) -> str:
        return " ".join([self.compiler, *self.flags])

    @property
    def is_there(self) -> bool:
        return shutil.which(self.compiler) is not None

    def run(self, sample: Sample, set_name: str, rounding: str = "FE_TONEAREST", under: tuple = ()) -> dict:
        """Outputs (M, K) by function. `under`: a program that runs the program, for instance valgrind.

        Raises RuntimeError with what the program said where it fails.
        """
        dtype = NUMBER_TYPES[self.number_type][1]
        wanted = functions(set_name, sample.wheels, sample.rollers)
        count = len(sample)
        columns = [np.stack([sample.vehicle[name] for name in VEHICLE_SCALARS], axis=1)]
        columns += [sample.vehicle["wheel_angles"]]
        columns += [sample.state[a.name].reshape(count, -1) for a in all_inputs(wanted)]
        states = np.concatenate(columns, axis=1).astype(dtype)
        where = [set_name, str(sample.wheels), str(sample.rollers), str(ROUNDINGS.index(rounding))]
        ran = subprocess.run([*under, program(self), *where], input=states.tobytes(), capture_output=True)
        if ran.returncode != 0:
            raise RuntimeError(f"{self.name}: {ran.returncode}: {ran.stderr.decode(errors='replace')[:2000]}")
        flat = np.frombuffer(ran.stdout, dtype).reshape(count, -1).T
        found, start = {}, 0
        for name, signature in wanted.items():
            size = sum(number_of(a) for a in signature.outputs)
            found[name], start = flat[start : start + size], start + size
        return found


def functions(set_name: str, wheels: int, rollers: int) -> dict[str, Signature]:
    """The functions that a build calls: all of a set but prepare."""
    base = set_name.removesuffix("_sharp")
    return {name: s for name, s in signatures(base, (), wheels, rollers).items() if s.outputs}


def number_of(argument: Argument) -> int:
    return int(np.prod(argument.shape))


def all_inputs(wanted: dict[str, Signature]) -> list[Argument]:
    """What the functions take, each name once, in a fixed order."""
    return list({a.name: a for signature in wanted.values() for a in signature.inputs}.values())


def in_c(shape: list) -> str:
    """The number of an argument's components as C."""
    return " * ".join({"n-1": "(n - 1)"}.get(size, str(size)) for size in shape) or "1"


def set_source(set_name: str) -> str:
    """The C function that reads states and calls every function of a set."""
    base = set_name.removesuffix("_sharp")
    called = [f for f in sets.functions(base, ()) if f["name"] in functions(set_name, 3, 5)]
    of_role = lambda function, role: [a for a in function["arguments"] if a["role"] == role]  # noqa: E731
    inputs = {a["name"]: in_c(a["shape"]) for f in called for a in of_role(f, "in")}
    results = {f"{f['name']}_{a['name']}": in_c(a["shape"]) for f in called for a in of_role(f, "out")}
    reads = [
        f"if (fread({name}, sizeof(real_t), (size_t)({count}), stdin) != (size_t)({count}))\n            return 4;"
        for name, count in ({"wheel_angles": "N"} | inputs).items()
    ]
    calls = []
    for function in called:
        outputs = [f"{function['name']}_{a['name']}" for a in of_role(function, "out")]
        given = [a["name"] if a["shape"] else f"*{a['name']}" for a in of_role(function, "in")] + outputs
        name = form(function["name"], base != set_name)
        calls.append(f"omniroll_{base}_{name}(N, n, model, {', '.join(given)});")
        calls += [f"fwrite({name}, sizeof(real_t), (size_t)({results[name]}), stdout);" for name in outputs]
    sizes = {"vehicle": "8", "wheel_angles": "N"} | inputs | results
    lines = lambda parts, indent: ("\n" + " " * indent).join(parts)  # noqa: E731
    return SET.format(
        set=set_name,
        base=base,
        buffers=lines([f"real_t *const {name} = numbers((size_t)({count}));" for name, count in sizes.items()], 4),
        reads=lines(reads, 8),
        calls=lines(calls, 8),
        frees=lines([f"free({name});" for name in sizes], 4),
    )


def source() -> str:
    choices = "".join(f'    if (!strcmp(arguments[1], "{name}"))\n        return run_{name}(N, n);\n' for name in SETS)
    includes = "\n".join(f'#include "omniroll_{name}.h"' for name in MODELS)
    parts = [HEAD.format(includes=includes), *map(set_source, SETS)]
    return "".join([*parts, MAIN.format(modes=", ".join(ROUNDINGS), choices=choices)])


@cache
def folder() -> tempfile.TemporaryDirectory:
    """Where the programs are; goes with the process."""
    return tempfile.TemporaryDirectory(prefix="omniroll-builds-")


@cache
def program(build: Build) -> Path:
    """The compiled program. Raises RuntimeError with the compiler's words where it does not compile."""
    place = Path(folder().name)
    driver, made = place / "driver.c", place / f"program-{len(os.listdir(place))}"
    driver.write_text(source(), encoding="ascii")
    kernels = [ROOT / f"generated/c/omniroll_{name}.c" for name in MODELS]
    macro = NUMBER_TYPES[build.number_type][0]
    command = [build.compiler, "-std=c99", *build.flags, *macro, f"-I{ROOT / 'generated/c'}", driver, *kernels]
    done = subprocess.run([*map(str, command), "-lm", "-o", str(made)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{build.name}: {done.stderr[:2000]}")
    return made
