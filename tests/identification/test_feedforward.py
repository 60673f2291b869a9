"""Constants of feedforwards against those by hand, and against the rates of the wheels."""

import numpy as np
import pytest

import omniroll
from omniroll.identification.feedforward import feedforward, strafe_factor

# Wheels of a robot that is not alike in its two directions
VEHICLE = omniroll.Vehicle.paper(4).replace(wheel_angles=(0.6, 2.5, 3.8, 5.6))
MOTOR = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=4)


def test_constants_of_one_motor_by_hand():
    """Three wheels on the spot: V = R/(g k) (I a/(3 R/l) ...) in the numbers of the paper's vehicle, typed here."""
    vehicle = omniroll.Vehicle.paper()
    found = feedforward(vehicle, effects=[MOTOR, omniroll.Bearings(wheel_viscous=1e-3)])["turning"]
    ratio = vehicle.platform_radius / vehicle.wheel_radius  # of the wheels' rates to the heading's
    inertia = (vehicle.yaw_inertia + 3 * vehicle.wheel_inertia * ratio**2) / (3 * ratio)
    per_volt = 4 * 0.02 / 1.5
    assert found.kA == pytest.approx(inertia / per_volt, rel=1e-9)
    assert found.kV == pytest.approx((1e-3 / per_volt + 4 * 0.02) * ratio, rel=1e-9)
    assert abs(found.kS) < 1e-12 and found.unit == "rad"


def test_the_strafe_factor():
    """One on even layouts; elsewhere what the rates of the fastest wheels say, where no friction is."""
    assert strafe_factor(feedforward(omniroll.Vehicle.paper(4), effects=[MOTOR])) == pytest.approx(1)
    bound = omniroll.kernel(VEHICLE, "massless", "python")
    ahead, aside, _ = np.abs(bound.wheel_rows.T).max(axis=1)
    assert strafe_factor(feedforward(VEHICLE, effects=[MOTOR])) == pytest.approx(ahead / aside)


def test_no_motor_no_feedforward():
    with pytest.raises(omniroll.InvalidValueError, match="must have a Motor"):
        feedforward(VEHICLE)
