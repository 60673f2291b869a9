"""Runs in which wheels with rollers at an angle or in two rows slip: traction and energy."""

import numpy as np
import pytest

from omniroll import Contact, TorqueTable, Vehicle, simulate

FRICTION, GRAVITY = 0.6, 9.80665
RAYS = tuple(np.pi / 4 + np.pi / 2 * np.arange(4))
SIZES = {"mass": 10.0, "yaw_inertia": 0.4, "wheel_inertia": 2e-3, "roller_inertia": 4e-6, "platform_radius": 0.25}
WHEEL = {"wheels": 4, "rollers_per_wheel": 8, "wheel_radius": 0.05, "roller_axis_radius": 0.035, "yaw_scale": 1.0}
ROWS = Vehicle(**SIZES, **WHEEL, rows=2, row_offset=0.01, wheel_angles=RAYS)
PUSH = TorqueTable((0.0, 1.0), ((0.2, 0.1, -0.2, 0.1), (0.3, -0.2, 0.1, -0.3)))


def in_an_x(angle: float) -> Vehicle:
    """Front left, front right, rear left, rear right."""
    places = ((0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15))
    axles = tuple(np.pi / 2 * np.array([1, -1, 1, -1]))
    hands = tuple(angle * np.array([1, -1, -1, 1]))
    return Vehicle(**SIZES, **WHEEL, roller_angle=hands, wheel_places=places, wheel_angles=axles)


LAWS = {
    "viscous": {"coefficient": 100.0},
    "regularised": {"law": "regularised", "friction": 0.5, "speed": 0.01},
    "coulomb": {"law": "coulomb", "friction": 0.5},
}
VEHICLES = {"rows": ROWS, "mecanum": in_an_x(np.pi / 4)}


@pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 4, 1.0])
def test_spinning_wheels_on_massless_rollers_pull_along_their_rollers_alone(angle):
    """mu g cos psi ahead and mu g sin psi sideways; at 45 degrees two wheels pull with mu g/2 on the diagonal."""
    pulls = {(1, -1, 1, -1): [np.cos(angle), 0.0], (-1, -1, 1, 1): [0.0, np.sin(angle)]}
    if angle == np.pi / 4:
        pulls[1, 0, 0, -1] = [np.sqrt(1 / 8), -np.sqrt(1 / 8)]
    for spin, pull in pulls.items():
        ground = Contact(law="coulomb", friction=FRICTION, wheel_rates=tuple(50.0 * np.array(spin)))
        run = simulate(in_an_x(angle), nu=(0, 0, 0), duration=1e-6, roller_model="massless", effects=[ground])
        nu_dot = run.contacts.accelerations(run.nu, run.chi)["nu_dot"][0]
        np.testing.assert_allclose(0.25 * nu_dot[:2], FRICTION * GRAVITY * np.array(pull), rtol=0, atol=1e-9)


@pytest.mark.parametrize("law, model", [("viscous", "free"), ("regularised", "massless"), ("coulomb", "free")])
@pytest.mark.parametrize("kind", VEHICLES)
def test_the_account_closes_and_switches_change_no_speed(kind, model, law):
    run = simulate(
        VEHICLES[kind], nu=(2, 1, 0.5), duration=0.5, roller_model=model, effects=[Contact(**LAWS[law]), PUSH]
    )
    assert len(run.switches) > 10 and np.abs(run.slip).max() > 1e-3
    assert abs(run.ledger.residual) <= 1e-9 * run.energy.max()
    assert run.contact_spin.shape == run.chi.shape
    same = np.flatnonzero(np.diff(run.elapsed) == 0)
    np.testing.assert_array_equal(run.nu[same], run.nu[same + 1])
    np.testing.assert_array_equal(run.quantity("rates")[same], run.quantity("rates")[same + 1])
    if model == "free":  # spins are what the account's energy is made of
        middle = run.sample(0.2503)
        assert run.spins.shape == (len(run), 4, 7) and np.isfinite(middle.energy)
