"""Draws conventions.png: axes, angles and signs, as theory.md explains them. docs/site/pictures.py calls it.

Needs matplotlib. The wheel is that of the paper's vehicle: n = 5 truncated rollers, r = l cos(pi/(n-1)).
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

BODY, AXES, RATE, ANGLE, GREY = "#333333", "#1f5fa8", "#d1651a", "#2f7d4f", "#9a9a9a"
ROLLERS, WHEEL_RADIUS = 5, 1.0
AXIS_RADIUS = WHEEL_RADIUS * np.cos(np.pi / (ROLLERS - 1))
JOINT = np.pi / ROLLERS
UP = (-1.7, 2.05)  # of each panel, so that their scales are the same


def unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def arrow(axis: Axes, start, end, colour: str, width: float = 1.6, style: str = "-|>") -> None:
    axis.annotate(
        "",
        xy=end,
        xytext=start,
        arrowprops={
            "arrowstyle": style,
            "color": colour,
            "lw": width,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 13,
        },
    )


def turn(axis: Axes, centre, radius: float, first: float, last: float, colour: str, width: float = 1.4) -> None:
    """An arc from the angle `first` to `last`, with its arrow head at `last`."""
    angles = np.linspace(first, last, 60)
    x, y = centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)
    axis.plot(x[:-3], y[:-3], color=colour, lw=width, solid_capstyle="butt")
    arrow(axis, (x[-6], y[-6]), (x[-1], y[-1]), colour, width)


def bare(axis: Axes, title: str, across: tuple[float, float], up: tuple[float, float]) -> None:
    axis.set(xlim=across, ylim=up, aspect="equal")
    axis.set_title(title, loc="left", fontsize=11.5, color=BODY)
    axis.axis("off")


def draw_wheels_from_above(axis: Axes, heading: float, angles) -> None:
    """The platform and its wheels as slabs across their axles; S is the origin, the centres are at distance 1."""
    for a in angles:
        axis.plot(*np.array([(0, 0), unit(heading + a)]).T, color=GREY, lw=1)
    for a in angles:
        n, p = unit(heading + a), unit(heading + a + np.pi / 2)
        corners = np.array([n + s * 0.055 * n + t * 0.24 * p for s, t in ((1, 1), (1, -1), (-1, -1), (-1, 1))])
        axis.fill(*corners.T, color="#e8e8e8", ec=BODY, lw=1.2, zorder=3)
    axis.plot(0, 0, "o", color=BODY, ms=5, zorder=4)


def draw_frames(axis: Axes) -> None:
    """Seen from above: the fixed and the platform's frame, theta, alpha, n and n_perp."""
    heading, angles = 0.42, (0.0, 2 * np.pi / 3, 4 * np.pi / 3)
    bare(axis, "a   from above: frames", (-1.75, 2.3), UP)
    draw_wheels_from_above(axis, heading, angles)
    for angle, name, length in ((0, "$X$", 2.0), (np.pi / 2, "$Y$", 1.75)):
        arrow(axis, (0, 0), length * unit(angle), GREY, 1.1)
        axis.text(*(length * unit(angle) + (0.06, 0.04)), name, color=GREY, fontsize=12)
    for angle, name in ((heading, r"$\xi$"), (heading + np.pi / 2, r"$\eta$")):
        arrow(axis, (0, 0), 1.95 * unit(angle), AXES)
        axis.text(*(2.06 * unit(angle)), name, color=AXES, fontsize=14, ha="center", va="center")
    axis.text(0.02, -0.17, "$S$", fontsize=12, color=BODY)
    turn(axis, (0, 0), 1.62, 0.02, heading, ANGLE)
    axis.text(*(1.76 * unit(0.21)), r"$\theta$", color=ANGLE, fontsize=13, ha="center", va="center")
    turn(axis, (0, 0), 0.42, heading, heading + angles[1], ANGLE)
    axis.text(*(0.58 * unit(heading + 0.62)), r"$\alpha_2$", color=ANGLE, fontsize=13, ha="center", va="center")
    for number, a in enumerate(angles, 1):
        n, p = unit(heading + a), unit(heading + a + np.pi / 2)
        arrow(axis, n, n + 0.45 * n, RATE)
        arrow(axis, n, n + 0.45 * p, RATE)
        axis.text(
            *(n + 0.5 * n + 0.13 * p), rf"$\mathbf{{n}}_{number}$", color=RATE, fontsize=12, ha="center", va="center"
        )
        axis.text(
            *(n + 0.58 * p + 0.02 * n),
            rf"$\mathbf{{n}}_{number}^\perp$",
            color=RATE,
            fontsize=12,
            ha="center",
            va="center",
        )
    axis.text(*(0.53 * unit(heading + angles[2]) + (0.12, 0.0)), "$R$", color=BODY, fontsize=12)


def roller_outline(place: float) -> np.ndarray:
    """The barrel of a truncated roller whose middle is at the angle `place` from straight down, counterclockwise."""
    outer = np.linspace(-JOINT, JOINT, 40)
    rim = WHEEL_RADIUS * np.column_stack([np.sin(outer), -np.cos(outer)])
    inner = np.column_stack([rim[:, 0], -2 * AXIS_RADIUS - rim[:, 1]])[::-1]  # the rim's mirror image at its axis
    shape = np.vstack([rim, inner])
    c, s = np.cos(place), np.sin(place)
    return shape @ np.array([[c, s], [-s, c]])


def from_down(angle: float) -> np.ndarray:
    """The direction at this angle from straight down, counterclockwise."""
    return unit(angle - np.pi / 2)


