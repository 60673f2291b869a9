"""Both engines on the same slipping vehicles, and the precompiled kernel of all effects."""

from dataclasses import replace

import numpy as np
import pytest
from random_scenes import PAPER, PLACES, controller, coulomb, limited_motors, linear_table, slope, viscous

from omniroll import Contact, Torque, Vehicle, simulate
from omniroll.engine.control import one_run
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at

pytestmark = pytest.mark.long


def torque(rng):
    return Torque(tuple(rng.normal(scale=0.3, size=3)))


GRAVITY = 9.8  # across the plane
ALL = (linear_table, limited_motors, controller, slope)
SCENES = {  # law, roller model, what acts beside the ground
    "viscous": ("viscous", "free", ()),
    "viscous, massless rollers": ("viscous", "massless", ALL),
    "viscous, friction in rollers": ("viscous", "free", (viscous,)),
    "regularised": ("regularised", "free", ()),
    "regularised, with Coulomb's friction in rollers and all that acts": ("regularised", "free", (*ALL, coulomb)),
}
STICKING = {
    "coulomb": ("coulomb", "free", (slope, torque)),
    "coulomb, massless rollers": ("coulomb", "massless", (slope, torque)),
}
ACCURACY = 1e-11


def ground(law, rng):
    rates = rng.normal(scale=20, size=3)
    if law == "viscous":
        return Contact(rng.uniform(5, 40, 2), wheel_rates=rates)
    if law == "coulomb":
        friction = rng.uniform(0.1, 0.6, 2)
        static = friction * rng.choice([1.0, 1.4])
        return Contact(law=law, friction=friction, static_friction=static, normal_gravity=GRAVITY, wheel_rates=rates)
    return Contact(
        law=law, friction=rng.uniform(0.1, 0.6, 2), speed=0.05, normal_gravity=GRAVITY, wheel_rates=rates
    )  # fmt: skip


def slipping_task(name, seed):
    """A random state of a vehicle whose wheels slip, with every contact near its joint."""
    scenes = SCENES | STICKING
    law, model, makers = scenes[name]
    rng = np.random.default_rng([seed, list(scenes).index(name)])
    vehicle = PAPER.replace(wheel_places=PLACES, center_of_mass=(0.005, -0.01)) if seed % 2 else PAPER
    chi = rng.choice([-1, 1], 3) * rng.uniform(0.55, 0.62, 3)
    start = {"nu": rng.normal(scale=2, size=3), "chi": chi, "pose": rng.normal(size=3)}
    if model == "free":
        start["spins"] = rng.normal(scale=3, size=(3, 4))
    effects = [ground(law, rng), *(make(rng) for make in makers)]
    return vehicle, start | {"duration": 0.1, "roller_model": model, "effects": effects}


def assert_agreement(own, other, bound):
    times = np.linspace(0, own.elapsed[-1], 7)
    assert own.switches.wheel.tolist() == other.switches.wheel.tolist() and len(own.switches) >= 1
    assert distance_at(own, other, times) < bound
    size = 1 + np.abs(other.added).max()
    np.testing.assert_allclose(own.added[-1], other.added[-1], rtol=0, atol=10 * bound * size)
    for run in (own, other):
        assert abs(run.ledger.residual) <= 1e-9 * (run.energy.max() + 1e-3)


def with_all_effects(vehicle, options):
    """The run on the precompiled kernel, which runs where that of a scene is not compiled."""
    task = checked_task(vehicle, **options)
    general = replace(task, kernel=task.effects.kernel(vehicle, options["roller_model"], "python"))
    run = one_run(general, ACCURACY)
    assert run.stats["engine"] == "compiled" and run.stats["kernel"] != task.kernel.set_name
    return run


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["viscous", "regularised"])
def test_the_own_kernel_of_a_scene_gives_the_same(name, seed):
    vehicle, options = slipping_task(name, seed)
    own = one_run(checked_task(vehicle, **options), ACCURACY)
    assert_agreement(own, with_all_effects(vehicle, options), 1e-9)


@pytest.mark.parametrize("wheels, rollers", [(1, 5), (2, 4), (5, 7)])
def test_any_number_of_wheels(wheels, rollers):
    """Wheels in other numbers than those whose loops are unrolled; a viscous ground asks for no loads."""
    vehicle = Vehicle.paper(wheels, rollers)
    runs = [
        simulate(vehicle, nu=(2, -1, 1), duration=0.5, effects=[Contact(20)], accuracy=accuracy, control=False)
        for accuracy in (1e-11, 1e-8)
    ]
    assert len(runs[0].switches) >= 1
    assert distance_at(*runs, np.linspace(0, 0.5, 5)) < 1e-8


def test_the_error_estimate_holds():
    vehicle, options = slipping_task("regularised", 0)
    run = simulate(vehicle, **options, accuracy=1e-7)
    finer = simulate(vehicle, **options, accuracy=1e-12, control=False)
    error = distance_at(run, finer, run.elapsed)
    assert error <= 1e-6 and error <= 10 * run.stats["error_estimate"] + 1e-12
