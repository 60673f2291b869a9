"""Constants of feedforwards against those by hand and the wheels' rates; drives of paths against runs."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll.identification.feedforward import feedforward, strafe_factor
from omniroll.identification.path_drive import path_drive

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


def test_constants_of_a_fit_have_its_deviations():
    """From a log with noise they hold the truth; they spread as the friction and inertia that they are made of do."""
    vehicle, friction = omniroll.Vehicle.paper(), omniroll.Bearings(wheel_viscous=1e-3)
    knots = np.arange(0, 3.5, 0.5)
    driven = replace(MOTOR, voltage=2 * np.random.default_rng(1).uniform(-1, 1, (len(knots), 3)), times=knots)
    options = {"nu": (0, 0, 0), "roller_model": "massless"}
    run = omniroll.simulate(vehicle, **options, duration=3, effects=[driven, friction])
    times = np.linspace(0.01, 3, 300)
    read = run.measure(times, omniroll.Instruments(noise={"wheel_rate": 0.1}, seed=1), ["wheel_rate"])
    guess = [driven, replace(friction, wheel_viscous=2e-3)]
    log, free = omniroll.Log(read | {"t": times}), ("yaw_inertia", "wheel_viscous")
    fit = omniroll.fit(vehicle.replace(yaw_inertia=0.035), log, free, effects=guess, **options)
    found, true = feedforward(fit)["turning"], feedforward(vehicle, effects=[MOTOR, friction])["turning"]
    for name in ("kV", "kA"):
        assert 0 < abs(getattr(found, name) - getattr(true, name)) < 4 * found.deviations[name]
    ratio, per_volt = vehicle.platform_radius / vehicle.wheel_radius, 4 * 0.02 / 1.5
    of_inertia, of_friction = fit.deviations
    assert found.deviations["kA"] == pytest.approx(of_inertia / (3 * ratio * per_volt), rel=1e-6)
    assert found.deviations["kV"] == pytest.approx(of_friction * ratio / per_volt, rel=1e-6)


def test_no_motor_no_feedforward():
    with pytest.raises(omniroll.InvalidValueError, match="must have a Motor"):
        feedforward(VEHICLE)


# A path along a circle, while the vehicle turns: every wheel speeds up, and passes several joints
END = 0.6  # of the runs: the fourth of the path's knots
WAY = np.linspace(0, 1, 6) ** 2 / 2
PATH = np.linspace(0, 1, 6), np.stack([0.3 * np.sin(WAY), 0.3 * (1 - np.cos(WAY)), 5 * WAY], axis=1)
HEAVY = omniroll.Vehicle.paper().replace(roller_inertia=10 * omniroll.Vehicle.paper().roller_inertia)


def missed(sample_time, drive_model, model="free", friction=()):
    """How far from the path a run is at its end that is driven without feedback, in m; and the drive."""
    motors = [] if not friction else [MOTOR, *friction]
    drive = path_drive(HEAVY, *PATH, sample_time=sample_time, roller_model=drive_model, effects=motors)
    held = drive.torque if not friction else drive.voltage
    times, rows = drive.times, held
    acting = [omniroll.TorqueTable(times, rows, interpolation="hold")]
    if friction:
        acting = [replace(MOTOR, voltage=rows, times=times, interpolation="hold"), *friction]
    run = omniroll.simulate(HEAVY, nu=(0, 0, 0), duration=END, roller_model=model, effects=acting)
    assert 3 < len(run.switches) < drive.switches
    return np.linalg.norm(run.pose[-1, :2] - PATH[1][3, :2]), drive


@pytest.mark.parametrize("model", ["free", "locked"])
def test_a_path_is_driven_with_the_rollers_momenta_in_it(model):
    """The error of outputs that are held goes with the sample time; without the rollers' effects it stays."""
    (coarse, _), (fine, _) = missed(0.02, model, model), missed(0.005, model, model)
    without, _ = missed(0.005, "massless", model)
    assert fine < coarse / 3 and fine < without / 50


def test_paths_that_cannot_be_driven_beforehand():
    with pytest.raises(omniroll.InvalidValueError, match="roller_viscous"):
        path_drive(HEAVY, *PATH, effects=[omniroll.Bearings(roller_viscous=1e-6)])
    with pytest.raises(omniroll.InvalidValueError, match="no Contact"):
        path_drive(HEAVY, *PATH, effects=[omniroll.Contact(100.0)])
    with pytest.raises(omniroll.InvalidValueError, match="sample_time"):
        path_drive(HEAVY, *PATH, sample_time=0)


@pytest.mark.long
def test_a_path_is_driven_by_voltages_against_friction():
    friction = (omniroll.Bearings(wheel_viscous=1e-3, wheel_coulomb=0.01, wheel_speed=1e-3),)
    off, drive = missed(0.005, "locked", "locked", friction)
    assert off < 2e-4
    others = path_drive(HEAVY, *PATH, sample_time=0.005, roller_model="locked", effects=friction)
    assert np.array_equal(others.torque, drive.torque) and others.voltage is None
    without, _ = missed(0.005, "locked", "locked")
    assert without < 2e-4
