"""Sensitivities of runs: wheels that switch together, outputs at their limits, names, files and refusals."""

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Contact, Controller, FunctionController, InvalidValueError, NoDerivativeError, OneSidedWarning
from omniroll.kernels.kernel import kernel
from tests.sensitivities.differences import TIED, VEHICLE, Case, derivative, differenced, motion
from tests.sensitivities.test_differences import LIMITED, REGULARISED, RUNNING


def test_what_does_nothing_has_derivatives_that_are_exactly_zero():
    run = Case("massless").run(sensitivities=("roller_inertia", "roller_axis_radius", "pose[0]", "mass"))
    for name in ("roller_inertia", "roller_axis_radius"):
        assert not derivative(run, name).any()
    assert derivative(run, "pose[0]").tolist() == [0, 0, 0, 0, 0, 0, 1, 0, 0]
    limited = replace(LIMITED, voltage=(1, 2, 30), current_limit=0.1)
    stuck = Case("locked", effects=(limited,), duration=0.2).run(sensitivities=("voltage[2]",))
    assert not derivative(stuck, "voltage[2]").any()


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


@pytest.mark.parametrize("law, name", [(RUNNING, "friction"), (REGULARISED, "load"), (REGULARISED, "coefficient[0]")])
def test_names_of_numbers_that_a_law_does_not_have(law, name):
    with pytest.raises(InvalidValueError, match="is no number of this run"):
        Case("massless", effects=(law,)).run(sensitivities=(name,))


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


def test_a_contact_that_carries_nothing_has_no_part_in_the_slopes_of_the_others():
    """The centre of mass of four wheels so far ahead that the load of the wheel behind would pull."""
    ground = Contact(law="regularised", friction=0.3, speed=0.05)

    def loads(mass):
        vehicle = omniroll.Vehicle.paper(4, 5).replace(mass=mass, center_of_mass=(0.1, 0.0))
        return vehicle, np.array(ground.constants(vehicle)["contact_load"])

    vehicle, own = loads(1.0)
    assert (own == 0).sum() == 1
    slopes = ground.constants_along(vehicle, {"mass": np.ones(())})["contact_load"]
    assert np.ravel(slopes) == pytest.approx((loads(1.5)[1] - loads(0.5)[1]), rel=1e-12, abs=1e-14)
