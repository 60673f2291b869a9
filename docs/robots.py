"""Measures and draws what robots.md shows: the table of figures on the page, and robots.png.

    python docs/robots.py       writes the table; docs/site/pictures.py draws

Takes some seconds. Needs matplotlib.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

import omniroll
from omniroll.results import pictures
from omniroll.robots.catalogue import ROBOTS

PAGE = Path(__file__).with_name("robots.md")
BEGIN, END = "<!-- measured by robots.py -->", "<!-- up to this line -->"
SPEED = 0.5  # m/s
DIRECTIONS = np.arange(0, 91, 5)  # degrees from forward
WAY = 1.0  # m
COLOURS = ("#d1651a", "#1f5fa8", "#6b6b6b", "#3c8c5a")
SCENES = ("tigers", "robomaster")


def lost(vehicle: omniroll.Vehicle, degrees: float, model: str = "free") -> np.ndarray:
    """(2,) The parts of the energy at the start that are lost over the first and the second metre of coasting."""
    angle = np.radians(degrees)
    nu = SPEED / vehicle.platform_radius * np.array([np.cos(angle), np.sin(angle), 0.0])
    run = omniroll.simulate(vehicle, nu=nu, duration=3 * WAY / SPEED, roller_model=model, accuracy=1e-7)
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(run.pose[:, :2], axis=0), axis=1))])
    kept = run.energy[np.searchsorted(way, [0, WAY, 2 * WAY])] / run.energy[0]
    return -np.diff(kept)


def coasting() -> tuple[list[str], dict[str, np.ndarray]]:
    """The rows of the table, and the losses by direction of every robot on omni-wheels."""
    rows, curves = [], {}
    for name, robot in ROBOTS.items():
        if not robot.vehicle.has_wheels_of_the_paper:
            continue
        free, locked = (
            100 * np.array([lost(robot.vehicle, degrees, model) for degrees in DIRECTIONS])
            for model in ("free", "locked")
        )
        curves[name] = free[:, 0]
        lever = f"{100 * robot.lever_change:.2g} %" if robot.row_offset else "-"
        columns = (f"{abs(values.min()):.2g} to {values.max():.2g} %" for values in (*free.T, *locked.T))
        rows.append(f"| {robot.title} | {' | '.join(columns)} | {lever} |")
    return rows, curves


def driven() -> tuple[list[str], dict[str, dict[str, omniroll.Trajectory]]]:
    """The rows of the table, and the runs of each scene by roller model."""
    rows, found = [], {}
    for name in SCENES:
        scene = omniroll.load_scene(PAGE.parents[1] / f"scenes/{name}.toml")
        runs = {model: omniroll.run(scene, roller_model=model) for model in ("massless", "locked", "free")}
        found[name] = runs
        for model, run in runs.items():
            sums, end = run.ledger.contributions, run.pose[-1] - runs["massless"].pose[-1]
            away = 1e3 * np.hypot(*end[:2])
            rows.append(
                f"| `{name}` | {model} | {len(run.switches)} | {sums['drive_work']:.3g} J | "
                f"{abs(sums['switches']):.2g} J | {away:.2g} mm |"
            )
    return rows, found


def draw(folder: Path) -> None:
    (_, curves), (_, scenes) = coasting(), driven()
    with matplotlib.rc_context(pictures.STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        for (name, curve), colour in zip(curves.items(), COLOURS, strict=True):
            axes[0].plot(DIRECTIONS, curve, color=colour, label=ROBOTS[name].title)
        axes[0].set(
            title="energy lost over the first metre, coasting", xlabel="direction of motion, degrees from forward"
        )
        axes[0].set(ylabel=f"% of the energy at {SPEED:g} m/s", xticks=range(0, 91, 15))
        axes[0].set_ylim(0, 1.35 * max(curve.max() for curve in curves.values()))  # room for the legend
        axes[0].legend(fontsize="small", loc="upper center", ncols=2)
        for axis, (name, runs) in zip(axes[1:], scenes.items(), strict=True):
            for model, run in runs.items():
                taken = -np.concatenate([[0], np.cumsum(run.switches.energy_jump)])
                times = np.concatenate([[run.t[0]], run.switches.t])
                axis.step(times, taken, where="post", color=pictures.COLOURS[model], label=model)
            axis.set(title=f"scenes/{name}.toml: energy that switches took", xlabel="t, s", ylabel="J")
            axis.legend()
        pictures.save(figure, folder / "robots.png")


def main() -> None:
    lines = [
        f"Coasting from {SPEED:g} m/s, over all directions of motion: the part of the energy that is lost.",
        "",
        "| robot | free, first metre | second metre | locked, first metre | second metre | lever of yaw alternates |",
        "| --- | --- | --- | --- | --- | --- |",
        *coasting()[0],
        "",
        "The scenes, driven through their motors:",
        "",
        "| scene | rollers | switches | work of the motors | taken by switches | end, away from massless |",
        "| --- | --- | --- | --- | --- | --- |",
        *driven()[0],
    ]
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    PAGE.write_text("\n".join([f"{before}{BEGIN}", "", *lines, "", f"{END}{rest.split(END)[1]}"]), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
