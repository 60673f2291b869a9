"""Measures and draws what docs/ground-contact.md shows: docs/ground-contact.png, and the numbers on the page.

    python docs/ground_contact.py

Takes about two minutes. Needs matplotlib.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

import omniroll
from omniroll.results import pictures
from omniroll.results.comparison import distance_at

PAPER = omniroll.Vehicle.paper()
START = {"nu": (1.7, 0.1, 0.0), "chi": (-0.09, 0.2, -0.05)}
DURATION = 2.9  # 15 switches, the closest 0.06 s apart
COEFFICIENTS = np.logspace(2, 6, 9)
REAL = (10.0, 30.0, 100.0, 300.0)
SHOWN = 0.03  # s after the first switch
ORANGE, BLUE, GREY = "#d1651a", "#1f5fa8", "#6b6b6b"


def rolling(law: str) -> omniroll.Trajectory:
    return omniroll.simulate(PAPER, **START, duration=DURATION, switching=law, accuracy=1e-13, control=False)


def slipping(coefficient: float, duration: float, accuracy: float = 1e-11) -> omniroll.Trajectory:
    effects = [omniroll.Contact(coefficient)]
    return omniroll.simulate(PAPER, **START, duration=duration, accuracy=accuracy, effects=effects, control=False)


def distances(runs: dict[str, omniroll.Trajectory]) -> dict[str, np.ndarray]:
    """Of each law to the motion with slip, for every coefficient, at times in the middle between two switches."""
    switches = runs["impact"].switches.t
    times = np.append((switches[1:] + switches[:-1]) / 2, DURATION)
    found: dict[str, list[float]] = {law: [] for law in runs}
    for coefficient in COEFFICIENTS:
        motion = slipping(coefficient, DURATION)
        for law, other in runs.items():
            found[law].append(distance_at(motion, other, times))
        print(f"{coefficient:9.3g} N s/m", *(f"{law} {found[law][-1]:.3e}" for law in found), flush=True)
    slope = np.polyfit(np.log10(COEFFICIENTS), np.log10(found["impact"]), 1)[0]
    print(f"{len(switches)} switches, least gap {np.diff(switches).min():.3g} s, fitted slope {slope:.4f}")
    return {law: np.array(values) for law, values in found.items()}


def draw_distances(axis, found: dict[str, np.ndarray]) -> None:
    axis.loglog(COEFFICIENTS, found["smooth"], "o-", color=GREY, markersize=3.5, label="to the law smooth")
    axis.loglog(COEFFICIENTS, found["impact"], "o-", color=ORANGE, markersize=3.5, label="to the law impact")
    axis.loglog(COEFFICIENTS, found["impact"][0] * COEFFICIENTS[0] / COEFFICIENTS, ":", color=BLUE, label="1/coefficient")
    axis.set(
        title="a strong ground rolls with the law impact", xlabel="coefficient, N s/m", ylabel="distance to rolling"
    )
    axis.legend()


def draw_a_switch(slip_axis, energy_axis, impact: omniroll.Trajectory) -> None:
    first = impact.switches[0]
    after = np.linspace(0, SHOWN, 400)
    for coefficient, shade in zip(REAL, (0.35, 0.55, 0.75, 1.0), strict=True):
        motion = slipping(coefficient, first.t + SHOWN + 0.01, 1e-9)
        (own,) = (s for s in motion.switches if s.wheel == first.wheel)
        row = np.flatnonzero(motion.t == own.t)[-1]
        shown = slice(row, np.searchsorted(motion.t, own.t + SHOWN) + 1)
        style = {"color": ORANGE, "alpha": shade, "label": f"{coefficient:g} N s/m"}
        slip_axis.plot(1e3 * (motion.t[shown] - own.t), 1e3 * motion.slip[shown, first.wheel, 0], **style)
        energy_axis.plot(1e3 * after, 1e3 * (motion.sample(own.t + after).energy - motion.energy[row]), **style)
        peak, gone = motion.slip[row, first.wheel, 0], np.abs(motion.slip[row:, first.wheel, 0])
        tenth = motion.t[row:][gone < 0.1 * abs(peak)]
        force = np.abs(motion.ground_force[shown, first.wheel]).max()
        fades = 1e3 * (tenth[0] - own.t) if len(tenth) else np.inf
        print(f"{coefficient:g} N s/m: slip {peak:.4f} m/s, largest force {force:.2f} N, a tenth after {fades:.2f} ms")
    energy_axis.axhline(1e3 * first.energy_jump, color=BLUE, linestyle="--", label="impact: at once")
    print(f"impact takes {-1e3 * first.energy_jump:.4f} mJ at the first switch, t = {first.t:.4f} s")
    slip_axis.set(title="the entering roller slips along its axle", xlabel="ms after the switch", ylabel="slip, mm/s")
    energy_axis.set(title="and the ground takes energy", xlabel="ms after the switch", ylabel="kinetic energy, mJ")
    slip_axis.legend()
    energy_axis.legend()


def main() -> None:
    runs = {law: rolling(law) for law in ("impact", "smooth")}
    with matplotlib.rc_context(pictures.STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        draw_a_switch(axes[1], axes[2], runs["impact"])
        draw_distances(axes[0], distances(runs))
        pictures.save(figure, Path(__file__).with_name("ground-contact.png"))


if __name__ == "__main__":
    main()
