"""Draws fitting-mujoco.png: what a fit to a log of MuJoCo leaves over, for fitting.md. docs/site/pictures.py calls it.

Needs matplotlib and MuJoCo.
"""

import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1] / "tests"


def draw(folder: Path) -> None:
    sys.path.insert(0, str(TESTS))
    from identification import mujoco_logs

    mujoco_logs.fit_of(0, mujoco_logs.FEW_SPHERES).picture(folder / "fitting-mujoco.png")
