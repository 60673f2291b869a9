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


VEHICLES = {
    "paper": PAPER,
    "sharp": SHARP,
    "five wheels": omniroll.Vehicle.paper(5, 7),
    "each its own": [PAPER.replace(mass=mass) for mass in np.random.default_rng(1).uniform(0.5, 5, 37)],
}


@pytest.mark.parametrize("count", [1, 16, 37])
@pytest.mark.parametrize("model", ROLLER_MODELS)
@pytest.mark.parametrize("name", VEHICLES)
def test_a_batch_gives_what_each_gets_alone(name, model, count):
    given = VEHICLES[name]
    vehicles, given = (given[:count], given[:count]) if name == "each its own" else ([given] * count, given)
    state = states(count, vehicles[0].wheels, vehicles[0].rollers_per_wheel, seed=count)
    found = omniroll.Batch(given, model).accelerations(*state[:2], *further(model, state[2]))
    wanted = alone(vehicles, model, *state)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


def test_a_bound_call_reads_its_arrays_anew():
    nu, chi, _ = states(20)
    made, nu_dot = omniroll.Batch(PAPER, "locked"), np.empty((3, 20))
    call = made.bind(nu, chi, nu_dot=nu_dot)
    call()
    before = nu_dot.copy()
    nu *= 2
    call()
    assert (nu_dot == 4 * before).all()


def bound(**change):
    arrays = dict(zip(("nu", "chi", "momenta"), states(4), strict=True)) | {"nu_dot": np.empty((3, 4))}
    return omniroll.Batch(PAPER).bind(**arrays | change)


@pytest.mark.parametrize(("call", "field"), [
    (lambda: omniroll.Batch([PAPER, omniroll.Vehicle.paper(4)]), r"vehicles\[1\]"),
    (lambda: omniroll.Batch([PAPER, SHARP]), r"vehicles\[1\]"),
    (lambda: omniroll.Batch([PAPER.replace(center_of_mass=(0.01, 0))]), r"vehicles\[0\]"),
    (lambda: omniroll.Batch(PAPER, "locked").accelerations(*states(4)), "momenta"),
    (lambda: omniroll.Batch(PAPER).accelerations(*states(4)[:2]), "momenta"),
    (lambda: omniroll.Batch(PAPER).accelerations(states(4)[0], np.full((3, 4), 0.7), states(4)[2]), "chi"),
    # Four vehicles have no constants for a fifth; and beyond these arrays the C code would read or write.
    (lambda: omniroll.Batch([PAPER] * 4).bind(*states(5), nu_dot=np.empty((3, 5))), r"nu.*\(3, 4\)"),
    (lambda: bound(nu_dot=np.empty((3, 5))), "nu"),
    (lambda: bound(nu=np.zeros((4, 3)).T), "nu"),
    (lambda: bound(chi=np.zeros((3, 4), np.float32)), "chi"),
    (lambda: bound(momenta=None), "momenta"),
])  # fmt: skip
def test_what_is_refused(call, field):
    with pytest.raises(omniroll.InvalidValueError, match=f"^{field}"):
        call()
