"""docs/conventions.md: its examples print what it says."""

import re
from pathlib import Path

PAGE = (Path(__file__).resolve().parents[2] / "docs/conventions.md").read_text(encoding="utf-8")


def blocks(language):
    return "".join(re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))


def test_the_examples_print_what_the_page_says(capsys):
    exec(blocks("python"), {})
    assert capsys.readouterr().out == blocks("text")
