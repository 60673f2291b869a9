"""The pictures: one sheet per motion and interval, in one style."""

from pathlib import Path
from types import SimpleNamespace

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from omniroll.studies.motions.cases import LONG, MASSLESS, SHORT, Motion, Runs, Setting

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
MOST_MARKS = 60  # changes of contact that are marked; more make a wall
DASHES = {"smooth": "-", "impact": (0, (4, 1.6))}
TIME_PANELS = {  # key: (title, unit, column, smallest span shown)
    "theta": (r"heading $\theta$", "rad", lambda run: run.pose[:, 2], 1e-3),
    "energy": ("kinetic energy", "mJ", lambda run: 1e3 * run.energy, 1e-2),
    "nu_1": (r"$\nu_1$, forward", "1/s", lambda run: run.nu[:, 0], 1e-3),
    "nu_2": (r"$\nu_2$, sideways", "1/s", lambda run: run.nu[:, 1], 1e-3),
    "nu_3": (r"$\nu_3 = \Lambda\theta'$", "1/s", lambda run: run.nu[:, 2], 1e-3),
}
SHEET = (
    ("path", "path", "theta", "energy"),
    ("path", "path", "nu_1", "nu_2"),
    ("path", "path", "nu_3", "key"),
)


def line_style(setting: Setting) -> dict:
    """Colour by roller model, dashes by switching law; the massless reference is drawn below the others."""
    massless = setting.roller_model == "massless"
    return {
        "color": COLOURS[setting.roller_model],
        "linestyle": (0, (1, 1.2)) if massless else DASHES[setting.switching],
        "zorder": 3 if massless else 2,
        "label": setting.label,
    }


def dense(run, end: float, points: int = 1500) -> SimpleNamespace:
    """t, nu, pose and energy of `run` up to `end`: its own rows, with samples between them.

    Both rows of a switch stay, in their order, so that a step is drawn as a step.
    """
    grid = np.linspace(run.t[0], end, points)
    samples, shown = run.sample(grid), run.t <= end
    order = np.argsort(np.concatenate([run.t[shown], grid]), kind="stable")
    merged = {"t": np.concatenate([run.t[shown], grid])[order]}
    for name in ("nu", "pose", "energy"):
        merged[name] = np.concatenate([getattr(run, name)[shown], getattr(samples, name)])[order]
    return SimpleNamespace(**merged)


def widen(axis: Axes, span: float) -> None:
    """Let the axis show at least `span`, so that rounding does not look like motion."""
    low, high = axis.get_ylim()
    if high - low < span:
        middle = (low + high) / 2
        axis.set_ylim(middle - span / 2, middle + span / 2)


def draw_path(axis: Axes, curves: list[tuple[Setting, SimpleNamespace]]) -> None:
    """The centre's path in the plane, equal scales, start marked."""
    for setting, rows in curves:
        axis.plot(rows.pose[:, 0], rows.pose[:, 1], **line_style(setting))
    axis.plot(*curves[0][1].pose[0, :2], "o", color="#222222", markersize=4, zorder=4)
    axis.set(title="path of the centre $S$", xlabel="x, m", ylabel="y, m")
    axis.margins(0.06)
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    half = max(right - left, high - low, 0.02) / 2
    axis.set_xlim((left + right) / 2 - half, (left + right) / 2 + half)
    axis.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)
    axis.set_aspect("equal")
    axis.locator_params(nbins=6)


def draw_over_time(axis: Axes, key: str, curves: list[tuple[Setting, SimpleNamespace]]) -> None:
    """One quantity of TIME_PANELS over time."""
    title, unit, column, span = TIME_PANELS[key]
    for setting, rows in curves:
        axis.plot(rows.t, column(rows), linewidth=1.3 if rows.t[-1] <= SHORT else 0.9, **line_style(setting))
    axis.set(title=title, ylabel=unit, xlim=(curves[0][1].t[0], curves[0][1].t[-1]))
    widen(axis, span)


def can_be_told_apart(run, end: float) -> bool:
    """Whether the changes of contact of `run` up to `end` are few enough to be marked."""
    return end <= SHORT and np.count_nonzero(run.switches["t"] <= end) <= MOST_MARKS


def mark_switches(axis: Axes, run, end: float) -> None:
    """Thin lines where a wheel of `run` changes its roller, up to `end`."""
    times = run.switches["t"]
    for time in times[times <= end]:
        axis.axvline(time, color="#b9c9de", linewidth=0.6, zorder=0)


def sheet(motion: Motion, settings: list[Setting], runs: Runs, end: float, title: str) -> Figure:
    """Path, heading, energy and nu of one motion under `settings`, up to `end`.

    On the short interval thin lines mark the changes of contact of the last setting, unless there are too many.
    """
    curves = [(setting, dense(runs[motion.number, setting.key], end)) for setting in settings]
    marked = runs[motion.number, settings[-1].key]
    marks = can_be_told_apart(marked, end)
    figure, axes = plt.subplot_mosaic([list(row) for row in SHEET], figsize=(13, 7), layout="constrained")
    draw_path(axes["path"], curves)
    for key in TIME_PANELS:
        draw_over_time(axes[key], key, curves)
        if marks:
            mark_switches(axes[key], marked, end)
    for key in ("nu_2", "nu_3"):
        axes[key].set_xlabel("t, s")
    handles, labels = axes["path"].get_legend_handles_labels()
    if marks:
        handles.append(plt.Line2D([], [], color="#b9c9de", linewidth=1))
        labels.append(f"change of contact ({settings[-1].label})")
    start = ", ".join(f"{value:g}" for value in motion.nu)
    axes["key"].axis("off")
    key_title = rf"$\nu(0)$ = ({start}) 1/s"
    axes["key"].legend(handles, labels, loc="center left", title=key_title, alignment="left")
    figure.suptitle(title, x=0.01, ha="left", fontsize=13)
    return figure


def laws_sheet(motion: Motion, settings: list[Setting], runs: Runs) -> Figure:
    """Energy and distance from the massless path under both switching laws, over the long interval."""
    figure, (energy, apart) = plt.subplots(1, 2, figsize=(13, 3.6), layout="constrained")
    massless = runs[motion.number, MASSLESS.key]
    for setting in settings:
        run = runs[motion.number, setting.key]
        other = massless.sample(run.t).pose
        energy.plot(run.t, 100 * (run.energy / run.energy[0] - 1), **line_style(setting))
        apart.plot(run.t, np.hypot(*(run.pose - other)[:, :2].T), **line_style(setting))
    energy.set(title="kinetic energy, change since the start", ylabel="%")
    apart.set(title="distance of the centre from the massless one", ylabel="m")
    for axis in (energy, apart):
        axis.set(xlabel="t, s", xlim=(0, LONG))
        widen(axis, 1e-3)
    energy.legend()
    figure.suptitle(f"Motion {motion.number}: the two switching laws", x=0.01, ha="left", fontsize=13)
    return figure


def save(figure: Figure, path: Path) -> Path:
    """Write `figure` as PNG and close it."""
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)
    return path
