"""Draws urdf-mjcf.png, a scene beside MuJoCo, as the command on the page does. docs/site/pictures.py calls it.

Needs matplotlib and MuJoCo.
"""

from pathlib import Path

import omniroll
from omniroll.studies.beside_mujoco import beside_mujoco

SCENE = Path(__file__).parents[1] / "scenes/driven.toml"


def draw(folder: Path) -> None:
    beside_mujoco(omniroll.load_scene(SCENE), step=5e-4, duration=2.0).draw(folder / "urdf-mjcf.png")
