"""Wheels that slip, with rollers across, at an angle or in two rows, against all bodies in all coordinates."""

from dataclasses import replace

import numpy as np
import pytest
from mecanum.vehicles import KINDS

from contact.other_bodies import named, slipping
from omniroll.results.accelerations import call_named

CLOSE = 1e-10  # of the largest number
DAMPING, FRICTION, LOAD, SPEED = np.array([3.7, 1.9]), np.array([0.7, 0.3]), 8.5, 0.02


def viscous(slip):
    return -DAMPING * slip


def regularised(slip):
    size = np.sqrt(((FRICTION * slip) ** 2).sum(axis=1) + FRICTION.prod() * SPEED**2)
    return -LOAD * FRICTION**2 * slip / size[:, None]


def coulomb(slip):
    size = np.sqrt(((FRICTION * slip) ** 2).sum(axis=1))
    return -LOAD * FRICTION**2 * slip / size[:, None]


LAWS = {
    "contact_viscous": (viscous, {"ground_damping": tuple(DAMPING)}),
    "contact_regularised": (
        regularised, {"contact_load": LOAD, "ground_friction": tuple(FRICTION), "ground_fade_speed": SPEED}
    ),
}  # fmt: skip
SUBJECTS = {
    f"{kind} {seed}": (lambda model, kind=kind, seed=seed: slipping(kind, seed, 2 + seed, 3 + 2 * seed, model))
    for kind in KINDS if kind not in ("profile", "arcs") for seed in (1, 2, 3)
}  # fmt: skip


def assert_close(found, wanted):
    assert np.abs(np.asarray(found) - wanted).max() <= CLOSE * np.abs(wanted).max()


def assert_moves(found, wanted):
    for name in wanted.keys() & found.keys():
        assert_close(found[name], wanted[name])


def expected(case, second):
    """nu', chi'' and the rates of the axial speeds of the rollers in contact, by name."""
    psi, yaw = np.broadcast_to(case.vehicle.roller_angle, case.count), case.nu[2] / case.vehicle.yaw_scale
    turning = case.rates[case.wheels] * yaw * np.cos(case.chi) + second[2] * np.sin(case.chi)
    axial = second[case.contacts] + np.cos(psi) * turning + np.sin(psi) * second[case.wheels]
    return {"nu_dot": case.nu_dot(second), "rates_dot": second[case.wheels], "contact_omega_dot": axial}


@pytest.mark.parametrize("name, model, law", [
    (name, model, list(LAWS)[(k + m) % 2]) for k, name in enumerate(SUBJECTS)
    for m, model in enumerate(("massless", "free"))
])  # fmt: skip
def test_smooth_ground_moves_the_vehicle_as_it_moves_all_bodies(name, model, law):
    case, (force_of, constants) = SUBJECTS[name](model), LAWS[law]
    torque, force = np.linspace(-1, 2, case.count), force_of(case.slip)
    bound = case.bound(("contact", law), **constants)
    known = case.known() | {"torque": torque}
    slip, ground_force = call_named(bound, "slip_forces", known)
    assert_close(slip, case.slip)
    assert_close(ground_force, force)
    found = named(bound, "slip_dynamics", known)
    assert_moves(found, expected(case, case.moved(force, torque)[0]))
    energy = case.rates @ case.mass @ case.rates / 2
    asked = known | {"axial": case.axial()[:, 1:]}
    assert call_named(bound, "slip_energy", asked) == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("model", ["massless", "free"])
@pytest.mark.parametrize("name", SUBJECTS)
def test_contacts_that_stick_and_slip_move_the_vehicle_as_they_move_all_bodies(name, model):
    case = SUBJECTS[name](model)
    sticks, torque = np.arange(case.count) % 2 == 0, np.linspace(-1, 2, case.count)
    stuck = [place for i in np.flatnonzero(sticks) for place in (case.wheels[i], case.contacts[i])]
    held = case.rows[np.repeat(sticks, 2)]
    rates = case.rates.copy()
    rates[stuck] = 0
    case.rates[stuck] = np.linalg.solve(held[:, stuck], -held @ rates)
    case = replace(case)  # what massless rollers do, and what follows from the rates
    force = np.where(sticks[:, None], 0, coulomb(np.where(sticks[:, None], 1, case.slip)))
    bound = case.bound(("contact", "contact_coulomb"))
    known = case.known() | {"torque": torque, "ground_push": force, "sticks": sticks.astype(float)}
    found = named(bound, "ground_dynamics", known)
    second, held_force = case.moved(force, torque, sticks)
    assert_moves(found, expected(case, second))
    assert_close(found["ground_force"], force + held_force)
    free = slice(1, None) if model == "massless" else slice(None)  # massless rollers do not slip across their axes
    assert_close(found["slip_dot"][:, free], case.slip_rates(second)[:, free])
