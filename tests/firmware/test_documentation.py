"""What docs/c-interface.md and README.md say of C is so: their commands and programs run as they stand there."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from firmware.files import NUMBER_TYPES, STRICT, run, tool

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/c-interface.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def shell(text, folder):
    """Runs a block of the shell where the scenes are."""
    shutil.copytree(ROOT / "scenes", folder / "scenes", dirs_exist_ok=True)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run("sh", "-ec", text, cwd=folder, env=os.environ | {"PATH": path})


def test_the_commands_and_the_program_of_the_page(tmp_path):
    tool("cc")
    for block in blocks(PAGE, "sh"):
        shell(block, tmp_path)
    (program,) = blocks(PAGE, "c")
    main = tmp_path / "firmware" / "main.c"
    main.write_text(program)
    for flags in NUMBER_TYPES.values():
        made = tmp_path / "program"
        run(tool("gcc"), *STRICT, *flags, main, tmp_path / "firmware/omniroll.c", "-lm", "-o", made)
        assert subprocess.run([made]).returncode == 0


def test_the_commands_of_the_readme(tmp_path):
    tool("cc")
    (block,) = (block for block in blocks(README, "sh") if "omniroll kernel" in block)
    shell(block, tmp_path)
    assert (tmp_path / "out/firmware/omniroll.o").exists() and (tmp_path / "out/free/omniroll.h").exists()


@pytest.mark.parametrize("page", ["docs/c-interface.md", "CHANGELOG.md"])
def test_links_lead_to_files(page):
    path = ROOT / page
    targets = re.findall(r"\]\(([^)#:]+)\)", path.read_text(encoding="utf-8"))
    assert [target for target in targets if not (path.parent / target).exists()] == []
