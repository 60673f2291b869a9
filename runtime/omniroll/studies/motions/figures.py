"""The pictures of the paper's motions, in the style of omniroll.results.pictures. They need matplotlib."""

from typing import TYPE_CHECKING

import numpy as np

from omniroll.results import pictures
from omniroll.studies.motions.cases import LONG, MASSLESS, Motion, Runs, Setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def sheet(motion: Motion, settings: list[Setting], runs: Runs, end: float, title: str) -> "Figure":
    """Path, heading, energy and nu of one motion under `settings`, up to `end`."""
    return pictures.sheet({setting.label: runs[motion.number, setting.key] for setting in settings}, end, title)


def laws_sheet(motion: Motion, settings: list[Setting], runs: Runs) -> "Figure":
    """Energy and distance from the massless path under both switching laws, over the long interval."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 3.6), layout="constrained")
    energy, apart = figure.subplots(1, 2)
    massless = runs[motion.number, MASSLESS.key]
    for setting in settings:
        run = runs[motion.number, setting.key]
        other = massless.sample(run.t).pose
        style = pictures.line_style(run) | {"label": setting.label}
        energy.plot(run.t, 100 * (run.energy / run.energy[0] - 1), **style)
        apart.plot(run.t, np.hypot(*(run.pose - other)[:, :2].T), **style)
    energy.set(title="kinetic energy, change since the start", ylabel="%")
    apart.set(title="distance of the centre from the massless one", ylabel="m")
    for axis in (energy, apart):
        axis.set(xlabel="t, s", xlim=(0, LONG))
        pictures.widen(axis, 1e-3)
    energy.legend()
    figure.suptitle(f"Motion {motion.number}: the two switching laws", x=0.01, ha="left", fontsize=13)
    return figure
