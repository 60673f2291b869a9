"""What a fit of 8 numbers to 10 s at 200 Hz does: counted, since seconds depend on the machine and on who else uses it.

`python -m identification.test_cost_of_fits`, from tests/, prints the seconds of a core that docs/fitting.md has.
"""

import time

import numpy as np
import pytest

import omniroll
from identification.coverage import GUESS, GUESSED_FRICTION
from identification.oracle_motion import FRICTION, KNOTS, SCHEDULES, VEHICLE
from omniroll.identification import exact, prediction

FREE = (
    "mass", "yaw_inertia", "wheel_inertia", "wheel_viscous", "roller_viscous", "gyro_bias", "gyro_delay",
    "wheel_rate_scale",
)  # fmt: skip
DRIVE = omniroll.TorqueTable(KNOTS, SCHEDULES["turning while driving"])
INSTRUMENTS = omniroll.Instruments(noise={"wheel_rate": 0.14, "gyro": 0.03}, bias={"gyro": 0.02}, seed=1)
TIMES = 0.005 * np.arange(1, 2001)


def log():
    acting = [DRIVE, omniroll.Bearings(wheel_viscous=FRICTION, roller_viscous=1e-5)]
    run = omniroll.simulate(VEHICLE, nu=(0, 0, 0), duration=10.1, effects=acting)
    return omniroll.Log(run.measure(TIMES, INSTRUMENTS, ["wheel_rate", "gyro"]) | {"t": TIMES})


def fit_to(given):
    acting = [DRIVE, omniroll.Bearings(wheel_viscous=GUESSED_FRICTION, roller_viscous=2e-5)]
    return omniroll.fit(GUESS, given, FREE, instruments=omniroll.Instruments(noise=INSTRUMENTS.noise), effects=acting)


@pytest.mark.long
def test_eight_numbers_take_few_runs_and_fewer_derivatives(monkeypatch):
    durations = {"run_of": [], "with_sensitivities": []}
    run_of, with_sensitivities = prediction.run_of, exact.with_sensitivities

    def counted_run(*given):
        run = run_of(*given)
        durations["run_of"].append(run.t[-1])
        return run

    def counted_derivatives(run, *given):
        durations["with_sensitivities"].append(run.t[-1])
        return with_sensitivities(run, *given)

    monkeypatch.setattr(prediction, "run_of", counted_run)
    monkeypatch.setattr(exact, "with_sensitivities", counted_derivatives)
    fit = fit_to(log())
    whole = {name: sum(end > 9 for end in ends) for name, ends in durations.items()}
    assert fit.differenced == () and 3 <= whole["with_sensitivities"] <= 6 and whole["run_of"] <= 20, whole
    for name in ("mass", "yaw_inertia", "wheel_inertia"):
        low, high = fit.interval(name, 0.999)
        assert low < getattr(VEHICLE, name) < high


if __name__ == "__main__":
    given = log()
    for _ in range(5):
        began = time.process_time()
        fit_to(given)
        print(f"{time.process_time() - began:.2f} s")
