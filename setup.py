"""What pyproject.toml cannot say: packages from several folders, and the libraries that are compiled.

$OMNIROLL_LEVELS names the levels of vector instructions, for instance "x86-64 x86-64-v3 x86-64-v4" (or "armv8-a" with
a cross compiler as $CC) for a wheel that goes to other machines; without it the widest of this machine.
$OMNIROLL_SETS names the roller models. For each there is the set without effects and the general ones, on which scenes
with effects run. A wheel that goes to other machines has sensitivities too, which elsewhere are compiled where a run
asks for them. With $OMNIROLL_MUST_COMPILE a file that the compiler refuses ends the build;
else the kernels in Python serve.
"""

import json
import os
import re
import runpy
import shutil
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from setuptools import Extension, find_packages, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
SETS = ("massless", "locked", "free")
OLDEST = 17  # of C libraries that tags can name
ALONG = "derivatives_along"  # codegen/along.py
KEPT = ("declarations.h", "functions.json", ".so", ".sha256")  # of a set with effects


@dataclass(frozen=True)
class Wanted:
    """A set that is built beforehand.

    model    the roller model
    effects  its effects
    engines  what is compiled of it
    pair     whether its pair is compiled too
    """

    model: str
    effects: tuple[str, ...]
    engines: tuple
    pair: bool = True


def wanted_sets(building: SimpleNamespace, models: Sequence[str], levels: Sequence[str], travels: bool) -> list[Wanted]:
    """The sets, those first that take the compiler longest. Sensitivities are compiled where a run asks for them; a
    wheel that travels to machines without a compiler brings those of the sets without effects."""
    registry = json.loads((ROOT / "generated/data/effects.json").read_text(encoding="utf-8"))["effects"]
    lowest = max(levels, key=list(building.LEVELS).index)  # runs wherever the others run
    engines, following = (
        tuple(
            building.Engine(level, wheels, kind=kind)
            for level in building.levels_of(kind, levels)
            for wheels in (*building.UNROLLED, None)
        )
        for kind in ("engine", "variations")
    )
    general = [(model, effects) for model in models for effects in building.general_sets(registry, model)]
    found = [Wanted(model, (), engines) for model in models]
    found += [Wanted(model, own, (building.Engine.general(lowest, model),)) for model, own in general[::-1]]
    found += [Wanted(model, (ALONG,), following, pair=False) for model in models if travels]
    return found


def write_sets(sets: Sequence[Wanted], place: Path) -> Iterator[Path]:
    """The folders of the sets with their texts, new, one after the other."""
    sys.path.insert(0, str(ROOT))
    from codegen.on_demand import Programs

    programs = Programs.load(ROOT / "generated/data")
    shutil.rmtree(place, ignore_errors=True)
    for wanted in sets:
        made = programs.kernel(wanted.model, wanted.effects)
        folder = place / made.name
        folder.mkdir(parents=True)
        in_python = made.calls_file() if wanted.effects else made.python_files()  # general sets run in C alone
        for file, text in (made.c_files() | in_python).items():
            (folder / file).write_text(text, encoding="utf-8")
        yield folder


class BuildLibraries(build_ext):
    """Writes the texts of the sets and compiles them, into omniroll/kernels/built."""

    def run(self) -> None:
        inplace = self.inplace or self.editable_mode
        top = ROOT / "runtime" if inplace else Path(self.build_lib).resolve()
        building = SimpleNamespace(**runpy.run_path(str(ROOT / "runtime/omniroll/kernels/building.py")))
        asked = os.environ.get("OMNIROLL_LEVELS", "").split()
        models = os.environ.get("OMNIROLL_SETS", "").split() or SETS
        place = top / "omniroll/kernels/built"
        sets = wanted_sets(building, models, asked or building.levels_here()[:1], travels=bool(asked))
        sources = ROOT / "runtime/csrc", ROOT / "generated/c"
        made_from = building.sources_digest(ROOT / "generated/data", ROOT / "codegen", *sources)
        jobs, folders = [], []
        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                for wanted, folder in zip(sets, write_sets(sets, place), strict=True):  # the first compile by now
                    jobs += [pool.submit(building.engine_library, folder, *sources, e) for e in wanted.engines]
                    if wanted.pair:
                        jobs.append(pool.submit(building.kernel_library, folder, "double", bool(wanted.effects)))
                    folders.append(folder)
                for job in jobs:
                    job.result()
        except building.CompilationError as problem:
            if os.environ.get("OMNIROLL_MUST_COMPILE") and shutil.which(building.compiler()[0]):
                raise SystemExit(f"omniroll: {problem}") from None
            print(f"omniroll: {problem}; the kernels in Python are there", file=sys.stderr)
        for wanted, folder in zip(sets, folders, strict=True):
            for text in folder.iterdir() if wanted.effects else ():
                if not text.name.endswith(KEPT):
                    text.unlink()
        (place / building.SOURCES).write_text(made_from, encoding="ascii")

    def get_outputs(self) -> list[str]:
        return []

    def get_source_files(self) -> list[str]:
        return []


class Wheel(bdist_wheel):
    """For any Python 3 on one kind of machine: the libraries are plain C.

    With $OMNIROLL_LEVELS, which says that the wheel travels, its tag names the kind of machine and the oldest C library
    that has all symbols its libraries ask for (PEP 600): pip installs it where both fit.
    """

    def get_tag(self) -> tuple[str, str, str]:
        levels = os.environ.get("OMNIROLL_LEVELS", "").split()
        place = super().get_tag()[2]
        if levels and place.startswith("linux_"):
            machine = "aarch64" if levels[0].startswith("arm") else place.removeprefix("linux_")
            place = f"manylinux_2_{self._oldest_c_library()}_{machine}"
        return "py3", "none", place

    def _oldest_c_library(self) -> int:
        """Its minor version: the newest of the versions of symbols that stand in the libraries."""
        libraries = Path(self.get_finalized_command("build").build_lib).rglob("built/*/*.so")
        versions = (int(minor) for file in libraries for minor in re.findall(rb"GLIBC_2\.(\d+)", file.read_bytes()))
        return max([OLDEST, *versions])


setup(
    packages=[
        *find_packages("runtime", include=["omniroll*"]),
        "omniroll.codegen",
        "omniroll.csrc",
        "omniroll.generated",
        "omniroll.generated.python",
    ],
    ext_modules=[Extension("omniroll.kernels.built", sources=[])],  # says that the wheel is not for every machine
    cmdclass={"build_ext": BuildLibraries, "bdist_wheel": Wheel},
)
