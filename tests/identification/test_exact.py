"""Fits take the derivatives of their readings from the sensitivities of runs, and differences where there are none."""

import numpy as np
import pytest

import omniroll
from omniroll.identification.model import Model
from omniroll.identification.prediction import STEP, Prediction

ROBOT = omniroll.Vehicle.paper()
DRIVE = omniroll.TorqueTable([0, 1, 2], 0.05 * np.array([[0, 0, 0], [1, -1, 2], [-1, 2, 1]]))
MOTOR = omniroll.Motor(voltage=(2, -1, 1), torque_constant=0.02, resistance=1.5, gear_ratio=4)
TIMES = np.linspace(0.02, 1.9, 150)
OF_INSTRUMENTS = ("gyro_bias", "wheel_rate_scale", "gyro_delay", "wheel_rate_delay")
CORRECTIONS = {"gyro_bias": 0.1, "gyro_delay": 0.01, "wheel_rate_scale": 1.1, "wheel_rate_delay": 0.003}


def prediction(effects, roller_model="free", torque=False):
    options = {"nu": (0.2, 0.1, 0.3), "roller_model": roller_model, "effects": tuple(effects)}
    empty = {"t": TIMES, "wheel_rate": np.zeros((len(TIMES), 3)), "gyro": np.zeros(len(TIMES))}
    log = omniroll.Log(empty | ({"net_torque": np.zeros((len(TIMES), 3))} if torque else {}))
    return Prediction(Model(ROBOT, options, omniroll.Instruments(), CORRECTIONS), [log])


def beside_differences(found, names):
    """Of each number and reading, how far the exact slopes are from differences at each time, and what is allowed."""
    sizes = [max(found.model.size(name), 0.1) for name in names]
    slopes, differences = found.slopes(names, sizes), found._differences(dict(zip(names, sizes, strict=True)))
    assert slopes.differenced == () and len(found.runs[0].switches) > 5
    for name, size, own, expected in zip(names, sizes, slopes.by_number, differences, strict=True):
        for reading, values in expected[0].items():
            # A run is exact to 1e-11, which the difference divides by its step.
            allowed = 1e-4 * np.abs(values).max() + 1e-10 / (STEP * size)
            yield (name, reading), np.abs(own[0][reading] - values).reshape(len(TIMES), -1).max(axis=1), allowed


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_they_are_those_of_differences(roller_model):
    """Motors with one constant for torque and back-EMF, numbers of the start, and instruments that err."""
    effects = [MOTOR, omniroll.Bearings(wheel_viscous=1e-3)]
    found = prediction(effects, roller_model)
    names = ("mass", "wheel_viscous", "torque_constant", "resistance", "nu[1]", *OF_INSTRUMENTS)
    for what, apart, allowed in beside_differences(found, names):
        assert apart.max() < allowed, what


STICKS = omniroll.Bearings(wheel_coulomb=1e-3)


@pytest.mark.long
def test_a_fit_says_where_it_differences():
    """Where instruments feel the torques that hold axles; scales and biases of instruments need no run."""
    found = prediction([DRIVE, STICKS], torque=True)
    slopes = found.slopes(("mass", "gyro_bias", "gyro_delay"), (1.0, 1.0, 1.0))
    assert slopes.differenced == ("mass", "gyro_delay")
    known = prediction([DRIVE, omniroll.Bearings(wheel_viscous=1e-3)])
    assert known.slopes(("gyro_delay",), (1.0,)).differenced == ()
    noise = np.random.default_rng(0).normal(scale=0.01, size=(len(TIMES), 3))
    torque = found.runs[0].measure(TIMES, names=["net_torque"])["net_torque"]
    log = omniroll.Log({"t": TIMES, "net_torque": torque + noise}, noise={"net_torque": 0.01})
    options = {key: found.model.options[key] for key in ("nu", "effects", "roller_model")}
    fit = omniroll.fit(ROBOT.replace(mass=2.4), log, ["mass"], **options)
    low, high = fit.interval("mass", 0.999)
    assert fit.differenced == ("mass",) and low < ROBOT.mass < high
    assert str(fit).endswith("mass: derivatives by differences of runs")


def test_where_wheels_switch_together_and_part_there_are_differences():
    """Impacts one after the other make another motion: there is no derivative by what parts them."""
    empty = {"t": TIMES, "wheel_rate": np.zeros((len(TIMES), 3))}
    options = {"nu": (0, 0, 1), "chi": np.zeros(3)}
    found = Prediction(Model(ROBOT, options, omniroll.Instruments()), [omniroll.Log(empty)])
    assert found.slopes(("mass",), (1.0,)).differenced == ()
    assert found.slopes(("mass", "chi[0]"), (1.0, 0.1)).differenced == ("mass", "chi[0]")


TRACKS = {"drive": {}, "track": {"wheel_radius": 0.02, "driven": False}}


@pytest.mark.parametrize("wheels", [
    {"rows": 2, "row_offset": 0.01, "rollers_per_wheel": 10}, {"roller_angle": np.pi / 4}, {"meridian_radius": 0.02},
    {"kinds": TRACKS, "wheel_kinds": ["drive", "drive", "track"]},
], ids=["two rows", "mecanum", "profile", "kinds"])  # fmt: skip
def test_wheels_whose_runs_have_no_derivatives_are_fitted_by_differences(wheels):
    """They have no library of derivatives, which a fit must not try to compile."""
    rates = {"t": TIMES, "wheel_rate": np.zeros((len(TIMES), 3)), "gyro": np.zeros(len(TIMES))}
    model = Model(ROBOT.replace(**wheels), {"nu": (0.2, 0.1, 0.3)}, omniroll.Instruments(), CORRECTIONS)
    slopes = Prediction(model, [omniroll.Log(rates)]).slopes(("mass", "gyro_bias", "gyro_delay"), (1.0, 1.0, 1.0))
    assert slopes.differenced == ("mass", "gyro_delay")
