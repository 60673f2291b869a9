"""Pictures of what drives a vehicle and what resists: torques, currents, voltages, loads, slip, the error along a path.

They need matplotlib.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from omniroll.effects.path_follower import Path, PathFollower
from omniroll.results.pictures import TINTS, Trajectory, widen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 1500  # of a line
READ = {  # instruments without errors: title, unit, smallest span of the axis
    "net_torque": ("torque at the axles, drive and bearings", "N m", 1e-9),
    "motor_current": ("current of the motors", "A", 1e-6),
    "motor_voltage": ("voltage at the motors", "V", 1e-6),
}
ACROSS = 2  # panels in a row


@dataclass(frozen=True)
class Panel:
    """Lines over time: values (T, K), and a label for each line."""

    title: str
    unit: str
    t: np.ndarray
    values: np.ndarray
    labels: tuple[str, ...]
    span: float


def panels(run: Trajectory) -> list[Panel]:
    """Those that a run has something to show in."""
    wheels = tuple(f"wheel {k}" for k in range(1, run.vehicle.wheels + 1))
    times = np.linspace(run.t[0], run.t[-1], POINTS) if run.t[-1] > run.t[0] else run.t[:1]
    found = []
    names = [name for name in READ if name != "net_torque" or run.drive is not None]
    for name, values in run.measure(times, names=names).items():
        title, unit, span = READ[name]
        found.append(Panel(title, unit, times, values, wheels, span))
    if run.slip is not None:
        speed = np.linalg.norm(run.slip, axis=-1)
        found.append(Panel("slip of the contacts", "m/s", run.t, speed, wheels, 1e-6))
    if run.ground_load is not None:
        found.append(Panel("loads of the contacts", "N", run.t, run.ground_load, wheels, 1e-3))
    return found + _of_path(run, times)


def _of_path(run: Trajectory, times: np.ndarray) -> list[Panel]:
    """How far the vehicle is from the pose that its path has at each time."""
    path = next((effect for effect in run.effects.effects if isinstance(effect, PathFollower)), None)
    if path is None:
        return []
    error = run.sample(times).pose - wanted_poses(path)(times)
    away = np.hypot(error[:, 0], error[:, 1])
    return [
        Panel("distance from the path", "m", times, away[:, None], ("of S",), 1e-6),
        Panel("heading, less the path's", "rad", times, error[:, 2:], ("heading",), 1e-6),
    ]


def wanted_poses(follower: PathFollower) -> Callable[[np.ndarray], np.ndarray]:
    """A function that gives the poses (T, 3) of a path at times (T,)."""
    path = Path(np.array(follower.times), np.array(follower.poses))
    return lambda times: np.array([path.at(time) for time in times])


def sheet(run: Trajectory, title: str) -> "Figure | None":
    """A panel for each of the quantities; None where a run has none of them: nothing drives it, nothing slips."""
    from matplotlib.figure import Figure

    shown = panels(run)
    if not shown:
        return None
    rows = -(-len(shown) // ACROSS)
    figure = Figure(figsize=(6.5 * min(ACROSS, len(shown)), 0.5 + 2.6 * rows), layout="constrained")
    axes = figure.subplots(rows, min(ACROSS, len(shown)), squeeze=False, sharex=True).flat
    for axis, panel in zip(axes, shown, strict=False):
        for k, label in enumerate(panel.labels):
            axis.plot(panel.t, panel.values[:, k], color=TINTS[k % len(TINTS)], linewidth=0.9, label=label)
        axis.set(title=panel.title, ylabel=panel.unit)
        axis.tick_params(labelbottom=True)
        widen(axis, panel.span)
    for axis in figure.axes[len(shown) :]:
        axis.set_axis_off()
    for axis in figure.axes[max(0, len(shown) - ACROSS) : len(shown)]:
        axis.set_xlabel("t, s")
    figure.axes[0].legend(loc="best")
    figure.suptitle(title, x=0.01, ha="left", fontsize=13)
    return figure
