"""The pictures of a scene's run: path, heading, energy and speeds; and what drives it and resists. They need
matplotlib."""

from pathlib import Path

from omniroll.results import force_pictures, pictures
from omniroll.results.trajectory import Trajectory


def draw(run: Trajectory, name: str, folder: Path, *, stopped: bool) -> None:
    """Write the pictures of the run of the scene `name` as PNG: picture.png, and forces.png where there are any.

    stopped  the run ended before its time
    """
    import matplotlib

    title = f"{name}: {run.t[0]:g} to {run.t[-1]:g} s" + (" (stopped)" if stopped else "")
    label = run.roller_model if run.roller_model == "massless" else f"{run.roller_model}, {run.switching}"
    with matplotlib.rc_context(pictures.STYLE):
        pictures.save(pictures.sheet({label: run}, run.t[-1], title), folder / "picture.png")
        forces = force_pictures.sheet(run, title)
        if forces is not None:
            pictures.save(forces, folder / "forces.png")
