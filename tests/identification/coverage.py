"""How often the intervals of fits hold the truth: logs of the oracle's motions with noise, one for each seed.

`python -m identification.coverage`, from tests/, fits all 400 logs and prints how many intervals of each number hold
the truth (5 minutes); docs/fitting.md has what it printed.
"""

import time

import numpy as np

import omniroll
from identification.oracle_motion import FRICTION, KNOTS, SCHEDULES, STEP, VEHICLE, recorded

TRUTH = {name: getattr(VEHICLE, name) for name in ("mass", "yaw_inertia", "wheel_inertia")} | {
    "wheel_viscous": FRICTION
}
FREE = tuple(TRUTH)
GUESS = VEHICLE.replace(mass=3.0, yaw_inertia=0.06, wheel_inertia=6e-4)  # away from the truth
GUESSED_FRICTION = 3e-3
NOISE = 0.01  # of the largest rate
LOGS = 400


def log_of(name, seed):
    """Rates of the wheels with noise."""
    rates = recorded(name)
    noise = NOISE * float(np.abs(rates).max())
    noisy = rates + np.random.default_rng(seed).normal(scale=noise, size=rates.shape)
    return omniroll.Log({"t": STEP * np.arange(len(rates)), "wheel_rate": noisy}, noise={"wheel_rate": noise})


def fit_of(name, seed):
    acting = [omniroll.TorqueTable(KNOTS, SCHEDULES[name]), omniroll.Bearings(wheel_viscous=GUESSED_FRICTION)]
    return omniroll.fit(GUESS, log_of(name, seed), FREE, effects=acting)


def inside(fit):
    """(4,) int: which intervals hold the truth."""
    ends = [(*fit.interval(name), value) for name, value in TRUTH.items()]
    return np.array([low < value < high for low, high, value in ends], int)


def study(seeds):
    """(S, 4) int, which intervals hold the truth, and (S, 4) errors in deviations, of fits to logs of these seeds."""
    fits = [fit_of("turning while driving", seed) for seed in seeds]
    truth = np.array(list(TRUTH.values()))
    return np.array([inside(fit) for fit in fits]), np.array([(fit.values - truth) / fit.deviations for fit in fits])


if __name__ == "__main__":
    began = time.process_time()
    held, errors = study(range(LOGS))
    for place, name in enumerate(FREE):
        spread = f"errors in deviations: mean {errors[:, place].mean():+.2f}, spread {errors[:, place].std():.2f}"
        print(f"{name:13}  {held[:, place].sum()} of {LOGS}  {spread}")
    print(f"{(time.process_time() - began) / LOGS:.2f} s of CPU a fit")
