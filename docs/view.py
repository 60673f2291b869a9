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
SIZE = "1180,640"
TIME = 7.3  # s
GO_THERE = """<script>
const waiting = setInterval(() => {
    if (!document.documentElement.hasAttribute("data-drawn")) return;
    clearInterval(waiting);
    omniroll.page.transport.go(%g);
}, 50);
</script>"""


def draw(folder: Path) -> None:
    run = omniroll.run(omniroll.load_scene(ROOT / "scenes/robot-soccer-kit.toml"), duration=20)
    page = omniroll.view(run, reactions=omniroll.reactions(run, height=0.04), title="Robot Soccer Kit")
    with tempfile.TemporaryDirectory() as aside:
        file = Path(aside, "view.html")
        file.write_text(page.html.replace("</body>", f"{GO_THERE % TIME}</body>"), encoding="utf-8")
        options = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--hide-scrollbars"]
        options += [f"--user-data-dir={aside}/profile", f"--window-size={SIZE}", "--virtual-time-budget=8000"]
        options += [f"--screenshot={folder / 'view.png'}", file.as_uri()]
        subprocess.run([CHROMIUM, *options], check=True, capture_output=True, timeout=120)
