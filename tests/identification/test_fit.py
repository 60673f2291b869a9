"""Fits to motions of the independent oracle with noise say what they do not know."""

import numpy as np
import pytest
from flint import arb
from oracle import lagrange
from oracle.balls import working_precision
from oracle.lagrange import Speeds
from reactions.machines import Case
from reactions.newton_euler import Acting
from reactions.test_newton_euler import nu_dot

from identification.coverage import fit_of
from identification.oracle_motion import FRICTION, MACHINE, ORACLE, VEHICLE

SHORT = 151  # rows of the motions, 1.5 s


@working_precision
def test_the_oracle_is_that_of_all_bodies():
    """One state with torques: multipliers against Newton's and Euler's equations of every body."""
    rng = np.random.default_rng(3)
    case = Case(MACHINE, VEHICLE, "free", rng.normal(size=3), rng.uniform(-0.5, 0.5, 3), rng.normal(size=(3, 3)))
    given = [0.05, -0.02, 0.01]
    wanted = nu_dot(case, case.oracle(Acting(wheel_torques=given)))
    forces = Speeds.zero(ORACLE)
    forces.chi = [arb(torque) for torque in given]
    found = lagrange.accelerations(ORACLE, case.nu, case.chi, case.spins.tolist(), forces=forces)
    assert [float(v) for v in found.nu_dot] == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    "name, words",
    [
        ("straight", {"mass and wheel_inertia only as mass +", "yaw_inertia: not determined"}),
        ("on the spot", {"yaw_inertia and wheel_inertia only as yaw_inertia +", "mass: not determined"}),
    ],
)
def test_what_a_motion_does_not_show_is_said(name, words):
    fit = fit_of(name, SHORT, 0)
    assert {next((w for w in words if said.startswith(w)), said) for said in fit.undetermined} == words
    low, high = fit.interval("wheel_viscous")
    assert low < FRICTION < high and high - low < 0.1 * FRICTION