def draw_rollers(axis: Axes, chi: float) -> None:
    for j in range(ROLLERS):
        place = chi + 2 * np.pi * j / ROLLERS
        axis.fill(*roller_outline(place).T, color="#dbe6f3" if j == 0 else "#f1f1f1", ec=BODY, lw=1.1)
        middle, along = AXIS_RADIUS * from_down(place), unit(place)
        axis.plot(*np.array([middle - 0.6 * along, middle + 0.6 * along]).T, color=BODY, lw=0.8, ls=(0, (6, 3, 1, 3)))
        axis.text(
            *(middle - 0.13 * from_down(place) + 0.22 * along),
            f"${j + 1}$",
            fontsize=11,
            color=BODY,
            ha="center",
            va="center",
        )


def draw_wheel(axis: Axes) -> None:
    """Seen from outside, from the tip of n: chi, kappa, rho, positive rate and torque, where the wheel rolls."""
    chi, contact = 0.42, np.array([0.0, -WHEEL_RADIUS])
    bare(axis, r"b   a wheel from outside: $\mathbf{n}_i$ points to the reader", (-2.15, 2.15), UP)
    axis.plot([-1.95, 1.95], [-WHEEL_RADIUS] * 2, color=GREY, lw=1.4)
    draw_rollers(axis, chi)
    axis.plot(*np.array([(0, 0), 1.4 * contact]).T, color=BODY, lw=1, ls=(0, (4, 3)))
    axis.text(-0.13, -0.5, "$l$", fontsize=12, color=BODY)
    axis.plot(*np.array([(0, 0), AXIS_RADIUS * from_down(chi)]).T, color=AXES, lw=1.5)
    axis.text(0.21, -0.28, "$r$", fontsize=12, color=AXES)
    for angle in (chi, chi + 2 * JOINT):
        axis.plot(*np.array([AXIS_RADIUS * from_down(angle), 1.4 * from_down(angle)]).T, color=ANGLE, lw=0.8)
    turn(axis, (0, 0), 1.28, -np.pi / 2, -np.pi / 2 + chi, ANGLE)
    axis.text(*(1.42 * from_down(chi / 2)), r"$\chi_i$", fontsize=13, color=ANGLE, ha="center", va="center")
    turn(axis, (0, 0), 1.28, -np.pi / 2 + chi, -np.pi / 2 + chi + 2 * JOINT, ANGLE)
    axis.text(*(1.42 * from_down(chi + JOINT)), r"$\kappa_2$", fontsize=13, color=ANGLE, ha="center", va="center")
    rho = WHEEL_RADIUS * np.cos(chi) - AXIS_RADIUS
    arrow(axis, contact, contact - rho * from_down(chi), RATE, 1.6, "|-|, widthA=0.15, widthB=0.15")
    axis.text(0.03, -0.92, r"$\rho_i$", fontsize=12, color=RATE)
    axis.plot(0, 0, "o", color=BODY, ms=5)
    axis.text(-0.19, 0.06, "$P_i$", fontsize=12, color=BODY)
    axis.plot(*contact, "o", color=BODY, ms=4, zorder=5)
    axis.text(-0.16, -1.17, "$C_i$", fontsize=12, color=BODY, ha="center")
    turn(axis, (0, 0), 1.2, 0.45, 1.3, RATE, 2.2)
    axis.text(0.98, 0.98, r"$\dot\chi_i>0$," + "\npositive torque", fontsize=11.5, color=RATE)
    arrow(axis, (-1.1, 0.0), (-1.95, 0.0), RATE, 2.2)
    axis.text(-2.12, 0.1, "the centre moves\nalong " + r"$-\mathbf{n}_i^\perp$", fontsize=10, color=RATE, va="bottom")
    corner = np.array([-1.85, -1.55])
    arrow(axis, corner, corner + (0.45, 0), AXES)
    axis.text(*(corner + (0.5, 0)), r"$\mathbf{n}_i^\perp$", fontsize=13, color=AXES, va="center")
    arrow(axis, corner, corner + (0, 0.45), AXES)
    axis.text(*(corner + (0.06, 0.36)), "$Z$", fontsize=12, color=AXES)


def draw_turning(axis: Axes) -> None:
    """Seen from above: equal positive wheel rates turn the vehicle clockwise."""
    angles = (0.0, 2 * np.pi / 3, 4 * np.pi / 3)
    bare(axis, r"c   from above: equal rates $\dot\chi_i>0$", (-1.75, 1.9), UP)
    draw_wheels_from_above(axis, np.pi / 2, angles)
    for a in angles:
        n, p = unit(np.pi / 2 + a), unit(np.pi / 2 + a + np.pi / 2)
        arrow(axis, n, n - 0.72 * p, RATE, 2.2)
        arrow(axis, n, n + 0.4 * n, GREY, 1.2)
    axis.text(0.33, 1.12, r"$-\mathbf{n}_1^\perp$", fontsize=12, color=RATE)
    axis.text(0.07, 1.36, r"$\mathbf{n}_1$", fontsize=12, color=GREY)
    turn(axis, (0, 0), 0.45, 1.15 * np.pi, -0.35 * np.pi, ANGLE, 2)
    axis.text(0.5, 0.3, r"$\dot\theta<0$", fontsize=13, color=ANGLE)
    axis.text(0.06, -0.17, "$S$", fontsize=12, color=BODY)


def draw(folder: Path) -> None:
    with plt.rc_context({"mathtext.fontset": "cm"}):
        figure, axes = plt.subplots(1, 3, figsize=(15, 4.8), layout="constrained", width_ratios=(4.05, 4.3, 3.65))
        draw_frames(axes[0])
        draw_wheel(axes[1])
        draw_turning(axes[2])
        figure.savefig(folder / "conventions.png", dpi=110, bbox_inches="tight", metadata={"Software": None})
