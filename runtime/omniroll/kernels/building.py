"""Compiles C into plain shared libraries: the same way when omniroll is installed and when a scene calls for a kernel.

This file uses the standard library alone, since setup.py runs it before omniroll is there.

OMNIROLL_CFLAGS holds further compiler flags, for instance `-march=native`; they come last and so win. CC names the
compiler.
"""

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

# A contraction to fused multiply-add would make results depend on the machine; so would -ffast-math.
FLAGS = ("-O2", "-std=c99", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=default")
# In spite of -ffp-contract=off, GCC fuses a sum and a difference that stand side by side when it makes vectors of them.
PAIR_FLAGS = ("-fno-tree-slp-vectorize",)
# No library of others takes vectors from the engine. Loops over wheels and lanes are short: peeled, they keep in
# registers what they else store. Nobody asks for errno: a root of a vector is one instruction then.
ENGINE_FLAGS = ("-Wno-psabi", "-fpeel-loops", "-fno-math-errno")
THOROUGH = ("-fno-schedule-insns2",)  # that pass makes GCC's vectors of -O2 slower by up to a third
QUICK = ("-O1", "-fexpensive-optimizations")  # 60 % of its time; of two levels the last one holds
ENGINE_SOURCES = ("run.c",)
BATCH_SOURCES = (*ENGINE_SOURCES, "batch.c")  # of a set without effects
VARIATIONS_SOURCES = ("deviations/following.c",)  # with the set's pair
# What a general set has of the friction of rollers on their disks, and of the ground. It solves for the same numbers as
# each set that it stands for, but for free rollers without friction on the smooth ground. A smooth law of a bearing
# stands beside the one that sticks, each at a torque of zero where the other acts.
DAMPED, SMOOTH, STICKING = ("roller_viscous",), ("roller_viscous", "roller_coulomb"), ("roller_sticking",)
GROUND, STICKY_GROUND = ("contact", "contact_viscous", "contact_regularised"), ("contact", "contact_coulomb")
MECANUM = ("joints", "kinds", "mecanum", "moving_rows")
PROFILE = ("joints", "mecanum", "moving_rows", "profile", "arcs", "weight")
SPRINGS = tuple(("contact", law, "contact_springs") for law in ("contact_regularised", "contact_coulomb"))
ROWS = ("joints", "kinds", "rows")  # rollers in two rows, and wheels of several kinds in one
# Beside friction of the ground: an absent one has the paper's numbers.
OTHER_KINDS = ("joints", "mecanum", "moving_rows", "rows")
CHOICES: dict[str, tuple[tuple[str, ...], ...]] = {
    "locked": ((*SMOOTH, *STICKING), (*SMOOTH, *ROWS), MECANUM, PROFILE),
    "massless": (
        (*SMOOTH, *STICKING), (*SMOOTH, *GROUND), (*SMOOTH, *STICKY_GROUND), (*STICKING, *STICKY_GROUND), *SPRINGS,
        *((*DAMPED, *STICKING, "contact", law) for law in GROUND[1:]),  # in series with a bearing
        (*SMOOTH, *ROWS), MECANUM, PROFILE, *((*OTHER_KINDS, *ground) for ground in (GROUND, STICKY_GROUND)),
    ),
    "free": (
        *((*rollers, *ground) for ground in ((), STICKY_GROUND) for rollers in ((), DAMPED, (*SMOOTH, *STICKING))),
        (*DAMPED, *GROUND), (*SMOOTH, *STICKING, *GROUND), *SPRINGS, ROWS, (*DAMPED, *ROWS), (*SMOOTH, *ROWS),
        MECANUM, PROFILE, *((*OTHER_KINDS, *ground) for ground in (GROUND, STICKY_GROUND)),
    ),
}  # fmt: skip
SOURCES = "sources.sha256"  # of what the libraries of a folder are made from
UNROLLED = (3, 4)  # numbers of wheels that an engine is compiled for; one without a number takes any
LONGEST = 300  # seconds
NUMBER_TYPES = {  # C type and the macro that chooses it
    "double": ("double", None),
    "float": ("float", "OMNIROLL_FLOAT"),
    "long_double": ("long double", "OMNIROLL_LONG_DOUBLE"),
}
# Levels of the machines' vector instructions, of each kind the widest first, and the processor's flags that they need.
# No level fuses multiplications and additions, so that all give the same bits.
LEVELS = {
    "x86-64-v4": ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"),
    "x86-64-v3": ("avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"),
    "x86-64": (),
    "armv8-a": (),
}
OF_ARM = ("armv8-a",)
ARM = ("aarch64", "arm64")  # what such machines call themselves


class CompilationError(RuntimeError):
    """There is no compiler, or it refused the source; the message has its last words."""


def compiler() -> list[str]:
    """The command and the flags that every library is compiled with."""
    return [*shlex.split(os.environ.get("CC", "cc")), *FLAGS]


def further_flags() -> list[str]:
    """Those that the user adds. They must come behind all others: of two levels the compiler takes the last."""
    return shlex.split(os.environ.get("OMNIROLL_CFLAGS", ""))


def find_compiler() -> list[str]:
    """The same, of a compiler that is there. Raises CompilationError."""
    command = compiler()
    if shutil.which(command[0]) is None:
        raise CompilationError(f"no C compiler: {command[0]} is not there; set CC")
    return command


def levels_here() -> list[str]:
    """The levels that this machine has, the widest first."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        lines = []
    flags = set(next((line.partition(":")[2].split() for line in lines if line.startswith("flags")), []))
    is_arm = platform.machine().lower() in ARM
    return [level for level, needed in LEVELS.items() if (level in OF_ARM) == is_arm and flags.issuperset(needed)]


def levels_of(kind: str, levels: Sequence[str]) -> list[str]:
    """The levels, of those given, at which libraries of this kind are compiled.

    Deviations go from node to node of a step. With four nodes in a vector twelve of them are enough; the eight of the
    widest level ask for sixteen, which takes longer.
    """
    if kind != "variations":
        return list(levels)
    return [level for level in levels if level != "x86-64-v4"] or ["x86-64-v3"]


def general_sets(registry: Sequence[Mapping], base: str) -> list[tuple[str, ...]]:
    """The effects of the general sets of a roller model: a scene runs on the first one that has all of its effects, and
    those that it does not call for are at neutral values.

    registry  the effects of generated/data/effects.json
    base      the roller model

    Each has one of the CHOICES, and every effect beside that has neutral values and constants or states, but for those
    that the choice excludes.
    """
    entries = {entry["name"]: entry for entry in registry}
    chosen = {name for choices in CHOICES.values() for choice in choices for name in choice}
    others = [
        name
        for name, entry in entries.items()
        if name not in chosen and entry["optional"] and entry["neutral"] and (entry["states"] or entry["constants"])
    ]
    found = []
    for choice in CHOICES[base]:
        excluded = {name for own in choice for name in entries[own]["excludes"]} - {*choice}
        present = {*choice, *others} - excluded
        found.append(tuple(name for name in entries if name in present))
    return found


def compile_library(sources: Sequence[Path], target: Path, folders: Sequence[Path], flags: Sequence[str] = ()) -> None:
    """Compile C files into the shared library `target`, which appears whole or not at all, and then its checksum.

    folders  where included files are searched
    Raises CompilationError, and OSError where the folder takes no more files.
    """
    with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
        made = Path(scratch, target.name)
        _compile(sources, made, folders, [*flags, "-lm"])
        os.replace(made, target)
    checksum(target).write_text(digest(target), encoding="ascii")


def _compile(sources: Sequence[Path], target: Path, folders: Sequence[Path], flags: Sequence[str]) -> None:
    """Call the compiler once. Raises CompilationError."""
    command = find_compiler()
    include = [f"-I{folder}" for folder in folders]
    try:
        done = subprocess.run(
            [*command, *include, *map(str, sources), *flags, *further_flags(), "-o", str(target)],
            capture_output=True, text=True, timeout=LONGEST,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise CompilationError(f"{command[0]} did not finish within {LONGEST} s on {target.stem}") from None
    if done.returncode:
        raise CompilationError(f"{command[0]} failed on {target.stem}: {done.stderr.strip()[-500:]}")


def sources_digest(data: Path, codegen: Path, engine: Path, constants: Path) -> str:
    """Of all that the texts and the libraries depend on: libraries of other sources take other arguments.

    data       folder of programs.json
    codegen    folder of the generator itself
    engine     folder of the engine's C files
    constants  folder of gauss.h and controller.h
    """
    found = hashlib.sha256()
    for name in ("programs", "effects", "symbols", "bounds"):
        found.update((data / f"{name}.json").read_bytes())
    for folder in (codegen, engine, constants):
        for entry in sorted(folder.rglob("*")):
            if entry.suffix in (".py", ".j2", ".c", ".h"):
                found.update(entry.relative_to(folder).as_posix().encode() + entry.read_bytes())
    return found.hexdigest()


def checksum(library: Path) -> Path:
    """The file with the digest of a library."""
    return library.with_name(f"{library.name}.sha256")


def digest(library: Path) -> str:
    return hashlib.sha256(library.read_bytes()).hexdigest()


def is_whole(library: Path) -> bool:
    """Whether a library is there, and as it was compiled. One that was cut off would end the process that loads it."""
    try:
        return checksum(library).read_text(encoding="ascii") == digest(library)
    except (OSError, ValueError):
        return False


def kernel_library(folder: Path, number_type: str, quick: bool = False) -> None:
    """Compile the pair of files in a set's folder for a number type into <number type>.so."""
    _, macro = NUMBER_TYPES[number_type]
    flags = [*PAIR_FLAGS, *QUICK * quick, "-DOMNIROLL_PLAIN_NAMES", *([f"-D{macro}=1"] if macro else [])]
    compile_library([folder / "omniroll.c"], folder / f"{number_type}.so", [folder], flags)


@dataclass(frozen=True)
class Engine:
    """What a compiled engine is made for.

    level   of LEVELS
    wheels  of UNROLLED, whose loops are unrolled; None for any number of wheels
    sharp   whether nu' is solved for by the functions for sharp tips
    quick   whether the compiler is to be quick about it: runs take a tenth longer
    kind    "engine" for runs, "variations" for their sensitivities
    bare    whether it is for a set without effects
    """

    level: str
    wheels: int | None
    sharp: bool = False
    quick: bool = False
    kind: str = "engine"
    bare: bool = True

    @classmethod
    def general(cls, level: str, base: str) -> "Engine":
        """For any vehicle with the rollers of a model."""
        return cls(level, None, base != "massless", quick=True, bare=False)

    @property
    def file(self) -> str:
        """The name of its library."""
        return f"{self.kind}-{self.level}-{self.wheels or 'any'}{'-sharp' * self.sharp}.so"

    @property
    def flags(self) -> list[str]:
        wheels = [f"-DOMNIROLL_WHEELS={self.wheels}"] if self.wheels else []
        sharp = ["-DOMNIROLL_SHARP"] if self.sharp else []
        return [*ENGINE_FLAGS, *(QUICK if self.quick else THOROUGH), f"-march={self.level}", *wheels, *sharp]


def engine_library(folder: Path, sources: Path, constants: Path, engine: Engine) -> None:
    """Compile the engine for a set, without the set's pair; for sensitivities with it.

    folder     of the set
    sources    folder of the engine's C files
    constants  folder of gauss.h and controller.h
    """
    if engine.kind == "variations":
        files, flags = [folder / "omniroll.c", *(sources / name for name in VARIATIONS_SOURCES)], PAIR_FLAGS
    else:
        files, flags = [sources / name for name in (BATCH_SOURCES if engine.bare else ENGINE_SOURCES)], ()
    compile_library(files, folder / engine.file, [folder, sources, constants], [*flags, *engine.flags])
