"""The sources of the documentation's site: every page and every public name is there, no link is dead."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

import omniroll
import omniroll.effects

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if "site" not in page.parts]  # whose links are those of the site


def tool(name: str):
    """A module of docs/site."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f"docs/site/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


assemble, rendering, notebooks = tool("assemble"), tool("rendering"), tool("notebooks")


@pytest.fixture(scope="module")
def sources(tmp_path_factory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("site")
    made = tmp_path_factory.mktemp("notebooks")
    (made / "first-vehicle.ipynb").write_text("{}")
    assemble.main(folder, None, made)
    assert (folder / "files/notebooks/first-vehicle.ipynb").read_text() == "{}"
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in folder.rglob("*.md")}


def test_every_page_has_a_place_in_the_contents(sources):
    contents = re.findall(r"^```{toctree}\n(?::[^\n]*\n)*\n(.*?)^```", sources["index.md"], re.MULTILINE | re.DOTALL)
    listed = [f"{name}.md" for block in contents for name in block.split()]
    assert sorted([*listed, "index.md"]) == sorted(sources) and len(contents) == 4


def test_a_tutorial_is_a_notebook_to_download(sources):
    link = "[This page as a notebook of Jupyter](path:/files/notebooks/first-vehicle.ipynb)\n"
    assert sources["tutorials/first-vehicle.md"].endswith(link)
    page = "# A\n\nSee [b](c.md).\n\n```python\nx = 2\nprint(x)\n```\n\n```text\n3\n```\n\n"
    page += "End.\n\n```python\nx += 1\n```\n"
    title, first, end, second = notebooks.executed([*notebooks.cells_of(page)])
    assert title["source"] == f"# A\n\nSee b.\n\n{notebooks.NEEDS}" and end["source"] == "End."
    assert [cell["execution_count"] for cell in (first, second)] == [1, 2] and second["outputs"] == []
    assert first["outputs"] == [{"output_type": "stream", "name": "stdout", "text": "2\n"}]


@pytest.mark.long
def test_notebooks_print_what_the_tutorials_say(tmp_path):
    made = notebooks.main(tmp_path)
    pages = (ROOT / "docs/tutorials").glob("*.md")
    assert {path.stem for path in made} == {page.stem for page in pages if "```python" in page.read_text("utf-8")}
    for path in made:
        page = (ROOT / "docs/tutorials" / f"{path.stem}.md").read_text(encoding="utf-8")
        printed = [out["text"] for cell in json.loads(path.read_text())["cells"] for out in cell.get("outputs", ())]
        assert "".join(printed) == "".join(re.findall(r"^```text\n(.*?)^```", page, re.MULTILINE | re.DOTALL))


def test_every_public_name_is_in_the_reference(sources):
    named = re.findall(r"auto(?:class|function|exception):: omniroll\.(\w+)", sources["reference/python.md"])
    assert sorted(named) == sorted(omniroll.__all__)


def test_every_command_and_its_options_are_in_the_reference(sources):
    page = sources["reference/command-line.md"]
    assert "## omniroll run\n" in page and "--view" in page and "## omniroll completion\n" in page


def test_a_link_that_leads_nowhere_is_an_error():
    with pytest.raises(FileNotFoundError, match="docs/x.md: gone.md leads nowhere"):
        assemble.with_links("[here](gone.md)", "docs/x.md", "x.md", set())


def anchors(page: Path) -> set[str]:
    """The names by which the page's headings are linked."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_and_to_headings(page):
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#:]+)\)", text)
    assert [target for target in targets if not (page.parent / target).exists()] == []
    for target, heading in re.findall(r"\]\(([\w/.-]*\.md)?#([^)]+)\)", text):
        assert heading in anchors(page.parent / target if target else page) or f'id="{heading}"' in text, heading


def test_what_an_effect_brings_and_says_is_what_the_page_lists():
    page = (ROOT / "docs/adding-an-effect.md").read_text(encoding="utf-8")
    kinds, methods = (re.findall(r"^\| `(\w+)", part, re.MULTILINE) for part in page.split("## 2."))
    registry = (ROOT / "maxima/machinery/effects.mac").read_text(encoding="utf-8").split("The kinds:")[1]
    assert set(kinds) <= set(re.findall(r"^   (\w+)  ", registry.split("*/")[0], re.MULTILINE))
    assert methods and [name for name in methods if not hasattr(omniroll.effects.Effect, name)] == []


@pytest.mark.parametrize("text, wanted", [
    ("[a](theory.md#9-the-switch)", "[a](../theory.md#9-the-switch)"),
    ("[a](../generated/symbols.md)", "[a](../symbols.md)"),
    ("[a](../maxima/derive.mac)", "[a](path:/files/maxima/derive.mac)"),
    ("[a](../maxima)", "a"),
    ("`[a](gone.md)` and\n```toml\n[a](gone.md)\n```\n", "`[a](gone.md)` and\n```toml\n[a](gone.md)\n```\n"),
])  # fmt: skip
def test_links_hold_on_the_site(text, wanted):
    assert assemble.with_links(text, "docs/x.md", "deeper/x.md", set()) == wanted


def test_every_picture_is_drawn_by_a_script_or_where_it_is_measured(sources):
    """Those of the pages, those of the scripts, and those in docs/ are the same."""
    pictures = tool("pictures")
    made = {f"{name.replace('_', '-')}.png" for name in pictures.NAMES} | {f"{name}.png" for name in pictures.MEASURED}
    named = {name for text in sources.values() for name in re.findall(r"!\[[^\]]*\]\(([\w-]+\.png)\)", text)}
    assert named == made == {path.name for path in (ROOT / "docs").glob("*.png")}
    assert all((ROOT / "docs" / f"{name}.py").exists() for name in pictures.NAMES)
