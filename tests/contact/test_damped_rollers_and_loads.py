"""Massless rollers whose bearings stick and have viscous friction, too, beside the law coulomb where loads follow the
motion: every body, a closed form, and the laws in every row."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from contact.in_steps import assert_samples_are_those_of_finer_runs
from contact.test_axles_under_loads import run_or_stop
from contact.test_massless_rollers import BOTH, contact_torques, first_row
from contact.test_massless_rollers_and_loads import (
    AHEAD,
    BEHIND,
    HEIGHT,
    RELATIVE,
    ROLLS,
    TILTS,
    TRICYCLE,
    assert_moves_as_every_body,
)
from contact.test_massless_rollers_that_stick import CROSS, DISTANCE, GRAVITY, INSTANT, LAW, MASSLESS, RADIUS, RHO
from contact.test_massless_rollers_that_stick_and_drag import BEARINGS, FRICTION, assert_rows_obey, dragging
from contact.test_moving_loads import numbers
from contact.test_newton_euler import slipping_case
from omniroll import Bearings, Contact, InvalidValueError, SimulationStopped, Slope, Torque, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

MU = np.array([0.5, 0.4])

# ---- every body ------------------------------------------------------------------------------------------------------


def standing_case(wheels, engine, attempts=300):
    """A machine that stands on all its wheels as it moves, its run over an instant, its drives' torques and its
    bearings' numbers; contacts slip on rollers that turn and that stick, one along its axle alone, one rolls."""
    sliding = np.where(np.arange(wheels) % 3 == 2, 0.3, 8e-3)
    for attempt in range(attempts):
        rng = np.random.default_rng([78, wheels, attempt])
        case = slipping_case(rng, wheels, 4, "massless", has_layout=True)
        bare = kernel(case.vehicle, "massless", "python")
        nu, rates = case.nu / 8, case.rates / 8
        rates[:2] = bare.wheel_rates(nu, case.chi)[0][:2]
        case, torque = replace(case, nu=nu, rates=rates), 0.05 * rng.normal(size=wheels)
        damping = 10 ** rng.uniform(-4, -1, wheels)
        damping[0] = 1e-4
        ground = Contact(law="coulomb", friction=tuple(MU), loads="dynamic", **numbers(case), wheel_rates=rates)
        with contextlib.suppress(InvalidValueError, SimulationStopped):  # it tips
            run = simulate(case.vehicle, **case.start(), duration=0, control=False, engine=engine, effects=[
                ground, Bearings(roller_coulomb=sliding, roller_viscous=damping), Torque(torque)])  # fmt: skip
            turns, sticks = np.abs(run.contact_spin[0]) > 1e-6, run.sticks[0]
            kinds = (turns & sticks).any() and (~turns & ~sticks).any()
            alone = turns & ~sticks & (np.abs(run.slip[0, :, 1]) < 1e-12)
            if run.ground_load[0].min() > 0 and kinds and alone.any() and (turns & ~sticks & ~alone).any():
                return case, run, torque, sliding, damping
    raise AssertionError("none stands")


@BOTH
@pytest.mark.parametrize("wheels", [4, 6])
def test_modes_and_loads_agree_with_every_body(wheels, engine):
    """The oracle gets the bearings' torques and the forces across; it must find the accelerations, the forces along the
    axles, and the loads, whose ellipses have the forces of slips and spins that share the speed along the axle."""
    case, run, torque, sliding, damping = standing_case(wheels, engine)
    slip, force, load, spin = run.slip[0], run.ground_force[0], run.ground_load[0], run.contact_spin[0]
    taken = contact_torques(run)[0] - damping * spin
    assert_moves_as_every_body(case, run, taken, torque)
    rho = case.vehicle.wheel_radius * np.cos(case.chi) - case.vehicle.roller_axis_radius
    bare = kernel(case.vehicle, "massless", "python")
    speed = rho * bare.wheel_rates(case.nu, case.chi)[1]
    turns, sticks = np.abs(spin) > 1e-6, run.sticks[0]
    assert slip[:, 0] + rho * spin == pytest.approx(speed, rel=RELATIVE, abs=1e-12)
    assert force[turns, 0] == pytest.approx((-np.sign(speed) * sliding - damping * spin)[turns] / rho[turns], rel=1e-9)
    taken_of = np.linalg.norm(force / MU, axis=1)
    assert taken_of[~sticks] == pytest.approx(load[~sticks], rel=RELATIVE) and (taken_of <= load * (1 + LAW)).all()
    normal = force / MU**2
    turned = slip[:, 0] * normal[:, 1] - slip[:, 1] * normal[:, 0]
    assert np.abs(turned[~sticks]).max() <= RELATIVE * np.abs(slip).max() * np.abs(normal).max()
    assert ((slip * normal).sum(axis=1)[~sticks] < 0).all()


