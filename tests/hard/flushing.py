"""Subnormal numbers counted as zero, as -ffast-math of any loaded library leaves a thread."""

import ctypes
import platform
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

CAN_FLUSH = platform.machine() in ("x86_64", "AMD64")


@cache
def _library() -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "flush.so")
        source = Path(__file__).with_name("flush.c")
        subprocess.run(["cc", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
        return ctypes.CDLL(str(library))


@contextmanager
def subnormals_are_zero() -> Iterator[None]:
    _library().flush(1)
    try:
        yield
    finally:
        _library().flush(0)
