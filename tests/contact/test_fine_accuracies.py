"""Slips that have just begun, small differences of large speeds, in runs that are asked for nearly all digits."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, SimulationStopped, Slope, Torque, TorqueTable, Vehicle, simulate

PAPER = Vehicle.paper()
BREAKS = TorqueTable((0.0, 0.5), ((0, 0, 0), (1.5, -0.7, -0.9)))


def steps(accuracy, nu, friction):
    """Of a vehicle whose contacts a growing torque breaks away."""
    ground = Contact(law="coulomb", friction=friction, normal_gravity=9.8)
    run = simulate(PAPER, nu=nu, duration=0.2, effects=[ground, BREAKS], accuracy=accuracy, control=False)
    assert (run.sticks[:-1] & ~run.sticks[1:]).any()
    return run.stats["steps"] + run.stats["rejected_steps"]


@pytest.mark.parametrize("nu", [(0, 0, 0), (1.0, 0.3, 0.5)])
def test_contacts_that_let_go_cost_few_steps_at_any_accuracy(nu):
    """Sweeps went on to change what is rounding of such a slip, and tries for smaller and smaller steps failed."""
    assert steps(1e-13, nu, 0.3) <= 1.5 * steps(1e-11, nu, 0.3)


STOPS = pytest.mark.xfail(
    raises=SimulationStopped,
    strict=True,
    reason="the direction of a slip of 5e-9 m/s is rounded by more than 1e-14 allows",
)


@pytest.mark.parametrize(
    "accuracy, engine", [(1e-13, "compiled"), (1e-14, "specialised"), pytest.param(1e-14, "compiled", marks=STOPS)]
)
def test_a_contact_lets_go_beside_one_that_sticks_and_one_that_slips(accuracy, engine):
    """The run stopped 5e-6 s later, where the slip was 2e-11 m/s: it would have needed 1e11 steps. At 1e-14, which is
    some 45 roundings, the prebuilt engine stops with an error; the scene's exact set takes short steps, and ends."""
    leaning = PAPER.replace(
        wheel_angles=(0.3498126015934843, 1.750243794903401, 4.523780221699875), mass=2.4448330391766775,
        yaw_inertia=0.02563993526711225, wheel_inertia=0.0021471597063558116, roller_inertia=1.3416110890954317e-06,
        center_of_mass=(0.004412102183072584, -0.0052526210786781324),
    )  # fmt: skip
    ground = Contact(
        law="coulomb", friction=0.06282421934356575, normal_gravity=9.6,
        wheel_rates=(-2.9817348368608037, -3.544164384744147, -0.9161293050260264),
    )  # fmt: skip
    effects = [
        ground,
        Torque((0.02439585785595215, 0.003667205981638463, 0.029491400039754957)),
        Bearings(wheel_viscous=1e-3, roller_viscous=1e-6),
        Slope(0.05108425726873547, 5.076391086471821),
    ]
    task = {
        "nu": (-1.7713223641678835, -3.1799250292790404, -3.0741329692511346),
        "chi": (0.13857034724641717, -0.04428413227405535, -0.07043604600154835),
        "spins": [[3.0, -0.8, -1.7, -0.6], [-5.0, -0.3, 2.3, 2.7], [-5.4, -5.4, -3.1, 5.2]],
        "duration": 0.8,
        "effects": effects,
        "control": False,
    }
    run = simulate(leaning, **task, accuracy=accuracy, engine=engine)
    coarse = simulate(leaning, **task, accuracy=1e-9)
    assert run.stats["steps"] <= 8 * coarse.stats["steps"]
    assert np.abs(run.nu[-1] - coarse.nu[-1]).max() <= 1e-9 * np.linalg.norm(coarse.nu, axis=1).max()
