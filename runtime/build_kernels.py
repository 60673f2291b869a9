"""Compile the generated C kernels, once per number type.

Into cffi modules (API mode), omniroll._kernels_double, _float and _long_double, each with every function of
every set in generated/c; setup.py names the functions at the end of this file. The declarations are read from
the generated headers; none is typed here.

The compiled engine (runtime/csrc) goes into a module of its own, omniroll._engine.

Where Python's own C headers are missing (on Debian they are a package apart), into plain shared libraries
omniroll._shared_double, ..., which omniroll.kernels.shared_kernels calls through cffi's ABI mode: the same C, slower
calls.

OMNIROLL_CFLAGS holds further compiler flags, for instance `-march=native`. They come last and so win.
"""

import os
import runpy
import shlex
import sysconfig
from pathlib import Path

import cffi
from setuptools import Extension

ROOT = Path(__file__).resolve().parent.parent
C_FOLDER = "generated/c"
# Debugging information would double the time to compile and the size (-g0).
# A contraction to fused multiply-add would make results depend on the machine; so would -ffast-math.
FLAGS = ["-O3", "-g0", "-std=c99", "-ffp-contract=off"]
ENGINE_FOLDER = "runtime/csrc"
# Its vectors are written out, so that -O3 would add nothing but time to compile.
ENGINE_FLAGS = ["-O2", "-g0", "-std=c99", "-ffp-contract=off", "-Wno-psabi"]
C_HEADERS = runpy.run_path(str(ROOT / "runtime/omniroll/kernels/c_headers.py"))


def has_python_headers() -> bool:
    """Whether a Python module can be compiled here."""
    return Path(sysconfig.get_path("include"), "Python.h").is_file()


def headers() -> list[Path]:
    """The generated headers, in the order of their names."""
    found = sorted(path for path in (ROOT / C_FOLDER).iterdir() if C_HEADERS["is_set_header"](path.name))
    if not found:
        raise FileNotFoundError(f"no generated headers in {C_FOLDER}; run `make regenerate`")
    return found


def compilation(number_type: str, *flags: str) -> dict:
    """What to compile and how, as the arguments of an Extension."""
    _, macro = C_HEADERS["NUMBER_TYPES"][number_type]
    return {
        "sources": [f"{C_FOLDER}/{header.stem}.c" for header in headers()],
        "depends": [f"{C_FOLDER}/{header.name}" for header in headers()],
        "include_dirs": [C_FOLDER],
        "define_macros": [(macro, "1")] if macro else [],
        "extra_compile_args": [*FLAGS, *flags, *shlex.split(os.environ.get("OMNIROLL_CFLAGS", ""))],
        "libraries": ["m"],
    }


def kernel_module(number_type: str) -> cffi.FFI:
    """The cffi builder of omniroll._kernels_<number_type>."""
    builder = cffi.FFI()
    texts = [header.read_text(encoding="utf-8") for header in headers()]
    builder.cdef(C_HEADERS["declarations"](number_type, texts))
    builder.set_source(
        f"omniroll._kernels_{number_type}",
        "\n".join(f'#include "{header.name}"' for header in headers()),
        **compilation(number_type, "-fvisibility=hidden"),
    )
    return builder


def engine_compilation(*flags: str) -> dict:
    """What to compile for the engine: two files for each set of effects that include its kernel and the rest."""
    folder = Path(ENGINE_FOLDER)
    sources = sorted(path.name for half in ("engine", "batch") for path in (ROOT / folder).glob(f"{half}_*.c"))
    included = sorted(path.name for path in (ROOT / folder).iterdir() if path.suffix in (".c", ".h"))
    return {
        "sources": [str(folder / name) for name in sources],
        "depends": [str(folder / name) for name in included] + compilation("double")["depends"],
        "include_dirs": [C_FOLDER, ENGINE_FOLDER],
        "extra_compile_args": [*ENGINE_FLAGS, *flags, *shlex.split(os.environ.get("OMNIROLL_CFLAGS", ""))],
        "libraries": ["m"],
    }


def engine() -> cffi.FFI:
    """The cffi builder of omniroll._engine."""
    builder = cffi.FFI()
    text = (ROOT / ENGINE_FOLDER / "engine.h").read_text(encoding="utf-8")
    builder.cdef(C_HEADERS["engine_declarations"](text))
    builder.set_source("omniroll._engine", '#include "engine.h"', **engine_compilation("-fvisibility=hidden"))
    return builder


def shared_libraries() -> list[Extension]:
    """The plain libraries omniroll._shared_<number_type> and omniroll._shared_engine."""
    kernels = [
        Extension(f"omniroll._shared_{number_type}", **compilation(number_type))
        for number_type in C_HEADERS["NUMBER_TYPES"]
    ]
    return [*kernels, Extension("omniroll._shared_engine", **engine_compilation())]


def double_kernels() -> cffi.FFI:
    return kernel_module("double")


def float_kernels() -> cffi.FFI:
    return kernel_module("float")


def long_double_kernels() -> cffi.FFI:
    return kernel_module("long_double")
