"""Kernel objects: both backends have the same methods and give the same numbers; kinematics both ways."""

import numpy as np
import pytest

from omniroll import Kernel, Vehicle, kernel
from omniroll.kernels.kernel import ROLLER_MODELS

VEHICLE = Vehicle.paper(4, 7).replace(wheel_angles=(0.0, 1.4, 3.3, 4.9))
SHARP = VEHICLE.replace(roller_axis_radius=VEHICLE.wheel_radius * np.cos(np.pi / 7) * (1 - 1e-9))
RANDOM = np.random.default_rng(11)


def arguments(bound, name):
    """Random inputs for a generated function: nu (6, 1, 3), chi (5, N), ..."""
    lead = iter([(6, 1), (5,), (6, 5), (5,), (6, 1)])
    values = []
    for argument in bound.signatures[name].inputs:
        scale = np.pi / 7 if argument.name == "chi" else 1.0
        values.append(scale * RANDOM.uniform(-1, 1, next(lead) + argument.shape))
    return values


@pytest.mark.parametrize("vehicle", [VEHICLE, SHARP], ids=["round", "sharp"])
@pytest.mark.parametrize("roller_model", ROLLER_MODELS)
def test_backends_agree_on_every_function(roller_model, vehicle):
    compiled, python = (kernel(vehicle, roller_model, backend) for backend in ("compiled", "python"))
    assert len(compiled.signatures) > 8 and compiled.sharp == python.sharp == (
        vehicle is SHARP and roller_model != "massless"
    )
    for name, signature in compiled.signatures.items():
        values = arguments(compiled, name)
        one, other = compiled.call(name, *values), python.call(name, *values)
        for mine, theirs, argument in zip(
            *((x if isinstance(x, tuple) else (x,)) for x in (one, other)), signature.outputs, strict=True
        ):
            assert mine.shape == theirs.shape and mine.shape[mine.ndim - len(argument.shape) :] == argument.shape
            np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-12 * np.abs(mine).max(), err_msg=name)


@pytest.mark.parametrize("roller_model", ROLLER_MODELS)
def test_every_generated_function_has_its_method(roller_model):
    bound = kernel(VEHICLE, roller_model, "python")
    assert all(callable(getattr(Kernel, name)) for name in bound.signatures)


@pytest.mark.parametrize("number_type, tolerance", [("float", 1e-4), ("long_double", 1e-12)])
def test_other_number_types(number_type, tolerance):
    double, other = kernel(VEHICLE, "free"), kernel(VEHICLE, "free", number_type=number_type)
    for name in ("forward_dynamics", "energy", "pose_rates", "spins_from_axial"):
        values = arguments(double, name)
        expected, found = double.call(name, *values), other.call(name, *values)
        assert found.dtype == {"float": np.float32, "long_double": np.longdouble}[number_type]
        np.testing.assert_allclose(found.astype(float), expected, rtol=tolerance, atol=tolerance)


# Wheel and roller kinematics both ways: nu -> wheel rates and contact spins -> nu


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
