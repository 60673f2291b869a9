"""Draws what sweeps.md shows: sweep.png.

    python docs/sweep.py        draws it into docs/; docs/site/pictures.py draws it for the site

Takes some seconds. Needs matplotlib.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from omniroll.results import pictures
from omniroll.scenes import sweep_picture
from omniroll.scenes.sweeping import Axis, SceneSweep

SCENE = Path(__file__).parents[1] / "scenes/wheel-spin.toml"
VARIED = ("vehicle.mass=2:3:21", "contact.friction=0.2,0.25,0.3")


def draw(folder: Path) -> None:
    sweep = SceneSweep.of(SCENE, [Axis.read(text) for text in VARIED])
    with matplotlib.rc_context(pictures.STYLE | {"figure.dpi": 90}):
        pictures.save(sweep_picture.sheet(sweep, sweep.run()), folder / "sweep.png")


if __name__ == "__main__":
    draw(Path(__file__).parent)
