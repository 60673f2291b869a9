"""Every example on every page: Python prints what the page says, commands and scenes are ones that omniroll takes."""

import shlex
import tomllib
import warnings
from pathlib import Path

import pages
import pytest

from omniroll import cli
from omniroll.scenes.schema import KIND_OF_WHEEL, KINDS, TABLES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LONG = ("docs/sensitivities",)  # compile what follows derivatives
BEFORE = {"docs/scenes": "omniroll run scenes/motion-3.toml --stream"}  # commands of a page that its examples follow


def blocks(language: str, page: Path) -> list[str]:
    return pages.blocks(language, page.read_text(encoding="utf-8"))


def with_blocks(language: str) -> list:
    found = [page for page in PAGES if blocks(language, page)]
    names = {page.relative_to(ROOT).with_suffix("").as_posix(): page for page in found}
    return [pytest.param(page, id=name, marks=[pytest.mark.long] * (name in LONG)) for name, page in names.items()]


@pytest.mark.parametrize("page", with_blocks("python"))
def test_examples_one_after_the_other_print_what_the_page_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    command = BEFORE.get(page.relative_to(ROOT).with_suffix("").as_posix())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if command:
            assert command in "".join(blocks("sh", page)) and cli.main(command.split()[1:]) == 0
            capsys.readouterr()
        exec(compile("".join(blocks("python", page)), str(page), "exec"), {"__name__": "__main__"})
    printed = "".join(f"{line}\n" for line in capsys.readouterr().out.splitlines())
    assert printed == "".join(blocks("text", page))


@pytest.mark.parametrize("page", with_blocks("sh"))
def test_commands_are_ones_that_the_command_line_takes(page):
    lines = [line.split(" # ")[0].strip() for block in blocks("sh", page) for line in block.splitlines()]
    for line in filter(lambda line: line.startswith("omniroll "), lines):
        assert cli.parser().parse_args(shlex.split(line.split(" > ")[0])[1:]).run, line


@pytest.mark.parametrize("page", with_blocks("toml"))
def test_scenes_have_tables_and_keys_that_there_are(page):
    for block in blocks("toml", page):
        for table, keys in tomllib.loads(block).items():
            of_kinds = [KIND_OF_WHEEL.key(name) for kind in keys.pop(KINDS, {}).values() for name in kind]
            assert None not in [*of_kinds, *map(TABLES[table].key, keys)]
