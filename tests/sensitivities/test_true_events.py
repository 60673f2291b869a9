"""The runs in 40 digits on the ground, which the hard case `derivatives-at-events` compares with, against closed forms;
and derivatives of runs against them, of one run of each kind that is quick."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, TorqueTable
from omniroll.vocabulary import STANDARD_GRAVITY
from tests.sensitivities.differences import SPINS, START, VEHICLE, Case, derivative
from tests.sensitivities.test_sticking_contacts import ROLLING, SKID, STILL

pytest.importorskip("flint")

from flint import arb  # noqa: E402
from hard import true_ground, true_sensitivities  # noqa: E402
from hard.setting import Setting  # noqa: E402

from omniroll.studies.accuracy.reference import digits  # noqa: E402

HEADING = 8  # in a row of nu, chi and pose
ON_THE_SPOT = STILL | {"chi": (0.0, 0.0, 0.0)}


def true(case, name):
    """The derivative at the end of a run, and what happens in it."""
    start = START | ({"spins": SPINS} if case.roller_model == "free" else {}) | case.start
    setting = Setting(case.roller_model, case.switching, "compiled")
    task = setting.task(case.vehicle, **start, effects=case.effects, duration=case.duration)
    return true_sensitivities.derivative_over_events(task, name)


def test_wheels_that_come_to_rest_on_the_spot_do_as_in_closed_form():
    """J chi'' = l F, I theta'' = 3 R F, F = -mu M g/3 until l chi' + R theta' = 0; then nothing changes any more."""
    mu, rate, end = 0.01, 2.0, 1.0
    ground = Contact(law="coulomb", friction=mu, wheel_rates=rate)
    found, log = true(Case("massless", effects=(ground,), start=ON_THE_SPOT, duration=end), "friction")
    radius, arm = VEHICLE.wheel_radius, VEHICLE.platform_radius
    load = VEHICLE.mass * STANDARD_GRAVITY / 3
    slowing = radius**2 / VEHICLE.wheel_inertia + 3 * arm**2 / VEHICLE.yaw_inertia
    rest = radius * rate / (mu * load * slowing)
    turning = -3 * arm * radius * rate / (VEHICLE.yaw_inertia * slowing)
    assert [what[2] for what in log if what[2] != "switch"] == ["sticks"] * 3
    assert found[HEADING] == pytest.approx(turning / 2 * rest / mu, rel=1e-13)


def test_wheels_that_let_go_together_do_as_in_closed_form():
    """While they stick (l + 3 J R^2/(l I)) F = -a t; from |F| = mu_s M g/3 on I theta'' = -3 R mu M g/3."""
    mu, static, top = 0.2, 0.3, 2.0
    radius, arm, wheel, yaw = (
        getattr(VEHICLE, name) for name in ("wheel_radius", "platform_radius", "wheel_inertia", "yaw_inertia")
    )
    load = VEHICLE.mass * STANDARD_GRAVITY / 3
    begins_by = load * (radius + 3 * wheel * arm**2 / (radius * yaw)) / top
    ground = Contact(law="coulomb", friction=mu, static_friction=static)
    push = TorqueTable((0.0, 1.0), ((0.0,) * 3, (top,) * 3))
    duration = static * begins_by + 0.02
    case = Case("massless", effects=(ground, push), start=ON_THE_SPOT, duration=duration)
    found, log = true(case, "static_friction")
    by_static = -3 * arm / yaw * load * begins_by * (static - mu)
    assert [what[2] for what in log if what[2] != "switch"] == ["sticks"] * 3 + ["slips"] * 3
    assert found[2] / VEHICLE.yaw_scale == pytest.approx(by_static, rel=1e-13)


@pytest.mark.long
@pytest.mark.parametrize("case, number", [
    (Case("massless", effects=(ROLLING,), duration=0.6), "mass"),
    (Case("massless", effects=(Contact(40.0),), duration=0.7), "coefficient"),
    (Case("free", effects=(Bearings(roller_coulomb=2e-5),), duration=0.02), "roller_coulomb"),
], ids=["coulomb", "viscous", "rollers"])  # fmt: skip
def test_derivatives_of_runs_are_differences_of_runs_in_40_digits(case, number):
    wanted, log = true(case, number)
    assert log
    found = derivative(case.run(sensitivities=(number,), accuracy=1e-12), number)
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()


def before_a_rest(run, which):
    """The last row before one of the rests in which that slip is larger than 1e-7 m/s."""
    rest = np.flatnonzero((run.sticks[1:] & ~run.sticks[:-1]).any(axis=1))[which]
    contact = np.flatnonzero(run.sticks[rest + 1] & ~run.sticks[rest])[0]
    return np.flatnonzero(np.linalg.norm(run.slip[:rest, contact], axis=-1) > 1e-7)[-1]


@pytest.mark.long
@pytest.mark.parametrize("rest", range(3))
def test_just_before_a_slip_comes_to_rest(rest):
    """There the direction of the slip turns fast, and with it the deviations of the wheels' rates and of the rollers'
    speeds, which rows have as well."""
    case = Case("free", effects=(SKID,), duration=0.3)
    run = case.run(sensitivities=("mass",))
    row = before_a_rest(run, rest)
    setting = Setting(case.roller_model, case.switching, "compiled")
    with digits(true_sensitivities.DIGITS, true_sensitivities.ORDER):
        task = setting.task(VEHICLE, **START, spins=SPINS, effects=case.effects, duration=float(run.t[row]))
        change = arb(true_sensitivities.CHANGE) * true_sensitivities.size(task, "mass")
        runs = [true_ground.Run(task, "mass", side * change) for side in (1, -1)]
        for beside in runs:
            beside.to_the_end()
        wanted = true_sensitivities.quotient(*(beside.y for beside in runs), 2 * change)
    assert sum(what[2] == "sticks" for what in runs[0].log) == rest
    assert np.abs(run.followed.rows[row, :, 0] - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.long
def test_in_the_row_of_a_rest_they_are_the_limit_before_it():
    """There the slip is zero, and its deviation is along the direction that it had last."""
    case, before = Case("free", effects=(SKID,), duration=0.0045), 1e-13
    run = case.run(sensitivities=("mass",))
    row = np.flatnonzero((run.sticks[1:] & ~run.sticks[:-1]).any(axis=1))[0]
    setting = Setting(case.roller_model, case.switching, "compiled")
    with digits(true_sensitivities.DIGITS, true_sensitivities.ORDER):
        task = setting.task(VEHICLE, **START, spins=SPINS, effects=case.effects, duration=case.duration)
        whole = true_ground.Run(task, "mass", arb(0))
        whole.to_the_end()
        rest = next(time for time, _, what in whole.log if what == "sticks")
        change = arb(10) ** -24 * true_sensitivities.size(task, "mass")
        runs = [true_ground.Run(task, "mass", side * change) for side in (1, -1)]
        for beside in runs:
            beside.end = rest - arb(before)
            beside.to_the_end()
        wanted = true_sensitivities.quotient(*(beside.y for beside in runs), 2 * change)
    assert all(not any(what[2] == "sticks" for what in beside.log) for beside in runs)
    assert np.abs(run.followed.rows[row, :, 0] - wanted).max() <= 1e-10 * np.abs(wanted).max()
