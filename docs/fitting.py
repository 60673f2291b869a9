"""Draws fitting.png and fitting-mujoco.png: what the fits on the page fitting.md leave over.

docs/site/pictures.py calls it. Needs matplotlib and MuJoCo.
"""

import re
import sys
from pathlib import Path

PAGE = Path(__file__).with_suffix(".md")
TESTS = PAGE.parents[1] / "tests"


def draw(folder: Path) -> None:
    (example,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    names: dict = {}
    exec(example, names)
    names["fit"].picture(folder / "fitting.png")
    sys.path.insert(0, str(TESTS))
    from identification import mujoco_logs

    mujoco_logs.fit_of(0).picture(folder / "fitting-mujoco.png")
