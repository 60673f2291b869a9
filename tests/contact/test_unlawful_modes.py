"""A run whose modes break the laws of friction stops and names the wheel: the engine asks it of each step, in
runs, sweeps and sessions alike."""

import pytest

from omniroll import Bearings, Contact, Session, SimulationStopped, Torque, Vehicle

ROLLS = ([Contact(law="coulomb", friction=0.5), Torque(0.2)], (1.0, 0.0, 1.0))
STANDS = ([Bearings(wheel_coulomb=0.05), Torque(0.02)], (0.0, 0.0, 0.0))


@pytest.mark.parametrize(("what", "scene"), [("contact", ROLLS), ("axle", STANDS)])
def test_what_sticks_with_more_than_it_can_take_ends_a_session(what, scene):
    """The bound of what sticks is lowered behind the engine's back, which then goes on with a wrong decision."""
    effects, nu = scene
    session = Session(Vehicle.paper(), effects=effects, nu=nu)
    session.step(0.01)
    run = session._run.run
    if what == "contact":
        assert run.grips[1].sticks
        for k in range(2):
            run.grips[1].staying[k] *= 1e-6
    else:
        run.bearings[1].holding = 1e-6
    with pytest.raises(SimulationStopped, match="takes more than it can") as stopped:
        session.step(0.01)
    assert stopped.value.wheel == 1
