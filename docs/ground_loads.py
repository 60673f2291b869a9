"""Draws ground-loads.png of ground-contact.md: a tall vehicle that brakes, its loads and its slip.

Takes some seconds. Needs matplotlib. docs/site/pictures.py calls it.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

from omniroll.scenes import load_scene
from omniroll.scenes import run as run_scene

COLOURS = ("#d1651a", "#1f5fa8", "#2a8c4a", "#1f5fa8")
WHERE = ("ahead", "left", "behind", "right")
ROOT = Path(__file__).resolve().parents[1]


def draw(folder: Path) -> None:
    run = run_scene(load_scene(ROOT / "scenes/hard-stop.toml"))
    times = np.linspace(0, run.t[-1], 1200)
    seen = run.sample(times)
    figure, (loads, slips) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    for wheel, (colour, where) in enumerate(zip(COLOURS, WHERE, strict=True)):
        style = {"color": colour, "linestyle": ":" if where == "right" else "-", "label": where}
        loads.plot(times, seen.ground_load[:, wheel], **style)
        slips.plot(times, np.abs(seen.slip[:, wheel, 1]), **style)
    slips.plot(times, run.vehicle.platform_radius * seen.nu[:, 0], color="#6b6b6b", label="the vehicle's speed")
    loads.set(title="loads of the four wheels", xlabel="s", ylabel="N")
    slips.set(title="slip along the rolling directions", xlabel="s", ylabel="m/s")
    loads.legend()
    slips.legend()
    figure.savefig(folder / "ground-loads.png", dpi=110, metadata={"Software": None})
