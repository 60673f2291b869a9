"""Derivatives over events in closed form: of runs, and of runs in 40 digits, with which the hard case
`derivatives-at-events` compares."""

import numpy as np
import pytest

from omniroll import Contact
from omniroll.kernels.kernel import kernel
from omniroll.vocabulary import STANDARD_GRAVITY
from tests.sensitivities.differences import SPINS, START, VEHICLE, Case
from tests.sensitivities.test_differences import (
    LEVEL,
    ramp,
)

pytest.importorskip("flint")

from hard import true_sensitivities  # noqa: E402
from hard.setting import Setting  # noqa: E402

HEADING = 8  # in a row of nu, chi and pose
ON_THE_SPOT = LEVEL | {"chi": (0.0, 0.0, 0.0)}


def true(case, name):
    """The derivative at the end of a run, and what happens in it."""
    start = START | ({"spins": SPINS} if case.roller_model == "free" else {}) | case.start
    setting = Setting(case.roller_model, case.switching, "compiled")
    task = setting.task(case.vehicle, **start, effects=case.effects, duration=case.duration)
    return true_sensitivities.derivative_over_events(task, name)


def on_the_spot(ground, *push, duration):
    """Three wheels that do alike: numbers of the vehicle; the heading, its rate at the end and what happened of runs in
    40 digits, by a number; and the same of the compiled engine."""
    numbers = (getattr(VEHICLE, name) for name in ("wheel_inertia", "yaw_inertia", "wheel_radius", "platform_radius"))
    case = Case("massless", effects=(ground, *push), start=ON_THE_SPOT, duration=duration)

    def by(name):
        (found, log), run = true(case, name), case.run(sensitivities=(name,))
        own = np.concatenate([getattr(run.sensitivity(name), part)[-1] for part in ("nu", "chi", "pose")])
        assert own == pytest.approx(found, rel=1e-10, abs=1e-11 * np.abs(found).max())
        return found, [what[2] for what in log if what[2] != "switch"]

    return (*numbers, VEHICLE.mass * STANDARD_GRAVITY / 3), by


def test_wheels_that_come_to_rest_on_the_spot_do_as_in_closed_form():
    """J chi'' = l F, I theta'' = 3 R F, F = -mu M g/3 until l chi' + R theta' = 0; then nothing changes any more."""
    mu, rate, end = 0.01, 2.0, 1.0
    (wheel, yaw, radius, arm, load), by = on_the_spot(
        Contact(law="coulomb", friction=mu, wheel_rates=rate), duration=end
    )
    slowing = radius**2 / wheel + 3 * arm**2 / yaw
    rest, turning = radius * rate / (mu * load * slowing), -3 * arm * radius * rate / (yaw * slowing)
    found, events = by("friction")
    assert events == ["sticks"] * 3
    assert found[HEADING] == pytest.approx(turning / 2 * rest / mu, rel=1e-13)
    found, _ = by("wheel_rates")
    assert found[HEADING] == pytest.approx(turning / rate * (end - rest / 2) - turning / 2 * rest / rate, rel=1e-13)
    softer = -3 * arm**2 / yaw**2  # dslowing/dI
    of_turning, of_rest = -turning * (1 / yaw + softer / slowing), -rest * softer / slowing
    found, _ = by("yaw_inertia")
    assert found[HEADING] == pytest.approx(of_turning * (end - rest / 2) - turning / 2 * of_rest, rel=1e-12)


def test_wheels_that_let_go_together_do_as_in_closed_form():
    """While they stick (l + 3 J R^2/(l I)) F = -a t; from |F| = mu_s M g/3 on I theta'' = -3 R mu M g/3."""
    mu, static, top = 0.2, 0.3, 2.0
    ground, end = Contact(law="coulomb", friction=mu, static_friction=static), 0.5
    (wheel, yaw, radius, arm, load), by = on_the_spot(ground, ramp(top, top, top), duration=end)
    begins_by = load * (radius + 3 * wheel * arm**2 / (radius * yaw)) / top
    for name, wanted in (("static_friction", begins_by * (static - mu)), ("friction", end - static * begins_by)):
        found, events = by(name)
        assert events == ["sticks"] * 3 + ["slips"] * 3
        assert found[2] / VEHICLE.yaw_scale == pytest.approx(-3 * arm / yaw * load * wanted, rel=1e-13)


def test_a_contact_that_sticks_takes_the_slip_that_a_start_has_beside_the_run():
    """Wheels that stand, with rates that are given, stick. With another rate of one the ground makes all roll at once:
    M* nu' = J g of that wheel, with the mass matrix of rolling and chi' = g nu."""
    ground = Contact(law="coulomb", friction=0.3, wheel_rates=0.0)
    run = Case("massless", effects=(ground,), start=LEVEL, duration=0.1).run(sensitivities=("wheel_rates[1]",))
    assert run.sticks.all()
    rolling = kernel(VEHICLE, "massless", "python")
    row = np.array([rolling.wheel_speeds(unit)[1] for unit in np.eye(3)])
    expected = np.linalg.solve(rolling.mass_matrix(run.chi[0]), VEHICLE.wheel_inertia * row)
    found = run.sensitivity("wheel_rates[1]").nu
    for row in (0, -1):
        assert found[row] == pytest.approx(expected, rel=1e-12)
