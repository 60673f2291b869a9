"""What README.md and the first tutorial promise is so: commands, the example, links, targets of make."""

import re
import shlex
import subprocess
import sys

from pages import ROOT, blocks, page

from omniroll import cli

README, TUTORIAL, ARCHITECTURE = map(page, ("README.md", "docs/tutorials/first-vehicle.md", "docs/architecture.md"))


def test_the_example_has_ten_lines_and_runs_as_printed(tmp_path):
    example = blocks("python", README)[0]
    assert len(example.splitlines()) <= 10
    done = subprocess.run([sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.rstrip("\n") == blocks("text", README)[0].rstrip("\n")


def test_the_commands_of_the_first_tutorial_do_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks("sh", TUTORIAL)[1:] for line in block.splitlines()]
    assert [cli.main(shlex.split(line.removesuffix(" --open"))[1:]) for line in lines] == [0, 0, 0]
    assert {"picture.png", "runs.html"} <= {path.name for path in (tmp_path / "out/run/my-robot").iterdir()}


def test_the_command_is_on_the_path_before_it_is_used():
    """make puts it into .venv, which a shell must be told of."""
    lines = [line for block in blocks("sh", README) for line in block.splitlines()]
    first = next(number for number, line in enumerate(lines) if line.startswith("omniroll "))
    assert any(line.startswith("source .venv/bin/activate") for line in lines[:first])


def test_every_make_target_that_is_named_exists_and_tells_what_it_does():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"`make ([a-z-]+)`", README + ARCHITECTURE))
    assert sorted(target for target in named if not re.search(rf"^{target}:", makefile, re.MULTILINE)) == []
    (public,) = re.findall(r"^\.PHONY: ((?:.*\\\n)*.*)$", makefile, re.MULTILINE)
    told = set(re.findall(r"^([a-z0-9-]+):.*##", makefile, re.MULTILINE))
    assert set(public.replace("\\", " ").split()) - {"all"} == told
