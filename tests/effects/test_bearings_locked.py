"""Axles that are locked: bearings with a bound that nothing reaches."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, InvalidValueError, Torque, Vehicle, simulate
from omniroll.vocabulary import STANDARD_GRAVITY

PAPER = Vehicle.paper()
GROUND = Contact(law="coulomb", friction=0.3, normal_gravity=9.8)
TORQUE = Torque((0.5, 0.02, 0.01))
ONE = (True, False, False)


def test_a_vehicle_whose_axles_are_locked_stands_where_its_wheels_roll():
    run = simulate(PAPER, nu=(0, 0, 0), duration=0.1, effects=[Bearings(wheel_locked=True), TORQUE])
    assert not run.nu.any() and not run.pose.any()


def test_a_locked_wheel_does_not_turn_and_the_others_do():
    run = simulate(PAPER, nu=(1, 0.2, 0.5), duration=0.5, effects=[Bearings(wheel_locked=ONE), GROUND, TORQUE])
    rates = run.quantity("rates")
    assert np.abs(rates[1:, 0]).max() < 1e-15 * np.abs(rates[0, 0]) and np.abs(rates[-1, 1:]).min() > 0.1
    assert abs(run.ledger.residual) < 1e-9 * run.ledger.scale


def test_it_is_a_torque_far_above_all_others():
    bound = 1e3 * PAPER.mass * STANDARD_GRAVITY * PAPER.wheel_radius
    task = {"nu": (1, 0.2, 0.5), "duration": 0.1}
    locked, held = (
        simulate(PAPER, **task, effects=[bearings, GROUND])
        for bearings in (Bearings(wheel_locked=ONE), Bearings(wheel_coulomb=(bound, 0, 0)))
    )
    np.testing.assert_array_equal(locked.nu, held.nu)


@pytest.mark.parametrize(("given", "bound"), [
    ({"wheel_locked": (True, 2)}, "true or false"),
    ({"wheel_locked": "yes"}, "true or false"),
    ({"wheel_locked": True, "wheel_coulomb": 1.0, "wheel_speed": 1.0}, "nothing rests"),
    ({"wheel_locked": False}, "at least one coefficient"),
])  # fmt: skip
def test_what_cannot_be_locked_is_refused(given, bound):
    with pytest.raises(InvalidValueError, match=bound):
        Bearings(**given)
