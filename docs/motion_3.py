"""Draws motion-3.png: motion 3 of the paper under the default law. docs/site/pictures.py calls it.

Needs matplotlib.
"""

from pathlib import Path

import matplotlib

import omniroll
from omniroll.results import pictures

DURATION = 200.0  # s


def draw(folder: Path) -> None:
    vehicle = omniroll.Vehicle.paper()
    runs = {
        model: omniroll.simulate(vehicle, nu=(1, 0, 1), duration=DURATION, roller_model=model)
        for model in ("massless", "locked", "free")
    }
    with matplotlib.rc_context(pictures.STYLE):
        figure = pictures.sheet(runs, DURATION, "Motion 3, impact at each switch")
        pictures.save(figure, folder / "motion-3.png")
