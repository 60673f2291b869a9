"""Sensitivities of runs in which contacts and axles stick side by side, under Coulomb's friction on the ground: where
there are none. test_friction.py holds CASES to differences of runs."""

import pytest

from omniroll import Bearings, Contact, NoDerivativeError, Torque, TorqueTable
from tests.sensitivities.differences import Case, derivative
from tests.sensitivities.test_axles_on_the_ground import AT_REST, HELD_LONGER, RUBBING

SKID = Contact(law="coulomb", friction=0.1, wheel_rates=(3.0, -2.0, 1.0))
STANDING = Contact(law="coulomb", friction=0.1)
HELD = Contact(law="coulomb", friction=0.1, static_friction=0.15)
PUSH = TorqueTable((0.0, 1.0), ((0, 0, 0), (0.2, -0.1, 0.05)))
STRONG = TorqueTable((0.0, 1.0), ((0, 0, 0), (0.9, -0.5, 0.4)))
BRAKES = Bearings(wheel_coulomb=0.2, wheel_break_away=0.3)
LIGHT = Contact(law="coulomb", friction=0.3, static_friction=0.4, load=(12.0, 2.0, 2.0))
BRAKES_OF_TWO = Bearings(wheel_coulomb=(0.01, 0.5, 0.5))
PUSH_OF_ONE = TorqueTable((0.0, 1.0), ((0, 0, 0), (0.4, 0, 0)))
STOPPING = Case("massless", effects=(SKID, RUBBING), duration=0.9)
CASES = {
    "comes to rest": (STOPPING, ("nu[0]", "mass", "wheel_coulomb[1]", "friction", "wheel_radius")),
    "free": (
        Case("free", effects=(STANDING, Bearings(wheel_coulomb=0.05, wheel_break_away=0.06)), duration=0.36),
        ("mass", "wheel_coulomb"),
    ),
    "axles let go": (
        Case("massless", effects=(STANDING, HELD_LONGER, PUSH), start=AT_REST, duration=0.9),
        ("wheel_break_away", "mass", "wheel_radius"),
    ),
    "contacts let go": (
        Case("massless", effects=(HELD, BRAKES, STRONG), start=AT_REST, duration=0.9), ("wheel_break_away", "mass")
    ),
    "a wheel that is pushed lets go": (
        Case("massless", effects=(LIGHT, BRAKES_OF_TWO, PUSH_OF_ONE), start=AT_REST, duration=0.8),
        ("static_friction", "load[1]", "wheel_radius"),
    ),
}  # fmt: skip


def kinds(run):
    """How wheels are in the rows: whether the contact sticks, and the axle."""
    pairs = zip(run.sticks.ravel(), run.modes.ravel() == 0, strict=True)
    return {(bool(contact), bool(axle)) for contact, axle in pairs}


def test_a_vehicle_that_stands_depends_on_nothing():
    case = Case("massless", effects=(STANDING, RUBBING, Torque((0.01, 0, 0))), start=AT_REST, duration=0.1)
    run = case.run(sensitivities=("nu[0]", "mass", "wheel_coulomb"))
    assert kinds(run) == {(True, True)}
    for name in ("nu[0]", "mass", "wheel_coulomb"):
        assert not derivative(run, name).any()


def test_a_wheel_that_stands_by_all_the_friction_of_its_axle_has_none():
    case = Case("massless", effects=(STANDING, RUBBING, Torque((0.02, 0, 0))), start=AT_REST, duration=0.1)
    with pytest.raises(NoDerivativeError, match="all its friction") as error:
        case.run(sensitivities=("mass",))
    assert error.value.wheels == (0,) and error.value.t == 0
