"""Rollers whose bearings stick where wheels may slip, under the laws viscous and regularised: a closed form, and every
body."""

from dataclasses import replace

import numpy as np
import pytest
from oracle.balls import exact, working_precision
from reactions.newton_euler import Acting

from contact.test_newton_euler import DAMPING, RELATIVE, by_bodies, named, slipping_case, viscous
from omniroll import Bearings, Contact, Vehicle, simulate
from omniroll.kernels.kernel import kernel

CROSS = Vehicle.paper(4, 4)  # wheel 1 looks along x, 2 along y, 3 and 4 opposite to them
ROLLER = CROSS.roller_inertia
INSTANT = 1e-10  # relative, of instants in closed form


def test_a_free_roller_spins_down_and_sticks():
    """B w' = -T, opposite to the ground, where its disk passes the reaction on to nobody."""
    torque, speed = 6e-3, 40.0
    spins = np.zeros((4, 3))
    spins[0, 1] = speed
    run = simulate(CROSS, nu=(0, 0, 0), spins=spins, duration=0.2, roller_model="free", control=False,
                   effects=[Contact(5.0), Bearings(roller_coulomb=torque)])  # fmt: skip
    stops = ROLLER * speed / torque
    assert 0.02 < stops < 0.15
    spin = np.abs(run.spins[:, 0, 1])
    assert run.t[np.flatnonzero(spin <= 1e-12 * speed)[0]] == pytest.approx(stops, rel=INSTANT)
    assert run.spins[-1, 0, 1] == 0
    assert np.abs(run.nu).max() <= 1e-13 * speed
    assert run.ledger.contributions["roller_loss"] == pytest.approx(-ROLLER * speed**2 / 2, rel=1e-10)


@pytest.mark.parametrize("wheels, rollers, axles", [(2, 4, ("axle_sticking",)), (3, 5, ()), (4, 6, ("axle_sticking",))])
def test_what_holds_rollers_stops_them_in_the_equations_of_every_body(wheels, rollers, axles):
    """Newton's and Euler's equations with the torques that the kernel says give the same accelerations, and none of the
    spins of rollers that stick, in contact and not."""
    rng = np.random.default_rng([12, wheels, len(axles)])
    case = slipping_case(rng, wheels, rollers, "free", has_layout=True)
    sticks = rng.random((wheels, rollers)) < 0.6
    sticks[0, 0], sticks[-1, 0] = True, False
    stands = np.arange(wheels) % 2 == 0 if axles else np.zeros(wheels, bool)
    case = replace(case, turns=case.turns * ~sticks[:, 0], spins=case.spins * ~sticks[:, 1:],
                   rates=case.rates * ~stands)  # fmt: skip
    torques = np.where(sticks, 0.0, 0.01 * rng.normal(size=(wheels, rollers)))
    constants = (("ground_damping", DAMPING),)
    bound = kernel(case.vehicle, "free", "python", constants=constants,
                   effects=("contact", "contact_viscous", "roller_sticking", *axles))  # fmt: skip
    values = {"contact_sticks": sticks[:, 0].astype(float), "free_sticks": sticks[:, 1:].astype(float)}
    values |= {"contact_bearing": torques[:, 0], "free_bearing": torques[:, 1:]}
    values |= {"axle_sticks": stands.astype(float), "bearing_torque": np.zeros(wheels)}
    found = named(bound, "disk_dynamics", case.known(bound, **values))
    held = np.concatenate([found["contact_holding"][:, None], found["free_holding"]], axis=1)
    assert not held[~sticks].any() and np.abs(held[sticks]).min() > 0
    wheel_torques = found.get("axle_holding", np.zeros(wheels))

    def exactly(array):
        return working_precision(lambda: [[exact(t) for t in row] for row in np.atleast_2d(array)])()

    given = Acting(ground=viscous, guide=wheels != 3, roller_torques=exactly(torques + held),
                   wheel_torques=exactly(wheel_torques)[0])  # fmt: skip
    wanted = by_bodies(case, given)
    for name, other in zip(("nu_dot", "rates_dot", "contact_omega_dot"), wanted, strict=True):
        assert found[name] == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * np.abs(wanted[1]).max())
    assert not found["rates_dot"][stands].any()
    spin_dot = np.concatenate([found["contact_spin_dot"][:, None], found["spins_dot"]], axis=1)
    by_body = case.spins_by_bodies(given)
    scale = np.abs(by_body).max()
    assert spin_dot == pytest.approx(by_body, rel=RELATIVE, abs=RELATIVE * scale)
    assert not spin_dot[sticks].any() and np.abs(by_body[sticks]).max() <= RELATIVE * scale
