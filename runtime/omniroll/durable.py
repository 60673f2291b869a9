"""Files that appear whole under their name or not at all: written beside, synced, renamed.

Whatever ends the writing (a full disk, a signal, the machine), the name holds what it held before, or all of the new.
"""

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import IO

_NUMBER = count()  # no two files that are being written share a name, whatever thread writes them


@contextmanager
def whole_file(path: str | os.PathLike, mode: str = "w") -> Iterator[IO]:
    """A file to write, for `with`. It gets its name when the block has ended without an error, and is gone otherwise.

    mode  "w" for text in UTF-8, whose line ends stay as they are written, or "wb"

    A device or a pipe is written to as it is, since a file must not take its place.
    """
    kind = {} if "b" in mode else {"encoding": "utf-8", "newline": ""}
    if os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path):
        with open(path, mode, **kind) as file:
            yield file
        return
    target = Path(os.path.realpath(path))  # a link stays a link
    beside = target.with_name(f".{target.name}.{os.getpid()}.{next(_NUMBER)}.part")
    try:
        with naming(target), open(beside, mode, **kind) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    sync(target.parent)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """For `with`: an error of the system that names no file, as that of a full disk, names this one."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot sync folders
            raise
    finally:
        os.close(descriptor)


def digest(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
