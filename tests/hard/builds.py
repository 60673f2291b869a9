"""The generated C kernels under other compilers, flags, number types and rounding modes.

A program is the pair of files of one roller model and a driver. It reads states from its input, prepares each state's
vehicle, calls every function and writes their outputs, all in its own number type.
"""

import itertools
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from hard.sampling import Sample
from omniroll.kernels import sets
from omniroll.kernels.kernel import Argument, Signature, form, signatures

ROOT = Path(__file__).resolve().parents[2]
SETS = ("massless", "locked", "free", "locked_sharp", "free_sharp")  # the last two call the functions for sharp tips
ROUNDINGS = ("FE_TONEAREST", "FE_UPWARD", "FE_DOWNWARD", "FE_TOWARDZERO")
NUMBER_TYPES = {  # macro, NumPy type
    "double": ([], np.float64),
    "float": (["-DOMNIROLL_FLOAT"], np.float32),
    "long double": (["-DOMNIROLL_LONG_DOUBLE"], np.longdouble),
}
MOTION = "-DMOTION"  # among the flags of a build: each state is also driven through joints
DRIVER = """#include "omniroll.h"

#include <fenv.h>
#include <stdio.h>
#include <stdlib.h>

static void *room(int count, size_t size)
{{
    void *const found = calloc(count > 0 ? (size_t)count : 1, size);
    if (!found)
        exit(3);
    return found;
}}

/* Reads an array, whole. */
static void get(omniroll_real *numbers, int count)
{{
    if (fread(numbers, sizeof(omniroll_real), (size_t)count, stdin) != (size_t)count)
        exit(4);
}}
{motion}
int main(int count, char **arguments)
{{
    static const int modes[] = {{{modes}}};
    if (count != 5 || fesetround(modes[atoi(arguments[3])]))
        return 2;
    const int N = atoi(arguments[1]), n = atoi(arguments[2]), sharp = atoi(arguments[4]);
    (void)sharp;
    omniroll_vehicle vehicle;
    omniroll_model model;
    {storage}
    {buffers}
    vehicle.wheels = N;
    vehicle.rollers_per_wheel = n;
    while (fread({first}, sizeof(omniroll_real), 1, stdin) == 1) {{
        {reads}
        if (omniroll_prepare(&vehicle, {given}, &model) != OMNIROLL_OK)
            return 5;
        {calls}
#ifdef MOTION
        if (!sharp) /* a step is the same for both */
            drive(&model, nu, chi);
#endif
    }}
    {frees}
    return 0;
}}
"""
# Under each law, two and a half times the time in which the first wheel reaches its joint. Free rollers start at rest.
# Their smooth switches raise the energy, so that some states would pass joints by the million: there the bound of a
# call ends the step, and its state is one that a motion can start from. Some motions leave the range of numbers.
DRIVE = """
#ifdef MOTION
static void drive(const omniroll_model *model, const omniroll_real *nu, const omniroll_real *chi)
{{
    const int N = model->wheels, n = model->rollers_per_wheel;
    omniroll_state state;
    {allocated}
    for (int law = OMNIROLL_SMOOTH; law <= OMNIROLL_IMPACT; law++) {{
        int wheel, status;
        for (int k = 0; k < 3; k++) {{
            state.nu[k] = nu[k];
            state.pose[k] = 0;
        }}
        for (int i = 0; i < N; i++) {{
            state.chi[i] = chi[i];
            state.contact[i] = 0;
        }}
        {copied}
        if (omniroll_start(model, &state) != OMNIROLL_OK)
            exit(6);
        status = omniroll_step(model, law, omniroll_time_to_joint(model, &state, &wheel)*5/2, &state);
        if (status == OMNIROLL_BAD_NUMBER)
            exit(7);
        if (status != OMNIROLL_BAD_STATE && omniroll_start(model, &state) != OMNIROLL_OK)
            exit(8);
    }}
    {freed}
}}
#endif
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
        base = set_name.removesuffix("_sharp")
        known = signatures(base, (), sample.wheels, sample.rollers)
        wanted = functions(set_name, sample.wheels, sample.rollers)
        count = len(sample)
        given = [sample.vehicle[a.name] for a in known["prepare"].inputs]
        given += [sample.state[a.name] for a in all_inputs(wanted)]
        states = np.concatenate([array.reshape(count, -1) for array in given], axis=1).astype(dtype)
        where = map(str, (sample.wheels, sample.rollers, ROUNDINGS.index(rounding), int(set_name != base)))
        ran = subprocess.run([*under, program(self, base), *where], input=states.tobytes(), capture_output=True)
        if ran.returncode != 0:
            said = ran.stderr.decode(errors="replace")[:2000]
            raise RuntimeError(f"{self.name}: {set_name}: {ran.returncode}: {said}")
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
    return "*".join({"n-1": "(n - 1)"}.get(size, str(size)) for size in shape) or "1"


def lines(parts: list[str], indent: int) -> str:
    return ("\n" + " " * indent).join(parts)


def allocated(kind: str, name: str, count: str) -> str:
    return f"{kind} *const {name} = room({count}, sizeof({kind}));"


def source(base: str) -> str:
    """The driver of a roller model: it reads states and calls every function, or its form for sharp tips."""
    of_role = lambda function, role: [a for a in function["arguments"] if a["role"] == role]  # noqa: E731
    by_name = {f["name"]: f for f in sets.functions(base, ())}
    vehicle = of_role(by_name["prepare"], "in")
    called = [by_name[name] for name in functions(base, 3, 5)]
    inputs = {a["name"]: in_c(a["shape"]) for f in called for a in of_role(f, "in")}
    results = {f"{f['name']}_{a['name']}": in_c(a["shape"]) for f in called for a in of_role(f, "out")}
    arrays = {a["name"]: in_c(a["shape"]) for a in vehicle if a["shape"]} | inputs | results
    reads = [f"get({a['name'] if a['shape'] else '&vehicle.' + a['name']}, {in_c(a['shape'])});" for a in vehicle]
    reads = reads[1:] + [f"vehicle.{a['name']} = {a['name']};" for a in vehicle if a["shape"]]
    reads += [f"get({name}, {count});" for name, count in inputs.items()]
    calls = []
    for function in called:
        outputs = [f"{function['name']}_{a['name']}" for a in of_role(function, "out")]
        given = [a["name"] if a["shape"] else f"*{a['name']}" for a in of_role(function, "in")] + outputs
        usual, sharp = (f"omniroll_{form(function['name'], tips, by_name)}" for tips in (False, True))
        code = usual if usual == sharp or base == "massless" else f"(sharp ? {sharp} : {usual})"
        calls.append(f"{code}(&model, {', '.join(given)});")
        calls += [f"fwrite({name}, sizeof(omniroll_real), (size_t)({results[name]}), stdout);" for name in outputs]
    storage = {"wheel": "N"} | ({"roller": "n - 1"} if has_rollers(base) else {})
    return DRIVER.format(
        motion=drive("momenta" in by_name),
        modes=", ".join(ROUNDINGS),
        storage=lines([allocated(f"omniroll_{name}", name, count) for name, count in storage.items()], 4),
        buffers=lines([allocated("omniroll_real", name, count) for name, count in arrays.items()], 4),
        first=f"&vehicle.{vehicle[0]['name']}",
        reads=lines(reads, 8),
        given=", ".join(storage),
        calls=lines(calls, 8),
        frees=lines([f"free({name});" for name in [*storage, *arrays]], 4),
    )


def has_rollers(base: str) -> bool:
    """Whether the model has constants of each free roller."""
    return "omniroll_roller;" in (sets.c_folder(base, ()) / "omniroll.h").read_text(encoding="utf-8")


def drive(free: bool) -> str:
    """The C function that drives a state through joints."""
    arrays = {"chi": "N", "work": "OMNIROLL_WORK(N, n)"}
    if free:
        arrays |= {"axial": "N*(n - 1)", "momenta": "2*N"}
    room = [f"state.{name} = room({count}, sizeof(omniroll_real));" for name, count in arrays.items()]
    copied = ["for (int k = 0; k < N*(n - 1); k++)", "    state.axial[k] = 0;"] if free else ["(void)n;"]
    return DRIVE.format(
        allocated=lines([*room, "state.contact = room(N, sizeof(int));"], 4),
        copied=lines(copied, 8),
        freed=lines([f"free(state.{name});" for name in [*arrays, "contact"]], 4),
    )


@cache
def folder() -> tempfile.TemporaryDirectory:
    """Where the programs are; goes with the process."""
    return tempfile.TemporaryDirectory(prefix="omniroll-builds-")


NUMBERS = itertools.count()  # of the programs


@cache
def program(build: Build, base: str) -> Path:
    """The compiled program. Raises RuntimeError with the compiler's words where it does not compile."""
    made = Path(folder().name) / f"program-{next(NUMBERS)}"
    driver = made.with_suffix(".c")
    driver.write_text(source(base), encoding="ascii")
    texts = sets.c_folder(base, ())
    macro = NUMBER_TYPES[build.number_type][0]
    command = [build.compiler, "-std=c99", *build.flags, *macro, f"-I{texts}", driver, texts / "omniroll.c"]
    done = subprocess.run([*map(str, command), "-lm", "-o", str(made)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{build.name}: {done.stderr[:2000]}")
    return made
