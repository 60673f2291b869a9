"""The picture of a scene's run: path, heading, energy and speeds. It needs matplotlib."""

from pathlib import Path

from omniroll.results import pictures
from omniroll.results.trajectory import Trajectory


def draw(run: Trajectory, name: str, path: Path, *, stopped: bool) -> None:
    """Write the picture of the run of the scene `name` as PNG; `stopped`: the run ended before its time."""
    import matplotlib

    title = f"{name}: {run.t[0]:g} to {run.t[-1]:g} s" + (" (stopped)" if stopped else "")
    label = run.roller_model if run.roller_model == "massless" else f"{run.roller_model}, {run.switching}"
    with matplotlib.rc_context(pictures.STYLE):
        pictures.save(pictures.sheet({label: run}, run.t[-1], title), path)
