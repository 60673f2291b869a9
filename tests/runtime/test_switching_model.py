"""The switching model: which roller is which, what the two laws do. Rules are numbered as in its contract."""

import numpy as np
import pytest

from omniroll import Vehicle, kernel
from omniroll.engine.switching import SwitchingModel, outward
from omniroll.vehicles.state import State, by_place, by_roller, physical_roller, place_of_roller

WHEELS, ROLLERS = 3, 5
JOINT = np.pi / ROLLERS
VEHICLE = Vehicle.paper().replace(wheel_angles=(0.1, 2.0, 4.4), roller_inertia=1e-4)
NU = np.array([0.7, -0.4, 1.3])


def state_at(chi, contact=(0, 3, 4), seed=1):
    """A state of free rollers with random axial speeds."""
    axial = np.random.default_rng(seed).normal(size=(WHEELS, ROLLERS))
    return State(NU, np.array(chi), np.zeros(3), np.array(contact), axial)


def model_of(roller_model, law="impact"):
    return SwitchingModel(kernel(VEHICLE, roller_model, "python"), law)


def test_places_and_numbers_are_inverse():
    """Rule 2."""
    contact = np.array([0, 3, 4])
    assert (physical_roller(contact, 1, ROLLERS) == contact).all()
    assert (physical_roller(contact, 2, ROLLERS) == [1, 4, 0]).all()
    for j in range(1, ROLLERS + 1):
        assert (place_of_roller(contact, physical_roller(contact, j, ROLLERS), ROLLERS) == j).all()
    values = np.arange(15.0).reshape(3, 5)
    assert (by_roller(by_place(values, contact), contact) == values).all()
    assert (by_place(values, contact)[:, 0] == values[np.arange(3), contact]).all()


@pytest.mark.parametrize("direction, entering_place, leaving_place", [(1, ROLLERS, 2), (-1, 2, ROLLERS)])
def test_a_switch_renumbers_the_rollers(direction, entering_place, leaving_place):
    """Rule 4: at +pi/n the roller j = n enters and the old one becomes j = 2; the mirror image at -pi/n."""
    before = state_at([0.1, direction * JOINT, -0.2])
    directions = np.array([0, direction, 0])
    after = model_of("free").apply(before, directions)
    assert (after.chi == [0.1, -direction * JOINT, -0.2]).all()
    assert after.contact[1] == physical_roller(before.contact, entering_place, ROLLERS)[1]
    assert place_of_roller(after.contact, before.contact, ROLLERS).tolist() == [1, leaving_place, 1]
    # Where a roller's axis points, chi + kappa_j, does not change.
    rollers = np.arange(ROLLERS)
    angle_before = before.chi[1] + 2 * np.pi * (place_of_roller(before.contact[1], rollers, ROLLERS) - 1) / ROLLERS
    angle_after = after.chi[1] + 2 * np.pi * (place_of_roller(after.contact[1], rollers, ROLLERS) - 1) / ROLLERS
    np.testing.assert_allclose(np.sin(angle_after - angle_before), 0, atol=1e-15)
    np.testing.assert_allclose(np.cos(angle_after - angle_before), 1)


@pytest.mark.parametrize("roller_model", ["massless", "locked", "free"])
@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_there_and_back_is_the_same_place(roller_model, law):
    model, before = model_of(roller_model, law), state_at([JOINT, -JOINT, 0.0])
    directions = np.array([1, -1, 0])
    after = model.apply(model.apply(before, directions), -directions)
    assert (after.chi == before.chi).all() and (after.contact == before.contact).all()


def test_outward():
    """Rule 3."""
    chi = np.array([JOINT, JOINT, JOINT, -JOINT, -JOINT, 0.99 * JOINT])
    assert outward(chi, np.array([1.0, -1.0, 0.0, 1.0, -1.0, 1.0]), ROLLERS).tolist() == [1, 0, 0, 0, -1, 0]


def test_tau_is_public():
    import omniroll

    assert omniroll.tau(-3.0, 1.0) == 400 * np.finfo(float).eps
