"""Sensitivities of runs whose loads follow the motion, against a closed form and differences of runs."""

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Contact, Motor, TorqueTable, Vehicle
from tests.sensitivities.differences import SPINS, START, Case, derivative, names_of
from tests.sensitivities.test_runs import check

# Runs whose loads follow the motion are exact to 1e-11 on the compiled engine, by what accuracies of 1e-13 and 1e-14
# differ; with massless rollers under smooth laws that is too little for differences, and those are the Python engine's.
EXACT, BY_PYTHON = {"exact": 1e-11}, {"exact": 1e-12, "engine": "python", "accuracy": 1e-13}
LOW, HIGH = {"loads": "dynamic", "height": 0.05}, {"loads": "dynamic", "height": 0.25}
VISCOUS, COULOMB = {"coefficient": 40.0}, {"law": "coulomb", "friction": 0.3}
REGULARISED = {"law": "regularised", "friction": 0.3, "speed": 0.05}
NUMBERS = {"nu[0]": 4e-4, "mass": 1e-2, "wheel_radius": 1e-5, "platform_radius": 1e-4, "wheel_inertia": 1e-6}
TALL = Vehicle.paper(4, 5)
TALL_SPINS = np.random.default_rng(0).normal(size=(4, 4))
BRAKING = {"nu": (9.0, 0.5, 0.3), "chi": (0.1, -0.2, 0.15, 0.05)}
STARTING = {"nu": (0.3, 0.1, 0.05), "chi": (0.1, -0.2, 0.15, 0.05)}
BEARINGS = Bearings(wheel_viscous=0.05)


def _pushed(roller_model, torque, height, **law):
    """Four wheels that are pushed until the one in front is off the ground, and comes back."""
    push = TorqueTable((0.0, 0.2, 0.4), ((0, 0, 0, 0), (0, torque, 0, -torque), (0, 0, 0, 0)))
    ground = Contact(**law, loads="dynamic", height=height)
    start = STARTING | ({"spins": TALL_SPINS} if roller_model == "free" else {})
    return Case(roller_model, effects=(ground, push), vehicle=TALL, start=start, duration=0.5)


def _differences_of(case):
    smooth = case.effects[0].law != "coulomb"
    return BY_PYTHON if smooth and case.roller_model == "massless" else EXACT


