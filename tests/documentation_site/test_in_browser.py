"""The site that `make docs` builds, in Chromium: front page, tutorial, reference and search, without a network."""

import shutil
from pathlib import Path

import pytest

sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is missing: make test-docs installs it")
SITE = Path(__file__).parents[2] / "out/site"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
    pytest.mark.skipif(not (SITE / "index.html").exists(), reason="the site is not built: make docs"),
]
QUIET = ("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-sync")


@pytest.fixture(scope="module")
def chromium():
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium):
    """A function that opens a page of the site. At the end nothing was asked of the network, and no error was said."""
    context = chromium.new_context()
    words, requests = [], []

    def open_page(name: str):
        page = context.new_page()
        page.on("console", lambda word: words.append(word.text) if word.type == "error" else None)
        page.on("pageerror", lambda error: words.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto((SITE / f"{name}.html").as_uri())
        return page

    yield open_page
    context.close()
    assert words == [] and [url for url in requests if not url.startswith(("file:", "data:"))] == []


def test_the_front_page_leads_to_the_first_tutorial(opened):
    page = opened("index")
    assert page.evaluate("document.querySelector('article img').naturalWidth") > 500
    page.get_by_role("link", name="the first tutorial").click()
    assert page.title().startswith("From nothing to a moving vehicle")
    assert "omniroll new my-robot.toml" in page.inner_text("article")


def test_a_tutorial_shows_code_and_what_it_prints(opened):
    page = opened("tutorials/motor-and-controller")
    assert page.locator("div.highlight-python").count() >= 3 and page.locator("div.highlight-text").count() >= 3


def test_the_reference_has_a_place_for_a_method(opened):
    page = opened("reference/python")
    entry = page.locator("#omniroll\\.Trajectory\\.sample")
    assert "sample" in entry.inner_text()
    assert "within the run" in entry.locator("xpath=..").inner_text()


def test_mathematics_is_set(opened):
    page = opened("theory")
    page.wait_for_function("document.querySelectorAll('mjx-container').length > 50")
    assert page.locator("mjx-merror").count() == 0 and "$`" not in page.inner_text("article")


@pytest.mark.parametrize("words, first, line", [
    ("energy ledger", "", "ledger"),
    ("tracking wheels", "What instruments on the robot read", "wheel"),
    ("fit", "How to fit a model to what a robot has recorded", "fit"),
    ("motor", "A motor and a controller", "motor"),
])  # fmt: skip
def test_the_search_shows_lines_and_the_page_of_the_subject_first(opened, words, first, line):
    page = opened("search")
    page.goto((SITE / "search.html").as_uri() + f"?q={words.replace(' ', '+')}")
    page.wait_for_function("document.querySelector('.search-summary')?.innerText.includes('finished')")
    found = page.locator("ul.search > li")
    assert first in found.first.locator("a").first.inner_text()
    page.wait_for_function("document.querySelector('ul.search p.context')")
    assert line in page.locator("ul.search p.context").first.inner_text().lower()
