"""The account of energy closes to the integration's accuracy with every effect."""

import numpy as np
import pytest

from omniroll import Bearings, Controller, Motor, Slope, Torque, TorqueTable, Vehicle, simulate

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
# Each choice once, and the last ones of the shorter lists again.
COMBINATIONS = [
    tuple(list(choices)[k % len(choices)] for choices in (DRIVES, AXLES, ROLLERS, SLOPES, LAYOUTS)) for k in range(4)
]


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


@pytest.mark.long
@pytest.mark.parametrize("combination", COMBINATIONS, ids=", ".join)
@pytest.mark.parametrize("laws", [("free", "impact"), ("locked", "smooth")])
def test_every_effect_has_its_part_in_an_account_that_closes(combination, laws):
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
