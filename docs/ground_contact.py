"""Measures and draws what ground-contact.md shows: the numbers on the page, and ground-contact.png.

    python docs/ground_contact.py       prints the numbers; docs/site/pictures.py draws

Needs matplotlib.
"""

import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from scipy.optimize import brentq

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
    axis.loglog(
        COEFFICIENTS, found["impact"][0] * COEFFICIENTS[0] / COEFFICIENTS, ":", color=BLUE, label="1/coefficient"
    )
    axis.set(
        title="a strong ground rolls with the law impact", xlabel="coefficient, N s/m", ylabel="distance to rolling"
    )
    axis.legend()


def draw_a_switch(slip_axis, energy_axis, impact: omniroll.Trajectory) -> None:
    first = impact.switches[0]
    after = np.linspace(0, SHOWN, 1000)
    for coefficient, shade in zip(REAL, (0.35, 0.55, 0.75, 1.0), strict=True):
        motion = slipping(coefficient, first.t + SHOWN + 0.01, 1e-9)
        (own,) = (s for s in motion.switches if s.wheel == first.wheel)
        row, seen = np.flatnonzero(motion.t == own.t)[-1], motion.sample(own.t + after)
        style = {"color": ORANGE, "alpha": shade, "label": f"{coefficient:g} N s/m"}
        slip = seen.slip[:, first.wheel, 0]
        slip_axis.plot(1e3 * after, 1e3 * slip, **style)
        energy_axis.plot(1e3 * after, 1e3 * (seen.energy - motion.energy[row]), **style)
        force = np.abs(seen.ground_force[:, first.wheel]).max()
        fades = 1e3 * after[np.abs(slip) < 0.1 * abs(slip[0])][0]
        print(
            f"{coefficient:g} N s/m: slip {slip[0]:.3f} m/s, largest force {force:.1f} N, a tenth after {fades:.1f} ms"
        )
    energy_axis.axhline(1e3 * first.energy_jump, color=BLUE, linestyle="--", label="impact: at once")
    print(f"impact takes {-1e3 * first.energy_jump:.4f} mJ at the first switch, t = {first.t:.4f} s")
    slip_axis.set(title="the entering roller slips along its axle", xlabel="ms after the switch", ylabel="slip, mm/s")
    energy_axis.set(title="and the ground takes energy", xlabel="ms after the switch", ylabel="kinetic energy, mJ")
    slip_axis.legend()
    energy_axis.legend()


def together() -> None:
    """Two wheels that rolling switches at once, and that are no mirror images of each other."""

    def motion(angle: float, **options) -> omniroll.Trajectory:
        start = {"nu": (1.0, 0.35, 0.6), "chi": (0.0, angle, 0.0), "duration": 0.5, "control": False}
        return omniroll.simulate(PAPER, **start, **options)

    def ahead(angle: float) -> float:
        found = motion(angle, accuracy=1e-14).switches
        times = {int(wheel): float(t) for t, wheel in zip(found.t[::-1], found.wheel[::-1], strict=True)}
        return times[1] - times[2]

    angle = brentq(ahead, 0.0, 0.02, xtol=1e-17, rtol=1e-15)
    impacts = {name: motion(angle + by, accuracy=1e-14) for name, by in (("joint", 0), ("one", 1e-9), ("other", -1e-9))}
    print("switches of rolling:", impacts["joint"].switches.t, "wheels", impacts["joint"].switches.wheel)
    for coefficient in np.logspace(2, 5, 4):
        slips = motion(angle, accuracy=1e-11, effects=[omniroll.Contact(coefficient)])
        away = (f"{name} {np.abs(slips.nu[-1] - other.nu[-1]).max():.2e}" for name, other in impacts.items())
        print(f"{coefficient:9.3g} N s/m, nu away from", *away, flush=True)


def draw(folder: Path) -> None:
    runs = {law: rolling(law) for law in ("impact", "smooth")}
    with matplotlib.rc_context(pictures.STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        draw_a_switch(axes[1], axes[2], runs["impact"])
        draw_distances(axes[0], distances(runs))
        pictures.save(figure, folder / "ground-contact.png")


if __name__ == "__main__":
    together()
    with tempfile.TemporaryDirectory() as aside:
        draw(Path(aside))
