"""Measures and draws what mecanum.md shows: the tables of the page, and mecanum.png.

    python docs/mecanum.py       writes the tables; docs/site/pictures.py draws

Takes some seconds. Needs matplotlib.
"""

import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

import omniroll
from omniroll.results import pictures
from omniroll.robots.catalogue import ROBOTS
from omniroll.vehicles import wheel_kind

PAGE = Path(__file__).with_name("mecanum.md")
BEGIN, END = "<!-- measured by mecanum.py -->", "<!-- up to this line -->"
NAMES = ("youbot", "strafer", "robomaster-hero")
COLOURS = ("#d1651a", "#1f5fa8", "#3c8c5a")
SPEED = 0.5  # m/s
YAW_RATE = 1.0  # rad/s
MODELS = ("massless", "locked", "free")
NOTHING = 1e-3  # %, above what the accuracy of the runs leaves
PHASES = 2000  # random ones of the wheels


def vehicle_of(name: str) -> omniroll.Vehicle:
    return ROBOTS[name].vehicle


def geometry(vehicle: omniroll.Vehicle) -> tuple[float, float, int, float]:
    """wheel_radius, roller_axis_radius, rollers_per_wheel and the size of roller_angle."""
    angle = wheel_kind.size_of(vehicle.roller_angle)
    return vehicle.wheel_radius, vehicle.roller_axis_radius, vehicle.rollers_per_wheel, angle


def closed_forms() -> list[str]:
    """Rows of the table of what rolling alone says."""
    rows = []
    for name in NAMES:
        vehicle = vehicle_of(name)
        forms = wheel_kind.rolling_of_kind(*geometry(vehicle))
        shift = forms["contact_shift"]
        rows.append(
            f"| {ROBOTS[name].title} | {vehicle.rollers_per_wheel} | {forms['strafe_factor']:.4f} | "
            f"{100 * forms['rate_ripple']:.1f} % | {1e3 * shift:.1f} mm | {2 * shift / vehicle.wheel_radius:.2f} | "
            f"{forms['spin_ratio']:.2f} | {100 * scrub(vehicle):.2f} % |"
        )
    return rows


def scrub(vehicle: omniroll.Vehicle) -> float:
    """The largest part of a wheel's rate by which four wheels at the rates of the usual kinematics fight each other
    while the vehicle is to go sideways, over random phases of the rollers."""
    usual = vehicle.middle_rows() @ (0.0, SPEED, 0.0)
    kernel = omniroll.kernel(vehicle, "massless")
    joint = math.pi / vehicle.rollers_per_wheel
    chi = np.random.default_rng(1).uniform(-joint, joint, (PHASES, vehicle.wheels))
    rows = np.stack([kernel.wheel_speeds(np.tile(unit, (PHASES, 1)), chi) for unit in np.eye(3)], axis=-1)
    left = [usual - row @ np.linalg.lstsq(row, usual, rcond=None)[0] for row in rows]
    return float(np.abs(left).max() / np.abs(usual).max())


def coasting(vehicle: omniroll.Vehicle, nu: tuple[float, float, float], duration: float, model: str):
    return omniroll.simulate(vehicle, nu=nu, duration=duration, roller_model=model, accuracy=1e-7)


def lost_by_yaw(name: str, model: str) -> float:
    """The part of the energy that one radian of turning on the spot takes."""
    run = coasting(vehicle_of(name), (0.0, 0.0, YAW_RATE), 1.5 / YAW_RATE, model)
    return 1 - run.energy[np.searchsorted(run.pose[:, 2], 1.0)] / run.energy[0]


def lost_sideways(name: str, model: str) -> float:
    """The part of the energy that the first metre sideways takes."""
    vehicle = vehicle_of(name)
    run = coasting(vehicle, (0.0, SPEED / vehicle.platform_radius, 0.0), 2.5 / SPEED, model)
    return 1 - run.energy[np.searchsorted(run.pose[:, 1], 1.0)] / run.energy[0]


def losses() -> list[str]:
    """Rows of the table of what changes of rollers take."""
    rows = []
    for name in NAMES:
        found = (100 * lost(name, model) for lost in (lost_by_yaw, lost_sideways) for model in MODELS)
        shown = (f"{part:.2g} %" if part > NOTHING else "0" for part in found)
        rows.append(f"| {ROBOTS[name].title} | {' | '.join(shown)} |")
    return rows


def over_a_turn(vehicle: omniroll.Vehicle, nu: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Angles of a wheel in rad over a third of a turn, and the rate of the first wheel there."""
    joint = math.pi / vehicle.rollers_per_wheel
    angles = np.linspace(0, 2 * math.pi / 3, 3001)
    chi = (angles + joint) % (2 * joint) - joint
    kernel = omniroll.kernel(vehicle, "massless")
    rates = kernel.wheel_speeds(np.tile(nu, (len(chi), 1)), np.tile(chi[:, None], (1, vehicle.wheels)))
    return angles, rates[:, 0]


def draw(folder: Path) -> None:
    with matplotlib.rc_context(pictures.STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        for name, colour in zip(NAMES, COLOURS, strict=True):
            vehicle, title = vehicle_of(name), ROBOTS[name].title
            usual = vehicle.middle_rows()[0]
            angles, rates = over_a_turn(vehicle, (0.0, 1 / vehicle.platform_radius, 0.0))
            axes[0].plot(np.degrees(angles), rates / usual[1], color=colour, label=title)
            angles, rates = over_a_turn(vehicle, (0.0, 0.0, 1.0))
            axes[1].plot(np.degrees(angles), rates / usual[2], color=colour)
            run = coasting(vehicle, (0.0, 0.0, YAW_RATE), 2.5 / YAW_RATE, "free")
            axes[2].plot(run.pose[:, 2], 100 * run.energy / run.energy[0], color=colour)
        axes[0].set(title="rate of a wheel, to the left", ylabel="over the usual kinematics'")
        axes[1].set(title="lever of a wheel, turning on the spot", ylabel="over the usual kinematics'")
        axes[2].set(title="coasting, turning on the spot", ylabel="energy, %", xlabel="heading, rad")
        for axis in axes[:2]:
            axis.set(xlabel="angle of the wheel, degrees")
        axes[0].legend(fontsize="small")
        pictures.save(figure, folder / "mecanum.png")


def main() -> None:
    lines = [
        "| robot | rollers | way sideways per turn | ripple of the rate | contact aside "
        "| leap of the lever over the wheel radius | spin at the joint | scrub |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *closed_forms(),
        "",
        f"What changes of rollers take from a robot that coasts, over a radian at {YAW_RATE:g} rad/s on the spot and "
        f"over a metre to the left from {SPEED:g} m/s:",
        "",
        "| robot | a radian, massless | locked | free | a metre, massless | locked | free |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *losses(),
    ]
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    PAGE.write_text("\n".join([f"{before}{BEGIN}", "", *lines, "", f"{END}{rest.split(END)[1]}"]), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