# ---- a closed form ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine, accuracy", [("compiled", 1e-9), ("python", 1e-9), ("python", 1e-10)])
def test_a_front_wheel_that_loses_load_slips_along_its_axle_as_the_vehicle_gets_faster(engine, accuracy):
    """Two wheels push with 2 tau/l = P; in front a roller turns with T/rho + d v, and N = W/3 - L x'' with
    L = (M h + 2 J/l)/0.3. Its contact slips where that is mu N; from there on x'' = (P - mu W/3)/(M + 2 J/l^2 - mu L),
    and the roller keeps the speed at which its bearing takes mu N."""
    friction, torque, push = 0.5, 0.05, 6.0
    held, whole = torque / RHO, TRICYCLE.mass + ROLLS
    lifts, weight = (TRICYCLE.mass * HEIGHT + TILTS) / (AHEAD - BEHIND), TRICYCLE.mass * GRAVITY
    damper, first = 60.0, (push - held) / whole
    # held + (push - held) (1 - e) = friction (weight/3 - lifts first e), e = exp(-damper t/whole)
    left = (push - friction * weight / 3) / (push - held - friction * lifts * first)
    slides = -whole / damper * np.log(left)
    assert 0 < left < 0.9
    reached = (push - held) / damper * (1 - left)
    ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=HEIGHT, normal_gravity=GRAVITY)
    bearings = Bearings(roller_coulomb=torque, roller_viscous=damper * RHO**2)
    drive = Torque((0.0, push * RADIUS / 2, push * RADIUS / 2))
    run = simulate(TRICYCLE, nu=(0, 0, 0), duration=1.01 * slides, effects=[ground, bearings, drive],
                   accuracy=accuracy, **MASSLESS | {"engine": engine})  # fmt: skip
    assert run.stats["engine"] == engine
    row = first_row(~run.sticks[:, 0])
    assert run.t[row] == pytest.approx(slides, rel=INSTANT)
    acceleration = (push - friction * weight / 3) / (whole - friction * lifts)
    load = weight / 3 - lifts * acceleration
    speed = reached + acceleration * 0.01 * slides
    rolls = (friction * load - held) / damper
    assert run.ground_load[-1, 0] == pytest.approx(load, rel=1e-10)
    assert np.abs(run.contact_spin[-1, 0]) * RHO == pytest.approx(rolls, rel=1e-10)
    assert np.abs(run.slip[-1, 0]) == pytest.approx([speed - rolls, 0], rel=1e-8, abs=1e-12)


# ---- runs ------------------------------------------------------------------------------------------------------------


def scene(number, lowest=0.02, highest=0.06):
    """One of the scenes of rollers that stick and drag, whose loads follow the motion."""
    vehicle, options = dragging(number)
    rng = np.random.default_rng([18, number])
    contact, *others = options["effects"]
    ground = replace(contact, loads="dynamic", height=float(rng.uniform(lowest, highest)))
    return vehicle, options | {"effects": [ground, *others], "accuracy": 1e-9}


def assert_the_laws_hold(number, duration, engine="python", bound=LAW):
    vehicle, options = scene(number)
    run, _ = run_or_stop(vehicle, options, engine, duration)
    assert_rows_obey(vehicle, options, run, number, bound)
    return run


@pytest.mark.parametrize("number", [15, 19])
def test_the_laws_hold_in_every_row(number):
    assert_the_laws_hold(number, 0.003)


@pytest.mark.long
@pytest.mark.parametrize("number", [4, 12])
def test_the_laws_hold_in_every_row_of_more_scenes(number):
    run = assert_the_laws_hold(number, 0.003)
    assert (~run.sticks & (np.abs(run.contact_spin) > 1e-6)).any(), "none slips and turns"


@pytest.mark.long
def test_a_contact_comes_to_rest_on_a_roller_that_turns():
    end = 4e-4
    run = assert_the_laws_hold(46, end)
    rests = run.sticks[-1]
    assert run.t[-1] == end and rests.any() and not run.sticks[0, rests].any()
    assert (np.abs(run.contact_spin[-1, rests]) > 1).all()


def test_samples_between_rows_are_those_of_finer_runs():
    vehicle, options = scene(15)
    names = ("slip", "ground_force", "ground_load", "contact_spin")
    times = np.linspace(0.0003, 0.0027, 5)
    assert_samples_are_those_of_finer_runs(vehicle, options | {"duration": 0.003}, times, names, 1e-9)


@pytest.mark.long
def test_the_smooth_law_tends_to_it_as_its_speed_goes_to_zero():
    """While all contacts slip and all rollers turn, at second order of that speed: the motion there is that of another
    law, on the compiled engine."""
    end = 0.02
    times = np.linspace(0, end, 7)
    numbers = {"friction": FRICTION, "wheel_rates": 0, "normal_gravity": GRAVITY, "loads": "dynamic", "height": 0.05}
    options = MASSLESS | {"nu": (0.6 / DISTANCE, 0.4 / DISTANCE, 3.0), "duration": end, "accuracy": 1e-9}
    others = [BEARINGS, Slope(0.2, 1.0)]
    limit = simulate(CROSS, effects=[Contact(law="coulomb", **numbers), *others], **options)
    assert not limit.sticks.any() and (np.abs(limit.contact_spin) > 1).any(axis=0).all()

    def distance(speed):
        ground = Contact(law="regularised", speed=speed, **numbers)
        return distance_at(simulate(CROSS, effects=[ground, *others], **options), limit, times)

    far, near = distance(1e-3), distance(1e-4)
    assert far < 1e-6
    assert np.log10(far / near) == pytest.approx(2, abs=0.05)


def test_derivatives_are_refused():
    effects = [Contact(law="coulomb", friction=FRICTION, loads="dynamic", height=0.01), BEARINGS]
    options = MASSLESS | {"nu": (1.0, 0, 0), "duration": 1e-3}
    with pytest.raises(InvalidValueError, match="roller_viscous.*is not followed"):
        simulate(CROSS, effects=effects, sensitivities=("nu[0]",), **options)
