"""The picture of a run: path, heading, energy and speeds."""

from pathlib import Path

from matplotlib.lines import Line2D

from omniroll.scenes.outcome import Outcome
from omniroll.studies.motions import figures
from omniroll.studies.motions.cases import Motion, Setting


def draw(outcome: Outcome, path: Path) -> None:
    """Write the picture as PNG."""
    run = outcome.trajectory
    motion = Motion(0, outcome.scene.name, tuple(run.nu[0]))
    setting = Setting(run.roller_model, run.switching)
    end = " (stopped)" if outcome.stopped else ""
    with figures.plt.rc_context(figures.STYLE):
        title = f"{motion.title}: {run.t[0]:g} to {run.t[-1]:g} s{end}"
        sheet = figures.sheet(motion, [setting], {(0, setting.key): run}, run.t[-1], title)
        for line in sheet.findobj(Line2D):  # dashes tell curves apart, and here is one
            if line.get_color() == figures.COLOURS[run.roller_model]:
                line.set_linestyle("-")
        figures.save(sheet, path)
