"""The example of docs/fitting.md prints what the page says."""

import re
from pathlib import Path


def test_the_page_is_true(capsys):
    page = (Path(__file__).parents[2] / "docs/fitting.md").read_text(encoding="utf-8")
    code, printed = (re.search(rf"```{kind}\n(.*?)```", page, re.DOTALL)[1] for kind in ("python", "text"))
    exec(code, {})
    assert capsys.readouterr().out == printed
