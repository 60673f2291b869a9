"""Axles whose bearings stick beside contacts that stick: every body in every mode, closed forms, and the convex
problem."""

from dataclasses import replace

import numpy as np
import pytest
from oracle.directions import allowed_by, directions_allowed
from reactions.newton_euler import Acting
from reactions.test_newton_euler import call

from contact.test_newton_euler import MODELS, slipping_case
from contact.test_sticking_bodies import RELATIVE, by_bodies
from contact.test_stuck_axles import CROSS, bearing_torques
from omniroll import Bearings, Contact, Slope, Torque, TorqueTable, Vehicle, simulate
from omniroll.kernels.kernel import kernel

RADIUS, INERTIA, MASS = CROSS.wheel_radius, CROSS.wheel_inertia, CROSS.mass
GRAVITY = 9.80665
INSTANT = 1e-10  # relative, of instants in closed form
STANDS, ROLLS, DRAGGED, SLIPS = (1, 1), (1, 0), (0, 1), (0, 0)  # whether the contact sticks, and the axle


# ---- every body ------------------------------------------------------------------------------------------------------


def case_in_modes(rng, model, contacts, axles):
    """A state in which what sticks is at rest."""
    case = slipping_case(rng, len(contacts), 5, model, has_layout=True)
    bound = kernel(case.vehicle, model, "python")
    case = replace(case, nu=allowed_by(bound.wheel_rows[contacts & axles]) @ case.nu)
    rolling, turning = bound.wheel_rates(case.nu, case.chi)
    rates = np.where(axles, 0.0, np.where(contacts, rolling, case.rates))
    return replace(case, rates=rates, turns=np.where(contacts, turning, case.turns))


def by_kernel(case, contacts, axles, push, torque, turning):
    """What the kernel gives, with the forces on standing wheels and the torques of all bearings put in."""
    effects = ("contact", "contact_coulomb", "drive", "axle_sticking")
    bound = kernel(case.vehicle, case.model, "python", effects=effects)
    stands = contacts & axles
    directions = directions_allowed(bound.wheel_rows[stands], np.eye(3)) if stands.any() else np.eye(3)
    values = {"torque": torque, "bearing_torque": np.where(axles, 0.0, turning), "axle_sticks": axles.astype(float)}
    values |= {"sticks": contacts.astype(float), "ground_push": np.where(contacts[:, None], 0.0, push)}
    values |= {"directions": directions.ravel(), "absent": (~directions.any(axis=0)).astype(float)}
    found = call(bound, "standing_dynamics", case.known(bound, **values))
    nu_rates, _, rates, *_, holding, held, force, slip_dot = found
    rows, radius = bound.wheel_rows[stands], case.vehicle.wheel_radius
    along, left, *_ = np.linalg.lstsq(-radius * rows.T, held, rcond=None) if stands.any() else (np.zeros(0), [])
    assert -radius * rows.T @ along == pytest.approx(held, abs=1e-12 * (1 + np.abs(held).max()))
    force[stands, 1] += along
    holding[stands] -= radius * along
    return nu_rates, rates, force, slip_dot, holding + np.where(axles, 0.0, turning)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("modes", [
    (STANDS, ROLLS, SLIPS),
    (STANDS, DRAGGED, STANDS),
    (DRAGGED, DRAGGED, ROLLS),
    (DRAGGED, SLIPS, DRAGGED),
    (STANDS, STANDS, STANDS),
    (STANDS, ROLLS, DRAGGED, SLIPS),
    (STANDS, STANDS, ROLLS, DRAGGED, SLIPS, STANDS),
])  # fmt: skip
def test_modes_of_contacts_and_axles_agree_with_every_body(model, modes):
    """The oracle is given forces and torques, and must find the same accelerations, and none of what sticks."""
    contacts, axles = np.array(modes, bool).T
    rng = np.random.default_rng([21, MODELS.index(model), *contacts.astype(int), *axles.astype(int)])
    case = case_in_modes(rng, model, contacts, axles)
    push, torque, turning = rng.normal(size=(len(modes), 2)), rng.normal(size=len(modes)), rng.normal(size=len(modes))
    nu_rates, rates, force, slip_dot, bearing = by_kernel(case, contacts, axles, push, torque, turning)
    acting = Acting(guide=True, wheel_torques=list(torque + bearing))
    wanted_nu, wanted_rates, slips = by_bodies(case, acting, force)
    given = np.abs(torque).max() / case.vehicle.wheel_inertia  # where all stand nothing else has a size
    size = np.abs(slips).max() + np.abs(wanted_nu).max() + np.abs(wanted_rates).max() + given
    for value, wanted in ((nu_rates, wanted_nu), (rates, wanted_rates)):
        assert value == pytest.approx(wanted, rel=RELATIVE, abs=RELATIVE * size)
    components = slice(0, 2) if model == "free" else slice(1, 2)
    assert slip_dot[:, components] == pytest.approx(slips[:, components], abs=RELATIVE * size)
    assert np.abs(slips[contacts][:, components]).max(initial=0.0) <= RELATIVE * size
    assert np.abs(wanted_rates[axles]).max(initial=0.0) <= RELATIVE * size
    assert not rates[axles].any()


