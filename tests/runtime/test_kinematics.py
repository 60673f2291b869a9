"""Wheel and roller kinematics both ways: nu -> wheel rates and contact spins -> nu."""

import numpy as np
import pytest

from omniroll import Vehicle
from omniroll.kernels.kernel import kernel


@pytest.mark.parametrize("backend", ["compiled", "python"])
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
@pytest.mark.parametrize("wheels", [2, 3, 5])
def test_nu_from_its_own_kinematics(wheels, model, backend):
    rng = np.random.default_rng(wheels)
    bound = kernel(Vehicle.paper(wheels), model, backend)
    nu, chi = rng.normal(size=(20, 3)), rng.uniform(-np.pi / 5, np.pi / 5, (20, wheels))
    chi_dot, contact_spin = bound.wheel_rates(nu, chi)
    np.testing.assert_allclose(bound.nu_from_contacts(chi, chi_dot, contact_spin), nu, rtol=0, atol=1e-13)
    np.testing.assert_allclose(bound.wheel_speeds(nu), chi_dot, rtol=0, atol=1e-13)
    if wheels > 2:
        np.testing.assert_allclose(bound.nu_from_wheels(chi_dot), nu, rtol=0, atol=1e-13)


def test_the_fit_is_that_of_least_squares():
    """Rates that no motion has: against NumPy's least squares on the rows of the kinematics itself."""
    rng = np.random.default_rng(7)
    vehicle = Vehicle.paper(3)
    bound = kernel(vehicle, "locked")
    chi = rng.uniform(-0.6, 0.6, 3)
    chi_dot, contact_spin = rng.normal(size=3), rng.normal(size=3)
    rates, spins = zip(*(bound.wheel_rates(unit, chi) for unit in np.eye(3)), strict=True)
    rho = vehicle.wheel_radius * np.cos(chi) - vehicle.roller_axis_radius
    rows = np.vstack([np.transpose(rates), np.transpose(spins) * (rho / vehicle.wheel_radius)[:, None]])
    wanted = np.linalg.lstsq(rows, np.concatenate([chi_dot, rho * contact_spin / vehicle.wheel_radius]))[0]
    np.testing.assert_allclose(bound.nu_from_contacts(chi, chi_dot, contact_spin), wanted, atol=1e-13)
