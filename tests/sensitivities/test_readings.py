"""How readings of instruments depend on the numbers of a run and on the time, against differences of readings."""

import numpy as np
import pytest

from omniroll import Bearings, Instruments, Motor, Slope, Torque
from omniroll.engine.reading_slopes import reading_slopes
from tests.sensitivities.differences import Case

MOTOR = Motor(voltage=((1, 2, 3), (3, 1, -1)), times=(0, 1), torque_constant=0.02, resistance=1.5, gear_ratio=4)
ACTING = (MOTOR, Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Slope(0.1, 0.4))
INSTRUMENTS = Instruments(place=(0.05, -0.02))
READINGS = ("wheel_angle", "wheel_rate", "net_torque", "motor_current", "motor_voltage", "gyro", "accelerometer")
CHANGES = {
    "mass": 1e-4, "wheel_radius": 1e-7, "platform_radius": 1e-6, "yaw_scale": 1e-5, "nu[0]": 1e-5, "chi[1]": 1e-5,
    "torque_constant": 1e-7, "resistance": 1e-5, "voltage[1][2]": 1e-4, "wheel_viscous": 1e-7, "angle": 1e-5,
    "gravity": 1e-3,
}  # fmt: skip
TIMES = np.linspace(0.03, 0.97, 25)


def measured(run, times=TIMES):
    return run.measure(times, INSTRUMENTS, READINGS) | {"pose": run.sample(times).pose}


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "locked", "free"])
def test_readings_by_numbers(roller_model):
    case = Case(roller_model, effects=ACTING)
    run = case.run(sensitivities=tuple(CHANGES))
    found = reading_slopes(run, TIMES, INSTRUMENTS, (*READINGS, "pose"))
    assert len(run.switches) > 3
    for column, (name, change) in enumerate(CHANGES.items(), 1):
        ahead, behind = (measured(case.changed(name, sign * change).run()) for sign in (1, -1))
        for reading, slopes in found.items():
            expected = (ahead[reading] - behind[reading]) / (2 * change)
            size = np.abs(expected).max() + 1e-9 / change
            assert np.abs(slopes[column] - expected).max() < 1e-5 * size, (name, reading)


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_readings_by_time(roller_model):
    run, step = Case(roller_model, effects=ACTING).run(sensitivities=("mass",)), 1e-5
    found = reading_slopes(run, TIMES, INSTRUMENTS, (*READINGS, "pose"))
    ahead, behind = (measured(run, TIMES + sign * step) for sign in (1, -1))
    for reading, slopes in found.items():
        expected = (ahead[reading] - behind[reading]) / (2 * step)
        assert np.abs(slopes[0] - expected).max() < 1e-6 * np.abs(expected).max() + 1e-9 / step, reading


def test_a_torque_that_is_read_and_counts_that_are_not_whole():
    run = Case("locked", effects=(Torque((0.01, 0.02, -0.01)),)).run(sensitivities=("torque[1]",))
    found = reading_slopes(run, TIMES, INSTRUMENTS, ("net_torque", "encoder_count", "wheel_angle"))
    assert (found["net_torque"][1] == [0, 1, 0]).all() and not found["net_torque"][0].any()
    assert found["encoder_count"] == pytest.approx(found["wheel_angle"] * INSTRUMENTS.counts_per_turn / (2 * np.pi))
