"""How readings of instruments depend on the numbers of a run and on the time, against differences of readings."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, Instruments, Motor, Slope, Torque
from omniroll.identification.reading_slopes import reading_slopes
from tests.sensitivities.differences import Case

MOTOR = Motor(voltage=((1, 2, 3), (3, 1, -1)), times=(0, 1), torque_constant=0.02, resistance=1.5, gear_ratio=4)
ACTING = (MOTOR, Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Slope(0.1, 0.4))
INSTRUMENTS = Instruments(
    place=(0.05, -0.02), tracking_places=[(0.02, 0.1)], tracking_directions=[0.1], tracking_radius=0.02
)
READINGS = (
    "wheel_angle", "wheel_rate", "tracking_angle", "tracking_rate", "net_torque", "motor_current", "motor_voltage",
    "gyro", "accelerometer",
)  # fmt: skip
CHANGES = {
    "mass": 1e-4, "wheel_radius": 1e-7, "platform_radius": 1e-6, "yaw_scale": 1e-5, "nu[0]": 1e-5, "chi[1]": 1e-5,
    "torque_constant": 1e-7, "resistance": 1e-5, "voltage[1][2]": 1e-4, "wheel_viscous": 1e-7, "angle": 1e-5,
    "gravity": 1e-3,
}  # fmt: skip
TIMES = np.linspace(0.03, 0.97, 25)
GRIPS = {"friction": 0.3, "wheel_rates": 0}
GROUNDS = {
    "viscous": (Contact(30.0, wheel_rates=0), Bearings(wheel_viscous=1e-3, roller_viscous=1e-6)),
    "regularised": (Contact(law="regularised", speed=0.05, normal_gravity=9.79, **GRIPS), Slope(0.05, 0.4)),
    "coulomb": (Contact(law="coulomb", **GRIPS),),
}


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
@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_readings_of_wheels_that_slip(roller_model, ground):
    """Times at which an event comes between the runs that are compared say nothing: at most two of them."""
    case = Case(roller_model, effects=(MOTOR, *GROUNDS[ground]), duration=0.6)
    changes = {name: CHANGES[name] for name in ("mass", "wheel_radius", "nu[0]", "voltage[1][2]", "torque_constant")}
    changes |= {} if ground == "viscous" else {"friction": 1e-5}
    times, step = np.linspace(0.03, 0.57, 25), 1e-6
    run = case.run(sensitivities=tuple(changes))
    found = reading_slopes(run, times, INSTRUMENTS, (*READINGS, "pose"))
    beside = [[measured(run, times + sign * step) for sign in (1, -1)]]
    beside += [[measured(case.changed(n, sign * by).run(), times) for sign in (1, -1)] for n, by in changes.items()]
    assert len(run.switches) > 3 and np.abs(run.slip).max() > 0.01
    for column, (by, (ahead, behind)) in enumerate(zip((step, *changes.values()), beside, strict=True)):
        for reading, slopes in found.items():
            expected = (ahead[reading] - behind[reading]) / (2 * by)
            size = np.abs(expected).max() + 1e-9 / by
            apart = np.abs(slopes[column] - expected).reshape(len(times), -1).max(axis=1)
            assert np.sort(apart)[-3] < 1e-5 * size, (column, reading)


def test_a_torque_that_is_read_and_counts_that_are_not_whole():
    run = Case("locked", effects=(Torque((0.01, 0.02, -0.01)),)).run(sensitivities=("torque[1]",))
    found = reading_slopes(run, TIMES, INSTRUMENTS, ("net_torque", "encoder_count", "wheel_angle"))
    assert (found["net_torque"][1] == [0, 1, 0]).all() and not found["net_torque"][0].any()
    assert found["encoder_count"] == pytest.approx(found["wheel_angle"] * INSTRUMENTS.counts_per_turn / (2 * np.pi))
