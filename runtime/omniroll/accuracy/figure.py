"""The figure of a study: error against time, one curve per integrator; and the same for the models."""

from pathlib import Path

from omniroll.accuracy.study import Point, Study
from omniroll.accuracy.tables import fullest

COLOURS = {
    "compiled": "#0b5fa5", "Python engine": "#4fa3d9", "SciPy RK45": "#b8860b", "SciPy DOP853": "#d1495b",
    "SciPy LSODA": "#7a5195", "SciPy Radau": "#2a9d6f", "RK4 fixed, double": "#444444",
    "RK4 fixed, float": "#999999", "massless": "#b8860b", "locked": "#2a9d6f", "free": "#0b5fa5",
}  # fmt: skip
LEFT_OUT = ("#d1495b", "#7a5195", "#e07b39", "#5c8001", "#444444", "#00798c")  # for models without an effect
MARKERS = {"compiled": "o", "Python engine": "s", "RK4 fixed, double": "x", "RK4 fixed, float": "+"}


def draw(study: Study, folder: Path) -> list[Path]:
    """Write accuracy.png and accuracy.svg; their paths. Needs matplotlib."""
    import matplotlib

    style = {"font.size": 9, "svg.hashsalt": "omniroll", "axes.spines.top": False, "axes.spines.right": False}
    with matplotlib.rc_context(style):
        from matplotlib.figure import Figure

        figure = Figure(figsize=(11, 5.2), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.7, 1), sharey=True)
        figure.suptitle(
            f"{study.scene}: {study.model} rollers, {study.law} switches, {study.duration:g} s simulated",
            x=0.01, ha="left", fontweight="bold",
        )  # fmt: skip
        bare = ", without effects" * bool(study.effects)
        _panel(left, study.points, f"numerical accuracy{bare}: one curve per integrator")
        left.legend(loc="center", bbox_to_anchor=(0.3, 0.36), fontsize=8, frameon=False)  # where no curve goes
        _panel(right, study.models, f"model accuracy: against {fullest(study)}", LEFT_OUT)
        left.set_ylabel("largest error over the trajectory, norm of `accuracy`")
        left.axhline(study.floor, color="0.6", lw=0.8, ls=":")
        left.annotate(
            "100 times the reference's own error", (0.42, study.floor), (0, -10), color="0.45", fontsize=7.5,
            ha="center", xycoords=("axes fraction", "data"), textcoords="offset points",
        )  # fmt: skip
        paths = [folder / "accuracy.png", folder / "accuracy.svg"]
        figure.savefig(paths[0], dpi=150, metadata={"Software": None})
        figure.savefig(paths[1], metadata={"Date": None})
    return paths


def _panel(axes, points: list[Point], title: str, further: tuple[str, ...] = ()) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, StrMethodFormatter

    names = list(dict.fromkeys(point.series for point in points))
    colours = COLOURS | dict(zip((name for name in names if name not in COLOURS), further, strict=False))
    for name in names:
        own = [point for point in points if point.series == name]
        axes.loglog(
            [p.microseconds for p in own], [p.trajectory for p in own], MARKERS.get(name, "o") + "-",
            color=colours.get(name), label=name, ms=4, lw=2.0 if name == "compiled" else 1.2,
        )  # fmt: skip
    axes.set_title(title, loc="left", fontsize=9)
    axes.set_xlabel("microseconds per simulated second")
    axes.grid(True, which="major", color="0.9", lw=0.6)
    axes.xaxis.set_minor_formatter(NullFormatter())
    low, high = axes.get_xlim()
    if high < 10 * low:  # within a decade: plain numbers
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.legend(fontsize=8, frameon=True, framealpha=0.9, edgecolor="none")
