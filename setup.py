"""What pyproject.toml cannot say: packages from several folders, and the libraries that are compiled.

$OMNIROLL_LEVELS names the levels of vector instructions, for instance "x86-64 x86-64-v3 x86-64-v4" for a wheel that
goes to other machines; without it the widest of this machine. $OMNIROLL_SETS names the sets of effects.
"""

import os
import runpy
import shutil
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

from setuptools import Extension, find_packages, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
SETS = ("massless", "locked", "free")


def write_sets(names: Sequence[str], place: Path) -> Iterator[Path]:
    """The folders of the sets with their texts, new."""
    sys.path.insert(0, str(ROOT))
    from codegen.on_demand import Programs

    programs = Programs.load(ROOT / "generated/data")
    shutil.rmtree(place, ignore_errors=True)
    for name in names:
        folder = place / name
        folder.mkdir(parents=True)
        for file, text in programs.kernel(name, ()).files().items():
            (folder / file).write_text(text, encoding="utf-8")
        yield folder


class BuildLibraries(build_ext):
    """Writes the texts of the sets and compiles them, into omniroll/kernels/built."""

    def run(self) -> None:
        inplace = self.inplace or self.editable_mode
        top = ROOT / "runtime" if inplace else Path(self.build_lib).resolve()
        building = SimpleNamespace(**runpy.run_path(str(ROOT / "runtime/omniroll/kernels/building.py")))
        levels = os.environ.get("OMNIROLL_LEVELS", "").split() or building.levels_here()[:1]
        names = os.environ.get("OMNIROLL_SETS", "").split() or SETS
        folders = list(write_sets(names, top / "omniroll/kernels/built"))
        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                jobs = [pool.submit(building.kernel_library, folder, "double") for folder in folders]
                jobs += [
                    pool.submit(
                        building.engine_library, folder, ROOT / "runtime/csrc", ROOT / "generated/c",
                        building.Engine(level, wheels),
                    )
                    for folder in folders
                    for level in levels
                    for wheels in (*building.UNROLLED, None)
                ]  # fmt: skip
                for job in jobs:
                    job.result()
        except building.CompilationError as problem:
            print(f"omniroll: {problem}; the kernels in Python are there", file=sys.stderr)

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
