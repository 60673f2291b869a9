"""docs/scenes.md says what the schema says; docs/adding-an-effect.md what the code says; links lead somewhere."""

import re
from pathlib import Path

import pytest

from omniroll.effects import Effect
from omniroll.scenes.page import page

PAGES = ("scenes", "adding-an-effect", "accuracy", "accuracy-motion-3", "reactions", "theory", "architecture")


def test_the_page_is_written_from_the_schema():
    """Where this fails: python -m omniroll.scenes.page docs/scenes.md"""
    text = Path("docs/scenes.md").read_text(encoding="utf-8")
    assert page(text) == text


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#:]+)\)", Path(f"docs/{page}.md").read_text(encoding="utf-8"))
    assert targets and [target for target in targets if not Path("docs", target).exists()] == []


def anchors(page: Path) -> set[str]:
    """The names by which the page's headings are linked."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", ["README.md", *(f"docs/{name}.md" for name in PAGES)])
def test_links_to_headings_lead_to_headings(page):
    links = re.findall(r"\]\(([\w/.-]*\.md)?#([^)]+)\)", Path(page).read_text(encoding="utf-8"))
    pages = [Path(page).parent / target if target else Path(page) for target, _ in links]
    assert [link for link, there in zip(links, pages, strict=True) if link[1] not in anchors(there)] == []


def test_what_an_effect_brings_and_says_is_what_the_page_lists():
    page = Path("docs/adding-an-effect.md").read_text(encoding="utf-8")
    kinds, methods = (re.findall(r"^\| `(\w+)", part, re.MULTILINE) for part in page.split("## 2."))
    registry = Path("maxima/machinery/effects.mac").read_text(encoding="utf-8").split("The kinds:")[1]
    assert set(kinds) <= set(re.findall(r"^   (\w+)  ", registry.split("*/")[0], re.MULTILINE))
    slope = Path("maxima/effects/slope.mac").read_text(encoding="utf-8")
    assert kinds == sorted(re.findall(r"^brings\(\"slope\", '(\w+)", slope, re.MULTILINE), key=kinds.index)
    assert methods and [name for name in methods if not hasattr(Effect, name)] == []
