"""The account of energy closes to the integration's accuracy with every effect, and each entry counts."""

import numpy as np
import pytest

from omniroll import Bearings, Controller, Motor, Slope, Torque, TorqueTable, Vehicle, simulate

pytestmark = pytest.mark.long

PAPER = Vehicle.paper()
LAYOUT = PAPER.replace(wheel_places=((0.15, 0.02), (-0.06, 0.13), (-0.09, -0.12)), center_of_mass=(0.01, -0.02))
START = {"nu": (1.0, 0.3, 0.7), "chi": (-0.6, 0.55, -0.6)}  # every wheel switches within 0.1 s
MOTOR = Motor((1.0, -2.0, 0.5), 0.01, 1.5, gear_ratio=5, current_limit=0.9, rotor_inertia=1e-6)
AXLES, ROLLERS = {"wheel_viscous": 1e-3}, {"roller_viscous": (1e-5, 2e-5, 1e-6)}
FADING_AXLES = {"wheel_coulomb": 2e-3, "wheel_speed": 0.3}
FADING_ROLLERS = {"roller_coulomb": 3e-5, "roller_speed": 0.5}
DRIVEN = (Torque((0.01, -0.02, 0.03)), TorqueTable([0.1, 0.2], [[0, 0.02, 0], [0.05, 0, 0]]))
CONTROLLED = (Motor(0.0, 0.01, 1.5, gear_ratio=5, current_limit=0.3),
              Controller((0.5, 0, -0.5), 1.0, 0.05, output="voltage"))  # fmt: skip
ALL = (*DRIVEN, Bearings(**AXLES, **ROLLERS), Slope(0.1, 0.7))


@pytest.mark.parametrize("vehicle, effects, entries", [
    (PAPER, (), ()),
    (LAYOUT, ALL, ("drive_work", "axle_loss", "roller_loss", "slope_work")),
    (PAPER, (MOTOR, Bearings(**FADING_AXLES, **FADING_ROLLERS)), ("drive_work", "axle_loss", "roller_loss")),
    (LAYOUT, (*CONTROLLED, Bearings(**AXLES, **FADING_AXLES, **ROLLERS, **FADING_ROLLERS), Slope(0.1, 0.7)),
     ("drive_work", "axle_loss", "roller_loss", "slope_work")),
])  # fmt: skip
@pytest.mark.parametrize("model, law", [("free", "impact"), ("locked", "smooth")])
def test_every_effect_has_its_part_in_an_account_that_closes(vehicle, effects, entries, model, law):
    spins = {"spins": 0.5} if model == "free" else {}
    run = simulate(vehicle, **START, **spins, duration=0.3, roller_model=model, switching=law, accuracy=1e-9,
                   engine="python", effects=effects, control=False)  # fmt: skip
    ledger, said = run.ledger, run.ledger.contributions
    assert abs(ledger.residual) < 1e-9 * ledger.scale and run.stats["phase_energy_drift"] < 1e-9
    assert set(said) == {*entries, "switches"} and len(run.switches) == 3
    assert all(said[name] < 0 for name in entries if name.endswith("loss"))
    assert all(abs(value) > 1e-7 * ledger.scale for value in said.values())


@pytest.mark.parametrize("accuracy", [1e-4, 1e-7, 1e-11])
def test_the_residual_falls_with_the_accuracy(accuracy):
    run = simulate(PAPER, **START, duration=3, accuracy=accuracy, control=False, effects=[MOTOR, *ALL[2:]])
    assert len(run.switches) > 10
    assert abs(run.ledger.residual) < accuracy * run.ledger.scale


def test_the_account_row_by_row():
    run = simulate(PAPER, **START, duration=2, accuracy=1e-11, control=False, effects=ALL)
    jumps = np.zeros(len(run))
    for switch in run.switches:
        jumps[np.flatnonzero(run.t == switch.t)[-1] :] += switch.energy_jump
    explained = run.energy[0] + run.gained() + jumps
    np.testing.assert_allclose(run.energy, explained, atol=1e-11 * run.ledger.scale)
    assert (np.diff(run.quantity("axle_loss")) >= 0).all() and (np.diff(run.quantity("roller_loss")) >= 0).all()
