"""A picture of where and when each wheel slipped: the tracks of the contacts, and their slip over time. It needs
matplotlib."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omniroll.results import pictures
from omniroll.results.pictures import TINTS
from omniroll.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

POINTS = 1500  # of a track
STILL = 1e-12  # of the fastest slip, and of 1 m/s: slower is none
SHOWN = 1e-6  # m/s: what the scales reach at least


def tracks(run: Trajectory, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the contacts are on the ground, (T, N, 2) in m, and how fast they slip, (T, N) in m/s.

    run    of wheels that may slip
    times  (T,) in s, within the run
    """
    samples = run.sample(times)
    cos, sin = np.cos(samples.pose[:, 2]), np.sin(samples.pose[:, 2])
    places = run.vehicle.places()
    turned = np.stack([cos[:, None] * places[:, 0] - sin[:, None] * places[:, 1],
                       sin[:, None] * places[:, 0] + cos[:, None] * places[:, 1]], axis=-1)  # fmt: skip
    assert samples.slip is not None
    return samples.pose[:, None, :2] + turned, np.linalg.norm(samples.slip, axis=-1)


def lifted(run: Trajectory) -> np.ndarray:
    """(T, N) bool: contacts without load from each row on; none where loads do not follow the motion."""
    drives = run.effects.drives()
    if "carries" not in drives:
        return np.zeros((len(run), run.vehicle.wheels), bool)
    return run.drive[:, drives.index("carries")] < 0.5


def draw(run: Trajectory, title: str, path: Path) -> Path:
    """Write the picture of a run of wheels that may slip as PNG."""
    import matplotlib
    import matplotlib.pyplot as plt
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    times = np.unique(np.concatenate([np.linspace(run.t[0], run.t[-1], POINTS), run.t]))
    place, speed = tracks(run, times)
    wheels = run.vehicle.wheels
    with matplotlib.rc_context(pictures.STYLE):
        figure = plt.figure(figsize=(11, 1.2 + 1.25 * max(wheels, 3)), layout="constrained")
        grid = figure.add_gridspec(wheels, 2, width_ratios=(1, 1.15))
        fastest = max(float(speed.max()), SHOWN)
        scale = ScalarMappable(Normalize(0, fastest), "plasma_r")
        ground = figure.add_subplot(grid[:, 0])
        _draw_tracks(ground, place, speed, run.vehicle.wheels, scale)
        figure.colorbar(scale, ax=ground, label="slip, m/s", shrink=0.8)
        first, off = None, lifted(run)
        for wheel in range(wheels):
            axis = figure.add_subplot(grid[wheel, 1], sharex=first)
            first = first or axis
            _draw_slip(axis, times, speed[:, wheel], wheel, is_last=wheel == wheels - 1)
            _draw_lifts(axis, run.t, off[:, wheel])
            said = "; grey: it sticks" + "; red: no load" * bool(off.any()) if wheel == 0 else ""
            axis.set_title(f"wheel {wheel + 1}: slip, m/s{said}")
            axis.set_ylim(0, 1.05 * fastest)
        figure.suptitle(title, x=0.01, ha="left")
        return pictures.save(figure, path)


def _draw_tracks(axis: "Axes", place: np.ndarray, speed: np.ndarray, wheels: int, scale: "ScalarMappable") -> None:
    from matplotlib.collections import LineCollection

    slips = speed > STILL * max(speed.max(), 1.0)
    for wheel in range(wheels):
        track = place[:, wheel]
        axis.plot(*track.T, color="#bbbbbb", linewidth=1)
        parts = np.stack([track[:-1], track[1:]], axis=1)
        moving = slips[:-1, wheel] | slips[1:, wheel]
        colours = scale.to_rgba((speed[:-1, wheel] + speed[1:, wheel])[moving] / 2)
        axis.add_collection(LineCollection(parts[moving], colors=colours, linewidths=3.5))
        mark = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "#bbbbbb"}
        axis.annotate(str(wheel + 1), track[0], color=TINTS[wheel % len(TINTS)], ha="center", va="center", bbox=mark)
    axis.set_title("tracks of the contacts; coloured where they slip")
    axis.set(xlabel="x, m", ylabel="y, m")
    axis.set_aspect("equal", "datalim")


def _draw_slip(axis: "Axes", times: np.ndarray, speed: np.ndarray, wheel: int, is_last: bool) -> None:
    """Slip over time; the background is grey where there is none."""
    none = speed <= STILL * max(speed.max(), 1.0)
    axis.fill_between(times, 0, 1, where=none, step="post", color="#e8e8e8", transform=axis.get_xaxis_transform())
    axis.plot(times, speed, color=TINTS[wheel % len(TINTS)])
    if is_last:
        axis.set_xlabel("t, s")
    else:
        axis.tick_params(labelbottom=False)


def _draw_lifts(axis: "Axes", times: np.ndarray, lifted: np.ndarray) -> None:
    """The background is red where a contact, (T,) bool in rows, has no load."""
    across = axis.get_xaxis_transform()
    axis.fill_between(times, 0, 1, where=lifted, step="post", color="#f2d4d0", transform=across)
