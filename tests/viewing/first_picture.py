"""How long the page of 20 s of the soccer kit takes to its first picture: python -m viewing.first_picture, in tests/.

The time runs from the navigation to the end of the first drawing, in Chromium without a GPU, each time in a browser
that was just started.
"""

import statistics
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import omniroll
from viewing.runs import soccer_kit
from viewing.test_in_browser import CHROMIUM, QUIET

TIMES = 11
FIRST = "performance.getEntriesByName('omniroll: first picture')[0].startTime"


def seconds() -> list[float]:
    """The times in s, one for each browser."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = omniroll.view(soccer_kit(20.0)).save(Path(folder, "view.html"))
        found = []
        for _ in range(TIMES):
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
            page = browser.new_page(viewport={"width": 1400, "height": 860})
            page.goto(file.as_uri())
            page.wait_for_selector("html[data-drawn]")
            found.append(page.evaluate(FIRST) / 1e3)
            browser.close()
        return sorted(found)


if __name__ == "__main__":
    found = seconds()
    range_of = f"{found[0]:.2f} to {found[-1]:.2f} s"
    print(f"first picture after {statistics.median(found):.2f} s (median of {TIMES}; {range_of})")
