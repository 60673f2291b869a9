"""The page in Chromium, driven by Playwright. tests/viewer/requirements.txt has what this needs besides Chromium."""

import io
import shutil

import numpy as np
import pytest

import omniroll
from omniroll.viewer import shown
from viewing.runs import layout, locked, massless, slipping, soccer_kit, times

sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is missing: make test-viewer installs it")
axe = pytest.importorskip(
    "axe_playwright_python.sync_playwright", reason="axe is missing: make test-viewer installs it"
)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")]
QUIET = ("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-sync")
SIZES = {"desk": {"width": 900, "height": 560}, "phone": {"width": 390, "height": 780}}
DRIVER = "GL Driver Message"  # the browser's own word on a machine without a GPU, of every page with WebGL
SLANTS, ROW = (0.6, -0.6, 0.3), 0.012  # rad by wheel; m
SET_TIME = """(slider, time) => {
    slider.value = time;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    return omniroll.page.transport.time;
}"""
WALK = """times => times.map((time) => {
    const slider = document.getElementById("time");
    slider.value = time;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    const { model } = omniroll.page.stage.parts[0];
    return {
        time: omniroll.page.transport.time,
        drawn: model.wheels.map((_, wheel) => model.drawnAngles(wheel)),
        marked: model.wheels.map(({ marked }) => marked),
    };
})"""
DRAWN = "omniroll.page.stage.parts.map(({ model }) => model.wheels.map((_, wheel) => model.drawnAngles(wheel)))"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Pages by name."""
    folder = tmp_path_factory.mktemp("pages")
    kit = soccer_kit(3.0)
    omniroll.view(kit, reactions=omniroll.reactions(kit, height=0.04)).save(folder / "kit.html")
    omniroll.view(layout()).save(folder / "layout.html")
    omniroll.view(massless(), locked()).save(folder / "two.html")
    omniroll.view(slipping()).save(folder / "slipping.html")
    with pytest.MonkeyPatch.context() as patch:  # a page draws the angles and rows that it is told of
        kind = {"roller_angles": SLANTS, "row_offset": ROW}
        patch.setattr(shown, "_kind_of_wheels", lambda vehicle: kind)
        omniroll.view(massless()).save(folder / "kind.html")
    return folder


@pytest.fixture(scope="module")
def chromium():
    with sync_api.sync_playwright() as playwright:
        browsers = {
            "WebGL": playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET),
            "flat": playwright.chromium.launch(executable_path=CHROMIUM, args=[*QUIET, "--disable-3d-apis"]),
        }
        yield browsers
        for browser in browsers.values():
            browser.close()


@pytest.fixture
def opened(chromium, files):
    """A function that opens a page. At the end of the test nothing else was asked for, and no word was said."""
    words, requests, contexts = [], [], []

    def open_page(name, *, size="desk", scheme="light", graphics="WebGL"):
        context = chromium[graphics].new_context(viewport=SIZES[size], color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: words.append(message.text))
        page.on("pageerror", lambda error: words.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto((files / f"{name}.html").as_uri())
        page.wait_for_selector("html[data-drawn] #plots figure canvas", state="attached")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert [word for word in words if DRIVER not in word] == []
    assert all(url.startswith("file:") for url in requests) and len(requests) == len(contexts)


def places(run: omniroll.Trajectory, elapsed: float) -> np.ndarray:
    """(N, n) angles of all rollers on their wheels, from straight down."""
    sample, rollers = run.sample(run.start_time + elapsed), run.vehicle.rollers_per_wheel
    return sample.chi[:, None] + 2 * np.pi * (np.arange(rollers) - sample.contact[:, None]) / rollers


def apart(one, other) -> float:
    return float(np.abs((np.asarray(one) - other + np.pi) % (2 * np.pi) - np.pi).max())


@pytest.mark.parametrize("name, run_of", [("kit", lambda: soccer_kit(3.0)), ("layout", layout)])
def test_the_slider_puts_rollers_where_the_run_has_them(opened, name, run_of):
    page, run = opened(name), run_of()
    wanted = times(run, 40)
    for elapsed, seen in zip(wanted, page.evaluate(WALK, wanted.tolist()), strict=True):
        assert seen["time"] == pytest.approx(elapsed, abs=1e-9)
        assert apart(seen["drawn"], places(run, seen["time"])) < 1e-6
        assert seen["marked"] == run.sample(run.start_time + seen["time"]).contact.tolist()


def test_rollers_are_drawn_at_their_angle_and_in_their_rows(opened):
    """Axes of wheels: x along the axle outward, y across it, z up."""
    page, run = opened("kind"), massless()
    elapsed = page.locator("#time").evaluate(SET_TIME, 3.21)
    drawn = page.evaluate(DRAWN.replace("drawnAngles", "drawnAxes"))[0]
    radius = run.vehicle.roller_axis_radius
    for slant, angles, rollers in zip(SLANTS, places(run, elapsed), drawn, strict=True):
        for k, (angle, roller) in enumerate(zip(angles, rollers, strict=True)):
            rim = np.cos(slant) * np.array([0, np.cos(angle), np.sin(angle)])
            assert roller["axis"] == pytest.approx(rim + [np.sin(slant), 0, 0], abs=1e-6)
            assert roller["row"] == pytest.approx(-ROW if k % 2 else ROW, rel=1e-6)
    patches = page.evaluate("omniroll.page.stage.parts[0].model.wheels.map(({ patch }) => patch.position.x)")
    sample = run.sample(run.start_time + elapsed)
    rows = np.where(sample.contact % 2, -ROW, ROW)
    assert patches == pytest.approx(rows - radius * np.tan(SLANTS) * np.tan(sample.chi), abs=1e-6)


def test_slip_is_an_arrow_along_the_slip(opened):
    """As long as the slip is fast, which decays; the legend has the fastest."""
    page, run = opened("slipping"), slipping()
    fastest = np.linalg.norm(run.slip, axis=-1).max()
    assert f"slip, at most {fastest:.3g} m/s" in page.inner_text("#legend")
    arrows = """omniroll.page.stage.parts[0].model.wheels.map(({ slip }) =>
        [slip.group.visible, slip.head.position.z / slip.scale])"""
    first = page.evaluate(arrows)
    assert [length for _, length in first] == pytest.approx(np.linalg.norm(run.slip[0], axis=-1), rel=1e-4)
    assert all(visible for visible, _ in first)
    page.evaluate(f"({SET_TIME})(document.getElementById('time'), 0.1)")
    later = page.evaluate("[...omniroll.page.runs[0].slipAt(omniroll.page.stage.states[0])]")
    assert np.abs(later).max() < 1e-2 * fastest


def test_two_runs_stand_at_the_same_time(opened):
    page = opened("two")
    elapsed = page.locator("#time").evaluate(SET_TIME, 4.321)
    for drawn, run in zip(page.evaluate(DRAWN), (massless(), locked()), strict=True):
        assert apart(drawn, places(run, elapsed)) < 1e-6
    page.locator("#beside").select_option("beside")
    assert page.locator("#names span").all_inner_texts() == ["massless rollers", "locked rollers, impact"]


def test_play_advances_and_pause_holds(opened):
    page = opened("kit")
    before = page.evaluate(DRAWN)
    page.locator("#play").click()
    page.wait_for_function("omniroll.page.transport.time > 0.02")
    page.locator("#play").click()
    page.wait_for_function("!omniroll.page.transport.isPlaying")  # a slow machine is still drawing when click() returns
    held = page.evaluate("omniroll.page.transport.time")
    assert apart(page.evaluate(DRAWN), np.array(before)) > 1e-3
    page.wait_for_timeout(200)
    assert page.evaluate("omniroll.page.transport.time") == held
    assert page.locator("#clock").inner_text() == f"{held:.3f} s"


def test_keys_and_ticks_jump_to_switches(opened):
    page, run = opened("kit"), soccer_kit(3.0)
    switches = np.unique(run.elapsed[1:][(run.contact[1:] != run.contact[:-1]).any(axis=1)])
    time = "omniroll.page.transport.time"
    for expected in (switches[0], switches[1]):
        page.keyboard.press("]")
        assert page.evaluate(time) == expected
    page.keyboard.press("[")
    assert page.evaluate(time) == switches[0]
    page.keyboard.press("End")
    assert page.evaluate(time) == run.elapsed[-1]
    over = page.locator("#plots .u-over").first
    place = page.evaluate("time => omniroll.page.plots.charts[0].valToPos(time, 'x')", float(switches[3]))
    over.click(position={"x": place + 1, "y": 20})
    assert page.evaluate(time) in switches


@pytest.mark.parametrize("graphics", ["WebGL", "flat"])
def test_the_picture_is_not_blank(opened, graphics):
    """The roller in contact has its colour, and there are many others."""
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    page = opened("kit", graphics=graphics)
    assert page.evaluate("Boolean(omniroll.page.stage.isFlat)") == (graphics == "flat")
    page.locator("#time").evaluate(SET_TIME, 1.0)
    page.wait_for_timeout(500)
    pixels = np.asarray(image.open(io.BytesIO(page.locator("#stage").screenshot())).convert("RGB"), int)
    colours = np.unique(pixels.reshape(-1, 3), axis=0)
    assert len(colours) > 50
    red, green, blue = np.moveaxis(pixels, -1, 0)
    assert ((red > 180) & (green > 100) & (green < 190) & (blue < 80)).sum() > 30


@pytest.mark.parametrize("size, scheme, graphics", [
    ("desk", "light", "WebGL"), ("desk", "dark", "flat"), ("phone", "light", "flat"),
])  # fmt: skip
def test_axe_finds_nothing(opened, size, scheme, graphics):
    page = opened("two" if size == "desk" else "kit", size=size, scheme=scheme, graphics=graphics)
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    page.locator("#help").click()
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
