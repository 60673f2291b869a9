"""The switching model: which roller is which, what the two laws do. Rules are numbered as in its contract."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Vehicle, kernel
from omniroll.engine.switching import SwitchingModel, outward
from omniroll.vehicles.state import State, by_place, by_roller, physical_roller, place_of_roller
from omniroll.vocabulary import LAWS

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


def spins_by_roller(model, state):
    spins = model.kernel.spins_from_axial(state.nu, state.chi, state.free_axial())
    contact_spin = model.kernel.wheel_rates(state.nu, state.chi)[1]
    return by_roller(np.column_stack([contact_spin, spins]), state.contact)


def energy(model, state):
    if state.axial is None or model.kernel.roller_model != "free":
        return model.kernel.energy(state.nu, state.chi)
    return model.kernel.energy(
        state.nu, state.chi, model.kernel.spins_from_axial(state.nu, state.chi, state.free_axial())
    )


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


def test_smooth_keeps_speeds_and_spins_but_the_entering_one():
    """Rules 6 and 7 under free."""
    model, before = model_of("free", "smooth"), state_at([0.1, JOINT, -0.2])
    after = model.apply(before, np.array([0, 1, 0]))
    assert (after.nu == before.nu).all()
    spins_before, spins_after = spins_by_roller(model, before), spins_by_roller(model, after)
    entered = after.contact[1]
    others = np.arange(ROLLERS) != entered
    np.testing.assert_allclose(spins_after[1, others], spins_before[1, others], rtol=1e-13)
    np.testing.assert_allclose(spins_after[[0, 2]], spins_before[[0, 2]], rtol=1e-13)
    # (2.1) gives the entering roller the spin of the leaving one: rho is the same on both sides of the joint.
    assert spins_after[1, entered] == pytest.approx(spins_before[1, before.contact[1]], rel=1e-13)


def test_impact_keeps_axial_speeds_of_free_rollers():
    """Rules 6 and 7 under free: the leaving roller's absolute axial speed stays; its spin follows theta'."""
    model, before = model_of("free"), state_at([JOINT, JOINT, -0.2])
    after = model.apply(before, np.array([1, 1, 0]))
    assert (after.nu != before.nu).all()
    theta_dot = before.nu[2] / VEHICLE.yaw_scale
    left = spins_by_roller(model, before)[1, before.contact[1]] + theta_dot * np.sin(JOINT)
    assert after.axial[1, before.contact[1]] == pytest.approx(left, rel=1e-13)
    untouched = [c for c in range(ROLLERS) if c not in (before.contact[1], after.contact[1])]
    assert (after.axial[1, untouched] == before.axial[1, untouched]).all()


@pytest.mark.parametrize("roller_model", ["locked", "free"])
@pytest.mark.parametrize("directions", [(0, 1, 0), (1, 0, -1), (1, 1, 1)])
def test_impact_never_adds_energy(roller_model, directions):
    """Rule 8, for random states: a loss at every switch."""
    model = model_of(roller_model)
    for seed in range(20):
        before = state_at(np.array(directions) * JOINT, seed=seed)
        before = replace(before, nu=np.random.default_rng(seed).normal(size=3))
        after = model.apply(before, np.array(directions))
        assert energy(model, after) < energy(model, before)


def test_impact_of_a_motion_that_obeys_changes_nothing():
    """Rule 6: an entering roller that has the demanded spin already passes without a blow."""
    model, before = model_of("free"), state_at([0.1, JOINT, -0.2])
    after = model.apply(before, np.array([0, 1, 0]))
    demanded = model.kernel.wheel_rates(before.nu, after.chi)[1][1]
    axial = before.axial.copy()
    axial[1, after.contact[1]] = demanded + before.nu[2] / VEHICLE.yaw_scale * np.sin(after.chi[1])
    undisturbed = model.apply(replace(before, axial=axial), np.array([0, 1, 0]))
    np.testing.assert_allclose(undisturbed.nu, before.nu, rtol=1e-13)


def test_massless_rollers_only_change_the_books():
    """Rule 7."""
    for law in LAWS:
        before = state_at([JOINT, JOINT, -JOINT])
        after = model_of("massless", law).apply(before, np.array([1, 0, -1]))
        assert (after.nu == before.nu).all()
        assert after.contact.tolist() == [4, 3, 0]


def test_a_joint_switch_is_one_projection():
    """Rule 5: two wheels together is not one after the other."""
    model, before = model_of("locked"), state_at([JOINT, JOINT, 0.0])
    together = model.apply(before, np.array([1, 1, 0]))
    in_a_row = model.apply(model.apply(before, np.array([1, 0, 0])), np.array([0, 1, 0]))
    assert np.abs(together.nu - in_a_row.nu).max() > 1e-9


def test_outward():
    """Rule 3."""
    chi = np.array([JOINT, JOINT, JOINT, -JOINT, -JOINT, 0.99 * JOINT])
    assert outward(chi, np.array([1.0, -1.0, 0.0, 1.0, -1.0, 1.0]), ROLLERS).tolist() == [
        1,
        0,
        0,
        0,
        -1,
        0,
    ]


def test_tau_is_public():
    import omniroll

    assert omniroll.tau(-3.0, 1.0) == 400 * np.finfo(float).eps
