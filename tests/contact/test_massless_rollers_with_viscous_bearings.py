"""Massless rollers whose bearings stick and have viscous friction, too, under the laws viscous and regularised: closed
forms, and roots in 40 digits. test_massless_rollers.py holds them to every body."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from mpmath import mp, mpf
from reactions.test_newton_euler import call

from contact.test_massless_rollers import CROSS, DISTANCE, INSTANT, MASS, MASSLESS, RHO, contact_torques, first_row
from contact.test_newton_euler import DAMPING, FADE_SPEED, FRICTION, LOAD
from omniroll import Bearings, Contact, Slope, simulate
from omniroll.kernels.kernel import kernel

GRAVITY, INCLINE = 9.80665, 0.2
EPS = float(np.finfo(float).eps)

DAMPED = ("contact", "contact_regularised", "roller_sticking", "roller_viscous")
DAMPER = 4e-4  # N m s, of the bearings in closed forms: over rho^2 that is 2.8 N s/m, beside ground of 6 N s/m


# Closed forms


def after(time, speed, rate, rest):
    """Of v' = -rate (v - rest) from `speed`."""
    return rest + (speed - rest) * np.exp(-rate * time)


@pytest.mark.parametrize("above", [1.0, 1.5])
@pytest.mark.parametrize("damper", [0.0, DAMPER])
def test_bearings_hold_a_vehicle_on_a_slope_and_brake_it(damper, above):
    """All axles stick. Until rho c v is what two bearings hold, M v' = M g sin b - 4 c v; from there on their contacts
    slip with (d v + T/rho)/(c + d), d = c_phi/rho^2, and their rollers have the rest of v."""
    c, sliding, end = 6.0, 0.02, 0.25
    bearings = Bearings(roller_coulomb=sliding, roller_break_away=above * sliding, wheel_coulomb=3.0)
    bearings = replace(bearings, roller_viscous=damper) if damper else bearings
    effects = [Contact(c), bearings, Slope(INCLINE, 0.0, gravity=GRAVITY)]
    run = simulate(CROSS, nu=(0, 0, 0), duration=end, effects=effects, accuracy=1e-12, **MASSLESS)
    fall, stuck, d = GRAVITY * np.sin(INCLINE), 4 * c / MASS, damper / RHO**2
    speed = above * sliding / (RHO * c)
    let_go = -np.log(1 - speed * stuck / fall) / stuck
    assert let_go < end / 2
    spins = np.abs(run.contact_spin)
    moving = np.flatnonzero((spins > 1e-9).any(axis=0))
    assert sorted(moving) in ([0, 2], [1, 3])
    for wheel in moving:
        assert run.t[first_row(spins[:, wheel] > 1e-9) - 1] == pytest.approx(let_go, rel=INSTANT)
    turning = (2 * c + 2 * c * d / (c + d)) / MASS
    rest = (fall - 2 * c / (c + d) * sliding / (RHO * MASS)) / turning
    wanted = after(end - let_go, speed, turning, rest)
    assert np.linalg.norm(run.nu[-1, :2]) * DISTANCE == pytest.approx(wanted, rel=1e-10)
    slip = (d * wanted + sliding / RHO) / (c + d)
    assert spins[-1, moving] == pytest.approx([(wanted - slip) / RHO] * 2, rel=1e-10)
    assert np.abs(run.slip[-1, moving, 0]) == pytest.approx([slip] * 2, rel=1e-10)
    most = above * sliding if damper == 0 else above * sliding + damper * spins.max()
    assert above * sliding <= np.abs(contact_torques(run)).max() * (1 + 1e-10) <= most * (1 + 2e-10)
    assert not run.quantity("rates").any()


# Every body


@pytest.mark.parametrize("ratio", [1e-8, 1.0, 1e8])
def test_slip_and_spin_have_all_digits_whichever_is_small(ratio):
    """Of the ground's coefficient the bearing's damper over rho^2 is `ratio`. Beside fractions, to 16 roundings."""
    chi, nu, torque = np.zeros(4), np.array([0.3, -0.2, 0.1]), 1e-3
    constants = (("ground_damping", DAMPING), ("roller_damping", ratio * DAMPING[0] * RHO**2))
    effects = ("contact", "contact_viscous", "roller_sticking", "roller_viscous")
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=effects)
    speed = RHO * bound.wheel_rates(nu, chi)[1]
    values = {"nu": nu, "chi": chi, "rates": np.zeros(4), "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -np.sign(speed) * torque, "bearing_torque": np.zeros(4)}
    (slips, forces), (spins, _) = call(bound, "slip_forces", values), call(bound, "slip_spins", values)
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
    bound = kernel(CROSS, "massless", "python", constants=constants, effects=DAMPED)
    nu, chi = np.array([0.3, -0.2, 0.1]) * min(1.0, 0.5 * part / max(drag, 1e-6)), np.zeros(4)
    rates, spins = bound.wheel_rates(nu, chi)
    speed = RHO * spins
    torque = np.sign(speed) * RHO * (part * whole - damping / RHO**2 * np.abs(speed))
    values = {"nu": nu, "chi": chi, "rates": rates, "contact_sticks": np.zeros(4)}
    values |= {"contact_bearing": -torque, "bearing_torque": np.zeros(4)}
    slips, forces = call(bound, "slip_forces", values)
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
