"""Logs of MuJoCo's model with a body for each roller, whose contacts give way and slip, and fits to them.

`python -m identification.mujoco_logs`, from tests/, prints how far fits to logs of several drives are from the numbers
that MuJoCo was given; docs/fitting.md has what it printed.
"""

from itertools import product

import numpy as np

import omniroll
from omniroll.exchange.run_in_mujoco import run_in_mujoco

VEHICLE = omniroll.Vehicle.paper()
FRICTION = 8e-3  # N m s, of the axles
TRUTH = {name: getattr(VEHICLE, name) for name in ("mass", "yaw_inertia", "wheel_inertia")} | {
    "wheel_viscous": FRICTION
}
GUESS = VEHICLE.replace(mass=1.3 * VEHICLE.mass, yaw_inertia=1.3 * VEHICLE.yaw_inertia)
DURATION, STEP = 10.0, 0.01  # s
TORQUE, EVERY = 0.06, 0.25  # N m and s: size of random torques, and the time between two of them
# Longer steps, more friction and larger torques each take the contacts further from rolling, and the wheels' inertia
# with them: docs/fitting.md has by how much.
MUJOCO_STEP, GROUND_FRICTION = 1e-4, 0.5  # s, 1
SPHERES, FEW_SPHERES = 101, 31  # of a roller; of few of them it is a polygon, and wheels roll unevenly
NOISE = 0.01  # of the largest rate
DRIVES = 6


def drive_of(seed):
    """Random torques that push ahead, aside and around."""
    times = np.arange(0, DURATION + EVERY, EVERY)
    ahead, aside, around = TORQUE * np.random.default_rng(seed).normal(size=(3, len(times), 1))
    axles = np.array(VEHICLE.wheel_angles)
    rows = -ahead * np.sin(axles) + aside * np.cos(axles) + around
    rows[0] = 0
    return omniroll.TorqueTable(times, rows)


def log_of(seed, spheres):
    """What the encoders in MuJoCo's wheels read, with noise."""
    acting = [drive_of(seed), omniroll.Bearings(wheel_viscous=FRICTION)]
    run = omniroll.simulate(VEHICLE, nu=(0, 0, 0), duration=DURATION, effects=acting)
    times = STEP * np.arange(1, round(DURATION / STEP) + 1)
    found = run_in_mujoco(run, times, MUJOCO_STEP, GROUND_FRICTION, spheres)
    noise = NOISE * float(np.abs(found.wheel_rates).max())
    noisy = found.wheel_rates + np.random.default_rng(seed).normal(scale=noise, size=found.wheel_rates.shape)
    return omniroll.Log({"t": found.t, "wheel_rate": noisy}, noise={"wheel_rate": noise}, name="MuJoCo")


def fit_of(seed, spheres=SPHERES):
    acting = [drive_of(seed), omniroll.Bearings(wheel_viscous=0.7 * FRICTION)]
    return omniroll.fit(GUESS, log_of(seed, spheres), tuple(TRUTH), effects=acting)


def errors(fit):
    """By name, relative."""
    return {name: fit[name] / value - 1 for name, value in TRUTH.items()}


if __name__ == "__main__":
    print("spheres", "drive", *TRUTH, "residuals over noise", "half intervals", "doubts", sep=" | ")
    for spheres, seed in product((SPHERES, FEW_SPHERES), range(DRIVES)):
        fit = fit_of(seed, spheres)
        left = fit.residuals[0]["wheel_rate"] / fit.noise[0]["wheel_rate"]
        halves = (f"{100 * 1.96 * d / v:.1f}" for d, v in zip(fit.deviations, fit.values, strict=True))
        found = (f"{100 * error:+.1f} %" for error in errors(fit).values())
        print(spheres, seed, *found, f"{np.sqrt(np.mean(left**2)):.2f}", " ".join(halves), len(fit.doubts), sep=" | ")
