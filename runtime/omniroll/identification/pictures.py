"""Pictures of fits: what the fitted model leaves over. They need matplotlib."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omniroll import extras
from omniroll.identification.log import ENTRIES, Log
from omniroll.results.pictures import STYLE, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NOISE = 2  # deviations that are shown as a band
COLOURS = ("#1f5fa8", "#d1651a", "#3d8c40", "#8a5fb0", "#6b6b6b", "#b03060")


def draw_residuals(
    logs: Sequence[Log],
    residuals: Sequence[Mapping[str, np.ndarray]],
    noises: Sequence[Mapping[str, float]],
    path: Path,
) -> Path:
    """Residuals over time: a row for each reading, a column for each log. Its path.

    Raises MissingPackageError without matplotlib.
    """
    matplotlib = extras.needed("matplotlib", "plots", "a picture")
    from matplotlib.figure import Figure

    channels = list(dict.fromkeys(name for left in residuals for name in left))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9 * len(logs), 2.2 * len(channels) + 0.8), layout="constrained")
        axes = figure.subplots(len(channels), len(logs), sharex="col", sharey="row", squeeze=False)
        for column, (log, left, noise) in enumerate(zip(logs, residuals, noises, strict=True)):
            for row, name in enumerate(channels):
                if name in left:
                    _panel(axes[row, column], log, name, left[name], noise[name])
                else:
                    axes[row, column].axis("off")
            axes[-1, column].set_xlabel("t, s")
        figure.suptitle("What the fitted model leaves over", x=0.01, ha="left", fontsize=13)
        return save(figure, path)


def _panel(axis: "Axes", log: Log, name: str, left: np.ndarray, noise: float) -> None:
    """The residuals of one reading, with the band of its noise."""
    columns = left.reshape(len(left), -1).T
    for k, (column, colour) in enumerate(zip(columns, COLOURS * len(columns), strict=False), 1):
        label = f"{k}" if len(columns) > 1 else None
        axis.plot(log.t, column, ".", markersize=2, color=colour, label=label)
    axis.axhspan(-NOISE * noise, NOISE * noise, color="#d8e4f2", zorder=0)
    size = float(np.sqrt(np.mean(left**2))) / noise
    title = f"{name}, {log.name}: {size:.3g} times the noise of {noise:.3g} {ENTRIES[name].unit}"
    axis.set(title=title, ylabel=ENTRIES[name].unit, xlim=(log.t[0], log.t[-1]))
    if len(columns) > 1:
        axis.legend(loc="upper right", ncols=len(columns), markerscale=4)
