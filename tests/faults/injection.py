"""Writes the results of a scene again and again, each time with a fault at another call that changes files.

Run as a program, with shim.c preloaded:

    python -m faults.injection FOLDER SCENE-BEFORE SCENE-NEW HOW [EVERY [stream]]

FOLDER is made and used. HOW is one of HOW below; with EVERY only every so many calls are struck; with "stream" the new
results go to the disk part by part. It prints a JSON
object: how many calls were struck, how often the old and the new results stood afterwards, and what was wrong.
"""

import ctypes
import errno
import json
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from omniroll.errors import OmnirollError
from omniroll.scenes.loading import load_scene
from omniroll.scenes.outcome import FILES, Outcome, result_folder, run_scene, write
from omniroll.scenes.result_folder import PARTS, ResultFolder, Results, load_results
from omniroll.scenes.streaming import Stream

HERE = Path(__file__).parent
HOW = {"error": (0, errno.EIO), "full": (1, errno.ENOSPC), "kill": (2, 0)}


def built_shim(folder: Path) -> Path:
    """The shim, compiled."""
    library = folder / "shim.so"
    command = ["cc", "-shared", "-fPIC", "-O1", str(HERE / "shim.c"), "-o", str(library), "-ldl"]
    subprocess.run(command, check=True)
    return library


def injected(shim: Path, *arguments: object) -> dict:
    """What this program prints, run with the shim."""
    environment = os.environ | {"LD_PRELOAD": str(shim), "PYTHONPATH": str(HERE.parent)}
    command = [sys.executable, "-m", "faults.injection", *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


Making = Callable[[ResultFolder], Outcome]


def in_memory(scene: str) -> Making:
    """A run, made once."""
    outcome = run_scene(load_scene(scene))
    return lambda results: outcome


def in_parts(scene: str) -> Making:
    """A run that is made each time it is written, since it is written while it goes on."""
    memory = 3e4  # bytes: a few rows

    def made(results: ResultFolder) -> Outcome:
        outcome = run_scene(load_scene(scene), stream=Stream(results.unfinished, memory))
        return replace(outcome, seconds=0.0)  # the only number that differs from time to time

    return made


def attempt(folder: Path, making: Making) -> bool:
    """Write the results as `omniroll run` does; whether it says that they are kept."""
    try:
        with result_folder(folder) as results:
            write(making(results), results)
    except (OSError, OmnirollError):
        return False
    return True


def wrong(folder: Path, contents: dict[str, dict[str, bytes]], said: bool) -> tuple[str, list[str]]:
    """Which results stand in the folder, and what is wrong with it."""
    problems = []
    for name in FILES:
        if (folder / name).exists() and (folder / name).read_bytes() not in [c.get(name) for c in contents.values()]:
            problems.append(f"{name} is half written under its final name")
    try:
        found = load_results(folder)
        stands = standing(found, contents)
        found.trajectory()
    except (OSError, OmnirollError) as error:
        return "none", [*problems, f"nothing can be read: {error}"]
    if stands == "mixed":
        problems.append("a mix was read")
    if said and stands != "new":
        problems.append(f"{stands} results stand, and the run said that it had kept its own")
    with result_folder(folder):  # the next run puts in order what was cut off
        pass
    again = load_results(folder)
    if standing(again, contents) != stands or not {p.parent for p in again.places.values()} <= {folder, folder / PARTS}:
        problems.append("the next run does not put the folder in order")
    if set(content(folder)) != set(contents[stands]):
        problems.append("files of the other run are left")
    return stands, problems


def standing(found: Results, contents: dict[str, dict[str, bytes]]) -> str:
    """ "before", "new" or "mixed"."""
    bytes_of = {name: path.read_bytes() for name, path in found.places.items()}
    for which, content in contents.items():
        if bytes_of == {name: part for name, part in content.items() if name != "summary.json"}:
            return which
    return "mixed"


def content(folder: Path) -> dict[str, bytes]:
    """Of each file of the results, by its name."""
    paths = [*(folder / name for name in FILES if (folder / name).exists()), *folder.glob(f"{PARTS}/*")]
    return {path.name: path.read_bytes() for path in paths}


def main(place: str, scene_before: str, scene_new: str, how: str, every: str = "1", way: str = "") -> None:
    kind, number = HOW[how]
    shim = ctypes.CDLL(None)
    folder, before, new = (Path(place) / name for name in ("work", "before", "new"))
    makings = {before: in_memory(scene_before), new: in_parts(scene_new) if way else in_memory(scene_new)}
    contents = {}
    for path, making in makings.items():
        assert attempt(path, making)
        contents[path.name] = content(path)
    said = {"struck": 0, "before": 0, "new": 0, "wrong": []}
    call = 1
    while True:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(before, folder)
        child = os.fork()
        if not child:
            os.close(2)
            shim.faults_arm(os.fsencode(folder), ctypes.c_long(call), kind, number)
            kept = attempt(folder, makings[new])
            os._exit((3 if kept else 4) if shim.faults_count() >= call else 5)
        _, status = os.waitpid(child, 0)
        ended = os.waitstatus_to_exitcode(status)
        if ended == 5:
            break
        stands, problems = wrong(folder, contents, said=ended == 3)
        said["struck"] += 1
        said[stands] = said.get(stands, 0) + 1
        said["wrong"] += [f"call {call}: {problem}" for problem in problems]
        call += int(every)
    print(json.dumps(said))


if __name__ == "__main__":
    np.seterr(all="raise")
    warnings.simplefilter("ignore")
    main(*sys.argv[1:])
