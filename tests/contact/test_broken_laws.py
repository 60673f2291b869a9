"""A run that breaks the laws of friction, or whose energy comes from nowhere, is never returned, nor one with bounds
that leave no digits."""

from dataclasses import replace

import pytest

import omniroll
from omniroll import Bearings, Contact, Session, SimulationStopped, Torque
from omniroll.engine.control import lawful

PAPER = omniroll.Vehicle.paper()


def sticking(friction):
    return omniroll.Contact(law="coulomb", friction=friction)


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


def test_energy_from_nowhere():
    """Kept numbers are changed: the work of the drive, and what slips lose."""
    effects = [sticking(0.8), Torque((0.02, -0.01, 0.03))]
    run = omniroll.simulate(PAPER, nu=(0.3, 0, 0.2), duration=0.05, effects=effects, roller_model="massless",
                            accuracy=1e-7)  # fmt: skip
    assert lawful(run) is run
    dense = run.dense.copy()
    dense[..., 6 + PAPER.wheels :] *= 1.5
    wrong = replace(run, made=run.made | {"dense": lambda: dense}, in_part={})
    with pytest.raises(SimulationStopped, match="come from nowhere.*: this is a fault") as said:
        lawful(wrong)
    assert said.value.trajectory is wrong


ROLLS = ([Contact(law="coulomb", friction=0.5), Torque(0.2)], (1.0, 0.0, 1.0))

STANDS = ([Bearings(wheel_coulomb=0.05), Torque(0.02)], (0.0, 0.0, 0.0))


@pytest.mark.parametrize(("what", "scene"), [("contact", ROLLS), ("axle", STANDS)])
def test_what_sticks_with_more_than_it_can_take_ends_a_session(what, scene):
    """The bound of what sticks is lowered behind the engine's back, which then goes on with a wrong decision."""
    effects, nu = scene
    session = Session(PAPER, effects=effects, nu=nu)
    session.step(0.01)
    run = session._run.run
    if what == "contact":
        assert run.ground.grips[1].sticks
        for k in range(2):
            run.ground.grips[1].staying[k] *= 1e-6
    else:
        run.bearings.each[1].holding = 1e-6
    with pytest.raises(SimulationStopped, match="takes more than it can") as stopped:
        session.step(0.01)
    assert stopped.value.wheel == 1
