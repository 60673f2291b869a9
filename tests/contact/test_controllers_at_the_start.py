"""Friction is decided under what a controller gives at its first sample, which is the start of the run."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, FunctionController, Session, Torque, Vehicle, simulate

VEHICLE = Vehicle.paper(4, 5)
START = {"nu": (3, 0, 1), "roller_model": "massless"}
GROUND = Contact(law="coulomb", friction=0.3)
STICKS = Bearings(wheel_coulomb=0.05, roller_coulomb=0.01)


@pytest.mark.parametrize("friction", [(GROUND,), (GROUND, STICKS), (STICKS,)])
def test_a_constant_function_acts_as_a_constant_torque(friction):
    given = FunctionController(lambda t, state: 1.0, 0.02)
    found, wanted = (
        simulate(VEHICLE, **START, duration=0.02, effects=[*friction, acts]) for acts in (given, Torque(1.0))
    )
    np.testing.assert_array_equal(found.nu[-1], wanted.nu[-1])
    session = Session(VEHICLE, **START, effects=[*friction, given])
    session.step(0.01)
    session.step(0.01)
    np.testing.assert_allclose(session.nu, wanted.nu[-1], rtol=0, atol=1e-8)
