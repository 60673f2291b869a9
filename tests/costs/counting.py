"""Instructions of the compiled engine, counted by valgrind's callgrind: no other program on the machine moves them.

A process of its own runs tasks under callgrind, which counts what the engine's function does and nothing else; or a
part of what `simulate` does, where a name says so. Under it there is no AVX-512: engines of the level x86-64-v3 run, of
all sets alike. Four numbers are a vector there.
"""

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cffi

from omniroll.engine import simulate as simulating
from omniroll.engine.compiled_engine import CompiledRun
from omniroll.engine.compiled_variations import CompiledVariations
from omniroll.engine.simulate import checked_task, simulate
from omniroll.kernels import building

LEVEL = "x86-64-v3"
HERE = Path(__file__).resolve().parent
HEADER = Path("/usr/include/valgrind/callgrind.h")
LONGEST = 1800  # seconds
OWN_SET = {"engine": "specialised"}  # the set of a task alone is counted, if the task does not say otherwise
# Parts of a call of `simulate`, as they stand behind a task's name: the run with its control and without sensitivities,
# what C follows of the deviations, all that is done for the derivatives.
CONTROLLED, FOLLOWED, DERIVED = ", controlled", ", deviations", ", derivatives"
PARTS = {
    CONTROLLED: (simulating, "controlled_run"),
    FOLLOWED: (CompiledVariations, "follow"),
    DERIVED: (simulating, "with_sensitivities"),
}
WRITTEN = re.compile(r"^desc: Trigger: Client Request: (.+?)$.*?^summary: (\d+)", re.MULTILINE | re.DOTALL)
MARKS = """
void start_counting(void);
void toggle_counting(void);
int counted_call(void *engine, void *run, const void *model);
void write_down(const char *name);
"""


@dataclass(frozen=True)
class Count:
    """What a run took."""

    instructions: int
    evaluations: int
    steps: int
    rejected_steps: int
    phases: int
    switches: int

    def __sub__(self, other: "Count") -> "Count":
        return Count(*(getattr(self, field.name) - getattr(other, field.name) for field in fields(self)))

    @property
    def per_phase(self) -> float:
        return self.instructions / self.phases

    @property
    def per_evaluation(self) -> float:
        return self.instructions / self.evaluations


def missing() -> str:
    """What counting needs and this machine does not have, or nothing."""
    absent = [name for name in ("valgrind", "cc") if shutil.which(name) is None]
    absent += [] if HEADER.exists() else [str(HEADER)]
    absent += [] if LEVEL in building.levels_here() else [LEVEL]
    return ", ".join(absent)


def counted(module: str, names: list[str]) -> dict[str, Count]:
    """The counts of runs. module: whose `task(name)` gives the arguments of simulate()."""
    figures, texts = under_callgrind(module, names)
    return {name: Count(_instructions(texts[name]), **figures[name]) for name in names}


def counted_parts(module: str, names: list[str], parts: tuple[str, ...]) -> dict[str, tuple[int, ...]]:
    """Instructions of parts of `simulate`, by the names of tasks that ask for sensitivities."""
    _, texts = under_callgrind(module, [name + part for name in names for part in parts])
    return {name: tuple(_instructions(texts[name + part]) for part in parts) for name in names}


def _instructions(text: str) -> int:
    return int(WRITTEN.search(text)[2])


def under_callgrind(module: str, names: list[str], flags: str = "") -> tuple[dict[str, dict], dict[str, str]]:
    """{name: figures of the run} and {name: what callgrind has written of it}. flags: further ones of the compiler."""
    with tempfile.TemporaryDirectory() as folder:
        marks = Path(folder, "marks.so")
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", HERE / "callgrind_marks.c", "-o", marks], check=True)
        command = [
            "valgrind", "--tool=callgrind", "--instr-atstart=no", "--collect-atstart=no",
            f"--callgrind-out-file={folder}/out", sys.executable, "-m", "costs.counting", str(marks), module, *names,
        ]  # fmt: skip
        environment = os.environ | {"OMNIROLL_CFLAGS": flags}
        done = subprocess.run(
            command, cwd=HERE.parent, env=environment, capture_output=True, text=True, timeout=LONGEST
        )
        assert done.returncode == 0, done.stderr[-2000:]
        texts = [file.read_text() for file in Path(folder).glob("out*")]
        written = [(WRITTEN.search(text), text) for text in texts]
        return json.loads(done.stdout.splitlines()[-1]), {found[1]: text for found, text in written if found}


# In the process under callgrind


class CountedEngine:
    """The engine's library, whose runs go through counted_call."""

    def __init__(self, ffi: cffi.FFI, lib, marks):
        self._ffi, self._lib, self._marks = ffi, lib, marks
        self._engine = int(ffi.cast("intptr_t", ffi.addressof(lib, "omniroll_run")))

    def __getattr__(self, name):
        return getattr(self._lib, name)

    def omniroll_run(self, run, model) -> int:
        places = [self._engine, *(int(self._ffi.cast("intptr_t", pointer)) for pointer in (run, model))]
        return self._marks.lib.counted_call(*(self._marks.ffi.cast("void *", place) for place in places))


def split_name(name: str) -> tuple[str, str]:
    """The name of a task, and which part of it is counted; none where that is the engine."""
    part = next((part for part in PARTS if name.endswith(part)), "")
    return name.removesuffix(part), part


def count_part(part: str, task: Mapping, marks: SimpleNamespace) -> None:
    """Simulate, and count what a method or a module's function does."""
    kind, name = PARTS[part]
    own = getattr(kind, name)

    def counted_call(*given, **named) -> Any:
        marks.lib.toggle_counting()
        found = own(*given, **named)
        marks.lib.toggle_counting()
        return found

    setattr(kind, name, counted_call)
    try:
        simulate(**OWN_SET | task | ({"sensitivities": ()} if part == CONTROLLED else {}))
    finally:
        setattr(kind, name, own)


def run(task: Mapping, marks: SimpleNamespace | None = None) -> dict[str, int]:
    """Simulate; the figures of the run."""
    options = OWN_SET | task
    options.pop("sensitivities", None)
    engine = CompiledRun(checked_task(options.pop("vehicle"), **options), options["accuracy"])
    if marks is not None:
        module = engine.module
        engine.module = SimpleNamespace(ffi=module.ffi, lib=CountedEngine(module.ffi, module.lib, marks))
    engine.advance()
    assert engine.stop is None, engine.stop
    stats = engine.stats()
    engine.release()
    return {field.name: stats[field.name] for field in fields(Count)[1:]}


def main(marks_library: str, module: str, *names: str) -> None:
    building.LEVELS = {LEVEL: building.LEVELS[LEVEL]}  # engines are found for this level alone,
    building.QUICK = building.THOROUGH  # and compiled alike, whether beforehand or on demand: kept apart from others
    os.environ["OMNIROLL_CACHE"] = str(Path(sys.prefix, "omniroll-kernels-thorough"))
    ffi = cffi.FFI()
    ffi.cdef(MARKS)
    marks, task = SimpleNamespace(ffi=ffi, lib=ffi.dlopen(marks_library)), importlib.import_module(module).task
    places = {name: split_name(name) for name in names}
    # Kernels are made and loaded beforehand, and so is what one run keeps for the next.
    for own, part in places.values():
        if part:
            count_part(part, task(own), marks)
        else:
            run(task(own) | {"duration": 1e-3})
    marks.lib.start_counting()
    found = {}
    for name, (own, part) in places.items():
        if part:
            count_part(part, task(own), marks)
        else:
            found[name] = run(task(own), marks)
        marks.lib.write_down(name.encode())
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
