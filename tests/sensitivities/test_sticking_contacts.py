"""Sensitivities of runs whose contacts stick on the ground and slip on it, against closed forms and differences."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, NoDerivativeError, Slope, Torque, TorqueTable
from omniroll.kernels.kernel import kernel
from omniroll.vocabulary import STANDARD_GRAVITY
from tests.sensitivities.differences import SPINS, VEHICLE, Case
from tests.sensitivities.test_runs import TIED, check

STILL = {"nu": (0.0, 0.0, 0.0), "pose": (0.0, 0.0, 0.0)}
GROUND = Contact(law="coulomb", friction=(0.3, 0.4))
SKID = Contact(law="coulomb", friction=0.4, wheel_rates=0.0)
LETS_GO = Contact(law="coulomb", friction=(0.3, 0.35), static_friction=(0.4, 0.45))
RISING = TorqueTable((0.0, 1.0), ((0, 0, 0), (1.0, -0.6, 0.4)))
TO_AND_FRO = TorqueTable((0.0, 0.2, 0.4, 1.0), ((1.0, -0.5, 0.6), (-1.0, 0.5, -0.6), (1.0, -0.6, 0.4), (1, 1, 1)))
KICK = TorqueTable((0.0, 0.1), ((0.0, 0.0, 0.0), (2.0, -1.5, 0.4)), interpolation="hold")
NUMBERS = {"nu[0]": 1e-4, "chi[1]": 1e-4, "mass": 1e-3, "wheel_inertia": 1e-6, "wheel_radius": 1e-6,
           "platform_radius": 1e-5, "friction": 1e-3}  # fmt: skip
OF_PUSH = {"mass": 1e-3, "friction": 1e-4, "torque[1][0]": 1e-4, "times[1]": 1e-4}
FOUR = VEHICLE.replace(wheels=4, wheel_angles=(0.7, 2.3, 3.9, 5.6), center_of_mass=(0.01, -0.005))
FOUR_START = {"chi": (0.1, -0.2, 0.15, 0.05), "spins": np.random.default_rng(0).normal(size=(4, SPINS.shape[1]))}
ROLLING = Contact(law="coulomb", friction=(0.3, 0.4), wheel_rates=(3.0, -2.0, 1.0))
TILTED = Contact(law="coulomb", friction=0.3, normal_gravity=9.6)
LOADS = Contact(law="coulomb", friction=0.3, load=(10.0, 12.0, 9.0))
OF_STATIC = {"static_friction": 1e-4, "static_friction[0]": 1e-2}
CASES = {
    "rolling, massless": (Case("massless", effects=(ROLLING,)), NUMBERS),
    "rolling, free": (Case("free", effects=(GROUND,)), NUMBERS | {"spins[1][2]": 1e-3, "roller_inertia": 1e-9}),
    "skid": (Case("free", effects=(SKID,), duration=0.3), NUMBERS),
    "lets go, massless": (Case("massless", effects=(LETS_GO, RISING), start=STILL, duration=0.6), OF_PUSH | OF_STATIC),
    "lets go, free": (Case("free", effects=(LETS_GO, RISING), start=STILL, duration=0.5), OF_PUSH | OF_STATIC),
    "one friction": (Case("free", effects=(GROUND, RISING), start=STILL, duration=0.4), OF_PUSH),
    "kicked": (Case("massless", effects=(Contact(law="coulomb", friction=0.05), KICK), start=STILL, duration=0.15),
               {"times[1]": 1e-4, "mass": 1e-3, "friction": 1e-5}),
    "turns back": (Case("massless", effects=(Contact(law="coulomb", friction=0.1), TO_AND_FRO), duration=0.8),
                   OF_PUSH | {"nu[1]": 1e-3}),
    "four wheels": (Case("free", vehicle=FOUR, effects=(SKID,), start=FOUR_START, duration=0.4),
                    {"mass": 1e-3, "platform_radius": 1e-5, "wheel_angles[2]": 1e-4, "center_of_mass[0]": 1e-4}),
    "slope": (Case("free", effects=(TILTED, Slope(0.1, 0.4)), duration=0.6),
              {"angle": 1e-4, "mass": 3e-3, "pose[2]": 1e-4}),
    "bearings": (Case("free", effects=(GROUND, Bearings(wheel_viscous=1e-3, roller_viscous=1e-5)), duration=0.6),
                 {"wheel_viscous[1]": 1e-6, "roller_viscous": 1e-8, "nu[0]": 1e-4}),
    "loads that are given": (Case("free", effects=(LOADS,)), {"load[1]": 1e-2, "mass": 1e-3}),
}  # fmt: skip


def _of_vehicle():
    names = ("wheel_inertia", "yaw_inertia", "wheel_radius", "platform_radius", "mass")
    return tuple(getattr(VEHICLE, name) for name in names)


@pytest.mark.long
@pytest.mark.parametrize("case, changes", CASES.values(), ids=CASES)
def test_they_are_the_differences_of_runs(case, changes):
    run = case.run()
    changes_modes = (run.sticks[1:] != run.sticks[:-1]).any()
    assert changes_modes or ((run.slip[..., 1].min(axis=0) < 0) & (run.slip[..., 1].max(axis=0) > 0)).any()
    check(case, changes, switches=0)


@pytest.mark.long
def test_on_the_way_to_rest():
    """At times in the middle of steps, while the slip falls and its direction turns."""
    case = CASES["rolling, free"][0]
    run = case.run()
    assert not run.sticks[np.searchsorted(run.t, 0.3815)].all()
    check(case, {"nu[0]": 1e-4, "mass": 1e-3, "friction[0]": 1e-3}, t=0.3815)


def _spun(duration, friction, **options):
    """Three wheels that spin alike on the spot of a vehicle that stands, until the ground has taken it along."""
    ground = Contact(law="coulomb", friction=friction, wheel_rates=2.0)
    case = Case("massless", effects=(ground,), start=STILL | {"chi": (0.0, 0.0, 0.0)}, duration=duration)
    return case.run(**options)


def test_wheels_that_spin_on_the_spot_come_to_rest_as_in_closed_form():
    """J chi'' = l F, I theta'' = 3 R F, F = -mu M g/3 until l chi' + R theta' = 0; then nothing changes any more."""
    mu, rate, end = 0.01, 2.0, 1.0
    wheel, yaw, radius, arm, mass = _of_vehicle()
    force, slowing = mu * mass * STANDARD_GRAVITY / 3, radius**2 / wheel + 3 * arm**2 / yaw
    rest, turning = radius * rate / (force * slowing), -3 * arm * radius * rate / (yaw * slowing)
    run = _spun(end, mu, sensitivities=("friction", "wheel_rates", "yaw_inertia"))
    assert 0 < rest < end / 2 and run.sticks[-1].all() and not run.sticks[0].any()
    assert run.pose[-1, 2] == pytest.approx(turning * (end - rest / 2), rel=1e-12)
    by_rest = -turning / 2  # of the heading at the end, while theta' stays what it comes to
    found = {name: run.sensitivity(name).pose[-1, 2] for name in ("friction", "wheel_rates", "yaw_inertia")}
    assert found["friction"] == pytest.approx(by_rest * -rest / mu, rel=1e-11)
    assert found["wheel_rates"] == pytest.approx(turning / rate * (end - rest / 2) + by_rest * rest / rate, rel=1e-11)
    softer = -3 * arm**2 / yaw**2  # dslowing/dI
    of_turning, of_rest = -turning * (1 / yaw + softer / slowing), -rest * softer / slowing
    expected = of_turning * (end - rest / 2) + by_rest * of_rest
    assert found["yaw_inertia"] == pytest.approx(expected, rel=1e-11)


def _let_go(names, mu=0.2, static=0.3, top=2.0, end=0.8):
    ground = Contact(law="coulomb", friction=mu, static_friction=static)
    push = TorqueTable((0.0, 1.0), ((0.0,) * 3, (top,) * 3))
    case = Case("massless", effects=(ground, push), start=STILL | {"chi": (0.0, 0.0, 0.0)}, duration=end)
    return case.run(sensitivities=names)


def test_wheels_that_let_go_together_do_as_in_closed_form():
    """While they stick (l + 3 J R^2/(l I)) F = -a t; from |F| = mu_s M g/3 on I theta'' = -3 R mu M g/3."""
    mu, static, top, end = 0.2, 0.3, 2.0, 0.8
    wheel, yaw, radius, arm, mass = _of_vehicle()
    load, lever = mass * STANDARD_GRAVITY / 3, radius + 3 * wheel * arm**2 / (radius * yaw)
    start = static * load * lever / top
    run = _let_go(("friction", "static_friction", "torque[1]", "times[1]"))
    assert start < end and run.sticks[0].all() and not run.sticks[-1].any()

    def rate(mu=mu, static=static, top=top):
        """theta' at the end, as numbers that carry tangents go through it."""
        begins = static * load * lever / top
        return -3 * arm / yaw * (static * load * begins / 2 + mu * load * (end - begins))

    assert run.nu[-1, 2] / VEHICLE.yaw_scale == pytest.approx(rate(), rel=1e-11)
    step = 1e-30
    by = {
        "friction": rate(mu=mu + 1j * step).imag / step,
        "static_friction": rate(static=static + 1j * step).imag / step,
        "torque[1]": rate(top=top + 1j * step).imag / step,
    }
    by["times[1]"] = -top * by["torque[1]"]  # the slope is top/time
    for name, expected in by.items():
        found = run.sensitivity(name).nu[-1, 2] / VEHICLE.yaw_scale
        assert found == pytest.approx(expected, rel=1e-10), name


