"""The compiled engine against the Python engine, and its own parts."""

import numpy as np
import pytest

from omniroll import Vehicle, simulate
from omniroll.engine import recorded, workspace
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import difference

PAPER = Vehicle.paper()
MODELS = ("massless", "locked", "free")
LAWS = ("smooth", "impact")


def random_start(rng, vehicle):
    joint = np.pi / vehicle.rollers_per_wheel
    spins = rng.normal(size=(vehicle.wheels, vehicle.rollers_per_wheel - 1))
    return {"nu": rng.normal(size=3), "chi": rng.uniform(-joint, joint, vehicle.wheels)}, spins


@pytest.mark.parametrize("wheels, rollers, model, law", [
    *((3, 5, model, law) for model in MODELS for law in LAWS), (1, 4, "free", "impact"), (2, 3, "locked", "impact"),
    (4, 8, "free", "smooth"), (5, 6, "massless", "impact"),
])  # fmt: skip
def test_both_engines_give_the_same_switches_and_motion(wheels, rollers, model, law):
    rng = np.random.default_rng([wheels, rollers, MODELS.index(model), LAWS.index(law)])
    vehicle = (
        Vehicle.paper(wheels, rollers)
        if rollers > 3
        else PAPER.replace(
            wheels=wheels, rollers_per_wheel=rollers, wheel_angles=(0.3, 2.0)[:wheels], roller_axis_radius=0.03
        )
    )
    start, spins = random_start(rng, vehicle)
    task = {**start, "duration": 2, "roller_model": model, "switching": law, "accuracy": 1e-11}
    if model == "free":
        task["spins"] = spins
    compiled, python = (simulate(vehicle, **task, engine=engine) for engine in ("compiled", "python"))
    assert compiled.switches.wheel.tolist() == python.switches.wheel.tolist()
    assert compiled.switches.direction.tolist() == python.switches.direction.tolist()
    np.testing.assert_allclose(compiled.switches.t, python.switches.t, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        compiled.switches.energy_jump, python.switches.energy_jump, rtol=0, atol=1e-9 * python.energy[0]
    )
    assert difference(compiled, python) < 2e-11


@pytest.mark.parametrize("law", LAWS)
def test_what_is_between_rows_obeys_the_equations(law):
    """The derivative of the polynomials is the kernel's right-hand side."""
    run = simulate(PAPER, nu=(1, 0.2, 1), duration=5, roller_model="locked", switching=law, accuracy=1e-10)
    rng = np.random.default_rng(1)
    starts = run.step_rows
    lengths = run.t[starts + 1] - run.t[starts]
    long = lengths > 1e-3
    times = run.t[starts][long] + lengths[long] * rng.uniform(0.1, 0.9, long.sum())
    step = 1e-5
    slope = (run.sample(times + step).nu - run.sample(times - step).nu) / (2 * step)
    middle = run.sample(times)
    np.testing.assert_allclose(slope, kernel(PAPER, "locked").forward_dynamics(middle.nu, middle.chi), atol=1e-6)


def test_integrals_in_bernstein_form():
    matrix = recorded.integral_to_bernstein()
    x = np.linspace(0, 1, 11)
    z = 2 * x - 1
    for k in range(workspace.NODES):
        from scipy.interpolate import BPoly

        series = np.polynomial.legendre.Legendre.basis(k).integ()
        wanted = (series(z) - series(-1)) / 2
        np.testing.assert_allclose(BPoly(matrix[:, [k]], [0, 1])(x), wanted, atol=1e-12)
