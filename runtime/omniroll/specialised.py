"""Kernels for sets of effects that were not generated beforehand: made when a scene calls for them, and kept.

The texts come from generated/data and codegen (no Maxima). What is made is kept in a folder named after everything that
it depends on, so that it is found again and never out of date:

  $OMNIROLL_CACHE, or omniroll/ in $XDG_CACHE_HOME or ~/.cache; a folder of this process where that cannot be written

Where there is no C compiler ($CC or cc) only the Python kernel is made.
"""

import hashlib
import importlib.util
import json
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
import threading
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING

import cffi

from omniroll import generated_data
from omniroll.c_headers import NUMBER_TYPES, declarations
from omniroll.errors import KernelsMissingError

if TYPE_CHECKING:
    from omniroll.codegen.on_demand import Programs

FLAGS = ("-O3", "-std=c99", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=default")
LONGEST_COMPILATION = 300  # seconds
BUILDING = threading.RLock()  # a kernel that two threads ask for is made once


@cache
def set_names() -> frozenset[str]:
    """The sets that were generated beforehand."""
    return frozenset(entry["name"] for entry in generated_data.load("kernels")["sets"])


def set_name(base: str, effects: tuple[str, ...]) -> str:
    """The set of a roller model and further effects."""
    return "_".join([base, *effects])


def functions(base: str, effects: tuple[str, ...]) -> list[dict]:
    """What the functions of a set take and give, and the operations that they are; as in kernels.json."""
    name = set_name(base, effects)
    if name in set_names():
        return [f for f in generated_data.load("kernels")["functions"] if f["set"] == name]
    return json.loads((_folder(base, effects) / "functions.json").read_text(encoding="utf-8"))


def python_module(base: str, effects: tuple[str, ...]) -> ModuleType:
    """The Python kernel of a set."""
    name = set_name(base, effects)
    qualified = f"omniroll.generated.python.{name}"
    if name in set_names():
        return importlib.import_module(qualified)
    with BUILDING:
        return _loaded(qualified, _folder(base, effects) / f"{name}.py")


@cache
def _loaded(qualified: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(qualified, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def compiled_library(base: str, effects: tuple[str, ...], number_type: str) -> SimpleNamespace:
    """`ffi` and `lib` of a set that was not generated beforehand. KernelsMissingError without a compiler."""
    folder, name = _folder(base, effects), set_name(base, effects)
    with BUILDING:
        library = _library(folder, name, number_type, tuple(_compiler()))
        return _opened(folder / f"omniroll_{name}.h", library, number_type)


@cache
def _opened(header: Path, library: Path, number_type: str) -> SimpleNamespace:
    ffi = cffi.FFI()
    ffi.cdef(declarations(number_type, [header.read_text(encoding="utf-8")]))
    return SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(library)))


def _compiler() -> list[str]:
    return [*shlex.split(os.environ.get("CC", "cc")), *FLAGS, *shlex.split(os.environ.get("OMNIROLL_CFLAGS", ""))]


def _library(folder: Path, name: str, number_type: str, command: tuple[str, ...]) -> Path:
    """The compiled kernel in its folder; compiled now where it is not there."""
    key = hashlib.sha256("\0".join([*command, platform.machine()]).encode()).hexdigest()[:16]
    library = folder / f"{number_type}-{key}.so"
    if library.exists():
        return library
    if shutil.which(command[0]) is None:
        raise KernelsMissingError(f"no C compiler: {command[0]} is not there; set CC, or choose the Python engine")
    _, macro = NUMBER_TYPES[number_type]
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        made = Path(scratch, "kernel.so")
        define = [f"-D{macro}"] if macro else []
        done = subprocess.run(
            [*command, *define, f"-I{folder}", str(folder / f"omniroll_{name}.c"), "-lm", "-o", str(made)],
            capture_output=True, text=True, timeout=LONGEST_COMPILATION,
        )  # fmt: skip
        if done.returncode:
            raise KernelsMissingError(f"{command[0]} failed on the kernel {name}: {done.stderr.strip()[-500:]}")
        os.replace(made, library)
    return library


@cache
def _source_key() -> str:
    """Of all that the texts depend on: the programs, and codegen itself."""
    digest = hashlib.sha256()
    for name in ("programs", "effects", "symbols"):
        digest.update((resources.files("omniroll.generated") / "data" / f"{name}.json").read_bytes())
    package = resources.files("omniroll.codegen")
    for entry in sorted([*package.iterdir(), *(package / "templates").iterdir()], key=lambda entry: entry.name):
        if entry.name.endswith((".py", ".j2")):
            digest.update(entry.name.encode() + entry.read_bytes())
    return digest.hexdigest()


def _folder(base: str, effects: tuple[str, ...]) -> Path:
    """The folder with the texts of a set; written now where it is not there."""
    name = set_name(base, effects)
    key = hashlib.sha256(f"{_source_key()} {name}".encode()).hexdigest()[:16]
    with BUILDING:
        folder = _cache() / key
        if not folder.is_dir():
            _write(folder, base, effects)
    return folder


@cache
def _cache() -> Path:
    """The folder of all kept kernels, which can be written."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    wanted = Path(os.environ.get("OMNIROLL_CACHE") or Path(home, "omniroll"))
    try:
        wanted.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=wanted):
            return wanted
    except OSError:
        return Path(_scratch().name)


@cache
def _scratch() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="omniroll-")


@cache
def programs() -> "Programs":
    """What kernels are made of."""
    from omniroll.codegen.on_demand import Programs  # only where it is called for

    load = generated_data.load
    return Programs(load("programs"), load("effects")["effects"], load("symbols")["symbols"])


def _write(folder: Path, base: str, effects: tuple[str, ...]) -> None:
    """All texts of a set at once: they are written aside and put in place in one move."""
    from omniroll.codegen.on_demand import kernel_on_demand  # only where it is called for

    made = kernel_on_demand(programs(), base, effects)
    scratch = Path(tempfile.mkdtemp(dir=folder.parent))
    texts = {
        f"omniroll_{made.name}.h": made.c_header,
        f"omniroll_{made.name}.c": made.c_source,
        f"{made.name}.py": made.python,
        "functions.json": json.dumps(made.functions),
    }
    for file, text in texts.items():
        (scratch / file).write_text(text, encoding="utf-8")
    try:
        os.replace(scratch, folder)
    except OSError:  # another process was faster
        shutil.rmtree(scratch, ignore_errors=True)
        if not folder.is_dir():
            raise
