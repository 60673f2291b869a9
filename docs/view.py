"""Draws docs/view.png: the page of `omniroll view` with the soccer kit's vehicle.

    python docs/view.py

Needs Chromium and tests/viewing/requirements.txt.
"""

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import omniroll

ROOT = Path(__file__).resolve().parents[1]
SIZE = {"width": 1180, "height": 640}
TIME = 7.3  # s


def draw(path: Path) -> None:
    """Write the picture."""
    run = omniroll.run(omniroll.load_scene(ROOT / "scenes/robot-soccer-kit.toml"), duration=20)
    page = omniroll.view(run, reactions=omniroll.reactions(run, height=0.04), title="Robot Soccer Kit")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = page.save(Path(folder, "view.html"))
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        tab = browser.new_page(viewport=SIZE)
        tab.goto(file.as_uri())
        tab.wait_for_selector("html[data-drawn] #plots figure canvas", state="attached")
        tab.evaluate(f"omniroll.page.transport.go({TIME})")
        tab.wait_for_timeout(1000)
        tab.screenshot(path=path)
        browser.close()


if __name__ == "__main__":
    draw(ROOT / "docs/view.png")
