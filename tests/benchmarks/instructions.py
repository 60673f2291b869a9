"""Instructions that the compiled engine takes for runs, counted by valgrind's callgrind.

`counted` runs this file in a process of its own, which counts within the engine's function alone.
"""

import ctypes
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

HERE = Path(__file__).resolve()
SHIM = """
#include <valgrind/callgrind.h>
int counted(int (*run)(void *, const void *), void *state, const void *model)
{
    CALLGRIND_TOGGLE_COLLECT;
    const int status = run(state, model);
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS;
    return status;
}
"""


def missing() -> str:
    """What counting needs and is not there, or nothing."""
    tools = [tool for tool in ("valgrind", "cc") if shutil.which(tool) is None]
    header = [] if Path("/usr/include/valgrind/callgrind.h").exists() else ["valgrind/callgrind.h"]
    return ", ".join(tools + header)


def counted(tasks: list[dict[str, Any]]) -> list[dict[str, int]]:
    """For each task its instructions, evaluations, steps and switches.

    tasks  arguments of `simulate` as JSON takes them; effects are pairs of a class of omniroll and its arguments

    They run first as they are, so that kernels are compiled, and then under callgrind.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "shim.c").write_text(SHIM)
        subprocess.run(["cc", "-O1", "-fPIC", "-shared", "-o", "shim.so", "shim.c"], cwd=place, check=True)
        callgrind = ["valgrind", "--tool=callgrind", "--collect-atstart=no", f"--callgrind-out-file={place}/counts"]
        for under in ([], [*callgrind, "--quiet"]):
            command = [*under, sys.executable, str(HERE), str(place)]
            subprocess.run(command, input=json.dumps(tasks), text=True, check=True)
        return json.loads((place / "found.json").read_text())


def collected(place: Path) -> int:
    """The instructions of all calls so far, each in a file of its own."""
    totals = (re.search(r"^summary: (\d+)", file.read_text(), re.MULTILINE) for file in place.glob("counts*"))
    return sum(int(total[1]) for total in totals if total)


def through(shim: ctypes.CDLL, module: Any) -> Any:
    """An engine whose runs are counted."""

    def run(*arguments: Any) -> int:
        pointers = [module.lib.omniroll_run, *arguments]
        addresses = (int(module.ffi.cast("uintptr_t", pointer)) for pointer in pointers)
        return shim.counted(*map(ctypes.c_void_p, addresses))

    names = ("omniroll_run_states", "omniroll_run_inputs", "omniroll_run_work_size")
    others = {name: getattr(module.lib, name) for name in names}
    return SimpleNamespace(ffi=module.ffi, lib=SimpleNamespace(**others, omniroll_run=run))


def run_all(place: Path) -> None:
    """What stands in the standard input, one after the other."""
    import omniroll
    from omniroll.engine import compiled_engine

    shim, engine_of = ctypes.CDLL(str(place / "shim.so")), compiled_engine.engine_of
    compiled_engine.engine_of = lambda kernel: through(shim, engine_of(kernel))
    results = []
    for task in json.load(sys.stdin):
        effects = [getattr(omniroll, name)(**arguments) for name, arguments in task.pop("effects")]
        before = collected(place)
        run = omniroll.simulate(omniroll.Vehicle.paper(), effects=effects, **task, control=False)
        counts = {name: run.stats[name] for name in ("evaluations", "steps")} | {"switches": len(run.switches)}
        results.append({"instructions": collected(place) - before} | counts)
    (place / "found.json").write_text(json.dumps(results))


if __name__ == "__main__":
    run_all(Path(sys.argv[1]))
