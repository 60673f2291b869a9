"""The walk of a mechanician in docs/, command by command, in a copy of what it reads and changes."""

import re
import shutil
import subprocess
import sys

import pytest
from pages import ROOT, blocks, page

PAGE = page("docs/walk-mechanician.md")
COMMANDS = [line for block in blocks("sh", PAGE) for line in block.splitlines()]
MADE = re.compile(r"make (\w[\w-]*.*)$")


def recipe(target: str) -> str:
    """What make would run of this package's."""
    said = subprocess.run(["sh", "-c", f"make -n {target}"], cwd=ROOT, capture_output=True, text=True, check=True)
    return " && ".join(re.findall(r"^\.venv/bin/python -m codegen.*", said.stdout, re.MULTILINE))


@pytest.mark.long
def test_the_walk(tmp_path):
    for name in ("maxima", "codegen", "generated", "scenes"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    said = ""
    for command in COMMANDS:
        if command in ("make build", "git checkout maxima"):
            continue
        made = MADE.search(command)
        line = command.replace(made[0], recipe(made[1])) if made else command
        done = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0 or "command -v" in command, f"{command}\n{done.stdout}{done.stderr}"
        said += done.stdout
    of_maxima = re.sub(r"\s", "", said)  # which breaks its lines
    assert "sum_i((B*R*sin(alpha)*sin(chi))/(Lambda*rho)+(J*R^2*cos(alpha))/(Lambda*l^2))" in of_maxima
    assert "0 fail" in said and "8 of 49 equations change" in said
    for block in blocks("text", PAGE):
        assert block in said
    assert (tmp_path / "out/what-if/motion.png").exists()
