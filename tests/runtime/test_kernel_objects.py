"""Kernel objects: both backends have the same methods and give the same numbers; names are checked."""

import numpy as np
import pytest

from omniroll import InvalidValueError, Kernel, Vehicle, kernel
from omniroll.kernels.kernel import ROLLER_MODELS, kept_kernel

VEHICLE = Vehicle.paper(4, 7).replace(wheel_angles=(0.0, 1.4, 3.3, 4.9))
RANDOM = np.random.default_rng(11)


def arguments(bound, name):
    """Random inputs for a generated function: nu (6, 1, 3), chi (5, N), ..."""
    lead = iter([(6, 1), (5,), (6, 5), (5,), (6, 1)])
    values = []
    for argument in bound.signatures[name].inputs:
        scale = np.pi / 7 if argument.name == "chi" else 1.0
        values.append(scale * RANDOM.uniform(-1, 1, next(lead) + argument.shape))
    return values


@pytest.mark.parametrize("roller_model", ROLLER_MODELS)
def test_backends_agree_on_every_function(roller_model):
    compiled, python = (kernel(VEHICLE, roller_model, backend) for backend in ("compiled", "python"))
    assert len(compiled.signatures) > 8
    for name, signature in compiled.signatures.items():
        values = arguments(compiled, name)
        one, other = compiled.call(name, *values), python.call(name, *values)
        for mine, theirs, argument in zip(
            *((x if isinstance(x, tuple) else (x,)) for x in (one, other)), signature.outputs, strict=True
        ):
            assert mine.shape == theirs.shape and mine.shape[mine.ndim - len(argument.shape) :] == argument.shape
            np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-12 * np.abs(mine).max(), err_msg=name)


@pytest.mark.parametrize("roller_model", ["locked", "free"])
@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_sharp_kernels_compute_the_same(roller_model, backend, monkeypatch):
    plain = kernel(VEHICLE, roller_model, backend)
    monkeypatch.setattr(Vehicle, "sharpness", lambda vehicle: 1e9)
    kept_kernel.cache_clear()
    sharp = kernel(VEHICLE, roller_model, backend)
    kept_kernel.cache_clear()
    assert plain.set_name == sharp.set_name == roller_model and sharp.sharp and not plain.sharp
    assert (
        sharp.form("forward_dynamics") == "forward_dynamics_sharp"
        and plain.form("forward_dynamics") == "forward_dynamics"
    )
    assert sharp.signatures == plain.signatures
    for name in ("forward_dynamics", "impact", "energy"):
        values = arguments(plain, name)
        np.testing.assert_allclose(sharp.call(name, *values), plain.call(name, *values), rtol=1e-9, atol=1e-9)


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


@pytest.mark.parametrize("backend", ["compiled", "python"])
@pytest.mark.parametrize("roller_model", ROLLER_MODELS)
def test_flow_is_the_three_kernels(backend, roller_model):
    bound = kernel(VEHICLE, roller_model, backend)
    nu, chi, pose = RANDOM.normal(size=3), RANDOM.uniform(-0.4, 0.4, 4), np.array([1.0, 2.0, 0.7])
    momenta = RANDOM.normal(size=(4, 2)) * 1e-6 if roller_model == "free" else None
    found = bound.flow(momenta)(0.0, np.concatenate([nu, chi, pose]))
    constants = () if momenta is None else (momenta,)
    expected = [bound.forward_dynamics(nu, chi, *constants), bound.wheel_speeds(nu), bound.pose_rates(nu, 0.7)]
    assert (found == np.concatenate(expected)).all()


def test_wrong_names_and_shapes():
    with pytest.raises(ValueError, match="roller_model = 'x'"):
        kernel(VEHICLE, "x")
    with pytest.raises(ValueError, match="backend = 'x'"):
        kernel(VEHICLE, "free", "x")
    with pytest.raises(ValueError, match="number_type = 'x'"):
        kernel(VEHICLE, "free", number_type="x")
    for backend in ("compiled", "python"):
        bound = kernel(VEHICLE, "free", backend)
        with pytest.raises(InvalidValueError, match=r"nu = \[1, 2\]: must have the shape \(..., 3\), not \(2,\)"):
            bound.pose_rates([1, 2], 0)
        with pytest.raises(InvalidValueError, match="nu = 'one': must be real numbers"):
            bound.pose_rates("one", 0)
        with pytest.raises(InvalidValueError, match="leading axes of the arguments must broadcast"):
            bound.pose_rates(np.zeros((2, 3)), np.zeros(3))
        with pytest.raises(InvalidValueError, match="name = 'sing': is no function of this kernel"):
            bound.call("sing")
    with pytest.raises(InvalidValueError, match="values = .*: must be those that energy takes: nu, chi, spins"):
        kernel(VEHICLE, "free").energy([1, 2, 3], np.zeros(4))
