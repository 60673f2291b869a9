"""docs/scenes.md says what the schema says; docs/adding-an-effect.md what the code says."""

import re
from pathlib import Path

import pytest

from omniroll.effects import Effect
from omniroll.scenes.page import page


def test_the_page_is_written_from_the_schema():
    """Where this fails: python -m omniroll.scenes.page docs/scenes.md"""
    text = Path("docs/scenes.md").read_text(encoding="utf-8")
    assert page(text) == text


@pytest.mark.parametrize("page", ["scenes", "adding-an-effect", "accuracy", "accuracy-motion-3"])
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#:]+)\)", Path(f"docs/{page}.md").read_text(encoding="utf-8"))
    assert targets and [target for target in targets if not Path("docs", target).exists()] == []


def test_what_an_effect_brings_and_says_is_what_the_page_lists():
    page = Path("docs/adding-an-effect.md").read_text(encoding="utf-8")
    kinds, methods = (re.findall(r"^\| `(\w+)", part, re.MULTILINE) for part in page.split("## 2."))
    registry = Path("maxima/machinery/effects.mac").read_text(encoding="utf-8").split("The kinds:")[1]
    assert set(kinds) <= set(re.findall(r"^   (\w+)  ", registry.split("*/")[0], re.MULTILINE))
    slope = Path("maxima/effects/slope.mac").read_text(encoding="utf-8")
    assert kinds == sorted(re.findall(r"^brings\(\"slope\", '(\w+)", slope, re.MULTILINE), key=kinds.index)
    assert methods and [name for name in methods if not hasattr(Effect, name)] == []
