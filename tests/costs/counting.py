"""Instructions of the compiled engine, counted by valgrind's callgrind: no other program on the machine moves them.

A process of its own runs tasks under callgrind, which counts what the engine's function does and nothing else; where a
task asks for sensitivities, then what follows the deviations in C. Under it there is no AVX-512: engines of the level
x86-64-v3 run, of all sets alike. Four numbers are a vector there.
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
# Behind a task's name: with its control; what follows the deviations; all that is done for the derivatives.
CONTROLLED, FOLLOWED, DERIVED = ", controlled", ", deviations", ", derivatives"
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


def counted_with_sensitivities(module: str, name: str) -> tuple[int, int, int]:
    """Instructions of a run whose task asks for sensitivities, with its control; of following its deviations; and of
    all that `simulate` does for the derivatives, in C and in Python."""
    _, texts = under_callgrind(module, [name])
    return tuple(_instructions(texts[name + part]) for part in (CONTROLLED, FOLLOWED, DERIVED))


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


def count_calls(kind: Any, name: str, task: Mapping, marks: SimpleNamespace) -> None:
    """Simulate, and count what a method or a module's function of this name does."""
    own = getattr(kind, name)

    def counted_call(*given, **named) -> Any:
        marks.lib.toggle_counting()
        found = own(*given, **named)
        marks.lib.toggle_counting()
        return found

    setattr(kind, name, counted_call)
    try:
        simulate(**task)
    finally:
        setattr(kind, name, own)


def run(task: Mapping, marks: SimpleNamespace | None = None) -> dict[str, int]:
    """Simulate; the figures of the run."""
    options = dict(task)
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
    for name in names:  # kernels are made and loaded beforehand, and so is what one run keeps for the next
        run(task(name) | {"duration": 1e-3})
        if "sensitivities" in task(name):
            simulate(**task(name))
    marks.lib.start_counting()
    found = {}
    for name in names:
        found[name] = run(task(name), marks)
        marks.lib.write_down(name.encode())
        if "sensitivities" in task(name):
            count_calls(simulating, "controlled_run", task(name) | {"sensitivities": ()}, marks)
            marks.lib.write_down((name + CONTROLLED).encode())
            count_calls(CompiledVariations, "follow", task(name), marks)
            marks.lib.write_down((name + FOLLOWED).encode())
            count_calls(simulating, "with_sensitivities", task(name), marks)
            marks.lib.write_down((name + DERIVED).encode())
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