ON_THREE = {
    "viscous, free": (Case("free", effects=(Contact(**VISCOUS, **LOW),), duration=0.5), {"coefficient": 1e-2}),
    "regularised, massless": (Case("massless", effects=(Contact(**REGULARISED, **LOW),), duration=0.5),
                              {"nu[0]": 1e-4, "wheel_radius": 1e-6, "platform_radius": 1e-6, "friction": 1e-3,
                               "speed": 1e-4, "height": 1e-3}),
    "regularised, free": (Case("free", effects=(Contact(**REGULARISED, **LOW),), duration=0.5),
                          {"friction": 1e-3, "speed": 1e-4, "height": 1e-3}),
    "coulomb, massless": (Case("massless", effects=(Contact(**COULOMB, **LOW, wheel_rates=0.0),), duration=0.3),
                          {"friction": 1e-3, "height": 1e-3}),
    "coulomb, free": (Case("free", effects=(Contact(**COULOMB, **LOW),), duration=0.6),
                      {"friction": 1e-3, "height": 1e-3}),
    "bearings of rollers": (
        Case("free", effects=(Contact(**COULOMB, **LOW), Bearings(roller_viscous=1e-5)), duration=0.6),
        {"roller_viscous": 1e-7, "height": 1e-3}),
}  # fmt: skip
OF_PUSH = {"nu[0]": 1e-3, "mass": 1e-3, "height": 1e-4, "torque[1][1]": 1e-4, "times[1]": 1e-4}
VANISHING = {
    "viscous": (_pushed("massless", 0.5, 0.2, coefficient=5.0), OF_PUSH | {"coefficient": 1e-3}),
    "viscous, free": (_pushed("free", 0.5, 0.2, coefficient=5.0), OF_PUSH | {"coefficient": 1e-3}),
    "regularised": (_pushed("massless", 0.5, 0.25, law="regularised", friction=0.5, speed=0.05),
                    OF_PUSH | {"friction": 1e-4}),
    "coulomb": (_pushed("massless", 0.5, 0.25, law="coulomb", friction=0.5), OF_PUSH | {"friction": 1e-4}),
    "coulomb, free": (_pushed("free", 0.7, 0.25, law="coulomb", friction=0.5), OF_PUSH | {"friction": 1e-4}),
    "braking": (
        Case("massless", vehicle=TALL, start=BRAKING, duration=0.6,
             effects=(Contact(law="coulomb", friction=0.7, **HIGH, wheel_rates=0.0), BEARINGS)),
        {"nu[0]": 1e-3, "mass": 1e-3, "friction": 1e-4, "height": 1e-4}),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("case, changes", ON_THREE.values(), ids=ON_THREE)
def test_they_are_the_differences_of_runs(case, changes):
    check(case, NUMBERS | changes, switches=0, **_differences_of(case))


# The wheels' masses have a part in the balance where their centroid is not the centre of mass. All wheels skid, blocked
# at the start, so that every number of the balance moves the motion: the smallest derivative is 0.02.
BESIDE = Vehicle.paper().replace(center_of_mass=(0.03, -0.05))
SKID = {"nu": (9.0, 2.5, 3.3)}
BALANCE = {"height": 0.1, "wheel_mass": 0.15, "normal_gravity": 9.7, "platform_products": (0.002, -0.003)}
OF_BALANCE = {"wheel_mass": 2e-2, "normal_gravity": 1e-1, "platform_products[0]": 2e-3, "platform_products[1]": 2e-3,
              "spin_inertia": 5e-5, "spin_inertia[1]": 5e-5}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("law", [COULOMB, REGULARISED], ids=["coulomb", "regularised"])
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_by_the_numbers_of_the_balance(roller_model, law):
    of_each = {name: by for name, by in OF_BALANCE.items() if name != "spin_inertia"}
    of_all = {"spin_inertia": OF_BALANCE["spin_inertia"]}
    for spin_inertia, changes in ((1e-3, of_all), ((1e-3, 1.2e-3, 8e-4), of_each)):
        ground = Contact(**law, **BALANCE, loads="dynamic", spin_inertia=spin_inertia, wheel_rates=0.0)
        case = Case(roller_model, effects=(ground,), vehicle=BESIDE, start=SKID, duration=0.3)
        # Under the law coulomb runs at 1e-13 are rounded by more, some 1e-11, than runs at 1e-11.
        options = _differences_of(case) | ({"accuracy": 1e-11} if law is COULOMB else {})
        check(case, changes, switches=0, **options)


@pytest.mark.long
@pytest.mark.parametrize("case, changes", VANISHING.values(), ids=VANISHING)
def test_where_a_load_vanishes_and_comes_back(case, changes):
    loads = case.run().ground_load
    assert (loads.min(axis=0) < 1e-9).any() and (loads[[0, -1]] > 0.1).all()
    check(case, changes, switches=0, **_differences_of(case))


@pytest.mark.long
@pytest.mark.parametrize("case", [ON_THREE["coulomb, free"][0], VANISHING["viscous"][0], VANISHING["braking"][0]])
def test_backwards_in_sessions_and_on_the_python_engine_they_are_the_same(case):
    names = ("nu[0]", "mass", "height")
    run, weights = case.run(sensitivities=names), np.array([[1.0, 2, 3], [0.5, -1, 2]])
    times = np.array([0.33, 0.9]) * case.duration
    found = omniroll.gradient(run, names, times, pose=weights)
    other = case.run(engine="python", accuracy=1e-11, sensitivities=names)
    spins = {"spins": SPINS} if case.roller_model == "free" else {}
    session = omniroll.Session(
        case.vehicle, **(START | spins | case.start), roller_model=case.roller_model, effects=case.effects,
        accuracy=1e-12, sensitivities=names,
    )  # fmt: skip
    for step in (0.1, 0.003, 0.4, 0.297, 0.2):
        session.step(step * case.duration)
    for name in names:
        forwards = (weights * run.sensitivity(name, times).pose).sum()
        assert found[name] == pytest.approx(forwards, rel=1e-11)
        own, stepped = derivative(run, name), session.sensitivity(name)
        parts = np.concatenate([getattr(stepped, part).ravel() for part in names_of(run)])
        for others in (derivative(other, name), parts):
            assert np.abs(own - others).max() <= 1e-8 * np.abs(own).max()


@pytest.mark.long
def test_without_height_they_are_those_of_loads_at_rest():
    """Where the centre of mass is on the ground and nothing turns about the axles, no force moves a load."""
    names = ("nu[0]", "mass", "friction", "platform_radius")
    flat = {"loads": "dynamic", "height": 1e-100, "spin_inertia": 1e-100}
    grounds = (Contact(**COULOMB, wheel_rates=0.0, **loads) for loads in ({}, flat))
    still, flat = (Case("massless", effects=(own,), duration=0.3).run(sensitivities=names) for own in grounds)
    for name in names:
        expected = derivative(still, name)
        assert np.abs(derivative(flat, name) - expected).max() <= 1e-9 * np.abs(expected).max()


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_a_gear_and_its_rotor_turn_under_such_loads(roller_model):
    """The rotor turns with the gear's ratio, so that it has an angular momentum of its own about the axle."""
    motor = Motor(voltage=2, torque_constant=0.02, resistance=1, gear_ratio=5, rotor_inertia=1e-5)
    case = Case(roller_model, effects=(Contact(**COULOMB, **LOW), motor), duration=0.5)
    check(case, {"gear_ratio": 1e-3, "rotor_inertia": 1e-7}, switches=0, **EXACT)