def test_a_contact_that_sticks_takes_the_slip_that_a_start_has_beside_the_run():
    """Wheels that stand, with rates that are given, stick. With another rate of one the ground makes all roll at once:
    M* nu' = J g of that wheel, with the mass matrix of rolling and chi' = g nu."""
    ground = Contact(law="coulomb", friction=0.3, wheel_rates=0.0)
    run = Case("massless", effects=(ground,), start=STILL, duration=0.1).run(sensitivities=("wheel_rates[1]",))
    assert run.sticks.all()
    rolling = kernel(VEHICLE, "massless", "python")
    row = np.array([rolling.wheel_speeds(unit)[1] for unit in np.eye(3)])
    expected = np.linalg.solve(rolling.mass_matrix(run.chi[0]), VEHICLE.wheel_inertia * row)
    found = run.sensitivity("wheel_rates[1]").nu
    for row in (0, -1):
        assert found[row] == pytest.approx(expected, rel=1e-12)


def _at_edge():
    """Wheels whose slip comes to rest at 0.01 s under torques that are 1e-8 less than what keeps it up."""
    wheel, yaw, radius, arm, mass = _of_vehicle()
    torque = 0.3 * mass * STANDARD_GRAVITY / 3 * (radius + 3 * wheel * arm**2 / (radius * yaw))
    ground = Contact(law="coulomb", friction=0.3, wheel_rates=0.01 * 1e-8 * torque / wheel)
    start = STILL | {"chi": (0.0,) * 3}
    return Case("massless", effects=(ground, Torque((1 - 1e-8) * torque)), start=start, duration=0.02)


@pytest.mark.parametrize(
    "case, names, reason",
    [
        (Case("massless", effects=(LETS_GO, TorqueTable((0.0, 1.0), ((0,) * 3, (2.0,) * 3))),
              start=STILL | {"chi": (0.0, 0.0, 0.0)}), ("torque[1][0]",), "apart where a number changes; by torque"),
        (Case("free", effects=(Contact(law="coulomb", friction=1.0),), start=TIED, duration=1.3), ("chi[0]",),
         "more than one order"),
        (_at_edge(), ("mass",), "only just|all its friction"),
    ],
    ids=["together", "orders", "only just"],
)  # fmt: skip
def test_where_there_is_none(case, names, reason):
    with pytest.raises(NoDerivativeError, match=reason) as caught:
        case.run(sensitivities=names)
    assert 0 < caught.value.t < case.duration and caught.value.wheels
