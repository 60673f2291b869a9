"""Sets of effects: their texts and their compiled libraries, made beforehand or when a scene calls for them.

A set has a folder with its files; one that is made on demand has its C files in a folder of their own, inside:

    omniroll.h omniroll.c    the pair that a controller takes
    kernel_in_lanes.h        the functions on vectors, for the compiled engine
    engine_set.h             what the compiled engine must know of the set
    declarations.h           what cffi must know of the pair
    functions.json           what the functions take and give
    float.so ...             the compiled pair, one library a number type
    engine-LEVEL-3.so ...    the compiled engine, one library a level of vector instructions and a number of wheels
                             (3, 4 or any), and engine-LEVEL-3-sharp.so for rollers with sharp tips

The folders of the sets that are built with omniroll are beside this file. Any other set is made from generated/data (no
Maxima) in a folder that is named after all that it depends on, so that it is found again and never out of date;
omniroll.codegen.cache says where.

A scene runs on a general set, which is built with omniroll for any vehicle (neutral_kernel.py): the effects that it
does not call for are at neutral values there. Its own set is compiled where engine="specialised" asks for that.
"""

import hashlib
import importlib.util
import json
import os
import platform
import shutil
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, TypeVar

import cffi

from omniroll import generated_data, json_texts
from omniroll.codegen import cache as cache_folder
from omniroll.codegen import specialise
from omniroll.codegen.along import ALONG
from omniroll.errors import KernelsMissingError
from omniroll.kernels import building
from omniroll.kernels.building import NUMBER_TYPES, CompilationError

if TYPE_CHECKING:
    from omniroll.codegen.on_demand import Programs, SetKernel

BUILT = Path(__file__).with_name("built")
MAKING = threading.RLock()  # what two threads ask for is made once
CHECKSUMS = "checksums.json"  # of the texts in a folder,
TEXTS = (".py", ".json", ".c", ".h")  # all of them
MAKING_PREFIX, LEFT = "making-", 3600.0  # folders in the making; one so many s old was left by a killed process
WHOLE: set[Path] = set()  # folders whose texts have been looked at
Made = TypeVar("Made")


@cache
def set_names() -> frozenset[str]:
    """The sets that were generated beforehand."""
    return frozenset(entry["name"] for entry in generated_data.load("kernels")["sets"])


@cache
def needs() -> dict[str, tuple[str, ...]]:
    """The effects without which an effect does nothing, by its name."""
    return {entry["name"]: tuple(entry["needs"]) for entry in generated_data.load("effects")["effects"]}


def set_name(base: str, effects: tuple[str, ...]) -> str:
    """The set of a roller model and further effects; what another one of them needs is not named."""
    return specialise.set_name(base, effects, needs())


@cache
def general_sets(base: str) -> list[tuple[str, ...]]:
    """The effects of the general sets of this roller model, which are built with omniroll; see building.py."""
    return building.general_sets(generated_data.load("effects")["effects"], base)


def is_general(base: str, effects: tuple[str, ...]) -> bool:
    """Whether this is such a set, and was built."""
    if effects not in general_sets(base):  # which costs less than a look into a folder: every run asks
        return False
    return (BUILT / set_name(base, effects) / "functions.json").exists() and _is_current(BUILT)


@cache
def _is_current(built: Path) -> bool:
    """Whether the libraries in this folder are made from the sources that are there; said where they are not. In a
    checkout the sources may have changed since: an engine that takes other arguments would end the process."""
    if not built.is_dir():
        return False
    try:
        made_from = (built / building.SOURCES).read_text(encoding="ascii")
    except (OSError, ValueError):
        made_from = ""
    if made_from != _source_key():
        _say(f"{built} is compiled from other sources than are there now: 'make build' compiles it anew; until then "
             "what is needed is compiled beside the user's other kernels")  # fmt: skip
    return made_from == _source_key()


def functions(base: str, effects: tuple[str, ...]) -> list[dict]:
    """What the functions of a set take and give, and the operations that they are; as in generated/data/kernels."""
    name = set_name(base, effects)
    if name in set_names():
        return [f for f in generated_data.load("kernels")["functions"] if name in f["sets"]]

    def read() -> list[dict]:
        place = BUILT / name if is_general(base, effects) else folder(base, effects)
        return json.loads((place / "functions.json").read_text(encoding="utf-8"))

    return _where_there_is_room(read)


def python_module(base: str, effects: tuple[str, ...]) -> ModuleType:
    """The Python kernel of a set."""
    name = set_name(base, effects)
    qualified = f"omniroll.generated.python.{name}"
    if name in set_names():
        return importlib.import_module(qualified)
    with MAKING:
        return _where_there_is_room(lambda: _loaded(qualified, folder(base, effects) / f"{name}.py"))


@cache
def _loaded(qualified: str, path: Path) -> ModuleType:
    try:
        return _executed(qualified, path)
    except (EOFError, ValueError, TypeError, ImportError):  # Python's own cache of it is damaged
        shutil.rmtree(path.with_name("__pycache__"), ignore_errors=True)
        return _executed(qualified, path)


