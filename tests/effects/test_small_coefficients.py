"""As the coefficient of an effect goes to zero, the motion tends to that without the effect: at first order.

The motion's end is a smooth function of the coefficient c as long as the order of the switches is the same, so that its
distance to the end without the effect is a c + O(c^2): it falls tenfold with c.
"""

import numpy as np
import pytest

from omniroll import Bearings, Controller, Motor, Slope, Torque, TorqueTable, Vehicle, simulate

PAPER = Vehicle.paper()
CASES = {
    "torque": (0.01, lambda c: [Torque((c, -2 * c, c / 2))]),
    "torque table": (0.01, lambda c: [TorqueTable([0.2, 0.6], [[c, 0, 0], [0, c, -c]])]),
    "motor": (0.01, lambda c: [Motor((1.0, 2.0, -1.0), torque_constant=c, back_emf=0.1, resistance=2.0)]),
    "controller": (0.01, lambda c: [Controller((0.5, 0.5, 0), c, 0.1, integral=c)]),
    "viscous axles": (1e-3, lambda c: [Bearings(wheel_viscous=c)]),
    "Coulomb axles": (1e-3, lambda c: [Bearings(wheel_coulomb=c, wheel_speed=0.5)]),
    "viscous rollers": (1e-6, lambda c: [Bearings(roller_viscous=c)]),
    "Coulomb rollers": (1e-6, lambda c: [Bearings(roller_coulomb=c, roller_speed=0.5)]),
    "slope": (1e-3, lambda c: [Slope(c, 0.4)]),
}


def end(roller_model, effects, vehicle=PAPER):
    run = simulate(
        vehicle, nu=(1.0, 0.2, 0.8), chi=(0.1, -0.3, 0.2), duration=1.0, roller_model=roller_model, accuracy=1e-12,
        effects=effects, control=False,
    )  # fmt: skip
    assert len(run.switches) > 1
    return np.concatenate([run.nu[-1], run.pose[-1]]), len(run.switches)


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "free"])
@pytest.mark.parametrize("name", CASES)
def test_first_order(name, roller_model):
    coefficient, effects = CASES[name]
    plain, switches = end(roller_model, [])
    distances = []
    for part in (1e-2, 1e-3):
        state, same = end(roller_model, effects(coefficient * part))
        assert same == switches
        distances.append(np.linalg.norm(state - plain))
    order = np.log10(distances[0] / distances[1])
    assert distances[1] > 1e-9  # far above the error of the runs
    assert order == pytest.approx(1, abs=0.02)


@pytest.mark.long
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_centre_of_mass_to_the_middle(roller_model):
    plain, _ = end(roller_model, [])
    found = [end(roller_model, [], PAPER.replace(center_of_mass=(0.6 * c, 0.8 * c)))[0] - plain for c in (1e-5, 1e-6)]
    assert np.log10(np.linalg.norm(found[0]) / np.linalg.norm(found[1])) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_wheels_to_their_rays(roller_model):
    plain, _ = end(roller_model, [])
    rays = 0.15 * np.exp(1j * np.array(PAPER.wheel_angles))
    away = np.array([0.3 + 0.5j, -0.4 + 0.2j, 0.1 - 0.6j])

    def moved(c):
        places = rays + c * away
        return end(roller_model, [], PAPER.replace(wheel_places=np.stack([places.real, places.imag], axis=-1).tolist()))

    found = [moved(c)[0] - plain for c in (1e-5, 1e-6)]
    assert np.log10(np.linalg.norm(found[0]) / np.linalg.norm(found[1])) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_motors_without_back_emf_are_torques(roller_model):
    """torque = gear ratio * torque constant * voltage / resistance, by hand."""
    plain, _ = end(roller_model, [Torque((0.03, -0.015, 0.0))])
    motor = {"voltage": (2.0, -1.0, 0.0), "torque_constant": 0.01, "resistance": 2.0, "gear_ratio": 3.0}
    found = [end(roller_model, [Motor(**motor, back_emf=c)])[0] - plain for c in (1e-5, 1e-6)]
    assert np.log10(np.linalg.norm(found[0]) / np.linalg.norm(found[1])) == pytest.approx(1, abs=0.02)


def test_rotors_without_inertia_are_no_rotors():
    motor = {"voltage": 1.0, "torque_constant": 0.01, "resistance": 2.0, "gear_ratio": 3.0}
    plain, _ = end("locked", [Motor(**motor)])
    found = [end("locked", [Motor(**motor, rotor_inertia=c)])[0] - plain for c in (1e-7, 1e-8)]
    assert np.log10(np.linalg.norm(found[0]) / np.linalg.norm(found[1])) == pytest.approx(1, abs=0.02)
