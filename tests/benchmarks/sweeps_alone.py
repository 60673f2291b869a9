"""What the parts of a sweep take where each waits for the one before, and nothing else is done (sweeps_alone.c)."""

import tempfile
import time
from pathlib import Path

import cffi

from omniroll.engine.compiled_engine import CompiledRun
from omniroll.engine.runs import Task
from omniroll.kernels import building, sets

from .common import ROOT

PARTS = ("evaluations", "with their sums", "sweeps")  # the order of sweeps_alone.c
COUNT, REPEATS = 20000, 15


def seconds(task: Task) -> dict[str, float]:
    """{part: s for the sixteen nodes of a step, of the repeat that was fastest} at the start of a run of a bare set."""
    run, ffi = CompiledRun(task, task.accuracy), cffi.FFI()
    ffi.cdef("double repeat_part(void *, void *, int, long long);")
    with tempfile.TemporaryDirectory() as folder:
        library = ffi.dlopen(str(_compiled(run, Path(folder))))
    model = run.kernel.model_for(run.module.ffi)
    pointers = [ffi.cast("void *", int(run.module.ffi.cast("intptr_t", place))) for place in (run.struct, model)]

    def once(part: int) -> float:
        began = time.thread_time()
        library.repeat_part(*pointers, part, COUNT)
        return (time.thread_time() - began) / COUNT

    found = {name: min(once(part) for _ in range(REPEATS)) for part, name in enumerate(PARTS)}
    run.release()
    return found


def _compiled(run: CompiledRun, folder: Path) -> Path:
    """The library, with the flags of the run's engine."""
    kernel, target = run.kernel, folder / "sweeps_alone.so"
    engine = building.Engine(building.levels_here()[0], kernel.wheels, kernel.sharp)
    of_set = sets.c_folder(kernel.base, kernel.effects)
    folders = [of_set, ROOT / "runtime/csrc", ROOT / "generated/c"]
    building.compile_library([Path(__file__).with_suffix(".c")], target, folders, engine.flags)
    return target
