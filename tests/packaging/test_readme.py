"""What README.md and the pages with examples promise is so: commands, examples, links."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from omniroll import cli

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


TUTORIALS = ("first-vehicle", "motor-and-controller", "what-accuracy-costs", "one-assumption")
EXAMPLES = (
    "sessions",
    "linearising",
    "sensitivities",
    "fitting",
    "viewing",
    "tables",
    "path-following",
    "gymnasium",
    *(f"tutorials/{name}" for name in TUTORIALS),
)
PAGES = {name: (ROOT / f"docs/{name}.md").read_text(encoding="utf-8") for name in EXAMPLES}


def blocks(language: str, page: str = README) -> list[str]:
    """The fenced code blocks of one language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)


def test_the_first_commands_are_make_and_make_test():
    commands = [line.split("#")[0].strip() for line in blocks("sh")[0].splitlines()]
    assert commands == ["make", "make test"]


def test_the_example_has_ten_lines_and_runs_as_printed(tmp_path):
    example = blocks("python")[0]
    assert len(example.splitlines()) <= 10
    done = subprocess.run([sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.rstrip("\n") == blocks("text")[0].rstrip("\n")


@pytest.mark.parametrize("page", [README, *PAGES.values()], ids=["README", *PAGES])
def test_the_examples_one_after_the_other_run_as_printed(tmp_path, page):
    done = subprocess.run(
        [sys.executable, "-c", "".join(blocks("python", page))], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "".join(blocks("text", page))


def test_links_and_pictures_lead_to_files():
    targets = re.findall(r"\]\(([^)#:]+)\)", README)
    assert targets and [target for target in targets if not (ROOT / target).exists()] == []


@pytest.mark.parametrize("page", [README, *PAGES.values()], ids=["README", *PAGES])
def test_commands_are_ones_that_the_command_line_takes(page):
    lines = [line.split("#")[0].strip() for block in blocks("sh", page) for line in block.splitlines()]
    for line in filter(lambda line: line.startswith("omniroll "), lines):
        assert cli.parser().parse_args(shlex.split(line)[1:]).run, line


def test_the_commands_of_the_first_tutorial_do_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks("sh", PAGES["tutorials/first-vehicle"])[1:] for line in block.splitlines()]
    assert [cli.main(shlex.split(line.removesuffix(" --open"))[1:]) for line in lines] == [0, 0, 0]
    assert {"picture.png", "runs.html"} <= {path.name for path in (tmp_path / "out/run/my-robot").iterdir()}


def test_the_command_is_on_the_path_before_it_is_used():
    """make puts it into .venv, which a shell must be told of."""
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    first = next(number for number, line in enumerate(lines) if line.startswith("omniroll "))
    assert any(line.startswith("source .venv/bin/activate") for line in lines[:first])


def test_every_make_target_that_it_names_exists():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"`make ([a-z-]+)`", README))
    assert sorted(target for target in named if not re.search(rf"^{target}:", makefile, re.MULTILINE)) == []
