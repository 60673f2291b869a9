"""Massless rollers whose bearings have viscous friction beside the ground's: slip, spin and force keep their digits,
whichever is small. Beside fractions, and roots in 40 digits."""

from fractions import Fraction

import numpy as np
import pytest
from mpmath import mp, mpf

from contact.moving_bodies import named
from omniroll import Vehicle
from omniroll.kernels.kernel import kernel

CROSS = Vehicle.paper(4, 4)
RHO = CROSS.wheel_radius - CROSS.roller_axis_radius  # of a roller that touches the ground in its middle
DAMPING, FRICTION, LOAD, FADE_SPEED = (3.7, 1.9), (0.7, 0.3), 8.5, 0.02
RUB = ("roller_sticking", "roller_viscous")
EPS = float(np.finfo(float).eps)


@pytest.mark.parametrize("ratio", [1e-8, 1.0, 1e8])
def test_slip_and_spin_have_all_digits_whichever_is_small(ratio):
    """Of the ground's coefficient the bearing's damper over rho^2 is `ratio`. Beside fractions, to 16 roundings."""
    chi, nu, torque = np.zeros(4), np.array([0.3, -0.2, 0.1]), 1e-3
    constants = (("ground_damping", DAMPING), ("roller_damping", ratio * DAMPING[0] * RHO**2))
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=("contact", "contact_viscous", *RUB))
    speed = RHO * bound.wheel_rates(nu, chi)[1]
    values = {"nu": nu, "chi": chi, "rates": np.zeros(4), "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -np.sign(speed) * torque, "bearing_torque": np.zeros(4)}
    slips, forces = named(bound, "slip_forces", values).values()
    spins = named(bound, "slip_spins", values)["contact_spin"]
    c, damping, rho = (Fraction(number) for number in (DAMPING[0], constants[1][1], RHO))
    for i, v in enumerate(map(Fraction, speed)):
        own = -Fraction(torque) if v > 0 else Fraction(torque)
        slip = (damping / rho**2 * v - own / rho) / (c + damping / rho**2)
        for found, wanted in ((slips[i, 0], slip), (spins[i], (v - slip) / rho), (forces[i, 0], -c * slip)):
            assert abs(Fraction(found) / wanted - 1) <= 16 * np.finfo(float).eps


@pytest.mark.parametrize("part", [0.0, 0.5, 1 - 1e-6, 1.0, 1 + 1e-6, 2.0, 1e3])
@pytest.mark.parametrize("drag", [0.0, 1e-12, 1e-6, 1e-3, 1.0, 1e6])
def test_slips_are_the_roots_as_well_as_the_pull_is_known(part, drag):
    """The ground and the damper d take P = d v + T/rho together; of the ground's whole friction A that is `part`, at
    least nearly, and d times the slip velocity where friction fades is `drag`. Beside roots in 40 digits; all bearings
    have a drag of 1e-24 beside."""
    law = {"contact_load": LOAD, "ground_friction": FRICTION, "ground_fade_speed": FADE_SPEED}
    whole, slow = FRICTION[0] * LOAD, np.sqrt(np.prod(FRICTION)) * FADE_SPEED / FRICTION[0]
    damping = drag * whole / slow * RHO**2
    constants = (*law.items(), ("roller_damping", damping))
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=("contact", "contact_regularised", *RUB))
    nu, chi = np.array([0.3, -0.2, 0.1]) * min(1.0, 0.5 * part / max(drag, 1e-6)), np.zeros(4)
    rates, spins = bound.wheel_rates(nu, chi)
    speed = RHO * spins
    torque = np.sign(speed) * RHO * (part * whole - damping / RHO**2 * np.abs(speed))
    values = {"nu": nu, "chi": chi, "rates": rates, "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -torque, "bearing_torque": np.zeros(4)}
    slips, forces = named(bound, "slip_forces", values).values()
    assert np.isfinite(slips).all() and np.isfinite(forces).all()
    if drag == 0.0 and part >= 1.0:
        return  # there is no root
    with mp.workdps(40):
        mu, d = mpf(FRICTION[0]), mpf(damping) / mpf(RHO) ** 2
        fade = mu * mpf(FRICTION[1]) * mpf(FADE_SPEED) ** 2
        for slip, v, own in zip(map(mpf, slips[:, 0]), map(mpf, speed), map(mpf, torque), strict=True):
            pull, size = d * v + own / mpf(RHO), mp.sqrt((mu * slip) ** 2 + fade)
            left = mpf(LOAD) * mu**2 * slip / size + d * slip - pull
            slope = mpf(LOAD) * mu**2 * fade / size**3 + d
            least = mpf(10) ** -24 * mpf(whole) * mu * abs(slip) / mp.sqrt(fade)
            assert abs(left) <= 16 * EPS * (abs(slip) * slope + abs(pull)) + least
