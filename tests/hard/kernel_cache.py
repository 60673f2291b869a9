"""The cache of kernels with changed, cut, swapped and lost files, asked for by two threads at once.

A stand-in for the compiler copies a library that was compiled before, so that each attempt takes a moment. No library
is loaded here: one that was damaged would end the process, which is what is_whole must see beforehand.
"""

import contextlib
import os
import shlex
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest import mock

from hypothesis import strategies as st

from hard.case import Case, Measurement, Scale
from hard.inputs import SECTION, measured
from hard.readers import EDITS, Edit, edited
from omniroll.kernels import building, sets
from omniroll.kernels.kernel import kept_kernel

SET = ("locked", ("slope",))
COPIES = '#!/bin/sh\nfor last; do :; done\nexec cp "$(dirname "$0")/made.so" "$last"\n'
WAYS = ("edit", "cut", "empty", "remove", "swap", "foreign", "braces")
Change = tuple[str, int, int, list[Edit]]  # how; which file; another one; where


def forget() -> None:
    """What this process remembers of the cache, as a new process would not."""
    sets.WHOLE.clear()
    for remembered in (sets._loaded, sets._opened_pair, sets._opened_engine, kept_kernel):
        remembered.cache_clear()


def contents(cache: Path) -> dict[Path, bytes]:
    """All files but locks and what Python keeps for itself."""
    found = sorted(path for path in cache.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path: path.read_bytes() for path in found if path.suffix != ".lock"}


def apply(change: Change, files: list[Path]) -> None:
    how, first, second, edits = change
    path, other = files[first % len(files)], files[second % len(files)]
    if not path.exists() or not other.exists():
        return
    old = path.read_bytes()
    if how == "remove":
        path.unlink()
    elif how == "swap":
        new = other.read_bytes()
        other.write_bytes(old)
        path.write_bytes(new)
    else:
        path.write_bytes({"edit": edited(old, edits), "cut": old[: len(old) // 2], "empty": b"",
                          "foreign": b"\x7fELF" + bytes(64), "braces": b"{}"}[how])  # fmt: skip


@contextlib.contextmanager
def made() -> Iterator[dict[Path, bytes]]:
    """A cache with one set, and its files as they should be."""
    with tempfile.TemporaryDirectory() as folder:
        compiler, cache = Path(folder, "compiler"), Path(folder, "cache")
        compiler.write_text(COPIES)
        compiler.chmod(0o755)
        shutil.copy(sets._pair("locked", (), "double")[0] / "double.so", Path(folder, "made.so"))
        with mock.patch.dict(os.environ, {"CC": shlex.quote(str(compiler)), "OMNIROLL_CACHE": str(cache)}):
            forget()
            sets._pair(*SET, "double")
            yield contents(cache)
            forget()


def damaged(scale: Scale) -> list[Measurement]:
    with made() as whole, ThreadPoolExecutor(2) as pool:
        files = list(whole)

        def check(changes: list[Change]) -> None:
            for change in changes:
                apply(change, files)
            forget()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                asked = [pool.submit(sets._pair, *SET, "double") for _ in range(2)]
                for place, file in (one.result() for one in asked):
                    assert building.is_whole(place / file)
                sets.functions(*SET)
            found = contents(Path(os.environ["OMNIROLL_CACHE"]))
            wrong = [path.name for path in whole if found.get(path) != whole[path]]
            assert not wrong, wrong

        changes = st.lists(
            st.tuples(st.sampled_from(WAYS), st.integers(0, 30), st.integers(0, 30), EDITS), min_size=1, max_size=3
        )
        return measured(check, changes, scale.of(4, 2000), "cache of kernels")


CASES = [
    Case(
        "changed-cache", SECTION, "Files of the cache of kernels changed, cut, lost, swapped or foreign; two ask",
        "loads a library that was cut off, which ends the process (SIGBUS)",
        "what is damaged is seen before it is loaded and made anew, byte by byte as it was", damaged,
    )
]  # fmt: skip
