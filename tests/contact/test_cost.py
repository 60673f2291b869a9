"""What wheels that slip cost on the compiled engine, in evaluations of the rates."""

import pytest

from omniroll import Contact, Vehicle, simulate

PAPER = Vehicle.paper()
MOTION = {"nu": (2.0, 1.0, 0.0), "duration": 1.0, "control": False}


def evaluations(*effects):
    return simulate(PAPER, **MOTION, effects=effects).stats["evaluations"]


def regularised(speed):
    return Contact(law="regularised", friction=0.3, speed=speed, wheel_rates=0)


def test_a_small_named_speed_costs_at_most_five_times_a_large_one():
    """The wheels skid until they roll, and at each of six switches the entering roller does."""
    assert evaluations(regularised(1e-6)) <= 5 * evaluations(regularised(1e-2))


@pytest.mark.parametrize("coefficient, times", [(3.0, 10), (30.0, 12), (1e4, 16)])
def test_slip_on_a_viscous_ground_against_the_bare_vehicle(coefficient, times):
    """Rolling evaluates in long steps; with slip each switch begins with steps as short as the roller's spin-up."""
    assert evaluations(Contact(coefficient, wheel_rates=0)) <= times * evaluations()


@pytest.mark.parametrize("friction, times", [(0.1, 40), (0.3, 18), (1.0, 41)])
def test_set_valued_friction_against_the_bare_vehicle(friction, times):
    """Contacts come to rest one after the other, and anew behind each of six switches."""
    assert evaluations(Contact(law="coulomb", friction=friction, wheel_rates=0)) <= times * evaluations()
