"""Where omniroll keeps what it makes once and uses again, and the lock under which it is made.

The generator keeps the Maxima that it has installed; the package keeps kernels that it has made for a scene.
"""

import os
import tempfile
import warnings
from functools import cache
from pathlib import Path

import platformdirs
from filelock import FileLock

_FULL: set[Path] = set()  # folders that have taken no more files


def user_folder() -> Path:
    """The user's cache folder for omniroll: ~/.cache/omniroll, or where the system keeps such folders."""
    return platformdirs.user_cache_path("omniroll", appauthor=False)


def folder() -> Path:
    """The folder for kernels, which exists and can be written.

    $OMNIROLL_CACHE, or user_folder(). Where that cannot be written, a folder of this process that goes away with it,
    and a RuntimeWarning, once.
    """
    wanted = Path(os.environ.get("OMNIROLL_CACHE") or user_folder())
    return Path(_scratch().name) if wanted in _FULL else _writable(wanted)


def give_way(wanted: Path) -> bool:
    """Use the folder of this process in place of `wanted`, which takes no more files. False: that is done already."""
    if wanted in _FULL or wanted == Path(_scratch().name):
        return False
    _FULL.add(wanted)
    return True


def come_back(wanted: Path) -> None:
    """Use `wanted` again: the folder of this process takes no files either."""
    _FULL.discard(wanted)


@cache
def _writable(wanted: Path) -> Path:
    try:
        wanted.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=wanted):
            return wanted
    except OSError as problem:
        text = f"kernels cannot be kept in {wanted}: {problem}; they are made for this process alone"
        warnings.warn(f"{text}; $OMNIROLL_CACHE names another folder", RuntimeWarning, stacklevel=3)
        return Path(_scratch().name)


@cache
def _scratch() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="omniroll-")


def lock(place: Path) -> FileLock:
    """A lock for what is made at `place`, for `with`: one thread of one process at a time.

    The lock is a file beside `place`. It ends with the process that holds it.
    """
    place.parent.mkdir(parents=True, exist_ok=True)
    return FileLock(place.with_suffix(".lock"))
