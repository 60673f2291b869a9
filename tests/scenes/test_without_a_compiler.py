"""Every shipped scene runs on what was built with the package, and each sixth is explained: nothing is compiled."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENES = sorted(Path("scenes").glob("*.toml"))
RUNS = """
import sys, warnings
warnings.simplefilter("error", RuntimeWarning)
from omniroll.scenes import load_scene, run
from omniroll.engine.simulate import checked_task
from omniroll.scenes.explanation import explained, runs_on
for place, name in enumerate(sys.argv[1:]):
    scene = load_scene(name)
    run(scene, duration=0.2)
    task = checked_task(scene.vehicle, **scene.options)
    print(name, runs_on(task) if place % 6 else explained(scene)["runs_on"])
"""


@pytest.mark.long
def test_shipped_scenes_need_no_compiler(tmp_path):
    environment = os.environ | {"CC": "/nonexistent", "OMNIROLL_CACHE": str(tmp_path)}
    command = [sys.executable, "-c", RUNS, *map(str, SCENES)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    told = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    assert told.keys() == {str(scene) for scene in SCENES}
    assert all(engine.startswith("compiled engine") for engine in told.values())
    assert not list(tmp_path.rglob("*.so"))
