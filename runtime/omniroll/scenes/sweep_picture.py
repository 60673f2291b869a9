"""The picture of a sweep: what the ends of its runs say, over one number, or over two as lines or maps. matplotlib."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from omniroll.conventions.twists import twist_of_nu
from omniroll.results.pictures import widen
from omniroll.scenes.sweeping import Axis, SceneSweep
from omniroll.sweeps.ends import Many

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_LINES = 6  # of one panel; more values of a second axis make maps
LINES = "viridis"
PANEL = (4.2, 3.0)  # inches


@dataclass(frozen=True)
class Panel:
    """One quantity at the ends of the runs: values (...), nan of runs that failed; least span of the axis."""

    title: str
    unit: str
    values: np.ndarray
    span: float


def panels(sweep: SceneSweep, many: Many) -> list[Panel]:
    """What is drawn: where the runs end, how fast, and what is left of their energy."""
    end = many.end
    x, y, theta = np.moveaxis(end.pose, -1, 0)
    speeds = zip(sweep.scenes, np.nan_to_num(end.nu).reshape(-1, 3), strict=True)
    twists = np.array([twist_of_nu(scene.vehicle, nu) for scene, nu in speeds])
    speed = np.linalg.norm(twists[:, :2], axis=-1).reshape(x.shape)
    return [
        Panel("x at the end", "m", x, 1e-6),
        Panel("y at the end", "m", y, 1e-6),
        Panel("heading at the end", "rad", theta, 1e-6),
        Panel("speed at the end", "m/s", np.where(np.isnan(x), np.nan, speed), 1e-6),
        Panel("energy at the end", "J", end.energy, 1e-9),
        Panel("wheels that switched", "1", many.switches.astype(float), 1.0),
    ]


def sheet(sweep: SceneSweep, many: Many) -> "Figure | None":
    """Six panels over the varied numbers; None where there are more than two of them. A cross marks a run that
    stopped, whose values are those at the stop."""
    from matplotlib.figure import Figure

    if len(sweep.axes) > 2:
        return None
    figure = Figure(figsize=(3 * PANEL[0], 2 * PANEL[1] + 0.5), layout="constrained")
    maps = len(sweep.axes) == 2 and len(sweep.axes[1].values) > MOST_LINES
    for axis, panel in zip(figure.subplots(2, 3).flat, panels(sweep, many), strict=True):
        (_map if maps else _lines)(axis, sweep.axes, panel, many.stopped)
        axis.set_xlabel(_label(sweep.axes[0]))
    if len(sweep.axes) == 2 and not maps:
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, title=_label(sweep.axes[1]), loc="outside right upper")
    stopped = int(many.stopped.sum())
    text = f"{sweep.name}: {many.stopped.size} runs" + (f", {stopped} of them stopped (crosses)" if stopped else "")
    figure.suptitle(text.replace("$", r"\$"), x=0.01, ha="left", fontsize=13)
    return figure


def _label(axis: Axis) -> str:
    return axis.name.replace("_", " ") + (f", {axis.unit}" if axis.unit not in ("", "1") else "")


def _lines(axis: "Axes", axes: tuple[Axis, ...], panel: Panel, stopped: np.ndarray) -> None:
    """One line for each value of a second axis."""
    import matplotlib

    along = axes[0].values
    others = axes[1].values if len(axes) == 2 else (None,)
    tints = matplotlib.colormaps[LINES](np.linspace(0.1, 0.8, len(others)))
    table, at_stop = panel.values.reshape(len(along), -1), stopped.reshape(len(along), -1)
    for k, value in enumerate(others):
        mark = "o" if len(along) <= 40 else None
        label = None if value is None else f"{value:g}"
        axis.plot(along, table[:, k], color=tints[k], marker=mark, markersize=3, label=label)
        axis.plot(along[at_stop[:, k]], table[at_stop[:, k], k], "x", color="#b03a48", zorder=4)
    axis.set(title=panel.title, ylabel="" if panel.unit == "1" else panel.unit)
    widen(axis, panel.span)


def _map(axis: "Axes", axes: tuple[Axis, ...], panel: Panel, stopped: np.ndarray) -> None:
    """A map over both axes."""
    first, second = (each.values for each in axes)
    drawn = axis.pcolormesh(first, second, panel.values.T, shading="nearest", cmap=LINES)
    where = np.argwhere(stopped)
    axis.plot(first[where[:, 0]], second[where[:, 1]], "x", color="#b03a48")
    axis.figure.colorbar(drawn, ax=axis, label="" if panel.unit == "1" else panel.unit)
    axis.grid(False)
    axis.set(title=panel.title, ylabel=_label(axes[1]))
