"""The account of energy closes to the integration's accuracy for every combination of effects."""

from itertools import combinations, product

import numpy as np
import pytest

from omniroll import Bearings, Controller, Motor, Slope, Torque, TorqueTable, Vehicle, generated_data, simulate

PAPER = Vehicle.paper()
ACCURACY = 1e-9
START = {"nu": (1.0, 0.3, 0.7), "chi": (-0.6, 0.55, -0.6)}  # every wheel switches within 0.1 s

DRIVES = {
    "no drive": (),
    "torques": (Torque((0.01, -0.02, 0.03)), TorqueTable([0.1, 0.2], [[0, 0.02, 0], [0.05, 0, 0]])),
    "motors": (Motor((1.0, -2.0, 0.5), 0.01, 1.5, gear_ratio=5, current_limit=0.9, rotor_inertia=1e-6),),
    "motors and a controller": (
        Motor(0.0, 0.01, 1.5, gear_ratio=5, current_limit=0.3),
        Controller((0.5, 0, -0.5), 1.0, 0.05, output="voltage"),
    ),
}
AXLES = {
    "axles free": {},
    "axles viscous": {"wheel_viscous": 1e-3},
    "axles Coulomb": {"wheel_coulomb": 2e-3, "wheel_speed": 0.3},
    "axles both": {"wheel_viscous": 1e-3, "wheel_coulomb": 2e-3, "wheel_speed": 0.3},
}
ROLLERS = {
    "rollers free": {},
    "rollers viscous": {"roller_viscous": (1e-5, 2e-5, 1e-6)},
    "rollers Coulomb": {"roller_coulomb": 3e-5, "roller_speed": 0.5},
    "rollers both": {"roller_viscous": 1e-5, "roller_coulomb": 3e-5, "roller_speed": 0.5},
}
SLOPES = {"level": (), "slope": (Slope(0.1, 0.7),)}
LAYOUTS = {
    "rays": PAPER,
    "layout": PAPER.replace(wheel_places=((0.15, 0.02), (-0.06, 0.13), (-0.09, -0.12)), center_of_mass=(0.01, -0.02)),
}
COMBINATIONS = [*product(DRIVES, AXLES, ROLLERS, SLOPES, LAYOUTS)]


def any_two():
    """16 of them in which every choice meets every other: an orthogonal array, made of the field with four elements."""
    twice, thrice = (0, 2, 3, 1), (0, 3, 1, 2)  # times the field's other two elements; its sum is the exclusive or
    columns = [list(choices) for choices in (DRIVES, AXLES, ROLLERS, SLOPES, LAYOUTS)]
    for a, b in product(range(4), repeat=2):
        row = (a, b, a ^ b, (a ^ twice[b]) & 1, (a ^ thrice[b]) & 1)
        yield tuple(column[k] for column, k in zip(columns, row, strict=True))


FEW = [*any_two()]


def effects_of(combination):
    drive, axles, rollers, slope, _ = combination
    friction = AXLES[axles] | ROLLERS[rollers]
    return [*DRIVES[drive], *([Bearings(**friction)] if friction else []), *SLOPES[slope]]


def account(combination, roller_model, switching="impact"):
    spins = {"spins": 0.5} if roller_model == "free" else {}
    run = simulate(
        LAYOUTS[combination[-1]], **START, **spins, duration=0.3, roller_model=roller_model, switching=switching,
        accuracy=ACCURACY, engine="python", effects=effects_of(combination), control=False,
    )  # fmt: skip
    return run


def check(run, combination):
    drive, axles, rollers, slope, _ = combination
    ledger, said = run.ledger, run.ledger.contributions
    assert abs(ledger.residual) < ACCURACY * ledger.scale
    expected = {
        "drive_work": drive != "no drive", "axle_loss": axles != "axles free", "roller_loss": rollers != "rollers free",
        "slope_work": slope == "slope", "switches": True,
    }  # fmt: skip
    assert set(said) == {name for name, there in expected.items() if there}
    assert all(said[name] < 0 for name in ("axle_loss", "roller_loss") if name in said)
    assert all(said[name] != 0 for name in ("drive_work", "slope_work") if name in said)
    assert run.stats["phase_energy_drift"] < ACCURACY
    assert len(run.switches) == 3
    if run.roller_model != "massless":
        assert abs(said["switches"]) > 100 * ACCURACY * ledger.scale


def test_the_combinations_are_all_that_the_registry_allows():
    """Every set of effects that acts on the motion of wheels that roll; of a drive, motors and none of both."""
    acting = [
        e["name"]
        for e in generated_data.load("effects")["effects"]
        if e["neutral"] and e["table"] not in ("reactions", "contact", "springs")
    ]
    acting.remove("axle_sticking")  # its account is in test_sticking.py
    acting.remove("roller_sticking")  # its account is in test_sticking_rollers.py
    named = [[name for effect in effects_of(c) for name in effect.kernel_effects()] for c in COMBINATIONS]
    sets = {
        frozenset(names + ["layout"] * LAYOUTS[c[-1]].has_layout) for names, c in zip(named, COMBINATIONS, strict=True)
    }
    choices = {frozenset(chosen) for size in range(len(acting) + 1) for chosen in combinations(acting, size)}
    assert sets == {chosen for chosen in choices if "motor" not in chosen or "drive" in chosen}


def test_every_two_choices_meet():
    for one, other in combinations(range(5), 2):
        assert len({(c[one], c[other]) for c in FEW}) == len({(c[one], c[other]) for c in COMBINATIONS})


@pytest.mark.long
@pytest.mark.parametrize("combination", FEW, ids=", ".join)
@pytest.mark.parametrize("laws", [("free", "impact"), ("locked", "smooth")])
def test_combinations_in_which_every_two_choices_meet_close(combination, laws):
    check(account(combination, *laws), combination)


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-4, 1e-7, 1e-11])
def test_the_residual_falls_with_the_accuracy(accuracy):
    effects = [*DRIVES["motors"], Bearings(**AXLES["axles both"], **ROLLERS["rollers viscous"]), *SLOPES["slope"]]
    run = simulate(PAPER, **START, duration=3, accuracy=accuracy, control=False, effects=effects)
    assert len(run.switches) > 10
    assert abs(run.ledger.residual) < accuracy * run.ledger.scale


@pytest.mark.long
def test_the_account_row_by_row():
    effects = [Torque(0.02), Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Slope(0.1)]
    run = simulate(PAPER, **START, duration=2, accuracy=1e-11, control=False, effects=effects)
    jumps = np.zeros(len(run))
    for switch in run.switches:
        jumps[np.flatnonzero(run.t == switch.t)[-1] :] += switch.energy_jump
    explained = run.energy[0] + run.gained() + jumps
    np.testing.assert_allclose(run.energy, explained, atol=1e-11 * run.ledger.scale)
    assert (np.diff(run.quantity("axle_loss")) >= 0).all() and (np.diff(run.quantity("roller_loss")) >= 0).all()


@pytest.mark.long
def test_a_wrong_entry_would_show():
    """The residual is not small by itself: without one of its entries it is large."""
    effects = [Torque(0.02), Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Slope(0.1)]
    ledger = simulate(PAPER, **START, duration=1, accuracy=1e-9, control=False, effects=effects).ledger
    for name, value in ledger.contributions.items():
        assert abs(value) > 1e-5 * ledger.scale, name
