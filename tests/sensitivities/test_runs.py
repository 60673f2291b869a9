"""Sensitivities of runs against differences of runs, over switches of both laws and with each effect."""

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import (
    Bearings,
    Controller,
    FunctionController,
    InvalidValueError,
    Motor,
    NoDerivativeError,
    OneSidedWarning,
    Slope,
    Torque,
    TorqueTable,
)
from omniroll.kernels.kernel import kernel
from tests.sensitivities.differences import VEHICLE, Case, derivative, differenced, motion

# How much each number is changed; its size times about 1e-4.
CHANGES = {
    "nu[0]": 1e-4, "chi[1]": 1e-4, "pose[2]": 1e-4, "spins[1][2]": 1e-3, "mass": 1e-3, "yaw_inertia": 1e-6,
    "wheel_inertia": 1e-6, "roller_inertia": 1e-9, "wheel_radius": 1e-6, "roller_axis_radius": 1e-6,
    "platform_radius": 1e-5, "yaw_scale": 1e-4, "wheel_angles[1]": 1e-4,
}  # fmt: skip
MOTOR = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4, rotor_inertia=1e-6)
LIMITED = replace(MOTOR, current_limit=1.0)
CONTROLLER = Controller(target=(1, 0, 0.5), proportional=1, integral=2, sample_time=0.05, output="voltage")
VISCOUS = Bearings(wheel_viscous=1e-3, roller_viscous=1e-5)
COULOMB = Bearings(roller_coulomb=1e-4, roller_speed=0.8)
TABLE = TorqueTable((0, 0.4, 0.8), ((0, 0, 0), (0.02, 0.01, 0.03), (0.01, 0.05, -0.02)))
HELD = replace(LIMITED, times=(0, 0.37, 0.7), voltage=((1, 2, 3), (3, 1, -1), (0, 0, 1)), interpolation="hold")
BACKWARDS = replace(LIMITED, back_emf=0.0, gear_ratio=-4.0)
FOLLOWING = replace(CONTROLLER, times=(0, 0.52), target=((0, 0, 0), (1, 0, 0.5)))
WITH_EFFECTS = [
    (Case("free", effects=(VISCOUS,)), {"nu[0]": 1e-4, "wheel_viscous[1]": 1e-6, "roller_viscous": 1e-9}),
    (Case("free", effects=(COULOMB,)), {"nu[0]": 1e-4, "roller_coulomb": 1e-9, "roller_speed": 1e-4}),
    (Case("free", effects=(Slope(0.1, 0.4),)), {"pose[2]": 1e-4, "angle": 1e-4, "direction": 1e-4, "gravity": 1e-3}),
    (Case("free", effects=(TABLE,)), {"torque[1][2]": 1e-4, "chi[1]": 1e-4}),
    (Case("free", effects=(TABLE,)), {"times[1]": 1e-4, "times[2]": 1e-4}),
    (Case("free", effects=(replace(TABLE, interpolation="hold"),)), {"times[1]": 1e-4, "torque[1][0]": 1e-4}),
    (Case("locked", effects=(HELD,)), {"times[1]": 1e-4, "voltage[1][2]": 1e-3, "current_limit": 1e-4}),
    (Case("locked", effects=(BACKWARDS,)), {"current_limit": 1e-4, "voltage[0]": 1e-4}),
    (Case("free", effects=(replace(MOTOR, voltage=0), FOLLOWING)), {"times[1]": 1e-4, "target[1][0]": 1e-3}),
    (Case("free", effects=(Torque((0.01, 0.02, -0.01)),)), {"torque[1]": 1e-5}),
    (Case("free", effects=(MOTOR,)), {"voltage[1]": 1e-4, "gear_ratio": 1e-4, "back_emf": 1e-6, "resistance": 1e-4}),
    (Case("massless", effects=(MOTOR,)), {"rotor_inertia": 1e-8, "gear_ratio": 1e-4}),
    (Case("free", effects=(LIMITED,)), {"torque_constant": 1e-6, "current_limit": 1e-4, "nu[0]": 1e-4}),
    (Case("free", effects=(replace(MOTOR, voltage=0), CONTROLLER)),
     {"target[0]": 1e-3, "proportional": 1e-3, "integral[1]": 1e-3, "voltage": 1e-3, "mass": 1e-3}),
]  # fmt: skip


