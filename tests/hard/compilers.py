"""The same kernels in other number types, from other compilers, in other rounding modes, under sanitizers, valgrind."""

import shutil
from collections.abc import Iterator

from hard.builds import MOTION, ROUNDINGS, SETS, Build
from hard.case import Cases, Measurement, Scale
from hard.kernel_errors import EPS, PACKAGE, PROMISE, REFERENCE, Bench, Found, compiled_kernels, measurements
from hard.kernels import kept_states
from hard.sampling import Sample, sample

CASES = Cases("Number types and compilers")
FAST, FUSED = ("-O3", "-march=native", "-ffp-contract=off"), ("-O3", "-march=native", "-ffp-contract=fast")
SLOW = ("-O0", "-ffp-contract=off")
ONE_JOINT = "-DOMNIROLL_MOST_JOINTS(wheels,rollers_per_wheel)=1"  # in a call


def measured(part: Sample, kernels: dict[str, Found], number_type: str = "double") -> Iterator[Measurement]:
    """Errors of all functions under each of the kernels, by what they are on."""
    for model in REFERENCE:
        bench = Bench(part, model)
        for on, outputs in kernels.items():
            errors = list(bench.errors(outputs, EPS[number_type]))
            yield from measurements(errors, on, number_type, components=False)


@CASES.case("number-types", "float, double, long double", promise=f"{PROMISE}, ulp of the type")
def number_types(scale: Scale) -> Iterator[Measurement]:
    """float on states that it can hold; long double on the same as double."""
    count = scale.of(60, 2_500)
    whole = sample(41, count, 3, 5, closest_tip=1e-9)
    short = moderate(sample(42, count, 3, 5, closest_tip=1e-4))
    for kind in EPS:
        kernels = {"compiled": compiled_kernels(Build(PACKAGE.compiler, PACKAGE.flags, kind))}
        yield from measured(short if kind == "float" else whole, kernels, kind)


def moderate(part: Sample) -> Sample:
    """In units in which float's range holds the squares, and rounded to float; rollers still pass their joint."""
    tame = {name: array.copy() for name, array in part.vehicle.items()}
    length, mass = tame["wheel_radius"], tame["mass"]
    state = dict(part.state)
    moment = length**2 * mass
    for name in ("yaw_inertia", "wheel_inertia", "roller_inertia"):
        tame[name] = tame[name] / moment
    for name in ("platform_radius", "roller_axis_radius", "wheel_radius"):
        tame[name] = tame[name] / length
    tame["mass"] = mass / mass
    speed = abs(state["nu"]).max(axis=1) + 1e-300
    powers = {"nu": 1, "spins": 1, "axial": 1, "chi_dot": 1, "contact_spin": 1, "entering": 1, "leaving": 1}
    powers |= {"momenta": 1, "force": 2, "nu_dot": 2}
    for name, power in powers.items():
        scaled = state[name] / (speed**power).reshape(-1, *[1] * (state[name].ndim - 1))
        state[name] = scaled / moment.reshape(-1, *[1] * (scaled.ndim - 1)) if name in ("momenta", "force") else scaled
    return Sample(part.wheels, part.rollers, tame, state).rounded("f4")


@CASES.case(
    "compilers-and-flags",
    "gcc and clang, -O0 and -O3 -march=native, contraction on and off",
    promise=f"each build: {PROMISE}",
)
def compilers_and_flags(scale: Scale) -> list[Measurement]:
    builds = [Build(compiler, flags) for compiler in ("gcc", "clang") for flags in (SLOW, FAST, FUSED)]
    kernels = {build.name: compiled_kernels(build) for build in builds if build.is_there}
    return measured(sample(43, scale.of(60, 2_500), 3, 5, closest_tip=1e-9), kernels)


@CASES.case("directed-rounding", "Rounding up, down, towards zero", promise=PROMISE)
def directed_rounding(scale: Scale) -> list[Measurement]:
    """The compiler is told that the mode may change."""
    build = Build("gcc", ("-O2", "-frounding-math", "-ffp-contract=off"))
    kernels = {mode: compiled_kernels(build, mode) for mode in ROUNDINGS[1:]} if build.is_there else {}
    return measured(sample(44, scale.of(60, 2_500), 3, 5, closest_tip=1e-9), kernels)


@CASES.case(
    "sanitizers-and-valgrind",
    "All functions, and steps through joints, under sanitizers and valgrind",
    promise="nothing is found",
)
def clean(scale: Scale) -> list[Measurement]:
    """Runs of all functions, and of steps through joints, that a sanitizer or valgrind complains of.

    The sanitizers also see the states that were worst for some function. Valgrind is slow: a step ends behind its
    second joint there.
    """
    part = sample(45, scale.of(5, 300), 3, 5, closest_tip=1e-9)
    usual = {set_name: [part] for set_name in SETS}
    worst_too = {name: [part, *(state for of, _, state in kept_states() if of == name)] for name in SETS}
    checked = ("-O1", "-g", MOTION, "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    tools = {
        f"address and undefined, {compiler}": (Build(compiler, checked), worst_too, ())
        for compiler in scale.of(("gcc",), ("gcc", "clang"))
    }
    if shutil.which("valgrind"):
        valgrind = ("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full")
        tools["valgrind"] = (Build("gcc", ("-O1", "-g", MOTION, ONE_JOINT)), usual, valgrind)
    return [
        Measurement("sets in which something is found", name, "double", "", complaints(*tool), 0)
        for name, tool in tools.items()
        if tool[0].is_there
    ]


def complaints(build: Build, states: dict[str, list[Sample]], under: tuple[str, ...]) -> int:
    found = 0
    for set_name in SETS:
        try:
            for part in states[set_name]:
                build.run(part, set_name, under=under)
        except RuntimeError as error:
            if "cannot find" in str(error):  # the compiler has no sanitizer libraries: nothing was measured
                return float("nan")
            found += 1
    return found
