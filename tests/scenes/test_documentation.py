"""docs/scenes.md says what the schema says."""

from pathlib import Path

from omniroll.scene.page import page


def test_the_page_is_written_from_the_schema():
    """Where this fails: python -m omniroll.scene.page docs/scenes.md"""
    text = Path("docs/scenes.md").read_text(encoding="utf-8")
    assert page(text) == text