def check(case, changes, t=None, tolerance=1e-9, switches=2, exact=1e-13, **options):
    run = case.run(sensitivities=tuple(changes))
    assert len(run.switches) >= switches
    for name, change in changes.items():
        expected = differenced(case, name, change, t, **options)
        # Runs are exact to some 1e-14 where `exact` does not say otherwise, which the difference divides by the change.
        allowed = tolerance * np.abs(expected).max() + exact / change
        assert np.abs(derivative(run, name, t) - expected).max() <= allowed, name


@pytest.mark.parametrize("switching", ["smooth", "impact"])
@pytest.mark.parametrize("roller_model", ["massless", "locked", "free"])
def test_they_are_the_differences_of_runs(roller_model, switching):
    case = Case(roller_model, switching)
    changes = {name: change for name, change in CHANGES.items() if roller_model == "free" or "spins" not in name}
    check(case, changes)


@pytest.mark.long
@pytest.mark.parametrize(
    "case, changes", WITH_EFFECTS, ids=lambda case: type(case.effects[0]).__name__ if isinstance(case, Case) else ""
)
def test_with_each_effect(case, changes):
    check(case, changes)


@pytest.mark.parametrize("effects", [(), (VISCOUS,), (COULOMB,)], ids=["none", "viscous", "coulomb"])
def test_between_rows(effects):
    check(Case("free", effects=effects), {"nu[0]": 1e-4, "mass": 1e-3}, t=0.637)


def test_what_does_nothing_has_derivatives_that_are_exactly_zero():
    run = Case("massless").run(sensitivities=("roller_inertia", "roller_axis_radius", "pose[0]", "mass"))
    for name in ("roller_inertia", "roller_axis_radius"):
        assert not derivative(run, name).any()
    assert derivative(run, "pose[0]").tolist() == [0, 0, 0, 0, 0, 0, 1, 0, 0]
    limited = replace(LIMITED, voltage=(1, 2, 30), current_limit=0.1)
    stuck = Case("locked", effects=(limited,), duration=0.2).run(sensitivities=("voltage[2]",))
    assert not derivative(stuck, "voltage[2]").any()


TIED = {"nu": (0.0, 0.0, 1.0), "chi": (0.1, 0.1, 0.1), "pose": (0.0, 0.0, 0.0), "spins": 0.0}


@pytest.mark.parametrize("roller_model", ["massless", "locked", "free"])
def test_wheels_that_switch_together_and_stay_together(roller_model):
    start = TIED if roller_model == "free" else {name: TIED[name] for name in ("nu", "chi", "pose")}
    case = Case(roller_model, "impact", start=start, duration=4.0)
    run = case.run(sensitivities=("mass", "nu[2]"))
    assert len(run.switches) == 6
    for name, change in {"mass": 1e-3, "nu[2]": 1e-4}.items():
        assert derivative(run, name) == pytest.approx(differenced(case, name, change), abs=1e-8)


def test_impacts_in_another_order_have_no_derivative():
    case = Case("free", "impact", start=TIED, duration=4.0)
    with pytest.raises(NoDerivativeError, match=r"wheels 0, 1, 2.*by chi\[0\]") as caught:
        case.run(sensitivities=("mass", "chi[0]"))
    switch = case.run().switches.t[0]
    assert caught.value.wheels == (0, 1, 2) and caught.value.t == switch
    assert pickle.loads(pickle.dumps(caught.value)).t == switch


def test_the_smooth_law_has_one_derivative_for_each_order():
    """Of a number that grows; with one that falls the wheels switch in the opposite order."""
    case = Case("free", "smooth", start=TIED, duration=4.0)
    with pytest.warns(OneSidedWarning, match=r"together, at t = 1\.23\d*, wheels 0, 1, 2: .* by nu\[0\]"):
        found = derivative(case.run(sensitivities=("nu[0]",)), "nu[0]")

    def one_sided(by):
        ends = [motion(case.changed("nu[0]", by * part).run()) for part in (0, 0.5, 1)]
        return (4 * ends[1] - ends[2] - 3 * ends[0]) / by

    rising, falling = ((4 * one_sided(by / 2) - one_sided(by)) / 3 for by in (1e-4, -1e-4))
    assert np.abs(found - rising).max() < 1e-7
    assert np.abs(found - falling).max() > 1e-4


def test_with_massless_rollers_every_order_has_the_same_one(recwarn):
    case = Case("massless", "impact", start={name: TIED[name] for name in ("nu", "chi", "pose")}, duration=4.0)
    found = derivative(case.run(sensitivities=("nu[0]",)), "nu[0]")
    assert not [w for w in recwarn if w.category is OneSidedWarning]
    assert found == pytest.approx(differenced(case, "nu[0]", 1e-4), abs=1e-9)


