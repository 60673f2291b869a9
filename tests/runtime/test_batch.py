"""Many vehicles at once: each gets what the kernel of that vehicle gives it alone."""

import dataclasses

import numpy as np
import pytest

import omniroll
from omniroll.kernels.kernel import ROLLER_MODELS, kernel

PAPER = omniroll.Vehicle.paper()
SHARP = dataclasses.replace(PAPER, roller_axis_radius=PAPER.wheel_radius * np.cos(np.pi / 5) * (1 - 1e-9))


def states(count, wheels=3, rollers=5, seed=1):
    rng = np.random.default_rng(seed)
    chi = rng.uniform(-np.pi / rollers, np.pi / rollers, (wheels, count))
    return rng.normal(size=(3, count)), chi, rng.normal(size=(wheels, 2, count)) * 1e-5


def further(model, momenta):
    return (momenta,) if model == "free" else ()


def alone(vehicles, model, nu, chi, momenta):
    found = [
        kernel(vehicle, model).forward_dynamics(nu[:, k], chi[:, k], *further(model, momenta[:, :, k]))
        for k, vehicle in enumerate(vehicles)
    ]
    return np.transpose(found)


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 15, 16, 17, 100])
@pytest.mark.parametrize("model", ROLLER_MODELS)
@pytest.mark.parametrize("vehicle", [PAPER, SHARP, omniroll.Vehicle.paper(5, 7)], ids=["paper", "sharp", "five"])
def test_one_vehicle_in_many_states(vehicle, model, count):
    state = states(count, vehicle.wheels, vehicle.rollers_per_wheel, seed=count)
    found = omniroll.Batch(vehicle, model).accelerations(*state[:2], *further(model, state[2]))
    wanted = alone([vehicle] * count, model, *state)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


@pytest.mark.parametrize("count", [1, 16, 37])
@pytest.mark.parametrize("model", ROLLER_MODELS)
def test_each_state_with_its_own_vehicle(model, count):
    masses = np.random.default_rng(count).uniform(0.5, 5, count)
    vehicles = [dataclasses.replace(PAPER, mass=mass) for mass in masses]
    state = states(count)
    found = omniroll.Batch(vehicles, model).accelerations(*state[:2], *further(model, state[2]))
    wanted = alone(vehicles, model, *state)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


@pytest.mark.parametrize(("change", "field"), [
    ({"nu": np.zeros((2, 4))}, "nu"),
    ({"nu": np.full((3, 4), np.nan)}, "nu"),
    ({"nu": np.full((3, 4), 1e300)}, "nu"),
    ({"nu": "fast"}, "nu"),
    ({"chi": np.zeros((3, 5))}, "chi"),
    ({"chi": np.full((3, 4), 0.7)}, "chi"),
    ({"chi": np.full((3, 4), 1e200)}, "chi"),
    ({"momenta": None}, "momenta"),
    ({"momenta": np.zeros((3, 4))}, "momenta"),
])  # fmt: skip
def test_states_that_are_refused(change, field):
    given = dict(zip(("nu", "chi", "momenta"), states(4), strict=True)) | change
    with pytest.raises(omniroll.InvalidValueError, match=f"^{field}"):
        omniroll.Batch(PAPER).accelerations(**given)


@pytest.mark.parametrize(("vehicles", "field"), [
    ([], "vehicles"),
    ([PAPER, "car"], "vehicles"),
    ([PAPER, omniroll.Vehicle.paper(4)], r"vehicles\[1\]"),
    ([PAPER, SHARP], r"vehicles\[1\]"),
    ([dataclasses.replace(PAPER, center_of_mass=(0.01, 0))], r"vehicles\[0\]"),
])  # fmt: skip
def test_vehicles_that_are_refused(vehicles, field):
    with pytest.raises(omniroll.InvalidValueError, match=f"^{field}"):
        omniroll.Batch(vehicles)


def test_momenta_belong_to_free_rollers_alone():
    with pytest.raises(omniroll.InvalidValueError, match="^momenta"):
        omniroll.Batch(PAPER, "locked").accelerations(*states(4))


def test_a_bound_call_reads_its_arrays_anew():
    nu, chi, _ = states(20)
    made, nu_dot = omniroll.Batch(PAPER, "locked"), np.empty((3, 20))
    call = made.bind(nu, chi, nu_dot=nu_dot)
    call()
    before = nu_dot.copy()
    nu *= 2
    call()
    assert (nu_dot == 4 * before).all()


@pytest.mark.parametrize(("change", "field"), [
    ({"nu_dot": np.empty((3, 5))}, "nu"),
    ({"nu": np.zeros((2, 4))}, "nu"),
    ({"nu": np.zeros((4, 3)).T}, "nu"),
    ({"chi": np.zeros((2, 4))}, "chi"),
    ({"chi": np.zeros((3, 4), np.float32)}, "chi"),
    ({"momenta": np.zeros((3, 4))}, "momenta"),
    ({"momenta": None}, "momenta"),
])  # fmt: skip
def test_arrays_that_cannot_be_bound(change, field):
    """The C code would read or write beyond them."""
    given = dict(zip(("nu", "chi", "momenta"), states(4), strict=True)) | {"nu_dot": np.empty((3, 4))} | change
    with pytest.raises(omniroll.InvalidValueError, match=f"^{field}"):
        omniroll.Batch(PAPER).bind(**given)


def test_as_many_states_as_vehicles():
    """A batch of four vehicles has no constants for a fifth."""
    state = states(5)
    with pytest.raises(omniroll.InvalidValueError, match=r"^nu.*\(3, 4\)"):
        omniroll.Batch([PAPER] * 4).bind(*state, nu_dot=np.empty((3, 5)))
    with pytest.raises(omniroll.InvalidValueError, match=r"^nu.*\(3, 4\)"):
        omniroll.Batch([PAPER] * 4).accelerations(*state)
