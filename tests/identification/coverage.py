"""How often the intervals of fits hold the truth: logs of the oracle's motions with noise, one for each seed."""

import numpy as np

import omniroll
from identification.oracle_motion import FRICTION, KNOTS, SCHEDULES, VEHICLE, motion

TRUTH = {name: getattr(VEHICLE, name) for name in ("mass", "yaw_inertia", "wheel_inertia")} | {
    "wheel_viscous": FRICTION
}
FREE = tuple(TRUTH)
GUESS = VEHICLE.replace(mass=3.0, yaw_inertia=0.06, wheel_inertia=6e-4)  # away from the truth
GUESSED_FRICTION = 3e-3
NOISE = 0.01  # of the largest rate
STEP = 0.01  # s


def log_of(name, count, seed):
    """Rates of the wheels with noise."""
    rates = motion(name, count, STEP)
    noise = NOISE * float(np.abs(rates).max())
    noisy = rates + np.random.default_rng(seed).normal(scale=noise, size=rates.shape)
    return omniroll.Log({"t": STEP * np.arange(count), "wheel_rate": noisy}, noise={"wheel_rate": noise})


def fit_of(name, count, seed):
    acting = [omniroll.TorqueTable(KNOTS, SCHEDULES[name]), omniroll.Bearings(wheel_viscous=GUESSED_FRICTION)]
    return omniroll.fit(GUESS, log_of(name, count, seed), FREE, effects=acting)


def inside(fit):
    """(4,) int: which intervals hold the truth."""
    ends = [(*fit.interval(name), value) for name, value in TRUTH.items()]
    return np.array([low < value < high for low, high, value in ends], int)
