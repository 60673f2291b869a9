"""Instructions that the compiled engine takes for runs, counted by valgrind: the same on every machine of one kind.

`counted` runs this file in a process of its own under callgrind, which counts within `omniroll_run` alone.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve()
VALGRIND = shutil.which("valgrind")


def counted(tasks: list[dict[str, Any]]) -> list[dict[str, float]]:
    """For each task, arguments of `simulate` as JSON takes them: its instructions, evaluations and switches.

    effects: pairs of a class of omniroll and its arguments; wheels, rollers: those of Vehicle.paper. A run counts from
    its second time on, so that libraries have been loaded.
    """
    assert VALGRIND is not None, "valgrind counts"
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder, "found.json")
        prefix = Path(folder, "callgrind")
        options = ["--tool=callgrind", "--collect-atstart=no", "--toggle-collect=omniroll_run",
                   "--dump-after=omniroll_run", f"--callgrind-out-file={prefix}", "--quiet"]  # fmt: skip
        command = [VALGRIND, *options, sys.executable, str(HERE), str(prefix), str(found)]
        subprocess.run(command, input=json.dumps(tasks), text=True, check=True)
        return json.loads(found.read_text())


def collected(prefix: Path) -> int:
    """The instructions of all calls so far."""
    totals = (re.search(r"^summary: (\d+)", file.read_text(), re.MULTILINE) for file in prefix.parent.glob(f"{prefix.name}.*"))
    return sum(int(total[1]) for total in totals if total)


def run_all(prefix: Path, found: Path) -> None:
    """What stands in the standard input, one after the other, each twice."""
    import omniroll

    results = []
    for task in json.load(sys.stdin):
        vehicle = omniroll.Vehicle.paper(task.pop("wheels", 3), task.pop("rollers", 5))
        effects = [getattr(omniroll, name)(**arguments) for name, arguments in task.pop("effects", [])]
        for _ in range(2):
            before = collected(prefix)
            run = omniroll.simulate(vehicle, effects=effects, **task, control=False)
        results.append({"instructions": collected(prefix) - before, "evaluations": run.stats["evaluations"],
                        "steps": run.stats["steps"], "switches": len(run.switches)})  # fmt: skip
    found.write_text(json.dumps(results))


if __name__ == "__main__":
    run_all(Path(sys.argv[1]), Path(sys.argv[2]))
