"""Draws fitting.png: what the fit on the page fitting.md leaves over. docs/site/pictures.py calls it.

Needs matplotlib.
"""

import re
from pathlib import Path

PAGE = Path(__file__).with_suffix(".md")


def draw(folder: Path) -> None:
    (example,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    names: dict = {}
    exec(example, names)
    names["fit"].picture(folder / "fitting.png")
