"""The figure of a study: error against time, one curve per integrator; and the same for the models."""

from pathlib import Path

from omniroll.studies.accuracy.study import Point, Study
from omniroll.studies.accuracy.tables import fullest

COLOURS = {
    "compiled": "#0b5fa5", "Python engine": "#4fa3d9", "SciPy RK45": "#b8860b", "SciPy DOP853": "#d1495b",
    "SciPy LSODA": "#7a5195", "SciPy Radau": "#2a9d6f", "RK4 fixed, double": "#444444",
    "RK4 fixed, float": "#999999", "DOP853, float kernel": "#e8a0ad", "heyoka": "#e07b39",
    "massless": "#b8860b", "locked": "#2a9d6f", "free": "#0b5fa5",
}  # fmt: skip
LEFT_OUT = ("#d1495b", "#7a5195", "#e07b39", "#5c8001", "#444444", "#00798c")  # for models without an effect
MARKERS = {
    "Python engine": "s", "RK4 fixed, double": "x", "RK4 fixed, float": "+", "DOP853, float kernel": "v", "heyoka": "D",
}  # fmt: skip


def draw(study: Study, folder: Path) -> list[Path]:
    """Write accuracy.png and accuracy.svg; their paths. Needs matplotlib."""
    import matplotlib

    style = {"font.size": 9, "svg.hashsalt": "omniroll", "axes.spines.top": False, "axes.spines.right": False}
    with matplotlib.rc_context(style):
        from matplotlib.figure import Figure

        figure = Figure(figsize=(11, 6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.7, 1), sharey=True)
        figure.suptitle(
            f"{study.scene}: {study.model} rollers, {study.law} switches, {study.duration:g} s simulated",
            x=0.01, ha="left", fontweight="bold",
        )  # fmt: skip
        laws = {name: f"{name}: {c:.1g} tol^{e:.2f}" for name, (c, e) in study.laws.items()}
        _panel(left, study.points, "numerical accuracy: one curve per integrator", study.floor, laws)
        _panel(right, study.models, f"model accuracy: against {fullest(study)}", study.models_floor)
        left.set_ylabel("largest error over the trajectory, norm of `accuracy`")
        left.set_ylim(bottom=_least(study) / 30)
        paths = [folder / "accuracy.png", folder / "accuracy.svg"]
        figure.savefig(paths[0], dpi=150, metadata={"Software": None})
        figure.savefig(paths[1], metadata={"Date": None})
    return paths


def _least(study: Study) -> float:
    """The smallest error or floor that is drawn."""
    parts = ((study.points, study.floor), (study.models, study.models_floor))
    return min((floor for points, floor in parts if points), default=1e-16)


def _panel(axes, points: list[Point], title: str, floor: float, laws: dict[str, str] | None = None) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, StrMethodFormatter

    axes.set_title(title, loc="left", fontsize=9)
    if not points:
        axes.text(0.5, 0.5, "nothing was measured", transform=axes.transAxes, ha="center", color="0.45")
        axes.set(xticks=[])
        return
    names = list(dict.fromkeys(point.series for point in points))
    colours = COLOURS | dict(zip((name for name in names if name not in COLOURS), LEFT_OUT, strict=False))
    for name in names:
        own = [point for point in points if point.series == name]
        axes.loglog(
            [p.microseconds for p in own], [p.trajectory for p in own], MARKERS.get(name, "o") + "-",
            color=colours.get(name), label=(laws or {}).get(name, name), ms=4, lw=2.0 if name == "compiled" else 1.2,
        )  # fmt: skip
    axes.axhline(floor, color="0.6", lw=0.8, ls=":")
    axes.annotate(
        "no smaller errors are shown", (0.02, floor), (0, -10), color="0.45", fontsize=7.5,
        xycoords=("axes fraction", "data"), textcoords="offset points",
    )  # fmt: skip
    axes.set_xlabel("microseconds per simulated second")
    axes.grid(True, which="major", color="0.9", lw=0.6)
    axes.xaxis.set_minor_formatter(NullFormatter())
    low, high = axes.get_xlim()
    if high < 10 * low:  # within a decade: plain numbers
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, fontsize=8, frameon=False)
