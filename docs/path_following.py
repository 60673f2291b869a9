"""Measures and draws what path-following.md shows: its table, and path-following.png.

    python docs/path_following.py       prints the table; docs/site/pictures.py draws

Needs matplotlib.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from scipy.interpolate import CubicSpline

import omniroll

VEHICLE = omniroll.load_scene(Path(__file__).parents[1] / "scenes/robot-soccer-kit.toml").vehicle
FRICTION = omniroll.Bearings(wheel_viscous=1e-5)
SAMPLE, BANDWIDTH = 0.01, 10.0
KNOTS = 33
DURATIONS = (12.0, 6.0, 3.0, 2.0)  # s
SHOWN = 3.0  # s


def eight(duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and poses along a figure eight of 0.8 m by 0.4 m, with half a turn."""
    part = np.linspace(0, 1, KNOTS)
    phase = 2 * np.pi * (3 * part**2 - 2 * part**3)
    return duration * part, np.stack([0.4 * np.sin(phase), 0.2 * np.sin(2 * phase), phase / 2], axis=1)


def on_the_path(times: np.ndarray, poses: np.ndarray) -> omniroll.PathFollower:
    return omniroll.PathFollower(times, poses, SAMPLE, BANDWIDTH)


def by_wheel_rates(times: np.ndarray, poses: np.ndarray) -> omniroll.Controller:
    """What a robot does that is told speeds alone: the path's twist in small steps, held by the wheels' controllers."""
    fine = np.linspace(times[0], times[-1], 401)
    spline = CubicSpline(times, poses, bc_type="clamped")
    (dx, dy, turning), heading = spline(fine, 1).T, spline(fine)[:, 2]
    along = np.stack([np.cos(heading) * dx + np.sin(heading) * dy, np.cos(heading) * dy - np.sin(heading) * dx])
    nu = np.stack([*(along / VEHICLE.platform_radius), turning * VEHICLE.yaw_scale], axis=1)
    return omniroll.Controller(nu, 0.025, SAMPLE, integral=2.0, times=fine)


def run(duration: float, controller, model: str) -> tuple[np.ndarray, np.ndarray]:
    """Poses, and those of the path at the same times."""
    times, poses = eight(duration)
    made = omniroll.simulate(
        VEHICLE, nu=(0, 0, 0), duration=duration, effects=[controller(times, poses), FRICTION], roller_model=model,
        accuracy=1e-6, control=False,
    )  # fmt: skip
    at = np.linspace(0, duration, 801)
    return made.sample(at).pose, CubicSpline(times, poses, bc_type="clamped")(at)


def away_from(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Distances in mm."""
    return 1e3 * np.hypot(*(found - wanted)[:, :2].T)


def draw(folder: Path) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    for controller, name in ((on_the_path, "path follower"), (by_wheel_rates, "wheel rates alone")):
        found, wanted = run(SHOWN, controller, "free")
        axes[0].plot(*found[:, :2].T, label=name)
        axes[1].semilogy(np.linspace(0, SHOWN, len(found)), away_from(found, wanted), label=name)
    axes[0].plot(*wanted[:, :2].T, "k:", lw=1, label="the path")
    axes[0].set(aspect="equal", xlabel="x, m", ylabel="y, m", title=f"a figure eight in {SHOWN:g} s, free rollers")
    axes[1].set(
        xlabel="t, s", ylabel="distance, mm", title="distance from the path's place at that time", ylim=(1e-3, None)
    )
    axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, frameon=False)
    for axis in axes:
        axis.grid(alpha=0.3)
    figure.savefig(folder / "path-following.png", dpi=110, metadata={"Software": None})


def main() -> None:
    print("| fastest | follower, massless | follower, free rollers | wheel rates, free rollers |")
    print("| --- | --- | --- | --- |")
    for duration in DURATIONS:
        cells = []
        for controller, model in ((on_the_path, "massless"), (on_the_path, "free"), (by_wheel_rates, "free")):
            found, wanted = run(duration, controller, model)
            away = away_from(found, wanted)
            cells.append(f"{np.sqrt((away**2).mean()):.2g} mm, at most {away.max():.2g} mm")
        speed = np.hypot(*np.gradient(wanted[:, :2], duration / 800, axis=0).T).max()
        print(f"| {speed:.2f} m/s | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
