"""The Python engine steps friction in time and decides nothing as the compiled engine does: a witness of it. In each
kind of friction it tends to it at first order; and what it refuses."""

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Contact, InvalidValueError, Slope, Vehicle, simulate

VEHICLE = Vehicle.paper(3, 4)
LOAD = VEHICLE.mass * 9.80665 / 3
TORQUE = 0.06 * LOAD * VEHICLE.wheel_radius
OF_ROLLERS = TORQUE / 2
SPINNING = (9.0, -3.0, 2.0)  # rad/s, of the wheels: the contacts slip, and some of them come to rest
GROUNDS = {
    "coulomb": Contact(law="coulomb", friction=(0.2, 0.3), static_friction=0.35, wheel_rates=SPINNING),
    "viscous": Contact(coefficient=(30.0, 20.0), wheel_rates=SPINNING),
    "regularised": Contact(law="regularised", friction=(0.2, 0.3), speed=0.02, wheel_rates=SPINNING),
    "rolling": None,
}
BEARINGS = {
    "none": None,
    "axles": Bearings(wheel_coulomb=TORQUE, wheel_break_away=1.5 * TORQUE),
    "rollers": Bearings(roller_coulomb=OF_ROLLERS, roller_break_away=1.5 * OF_ROLLERS),
    "both, viscous": Bearings(
        wheel_viscous=0.01 * TORQUE, wheel_coulomb=TORQUE, roller_viscous=0.01 * OF_ROLLERS, roller_coulomb=OF_ROLLERS
    ),
}
START, DURATION = {"nu": (3.0, 1.5, -4.0), "chi": (0.1, -0.2, 0.3)}, 0.06
STEPS = (20, 40, 80)
KINDS = [
    ("coulomb", "none", "free"), ("coulomb", "none", "massless"), ("coulomb", "axles", "free"),
    ("coulomb", "rollers", "free"), ("coulomb", "rollers", "massless"), ("coulomb", "both, viscous", "free"),
    ("viscous", "none", "free"), ("viscous", "axles", "massless"), ("viscous", "both, viscous", "free"),
    ("viscous", "both, viscous", "massless"), ("regularised", "none", "massless"), ("regularised", "axles", "free"),
    ("regularised", "both, viscous", "massless"), ("rolling", "axles", "locked"), ("rolling", "rollers", "massless"),
    ("rolling", "axles", "massless"), ("rolling", "both, viscous", "free"),
]  # fmt: skip


def errors(model, effects):
    """The mean distance of nu from the compiled engine's, for each number of steps, over the largest nu."""
    options = START | {"duration": DURATION, "roller_model": model, "effects": effects, "control": False}
    times = np.linspace(0, DURATION, 21)
    exact = simulate(VEHICLE, accuracy=1e-9, **options)
    assert exact.stats["engine"] == "compiled"
    found = []
    for steps in STEPS:
        run = simulate(VEHICLE, accuracy=DURATION / steps, engine="python", **options)
        assert (run.stats["engine"], run.stats["steps"]) == ("python", steps)
        assert abs(run.ledger.residual) <= 0.05 * run.energy[0]
        found.append(np.abs(run.sample(times).nu - exact.sample(times).nu).max(axis=1).mean())
    return np.array(found) / np.abs(exact.nu).max()


@pytest.mark.parametrize("ground, bearings, model", KINDS)
def test_it_tends_to_the_compiled_engine_at_first_order(ground, bearings, model):
    effects = [own for own in (GROUNDS[ground], BEARINGS[bearings]) if own is not None]
    found = errors(model, effects)
    order = -np.polyfit(np.log(STEPS), np.log(found), 1)[0]
    assert 0.8 <= order <= 1.2 and found[-1] < 2e-3, found


def test_the_error_estimate_is_that_of_twice_the_step():
    effects = [GROUNDS["coulomb"]]
    run = simulate(VEHICLE, **START, duration=0.02, accuracy=1e-3, engine="python", effects=effects)
    exact = simulate(VEHICLE, **START, duration=0.02, accuracy=1e-9, effects=effects)
    error = np.abs(run.nu[-1] - exact.nu[-1]).max() / np.abs(exact.nu).max()
    assert 0.2 * error < run.stats["error_estimate"] < 20 * error


@pytest.mark.parametrize("options, field", [
    ({"accuracy": 1e-9}, "accuracy"),  # of so many steps there would be no end
    ({"switching": "smooth", "effects": [BEARINGS["axles"]]}, "switching"),
])  # fmt: skip
def test_what_it_does_not_run_is_refused(options, field):
    given = {"accuracy": 1e-3, "effects": [GROUNDS["coulomb"]]} | options
    with pytest.raises(InvalidValueError, match="engine='compiled'") as refused:
        simulate(VEHICLE, **START, duration=0.1, engine="python", **given)
    assert refused.value.field == field


def test_what_the_compiled_engine_cannot_run_says_what_to_do(monkeypatch):
    monkeypatch.setattr(omniroll.engine.compiled_engine, "kernel_of", lambda task: None)
    with pytest.raises(omniroll.KernelsMissingError, match="C compiler"):
        simulate(VEHICLE, **START, duration=0.1, effects=[Slope(0.1)])
