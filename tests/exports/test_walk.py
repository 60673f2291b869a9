"""The walk of a control engineer in docs/, block by block, in a copy of what it reads."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from pages import ROOT, blocks, page

pytest.importorskip("fmpy", reason="fmpy is not installed: make test-exports installs it")
pytest.importorskip("casadi", reason="casadi is not installed: make test-exports installs it")

BLOCKS = blocks("sh", page("docs/walk-control-engineer.md"))
SETS_UP = re.compile(r"^(make build|.*pip install.*)\n", re.MULTILINE)  # which has been done where this test runs


def test_the_walk(tmp_path):
    for name in ("scenes", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    said = ""
    for block in BLOCKS:
        text = SETS_UP.sub("", block)
        done = subprocess.run(["sh", "-ec", text], cwd=tmp_path, env=os.environ, capture_output=True, text=True)
        assert done.returncode == 0, f"{text}\n{done.stdout}{done.stderr}"
        said += done.stdout
    joints, steps = map(int, re.search(r"^(\d+) (\d+)$", said, re.MULTILINE).groups())
    assert joints >= 1000 and steps > joints
    *_, nu = re.findall(r"nu after 3 s \[(.*)\]", said)
    assert [float(x) for x in nu.split()] == pytest.approx([1, 0, 0.5], abs=0.05)
    assert "casadi.external('rates', 'out/casadi/rates.so')" in said and "nu' per volt" in said
    x, y = map(float, re.search(r"x (\S+) m, y (\S+) m", said).groups())
    assert abs(x) + abs(y) > 0.1
    assert all((tmp_path / "out" / name).exists() for name in ("model.mat", "driven.fmu", "firmware/controller"))
