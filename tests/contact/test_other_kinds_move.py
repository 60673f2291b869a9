"""Runs in which wheels with rollers at an angle or in two rows slip: traction, energy, and rolling as a limit."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from contact.other_bodies import named, slipping
from omniroll import Contact, InvalidValueError, TorqueTable, Vehicle, simulate

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


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", ["massless", "free"])
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


@pytest.mark.parametrize("kind", VEHICLES)
def test_slip_tends_to_rolling_as_the_ground_grows_strong(kind):
    task = {"vehicle": VEHICLES[kind], "nu": (1, 0.3, 0.2), "duration": 0.3, "roller_model": "massless"}
    rolling = simulate(effects=[PUSH], **task).pose[-1]
    far = [
        np.linalg.norm(simulate(effects=[Contact(c), PUSH], accuracy=1e-11, **task).pose[-1] - rolling)
        for c in (1e5, 1e6)
    ]
    assert np.log10(far[0] / far[1]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("model", ["massless", "free"])
@pytest.mark.parametrize("what", ["roller_angle", "row_offset"])
def test_small_angles_and_offsets_tend_to_the_omni_wheel(what, model):
    case = slipping("mecanum" if what == "roller_angle" else "rows", 2, 4, 7, model)
    damping = {"ground_damping": (3.7, 1.9)}
    known, found = case.known() | {"torque": np.ones(4)}, []
    for size in (0.0, 1e-6, 2e-6):
        numbers = {"roller_angle": (size,) * 4} if what == "roller_angle" else {"rows": 2, "row_offset": size}
        if size == 0:
            numbers = {"roller_angle": 0.0, "rows": 1, "row_offset": 0.0}
        bound = replace_vehicle(case, numbers).bound(("contact", "contact_viscous"), **damping)
        moved = named(bound, "slip_dynamics", known)
        asked = ("nu_dot", "chi_dot", "rates_dot", "contact_omega_dot")
        found.append(np.concatenate([np.ravel(moved[name]) for name in asked if name in moved]))
    near, far = np.abs(found[1] - found[0]).max(), np.abs(found[2] - found[0]).max()
    assert 0 < near < 1e-3 * np.abs(found[0]).max() and far / near == pytest.approx(2, rel=1e-3)


def replace_vehicle(case, numbers):
    other = replace(case)
    other.vehicle = case.vehicle.replace(**numbers)
    return other


@pytest.mark.parametrize("kind", VEHICLES)
def test_an_accelerometer_feels_what_the_middle_does(kind):
    """Against differences of where it is."""
    run = simulate(
        VEHICLES[kind], nu=(0.5, 0.8, 1.0), duration=0.3, roller_model="massless", accuracy=1e-10,
        effects=[PUSH, Contact(**LAWS["viscous"], wheel_rates=0)],
    )  # fmt: skip
    step, times = 1e-5, np.array([0.0213, 0.0837, 0.1511, 0.2713])
    assert np.array_equal(*(run.state_and_row(times + way)[1] for way in (-step, step))), "no event lies between"
    before, now, after = (run.sample(times + way).pose for way in (-step, 0.0, step))
    moved = (before - 2 * now + after)[:, :2] / step**2
    cosine, sine = np.cos(now[:, 2]), np.sin(now[:, 2])
    felt = np.stack([cosine * moved[:, 0] + sine * moved[:, 1], cosine * moved[:, 1] - sine * moved[:, 0]], axis=-1)
    read = run.measure(times)["accelerometer"]
    assert np.abs(read - felt).max() < 1e-4 * np.abs(read).max()


@pytest.mark.parametrize("kind", VEHICLES)
def test_what_does_not_go_with_them_is_refused(kind):
    springs = [Contact(law="coulomb", friction=0.5), omniroll.Springs(height=0.1)]
    with pytest.raises(InvalidValueError, match="leave them out for the loads of the vehicle at rest"):
        simulate(VEHICLES[kind], nu=(1, 0, 0), duration=0.1, effects=springs)
