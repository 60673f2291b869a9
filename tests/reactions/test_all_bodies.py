"""Contact forces, loads and accelerations of the kernels against rigid bodies in all coordinates, which heave and tilt
where they are not held: with the forces and loads that are found no contact slips, and the platform stays level."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from contact.moving_bodies import moving, named
from contact.test_all_bodies import NORMAL, of_others
from mecanum import all_bodies
from mecanum.vehicles import platform_rates, vehicle_of

import omniroll
from omniroll.errors import RollingWarning
from omniroll.vehicles.loads import contact_loads

MODELS = ("massless", "locked", "free")


def rolling_case(model, seed=1, wheels=3, rollers=5, **changes):
    """A vehicle that rolls on level ground, and does not heave nor tilt."""
    case = moving("omni", seed, wheels, rollers, model, tilts=True)
    case = replace(case, bodies=replace(case.bodies, **changes))
    case.q[-3:] = case.rates[-3:] = 0
    return case.rolling()


def numbers_of(case):
    """What the loads depend on beside the vehicle: entries of the bodies."""
    bodies = case.bodies
    tensor, spin = np.array(bodies.platform[2]), bodies.gear * (bodies.gear - 1) * bodies.rotor[1]
    return {"height": bodies.center[2], "wheel_mass": bodies.mass_of_wheel,
            "platform_products": (-tensor[0, 2], -tensor[1, 2]),
            "spin_inertia": np.full(case.count, case.vehicle.wheel_inertia - spin)}  # fmt: skip


def assert_rolls(case, found, force, loads, torque=0, of_rollers=0, gravity=(0, 0, 9.80665)):
    """Under these forces and loads the bodies move as is said, on contacts that do not slip, without heave and tilt."""
    level = [case.bodies.size - k for k in (3, 2, 1)]
    moved = case.second(force, torque, of_rollers, loads, gravity)
    case.assert_moves(found, *moved, rests=level, sticks=range(case.count))


def checked(case, effects=(), constants=None, torque=0, on_wheels=0, on_rollers=0, **inputs):
    """Holds the kernel of these effects to the bodies, and gives its loads."""
    bound = case.bound(("reactions", *effects), **(constants or {}))
    given = {"normal_gravity": 9.80665, "torque": np.zeros(case.count) + torque} | inputs
    known = case.known() | numbers_of(case) | given
    if case.model == "free":
        known["axial"] = named(bound, "axial_speeds", known)["axial"]
        known["momenta"] = named(bound, "momenta", known)["momenta"]
    if "coulomb_momenta" in bound.signatures:
        (known["coulomb_momenta_dot"],) = named(bound, "coulomb_momenta", known).values()
    found = named(bound, bound.of_every_roller, known)
    known["nu_dot"] = found["nu_dot"]
    (force,), (sums, places) = (named(bound, name, known).values() for name in ("contact_forces", "load_balance"))
    loads = contact_loads(places, sums)
    pull = inputs.get("pull", np.zeros(3)) + [0, 0, known["normal_gravity"]]
    assert_rolls(case, found, force, loads, torque + on_wheels, on_rollers, pull)
    return loads


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("wheels, rollers", [(3, 3), (4, 5), (6, 4)])
def test_forces_and_loads_keep_the_vehicle_level_and_rolling(model, wheels, rollers):
    loads = checked(rolling_case(model, rollers, wheels, rollers))
    assert np.ptp(loads) > 1e-4 * loads.mean(), "loads that differ by the motion"


@pytest.mark.parametrize("model", MODELS)
def test_every_effect_at_once(model):
    """Locked rollers do not turn in their bearings, and there is no friction at rest."""
    case, draw = rolling_case(model, 2), np.random.default_rng(7)
    effects, numbers, damping, (on_wheels, on_rollers, pull) = of_others(case, draw)
    checked(case, effects, numbers, 0.1 * draw.normal(size=3), on_wheels, on_rollers, damping=damping, pull=pull,
            normal_gravity=NORMAL)  # fmt: skip


def test_a_rotor_behind_a_gear_turns_with_its_own_momentum():
    """What it adds to wheel_inertia is gear^2 of its inertia, to the momentum about the axle gear times it."""
    case = rolling_case("free", 4, rotor=(0.05, 3e-6, 2e-6), gear=-12.5)
    case = replace(case, vehicle=vehicle_of(case.bodies)).rolling()
    checked(case)
    with pytest.raises(AssertionError):
        checked(case, spin_inertia=np.full(3, case.vehicle.wheel_inertia))


@pytest.mark.parametrize("model", ["locked", "free"])
def test_rollers_cut_close_to_their_tips(model):
    """B/rho^2 outgrows the mass, and so does what rounding leaves of the contact roller's acceleration."""
    whole = rolling_case(model, 17).bodies
    case = rolling_case(model, 17, axis_radius=whole.wheel_radius * np.cos(np.pi / 5) * (1 - 1e-4))
    case.q[case.wheels] = np.array([1, -1, 1]) * np.pi / 5 * (1 - 1e-7)
    case = replace(case, vehicle=vehicle_of(case.bodies)).rolling()
    assert case.bound(("reactions",)).sharp
    checked(case)


@pytest.mark.parametrize("model", MODELS)
def test_rows_of_a_run(model):
    case, torque = rolling_case(model, 21), 0.03 * np.array([1, -2, 3])
    known = case.known()
    start = {"nu": known["nu"], "chi": known["chi"], "pose": (0, 0, known["heading"])}
    start |= {"spins": known["spins"]} if model == "free" else {}
    run = omniroll.simulate(case.vehicle, **start, duration=0.3, roller_model=model, accuracy=1e-9,
                            effects=[omniroll.Torque(torque)])  # fmt: skip
    assert len(run.switches) > 0
    numbers = numbers_of(case)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RollingWarning)
        found = omniroll.reactions(run, **numbers)
    for row in np.unique(np.linspace(0, len(run) - 1, 5).astype(int)):
        case.q[case.wheels], case.q[2] = run.chi[row], run.pose[row, 2]
        case.rates[:3] = all_bodies._heading(case.q) @ platform_rates(case.vehicle, run.nu[row])
        case.rates[case.frees] = 0 if run.spins is None else run.spins[row].ravel()
        here = replace(case).rolling()
        assert_rolls(here, {}, found.contact_force[row], found.load[row], torque)
