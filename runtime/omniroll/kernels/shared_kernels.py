"""The compiled kernels where Python's C headers were missing at installation: plain shared libraries.

They hold the same C as the modules omniroll._kernels_double, ..., and have the same two attributes, `ffi` and
`lib`. cffi calls them in its ABI mode, which costs more per call.
"""

from functools import cache
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import cffi

from omniroll.kernels.c_headers import declarations, engine_declarations, is_set_header


def libraries(number_type: str) -> list[Path]:
    """The library of a number type, in a list of one, or of none where it was not built."""
    return sorted(Path(__file__).parents[1].glob(f"_shared_{number_type}.*"))


def has_shared_kernels(number_type: str) -> bool:
    return bool(libraries(number_type))


@cache
def shared_kernels(number_type: str) -> SimpleNamespace:
    """`ffi` and `lib` of a number type's library, which must be there."""
    folder = resources.files("omniroll.generated") / "c"
    headers = sorted(entry.name for entry in folder.iterdir() if is_set_header(entry.name))
    ffi = cffi.FFI()
    ffi.cdef(declarations(number_type, [(folder / header).read_text(encoding="utf-8") for header in headers]))
    return SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(libraries(number_type)[0])))


def has_shared_engine() -> bool:
    return bool(libraries("engine"))


@cache
def shared_engine() -> SimpleNamespace:
    """`ffi` and `lib` of the compiled engine's library, which must be there."""
    ffi = cffi.FFI()
    ffi.cdef(engine_declarations((resources.files("omniroll.csrc") / "engine.h").read_text(encoding="utf-8")))
    return SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(libraries("engine")[0])))
