"""Question 8: what twelve derivatives of a run cost."""

import numpy as np

import omniroll
from omniroll import Bearings, Motor

from .common import Answer, Target, repeated

NU = ("nu[0]", "nu[1]", "nu[2]")
NUMBERS = ("mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "wheel_radius", "platform_radius")
NAMES = (*NU, "chi[0]", "chi[1]", "pose[2]", *NUMBERS)
START = {"nu": (1.0, 0.3, 0.8), "chi": (0.1, -0.2, 0.15)}
DURATION, REPEATS, CHANGE, MOST = 200.0, 3, 1e-5, 6.0
MOTOR = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4)
SCENES = (
    ("massless", ()),
    ("locked", ()),
    ("free", ()),
    ("free", (Bearings(wheel_viscous=1e-6, roller_viscous=1e-9),)),
    ("locked", (MOTOR,)),
)


def simulated(model, effects, start=START, **options):
    return omniroll.simulate(
        omniroll.Vehicle.paper(), **start, duration=DURATION, roller_model=model, effects=effects, **options
    )


def differenced(model, effects):
    """By central differences of two runs a number: the derivatives of the last chi and pose by nu; the others alike."""
    found = []
    for k in range(len(NAMES)):
        change = CHANGE * np.eye(3)[k % 3]
        ends = [
            simulated(model, effects, START | {"nu": START["nu"] + side * change}, control=False) for side in (-1, 1)
        ]
        if k < 3:
            found.append({part: (getattr(ends[1], part)[-1] - getattr(ends[0], part)[-1]) / (2 * CHANGE)
                          for part in ("chi", "pose")})  # fmt: skip
    return found


def error_of(run, by_nu) -> float:
    """A start k times as fast makes the same motion k times as fast: the derivatives by nu, times nu, add up to the
    duration times the rates. How far they are from that, over the largest of them."""
    rates = {"pose": run.kernel.pose_rates(run.nu[-1], run.pose[-1, 2]), "chi": run.kernel.wheel_speeds(run.nu[-1])}
    growth = max(np.abs(value).max() for one in by_nu for value in one.values())
    missed = (sum(nu * one[part] for nu, one in zip(START["nu"], by_nu, strict=True)) - DURATION * rate
              for part, rate in rates.items())  # fmt: skip
    return max(np.abs(value).max() for value in missed) / growth


def answer() -> Answer:
    rows, targets = [], []
    for model, effects in SCENES:
        run = simulated(model, effects, sensitivities=NAMES)
        plain = repeated(lambda model=model, effects=effects: simulated(model, effects) and None, REPEATS)
        own = repeated(lambda m=model, e=effects: simulated(m, e, sensitivities=NAMES) and None, REPEATS)
        differences = repeated(lambda m=model, e=effects: differenced(m, e) and None, 1)
        errors = ["", ""]
        if not effects:
            by_nu = [{part: getattr(run.sensitivity(name), part)[-1] for part in ("chi", "pose")} for name in NU]
            errors = [f"{error_of(run, found):.0e}" for found in (by_nu, differenced(model, effects))]
        ratio = own.least / plain.least
        what = ", ".join([model, *(type(effect).__name__ for effect in effects)])
        rows.append(
            [what, str(len(run.switches)), plain.in_unit(1e3), own.in_unit(1e3), f"{ratio:.1f}", errors[0],
             f"{differences.least * 1e3:.3g}", errors[1]]
        )  # fmt: skip
        targets.append(Target(f"12 derivatives within 6 runs: {what}", f"{ratio:.1f} runs", ratio <= MOST))
    return Answer(
        title="8. Twelve derivatives of a run",
        text=(
            f"The paper's vehicle over {DURATION:g} s from nu = {START['nu']}, accuracy 1e-9. ms of a plain run with "
            f"its error estimate, and of one with the derivatives by {', '.join(NAMES)}; then of the 24 runs, without "
            "error estimates, that central differences of the last row need. The error is that of the derivatives by "
            "nu, over the largest of them: a start k times as fast makes the same motion k times as fast. With effects "
            "that does not hold, and the error is not known here."
        ),
        headings=["rollers", "switches", "plain", "with 12", "ratio", "error", "24 runs", "error"],
        rows=rows,
        targets=targets,
    )
