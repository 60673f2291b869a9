"""Pictures of trajectories: the centre's path, the heading, the energy and nu over time. They need matplotlib."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Trajectory = Any  # omniroll.results.trajectory.Trajectory, whose method plot comes here

STYLE = {
    "figure.dpi": 130,
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#888888",
    "axes.labelcolor": "#333333",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "xtick.color": "#666666",
    "ytick.color": "#666666",
    "legend.frameon": False,
    "mathtext.fontset": "cm",
}
COLOURS = {"massless": "#6b6b6b", "locked": "#1f5fa8", "free": "#d1651a"}
TINTS = ("#1f5fa8", "#d1651a", "#3f8f4f", "#8b4fa0", "#b03a48", "#6b6b6b")  # of wheels
DASHES = {"smooth": "-", "impact": (0, (4, 1.6)), "slip": (0, (5, 1, 1, 1))}
SHORT = 10.0  # s: in so short a time some twenty switches can be told apart, and lines are drawn thick
MANY = 1000.0  # mJ that are drawn in J
MOST_MARKS = 60  # switches that are marked; the lines of more of them would merge
TIME_PANELS: dict[str, tuple[str, str, Callable[[Any], np.ndarray], float]] = {
    # panel: title, unit, what is drawn, smallest span of the axis
    "theta": (r"heading $\theta$", "rad", lambda rows: rows.pose[:, 2], 1e-3),
    "energy": ("kinetic energy", "mJ", lambda rows: 1e3 * rows.energy, 1e-2),
    "nu_1": (r"$\nu_1$, forward", "1/s", lambda rows: rows.nu[:, 0], 1e-3),
    "nu_2": (r"$\nu_2$, sideways", "1/s", lambda rows: rows.nu[:, 1], 1e-3),
    "nu_3": (r"$\nu_3 = \Lambda\theta'$", "1/s", lambda rows: rows.nu[:, 2], 1e-3),
}
PANELS = (
    ("path", "path", "theta", "energy"),
    ("path", "path", "nu_1", "nu_2"),
    ("path", "path", "nu_3", "key"),
)


def line_style(run: Trajectory, is_alone: bool = False) -> dict[str, Any]:
    """Colour by roller model, dashes by switching law.

    The dots of massless rollers are drawn over the other lines. A line that is alone is solid.
    """
    massless = run.roller_model == "massless"
    dashes = (0, (1, 1.2)) if massless else DASHES[run.switching]
    return {
        "color": COLOURS[run.roller_model],
        "linestyle": "-" if is_alone else dashes,
        "zorder": 3 if massless else 2,
    }


def rows_between(run: Trajectory, end: float, points: int = 1500) -> SimpleNamespace:
    """t, nu, pose and energy of `run` up to `end`: its own rows, with `points` samples among them.

    Both rows of a switch stay, in their order, so that a step is drawn as a step.
    """
    grid = np.linspace(run.t[0], end, points)
    samples, shown = run.sample(grid), run.t <= end
    order = np.argsort(np.concatenate([run.t[shown], grid]), kind="stable")
    merged = {"t": np.concatenate([run.t[shown], grid])[order]}
    for name in ("nu", "pose", "energy"):
        merged[name] = np.concatenate([getattr(run, name)[shown], getattr(samples, name)])[order]
    return SimpleNamespace(**merged)


def widen(axis: "Axes", span: float) -> None:
    """Let the axis show at least `span`, so that rounding does not look like motion."""
    low, high = axis.get_ylim()
    if high - low < span:
        middle = (low + high) / 2
        axis.set_ylim(middle - span / 2, middle + span / 2)


def sheet(runs: Mapping[str, Trajectory], end: float, title: str) -> "Figure":
    """Path, heading, energy and nu of some runs up to the time `end`, in s.

    runs  trajectories by the labels of their lines; all start with the same nu

    On a short interval thin lines mark the switches of the last run, unless there are too many of them.
    """
    from matplotlib.lines import Line2D

    lines = [
        (line_style(run, len(runs) == 1) | {"label": label}, rows_between(run, end)) for label, run in runs.items()
    ]
    last_label, last = list(runs.items())[-1]
    marks = _can_be_told_apart(last, end)
    figure, axes = panels_of(lines)
    if marks:
        for panel in TIME_PANELS:
            _mark_switches(axes[panel], last, end)
    handles, labels = axes["path"].get_legend_handles_labels()
    if marks:
        handles.append(Line2D([], [], color="#b9c9de", linewidth=1))
        labels.append(f"change of contact ({last_label})")
    start = ", ".join(f"{value:g}" for value in last.nu[0])
    axes["key"].axis("off")
    key_title = rf"$\nu(0)$ = ({start}) 1/s"
    axes["key"].legend(handles, labels, loc="center left", title=key_title, alignment="left")
    figure.suptitle(title, x=0.01, ha="left", fontsize=13)
    return figure


def panels_of(lines: list[tuple[dict[str, Any], SimpleNamespace]]) -> "tuple[Figure, dict[str, Axes]]":
    """A figure with the path, heading, energy and nu of lines (style, rows of t, nu, pose and energy), and its axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 7), layout="constrained")
    axes = figure.subplot_mosaic([list(row) for row in PANELS])
    _draw_path(axes["path"], lines)
    for panel in TIME_PANELS:
        _draw_over_time(axes[panel], panel, lines)
    for panel in ("nu_2", "nu_3"):
        axes[panel].set_xlabel("t, s")
    return figure, axes


def save(figure: "Figure", path: Path) -> Path:
    """Write a figure as PNG; its path."""
    figure.savefig(path, format="png", metadata={"Software": None})
    return path


def _draw_path(axis: "Axes", lines: list[tuple[dict, SimpleNamespace]]) -> None:
    """The centre's path in the plane, equal scales, start marked."""
    for style, rows in lines:
        axis.plot(rows.pose[:, 0], rows.pose[:, 1], **style)
    axis.plot(*lines[0][1].pose[0, :2], "o", color="#222222", markersize=4, zorder=4)
    axis.set(title="path of the centre $S$", xlabel="x, m", ylabel="y, m")
    axis.margins(0.06)
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    half = max(right - left, high - low, 0.02) / 2
    axis.set_xlim((left + right) / 2 - half, (left + right) / 2 + half)
    axis.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)
    axis.set_aspect("equal")
    axis.locator_params(nbins=6)


def _draw_over_time(axis: "Axes", panel: str, lines: list[tuple[dict, SimpleNamespace]]) -> None:
    """One quantity of TIME_PANELS over time."""
    title, unit, drawn, span = TIME_PANELS[panel]
    factor = 1.0
    if unit == "mJ" and max(float(np.abs(drawn(rows)).max()) for _, rows in lines) >= MANY:
        unit, factor = "J", 1e-3
    for style, rows in lines:
        axis.plot(rows.t, factor * drawn(rows), linewidth=1.3 if rows.t[-1] <= SHORT else 0.9, **style)
    axis.set(title=title, ylabel=unit, xlim=(lines[0][1].t[0], lines[0][1].t[-1]))
    widen(axis, factor * span)


def _can_be_told_apart(run: Trajectory, end: float) -> bool:
    """Whether the switches of `run` up to `end` are few enough to be marked."""
    return end <= SHORT and np.count_nonzero(run.switches["t"] <= end) <= MOST_MARKS


def _mark_switches(axis: "Axes", run: Trajectory, end: float) -> None:
    """Thin lines where a wheel of `run` changes its roller, up to `end`."""
    times = run.switches["t"]
    for time in times[times <= end]:
        axis.axvline(time, color="#b9c9de", linewidth=0.6, zorder=0)
