"""Draws view.png: the page of `omniroll view` with the soccer kit's vehicle. docs/site/pictures.py calls it.

Needs Chromium.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import omniroll

ROOT = Path(__file__).resolve().parents[1]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
WIDTH, HEIGHT = 1180, 640
TIME = 7.3  # s
# Chromium takes its picture at a moment of its own, in a window that it has just made higher, and what WebGL drew may
# be gone then. So the page has the picture's height from the start, and an image holds what was drawn.
GO_THERE = """<style>html { height: %dpx }</style>
<script>
const waiting = setInterval(() => {
    if (!document.documentElement.hasAttribute("data-drawn")) return;
    clearInterval(waiting);
    const { transport, stage } = omniroll.page, { canvas } = stage;
    transport.go(%g);
    stage.draw();
    const held = new Image();
    held.src = canvas.toDataURL();
    held.style = "position: absolute; inset: 0; width: 100%%; height: 100%%";
    canvas.replaceWith(held);
}, 50);
</script>"""


def draw(folder: Path) -> None:
    run = omniroll.run(omniroll.load_scene(ROOT / "scenes/robot-soccer-kit.toml"), duration=20)
    page = omniroll.view(run, reactions=omniroll.reactions(run, height=0.04), title="Robot Soccer Kit")
    with tempfile.TemporaryDirectory() as aside:
        file = Path(aside, "view.html")
        file.write_text(page.html.replace("</body>", f"{GO_THERE % (HEIGHT, TIME)}</body>"), encoding="utf-8")
        options = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--hide-scrollbars"]
        options += [f"--user-data-dir={aside}/profile", f"--window-size={WIDTH},{HEIGHT}", "--virtual-time-budget=8000"]
        options += [f"--screenshot={folder / 'view.png'}", file.as_uri()]
        subprocess.run([CHROMIUM, *options], check=True, capture_output=True, timeout=120)
