"""The compiled engine from other compilers and in other rounding modes: the same switches."""

import subprocess
from functools import cache
from pathlib import Path

import numpy as np

from hard import builds
from hard.builds import ROOT, ROUNDINGS, Build
from hard.case import Cases, Measurement, Scale
from hard.compilers import FAST, FUSED, SLOW
from hard.setting import PAPER
from omniroll.kernels import sets
from omniroll.kernels.building import ENGINE_SOURCES
from omniroll.kernels.kernel import VEHICLE_SCALARS

CASES = Cases("Number types and compilers")
LANGUAGE = ("-std=c11", "-Wno-psabi", "-DOMNIROLL_WHEELS=3")
PACKAGE = Build("gcc", ("-O2", "-ffp-contract=off"))
LATE = 1e-10  # s; the steps' tolerance in the program is 1e-11


@cache
def program(build: Build) -> Path:
    """tests/c/engine.c with the engine for free rollers."""
    made = Path(builds.folder().name) / f"engine-{build.name.replace(' ', '')}"
    engine, pair = ROOT / "runtime/csrc", sets.c_folder("free", ())
    sources = [ROOT / "tests/c/engine.c", pair / "omniroll.c", *(engine / name for name in ENGINE_SOURCES)]
    includes = [f"-I{folder}" for folder in (pair, engine, ROOT / "generated/c")]
    subprocess.run([build.compiler, *LANGUAGE, *build.flags, *includes, *sources, "-lm", "-o", made], check=True)
    return made


def switches(build: Build, rounding: str, duration: float) -> np.ndarray:
    """Rows (time, directions of the three wheels) of a run of the paper's vehicle."""
    numbers = [*(getattr(PAPER, name) for name in VEHICLE_SCALARS), *PAPER.wheel_angles, duration]
    command = [program(build), *map(repr, map(float, numbers)), str(ROUNDINGS.index(rounding))]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return np.array([line.split() for line in lines[:-1]], float)


@CASES.case(
    "same-switches",
    "A run with each compiler, each set of flags, each rounding mode",
    promise="the same wheels in the same order; times within ten tolerances of the steps",
)
def same_switches(scale: Scale) -> list[Measurement]:
    """Against the package's own flags; the motion has no two switches closer than a million tau."""
    duration = scale.of(5.0, 20.0)
    every = [Build(compiler, flags) for compiler in ("gcc", "clang") for flags in (SLOW, FAST, FUSED)]
    others = [(build, ROUNDINGS[0]) for build in scale.of(every[:1], every)]
    others += [(PACKAGE, mode) for mode in ROUNDINGS[1:]]
    if not PACKAGE.is_there:
        return []
    wanted, found = switches(PACKAGE, ROUNDINGS[0], duration), []
    for build, mode in others:
        if not build.is_there:
            continue
        run = switches(build, mode, duration)
        same = run.shape == wanted.shape and bool((run[:, 1:] == wanted[:, 1:]).all())
        late = float(np.abs(run[:, 0] - wanted[:, 0]).max()) if same else np.inf
        setting = build.name if mode == ROUNDINGS[0] else mode
        found.append(Measurement("runs with other switches", "compiled", "double", setting, not same, 0))
        found.append(Measurement("difference of switch times, s", "compiled", "double", setting, late, LATE))
    return found