# ---- closed forms ----------------------------------------------------------------------------------------------------


def run_of(model, effects, duration, nu=(0, 0, 0), **options):
    return simulate(CROSS, nu=nu, duration=duration, roller_model=model, effects=effects,
                    accuracy=1e-11, control=False, **options)  # fmt: skip


def changed(modes, t):
    """When the modes of a wheel (T,) change: of rows on both sides of an instant the time."""
    return [t[k + 1] for k in np.flatnonzero(modes[1:] != modes[:-1])]


@pytest.mark.parametrize("model", MODELS)
def test_a_growing_torque_breaks_the_axles_before_the_contacts(model):
    """The axles at b t = S; the contacts where what is left of the torque asks them for all their friction."""
    growth, breaks, load, friction = 2.0, 0.05, 7.0, 0.3
    effects = [Contact(law="coulomb", friction=friction, load=load), Bearings(wheel_coulomb=breaks),
               TorqueTable((0.0, 0.2), ((0, 0, 0, 0), (0.2 * growth, 0, -0.2 * growth, 0)))]  # fmt: skip
    run = run_of(model, effects, 0.15)
    rolls = run.quantity("rates")[:, 0] != 0
    first = run.t[np.flatnonzero(rolls)[0] - 1]
    assert first == pytest.approx(breaks / growth, rel=INSTANT)
    (slips,) = changed(run.sticks[:, 0], run.t)
    if model == "massless":
        asks = (1 + 2 * INERTIA / (MASS * RADIUS**2)) * RADIUS
        assert slips == pytest.approx((breaks + friction * load * asks) / growth, rel=INSTANT)
    assert changed(run.sticks[:, 2], run.t) == [slips]
    assert run.sticks[-1].tolist() == [False, True, False, True]


@pytest.mark.parametrize("model", MODELS)
def test_one_wheel_spins_on_the_spot_where_bearing_and_ground_are_both_used_up(model):
    """The others hold the vehicle, so that the torque has to use up S and l mu N; then J w' = b t - S - l mu N."""
    growth, breaks, load, friction = 2.0, 0.05, 2.0, 0.3
    loads = (load, 20.0, 20.0, 20.0)
    effects = [Contact(law="coulomb", friction=friction, load=loads), Bearings(wheel_coulomb=(breaks, 9, 9, 9)),
               TorqueTable((0.0, 0.2), ((0, 0, 0, 0), (0.2 * growth, 0, 0, 0)))]  # fmt: skip
    run = run_of(model, effects, 0.08)
    both = (breaks + RADIUS * friction * load) / growth
    assert both < 0.06
    assert changed(run.sticks[:, 0], run.t) == [pytest.approx(both, rel=INSTANT)]
    assert not run.nu.any() and run.sticks[:, 1:].all()
    wanted = growth * (run.t[-1] - both) ** 2 / (2 * INERTIA)
    assert abs(run.quantity("rates")[-1, 0]) == pytest.approx(wanted, rel=1e-9)


# ---- the convex problem ----------------------------------------------------------------------------------------------


def test_indeterminate_forces_are_those_of_least_norm():
    """Six wheels that stand on a slope: three equations. A torque asks the bearing of one wheel for more than it takes,
    so that a bound cuts its force off."""
    vehicle, angle = Vehicle.paper(6, 5), 0.02
    breaks = 0.06
    torque = np.array([0.075, 0, 0, 0, 0, 0.01])
    effects = [Contact(law="coulomb", friction=1.0, normal_gravity=GRAVITY), Bearings(wheel_coulomb=breaks),
               Torque(torque), Slope(angle, 0.4, gravity=GRAVITY)]  # fmt: skip
    run = simulate(vehicle, nu=(0, 0, 0), duration=0.01, roller_model="massless", effects=effects)
    assert run.sticks.all() and not run.nu.any()
    force, rows = run.ground_force[-1, :, 1], kernel(vehicle, "massless", "python").wheel_rows
    low, high = (-torque - breaks) / vehicle.wheel_radius, (-torque + breaks) / vehicle.wheel_radius
    free = (force > low * (1 - 1e-9)) & (force < high - 1e-9 * np.abs(high))
    z = np.linalg.lstsq(rows[free], force[free], rcond=None)[0]
    assert np.clip(rows @ z, low, high) == pytest.approx(force, abs=1e-9) and (~free).any()
    assert bearing_torques(run)[-1] == pytest.approx(-torque - vehicle.wheel_radius * force, abs=1e-12)
