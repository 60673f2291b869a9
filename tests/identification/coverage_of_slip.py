"""How often the intervals of fits to a log's slip hold the truth: logs of ground_motion.py, not of this simulator.

`python -m identification.coverage_of_slip`, from tests/, fits 400 logs on each ground, one for each seed, and writes
what it finds into docs/fitting.md (20 minutes).
"""

import time
from pathlib import Path

import numpy as np

import omniroll
from identification import ground_motion
from identification.ground_motion import KNOTS, ROWS, START_RATES, STEP, TRUTHS, VOLTS, motion

VEHICLE = omniroll.Vehicle(
    wheels=3, rollers_per_wheel=ground_motion.ROLLERS, wheel_angles=ground_motion.ALPHA,
    platform_radius=ground_motion.R, wheel_radius=ground_motion.L, roller_axis_radius=ground_motion.AXIS,
    mass=TRUTHS["viscous"].mass, yaw_inertia=ground_motion.YAW_INERTIA, wheel_inertia=ground_motion.WHEEL_INERTIA,
    roller_inertia=ground_motion.ROLLER_INERTIA,
)  # fmt: skip
NUMBER = {"viscous": "coefficient", "coulomb": "friction"}
AWAY = (1.15, 0.8, 1.3)  # where a fit begins, over the truth: mass, wheel_viscous, the ground's number
NOISE = {"wheel_rate": 0.3, "pose": 0.003}  # rad/s, and m and rad of a tracker
LOGS = 400
PAGE = Path(__file__).parents[2] / "docs/fitting.md"
BEGIN, END = "<!-- written by identification.coverage_of_slip -->\n", "<!-- up to here -->\n"


def names(law):
    return ("mass", "wheel_viscous", NUMBER[law])


def truth(law):
    own = TRUTHS[law]
    return np.array([own.mass, own.wheel_viscous, own.ground])


def acting(law, wheel_viscous, ground):
    """Motors, bearings and the ground as the simulator has them."""
    motor = omniroll.Motor(
        voltage=VOLTS, times=KNOTS, torque_constant=ground_motion.TORQUE_CONSTANT,
        resistance=ground_motion.RESISTANCE, gear_ratio=ground_motion.GEAR,
    )  # fmt: skip
    start = {"wheel_rates": START_RATES, "contact_spins": 0}
    contact = omniroll.Contact(law=law, **{NUMBER[law]: ground}, **start)
    return [motor, omniroll.Bearings(wheel_viscous=wheel_viscous), contact]


def log_of(law, seed, rows=ROWS):
    """Encoders' rates and a tracker's pose, with noise."""
    rng = np.random.default_rng([seed, len(law)])
    exact = dict(zip(NOISE, motion(law, rows), strict=True))
    noisy = {name: value + rng.normal(scale=NOISE[name], size=value.shape) for name, value in exact.items()}
    return omniroll.Log({"t": STEP * np.arange(rows)} | noisy, noise=NOISE)


def fit_of(law, seed, rows=ROWS):
    mass, wheel_viscous, ground = AWAY * truth(law)
    guess = VEHICLE.replace(mass=mass)
    return omniroll.fit(guess, log_of(law, seed, rows), names(law), effects=acting(law, wheel_viscous, ground))


def rows_of(law):
    """Lines of the page's table: of 400 logs."""
    fit_of(law, 0)  # what is compiled once is compiled
    began = time.process_time()
    fits = [fit_of(law, seed) for seed in range(LOGS)]
    seconds = (time.process_time() - began) / LOGS
    assert not any(fit.differenced for fit in fits)
    errors = np.array([(fit.values - truth(law)) / fit.deviations for fit in fits])
    for k, name in enumerate(names(law)):
        ends = np.array([fit.interval(name) for fit in fits])
        held = int(((ends[:, 0] < truth(law)[k]) & (truth(law)[k] < ends[:, 1])).sum())
        about = f"{held} | {errors[:, k].mean():+.2f} | {errors[:, k].std():.2f}"
        yield f"| {law if not k else ''} | {name} | {about} | {f'{seconds:.1f} s' if not k else ''} |"


def written(lines):
    """The page with these lines in the place of those that it has."""
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    _, after = rest.split(END)
    head = "| ground | number | hold | mean error in deviations | spread of it | a fit takes |\n" + 6 * "| --- " + "|\n"
    return before + BEGIN + head + "".join(f"{line}\n" for line in lines) + END + after


if __name__ == "__main__":
    lines = [line for law in TRUTHS for line in rows_of(law)]
    print("\n".join(lines))
    PAGE.write_text(written(lines), encoding="utf-8")
