"""What pyproject.toml cannot say: packages from several folders, and the libraries that are compiled.

$OMNIROLL_LEVELS names the levels of vector instructions, for instance "x86-64 x86-64-v3 x86-64-v4" for a wheel that
goes to other machines; without it the widest of this machine. $OMNIROLL_SETS names the roller models. For each there is
the set without effects, the same for sensitivities, and the general ones, which run scenes whose own set cannot be
compiled. With $OMNIROLL_MUST_COMPILE a file that the compiler refuses ends the build; else the kernels in Python serve.
"""

import json
import os
import runpy
import shutil
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from setuptools import Extension, find_packages, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
SETS = ("massless", "locked", "free")
ALONG = "derivatives_along"  # codegen/along.py


NEEDED = ("declarations.h", "functions.json", ".so", ".sha256")  # what is kept of a general set


def write_sets(sets: Sequence[tuple[str, tuple[str, ...]]], place: Path) -> Iterator[Path]:
    """The folders of the sets, (roller model, effects), with their texts, new."""
    sys.path.insert(0, str(ROOT))
    from codegen.on_demand import Programs

    programs = Programs.load(ROOT / "generated/data")
    shutil.rmtree(place, ignore_errors=True)
    for base, effects in sets:
        made = programs.kernel(base, effects)
        folder = place / made.name
        folder.mkdir(parents=True)
        for file, text in made.files().items():
            (folder / file).write_text(text, encoding="utf-8")
        yield folder


class BuildLibraries(build_ext):
    """Writes the texts of the sets and compiles them, into omniroll/kernels/built."""

    def run(self) -> None:
        inplace = self.inplace or self.editable_mode
        top = ROOT / "runtime" if inplace else Path(self.build_lib).resolve()
        building = SimpleNamespace(**runpy.run_path(str(ROOT / "runtime/omniroll/kernels/building.py")))
        levels = os.environ.get("OMNIROLL_LEVELS", "").split() or building.levels_here()[:1]
        models = os.environ.get("OMNIROLL_SETS", "").split() or SETS
        registry = json.loads((ROOT / "generated/data/effects.json").read_text(encoding="utf-8"))["effects"]
        general = [(model, effects) for model in models for effects in building.general_sets(registry, model)]
        place = top / "omniroll/kernels/built"
        plain, along = [(model, ()) for model in models], [(model, (ALONG,)) for model in models]
        folders = list(write_sets([*plain, *general, *along], place))
        followed = [folders.pop() for _ in models]
        engines = [building.Engine(level, wheels) for level in levels for wheels in (*building.UNROLLED, None)]
        jobs = [(folder, engine) for folder in folders[: len(models)] for engine in engines]
        jobs += [(folder, replace(engine, kind="variations")) for folder in followed for engine in engines]
        lowest = max(levels, key=list(building.LEVELS).index)  # runs wherever the others run
        own = folders[len(models) :]
        jobs += [(f, building.Engine.general(lowest, model)) for f, (model, _) in zip(own, general, strict=True)]
        sources = ROOT / "runtime/csrc", ROOT / "generated/c"
        made_from = building.sources_digest(ROOT / "generated/data", ROOT / "codegen", *sources)
        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                pairs = [pool.submit(building.kernel_library, folder, "double") for folder in folders]
                made = [pool.submit(building.engine_library, folder, *sources, engine) for folder, engine in jobs]
                for job in (*pairs, *made):
                    job.result()
        except building.CompilationError as problem:
            if os.environ.get("OMNIROLL_MUST_COMPILE") and shutil.which(building.compiler()[0]):
                raise SystemExit(f"omniroll: {problem}") from None
            print(f"omniroll: {problem}; the kernels in Python are there", file=sys.stderr)
        for text in (
            text for folder in [*own, *followed] for text in folder.iterdir() if not text.name.endswith(NEEDED)
        ):
            text.unlink()
        (place / building.SOURCES).write_text(made_from, encoding="ascii")

    def get_outputs(self) -> list[str]:
        return []

    def get_source_files(self) -> list[str]:
        return []


class Wheel(bdist_wheel):
    """For any Python 3 on one kind of machine: the libraries are plain C."""

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", super().get_tag()[2]


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
