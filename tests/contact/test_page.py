"""docs/ground-contact.md: its example prints what it says."""

import re
from pathlib import Path

PAGE = (Path(__file__).resolve().parents[2] / "docs/ground-contact.md").read_text(encoding="utf-8")


def test_the_example_prints_what_the_page_says(capsys):
    example, printed = (
        re.search(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1] for language in ("python", "text")
    )
    exec(example, {})
    assert capsys.readouterr().out == printed