def _executed(qualified: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(qualified, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Libraries


def library(base: str, effects: tuple[str, ...], number_type: str) -> SimpleNamespace:
    """`ffi` and `lib` of a set's compiled functions. Raises KernelsMissingError where they cannot be had."""
    with MAKING:
        return _where_there_is_room(lambda: _opened_pair(base, effects, number_type))


def engine(base: str, effects: tuple[str, ...], wheels: int, sharp: bool = False) -> SimpleNamespace:
    """`ffi` and `lib` of the compiled engine of a set.

    wheels  the vehicle's; the engine is compiled for this number, or for any
    sharp   whether the engine solves for nu' by the functions for sharp tips

    Raises KernelsMissingError where it cannot be had.
    """
    unrolled = wheels in building.UNROLLED and not is_general(base, effects)
    with MAKING:  # two threads get one library
        return _where_there_is_room(lambda: _opened_engine(base, effects, wheels if unrolled else None, sharp))


def variations(base: str, effects: tuple[str, ...], wheels: int, sharp: bool = False) -> SimpleNamespace:
    """`ffi` and `lib` of what follows the deviations of runs with the engine of a set; arguments as of `engine`.

    Raises KernelsMissingError where it cannot be had.
    """
    unrolled = wheels if wheels in building.UNROLLED else None
    with MAKING:
        return _where_there_is_room(lambda: _opened_variations(base, (*effects, ALONG), unrolled, sharp))


@cache
def _opened_pair(base: str, effects: tuple[str, ...], number_type: str) -> SimpleNamespace:
    place, file = _pair(base, effects, number_type)
    return _opened(place, file, number_type, [])


@cache
def _opened_engine(base: str, effects: tuple[str, ...], wheels: int | None, sharp: bool) -> SimpleNamespace:
    place, file = _engine(base, effects, wheels, sharp, "engine")
    return _opened(place, file, "double", [(_engine_sources() / "engine_calls.h").read_text(encoding="utf-8")])


@cache
def _opened_variations(base: str, effects: tuple[str, ...], wheels: int | None, sharp: bool) -> SimpleNamespace:
    place, file = _engine(base, effects, wheels, sharp, "variations")
    calls = _engine_sources() / "deviations/variations_calls.h"
    return _opened(place, file, "double", [calls.read_text(encoding="utf-8")])


def _opened(place: Path, file: str, number_type: str, further: list[str]) -> SimpleNamespace:
    """A library, and the declarations of its pair and what comes with it."""
    c_type, _ = NUMBER_TYPES[number_type]
    declarations = [f"typedef {c_type} omniroll_real;", (place / "declarations.h").read_text(encoding="utf-8")]
    ffi = cffi.FFI()
    ffi.cdef("\n".join(declarations + further))
    return SimpleNamespace(ffi=ffi, lib=ffi.dlopen(str(place / file)))


def _pair(base: str, effects: tuple[str, ...], number_type: str) -> tuple[Path, str]:
    """The folder and the library of a set's functions."""
    file = f"{number_type}.so"
    return _made(base, effects, [file], lambda place: building.kernel_library(place, number_type))


def _engine(base: str, effects: tuple[str, ...], wheels: int | None, sharp: bool, kind: str) -> tuple[Path, str]:
    """The folder and the library of a set's engine of a kind, at the widest level that runs here."""
    quick = kind == "engine"  # sensitivities are short to compile, and run long
    levels = building.levels_of(kind, building.levels_here())
    engines = [building.Engine(level, wheels, sharp, quick, kind, bare=not effects) for level in levels]
    constants = Path(str(resources.files("omniroll.generated") / "c"))

    def build(place: Path) -> None:
        what = f"{kind} of {set_name(base, effects)}"
        print(f"omniroll: compiling the {what}, once; it takes seconds", file=sys.stderr)
        building.engine_library(place, _engine_sources(), constants, engines[0])

    files = [engine.file for engine in engines]
    return _made(base, effects, files, build) if quick else _made(base, effects, files, build, otherwise="")


def _engine_sources() -> Path:
    return Path(str(resources.files("omniroll.csrc")))


def _made(
    base: str, effects: tuple[str, ...], files: list[str], build: Callable[[Path], None],
    otherwise: str = "; or choose the Python engine",
) -> tuple[Path, str]:  # fmt: skip
    """The folder of a set and the first library that it holds; `files[0]` is compiled now where there is none, or
    where it is not as it was compiled. `otherwise`: what to do without it."""
    built = BUILT / set_name(base, effects)
    for file in files if _is_current(BUILT) else ():
        if building.is_whole(built / file):
            return built, file
        if (built / file).exists():
            _say(f"{built / file} is damaged; it is compiled anew beside the user's other kernels")
    with MAKING:
        try:
            place = c_folder(base, effects)
            with cache_folder.lock(place / "libraries"):
                if not building.is_whole(place / files[0]):  # what is compiled needs no compiler any more
                    building.find_compiler()
                    if (place / files[0]).exists():
                        _say(f"{place / files[0]} is damaged, or its making was cut off; it is compiled anew")
                    for left in place.glob("tmp*"):  # by a compiler that was killed
                        shutil.rmtree(left, ignore_errors=True)
                    build(place)
        except CompilationError as problem:
            raise KernelsMissingError(f"{problem}{otherwise}") from None
        except OSError as problem:
            raise _cannot_keep(place, problem) from None
    return place, files[0]


class _NoRoomError(KernelsMissingError):
    """A folder of kernels takes no more files."""


def _cannot_keep(place: Path, problem: OSError) -> _NoRoomError:
    return _NoRoomError(f"kernels cannot be kept in {place.parent}: {problem}; $OMNIROLL_CACHE names another folder")


def _where_there_is_room(make: Callable[[], Made]) -> Made:
    """What `make` gives; where the folder takes no more files, made once more in one of this process."""
    try:
        return make()
    except _NoRoomError as problem:
        wanted = cache_folder.folder()
        if not cache_folder.give_way(wanted):
            raise
        try:
            made = make()
        except _NoRoomError:
            cache_folder.come_back(wanted)
            raise problem from None
        _say(f"{problem}; they are made for this process alone")
        return made


def _say(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=2)


def c_folder(base: str, effects: tuple[str, ...]) -> Path:
    """The folder with a set's C and what this compiler makes of it; the C is written now where it is not there."""
    flags = [*building.compiler(), *building.PAIR_FLAGS, *building.ENGINE_FLAGS, *building.further_flags()]
    key = hashlib.sha256("\0".join([*flags, platform.machine()]).encode()).hexdigest()[:16]
    place = folder(base, effects) / key
    _ensure(place, lambda: _texts(base, effects).c_files())
    return place


# Texts


def _ensure(place: Path, texts: Callable[[], dict[str, str]]) -> None:
    """A folder with these texts; one whose texts are not as they were written is made anew."""
    if place.is_dir() and not _is_whole(place):
        try:
            with cache_folder.lock(place):
                if place.is_dir() and not _is_whole(place):
                    _say(f"{place} is damaged; it is made anew")
                    shutil.rmtree(place)
        except OSError as problem:
            raise _cannot_keep(place, problem) from None
    if not place.is_dir():
        _put_in_place(place, texts())


def _is_whole(place: Path) -> bool:
    """Whether the texts in a folder are those that were written there; looked at once in a process."""
    if place not in WHOLE:
        try:
            checksums = json_texts.read_object((place / CHECKSUMS).read_text(encoding="utf-8"))
            texts = {file.name for file in place.iterdir() if file.suffix in TEXTS} - {CHECKSUMS}
            damaged = texts != checksums.keys()
            damaged = damaged or any(building.digest(place / file) != checksums[file] for file in texts)
        except (OSError, ValueError):
            damaged = True
        if damaged:
            return False
        WHOLE.add(place)
    return True


def _put_in_place(place: Path, texts: dict[str, str]) -> None:
    """A folder of files, whole or not at all: they are written aside and put in place in one move."""
    scratch = None
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        for left in place.parent.glob(f"{MAKING_PREFIX}*"):
            if time.time() - left.stat().st_mtime > LEFT:
                shutil.rmtree(left, ignore_errors=True)
        scratch = tempfile.mkdtemp(prefix=MAKING_PREFIX, dir=place.parent)
        checksums = {file: hashlib.sha256(text.encode()).hexdigest() for file, text in texts.items()}
        for file, text in (texts | {CHECKSUMS: json.dumps(checksums)}).items():
            Path(scratch, file).write_text(text, encoding="utf-8")
        os.replace(scratch, place)
    except OSError as problem:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)
        if not place.is_dir():  # else another process was faster
            raise _cannot_keep(place, problem) from None


@cache
def programs() -> "Programs":
    """What kernels are made of."""
    from omniroll.codegen.on_demand import Programs  # jinja2 only where a set is made

    return Programs.load(Path(str(resources.files("omniroll.generated") / "data")))


@lru_cache(maxsize=1)
def _texts(base: str, effects: tuple[str, ...]) -> "SetKernel":
    """The set that is made just now: first its Python is asked for, then its C."""
    return programs().kernel(base, effects)


@cache
def _source_key() -> str:
    """Of all that the texts and the libraries depend on."""
    generated = resources.files("omniroll.generated")
    folders = generated / "data", resources.files("omniroll.codegen"), _engine_sources(), generated / "c"
    return building.sources_digest(*(Path(str(folder)) for folder in folders))


def folder(base: str, effects: tuple[str, ...]) -> Path:
    """The folder with a set's Python; written now where it is not there. KernelsMissingError where it cannot be."""
    name = set_name(base, effects)
    key = hashlib.sha256(f"{_source_key()} {name}".encode()).hexdigest()[:16]
    with MAKING:
        place = cache_folder.folder() / key
        _ensure(place, lambda: _texts(base, effects).python_files())
    return place
