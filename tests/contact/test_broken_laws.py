"""A run whose energy comes from nowhere is never returned, nor one with bounds that leave no digits."""

from dataclasses import replace

import pytest

import omniroll
from omniroll.engine.control import lawful

PAPER = omniroll.Vehicle.paper()
PUSH = omniroll.Torque((0.02, -0.01, 0.03))


def sticking(friction):
    return omniroll.Contact(law="coulomb", friction=friction)


@pytest.fixture(scope="module")
def run():
    return omniroll.simulate(
        PAPER, nu=(0.3, 0, 0.2), duration=0.05, effects=[sticking(0.8), PUSH], roller_model="massless", accuracy=1e-7
    )


def test_energy_from_nowhere(run):
    assert lawful(run) is run
    dense = run.dense.copy()
    dense[..., 6 + PAPER.wheels :] *= 1.5  # the work of the drive, and what slips lose
    wrong = replace(run, made=run.made | {"dense": lambda: dense}, in_part={})
    with pytest.raises(omniroll.SimulationStopped, match="come from nowhere.*: this is a fault") as said:
        lawful(wrong)
    assert said.value.trajectory is wrong


@pytest.mark.parametrize("field", ["wheel_coulomb", "roller_coulomb", "wheel_break_away"])
def test_torques_beyond_use_are_refused(field):
    """They would leave no digits of what holds, or take minutes."""
    numbers = {"wheel_coulomb": 1e-3} | {field: 1e20}
    with pytest.raises(omniroll.InvalidValueError, match=r"must be at most 1.53e\+10; (a torque|wheel_locked)") as said:
        omniroll.simulate(PAPER, nu=(1, 0, 0), duration=1, effects=[sticking(0.3), omniroll.Bearings(**numbers)])
    assert said.value.field == field


def test_a_torque_that_locks_an_axle_locks_it():
    """The motion of an axle that is locked does not depend on the torque that locks it."""
    start = {"nu": (4, 0, 0.5), "duration": 0.05}
    locked, other = (
        omniroll.simulate(PAPER, **start, effects=[sticking(0.3), omniroll.Bearings(wheel_coulomb=torque)])
        for torque in (1e6, 1e8)
    )
    assert abs(locked.nu[-1] - other.nu[-1]).max() < 1e-6 and abs(locked.quantity("rates")[-1]).max() < 1e-6