@pytest.mark.parametrize("names, message", [
    ("mass", "must be a sequence of names"),
    (("mass", "mass"), "once"),
    (("weight",), "is no number of this run; there are nu, chi, pose, mass"),
    (("nu[3]",), r"places go with the shape \(3,\)"),
    (("mass[0]",), "places"),
    (("spins[0][0]",), "is no number"),
    (("wheel_viscous",), "is no number"),
])  # fmt: skip
def test_names_that_mean_nothing_are_refused(names, message):
    with pytest.raises(InvalidValueError, match=message):
        Case("locked").run(sensitivities=names)


def test_effects_that_are_not_followed_are_refused():
    own = FunctionController(lambda t, measured: (0.0, 0.0, 0.0), 0.1)
    with pytest.raises(InvalidValueError, match="not followed"):
        Case("free", effects=(own,)).run(sensitivities=("mass",))


def from_rest(proportional, integral, limit, **options):
    """One sample of a controller, whose output is held; the vehicle starts at rest."""
    loop = Controller(target=(1, 0, 0.5), proportional=proportional, integral=integral, sample_time=0.5, limit=limit)
    return Case("locked", start={"nu": (0.0, 0.0, 0.0)}, effects=(loop,), duration=0.5).run(**options)


def test_an_output_at_its_limit_is_a_kink_and_says_so():
    """The fastest wheel's output is just not cut off: a larger gain does nothing to it, a smaller one does."""
    largest = np.abs(kernel(VEHICLE, "locked", "python").wheel_speeds(np.array([1, 0, 0.5]))).max()
    gain, change = 1e-3, 1e-7
    with pytest.warns(OneSidedWarning, match="a controller's output is at its limit, at t = 0.0, wheels 2"):
        run = from_rest(gain, 0, gain * largest, sensitivities=("proportional", "mass"))
    beside = {
        side: (from_rest(gain + side * change, 0, gain * largest).nu[-1] - run.nu[-1]) / (side * change)
        for side in (1, -1)
    }
    own = run.sensitivity("proportional").nu[-1]
    assert own == pytest.approx(beside[1], rel=1e-3, abs=1e-4 * np.abs(own).max())
    assert np.abs(beside[-1] - own).max() > 0.3 * np.abs(own).max()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        from_rest(gain, 0, 0.9 * gain * largest, sensitivities=("proportional",))
        from_rest(gain, 0, gain * largest, sensitivities=("mass",))  # which moves no output of a vehicle at rest


def test_an_output_at_its_limit_that_stops_an_integral_has_no_derivative():
    largest = np.abs(kernel(VEHICLE, "locked", "python").wheel_speeds(np.array([1, 0, 0.5]))).max()
    gain, integral = 1e-3, 1e-4
    limit = (gain + 0.5 * integral) * largest
    with pytest.raises(NoDerivativeError, match="its integral goes on") as caught:
        from_rest(gain, integral, limit, sensitivities=("proportional",))
    assert caught.value.t == 0 and caught.value.wheels == (2,)


def test_a_trajectory_that_was_not_asked_says_so_and_one_that_was_can_be_pickled():
    with pytest.raises(InvalidValueError, match="not asked"):
        Case().run().sensitivity("mass")
    run = Case().run(sensitivities=("mass",))
    with pytest.raises(InvalidValueError, match="lie within the run"):
        run.sensitivity("mass", 1.5)
    again = pickle.loads(pickle.dumps(run))
    for t in (None, 0.37):
        assert np.array_equal(again.sensitivity("mass", t).nu, run.sensitivity("mass", t).nu)
    rows = run.sensitivity("mass")
    assert rows.nu.shape == run.nu.shape and rows.chi.shape == run.chi.shape and rows.pose.shape == run.pose.shape


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_a_trajectory_that_was_read_says_that_files_keep_no_derivatives(ending, tmp_path):
    run = Case().run(sensitivities=("mass",))
    run.save(tmp_path / f"run.{ending}")
    read = omniroll.Trajectory.load(tmp_path / f"run.{ending}")
    for again in (read, pickle.loads(pickle.dumps(read))):
        with pytest.raises(InvalidValueError, match="files do not keep derivatives"):
            again.sensitivity("mass")
    with pytest.raises(InvalidValueError, match="not asked"):
        pickle.loads(pickle.dumps(Case().run())).sensitivity("mass")
